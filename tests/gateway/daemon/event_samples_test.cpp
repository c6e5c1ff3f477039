// SPDX-License-Identifier: Apache-2.0
#include "gateway/daemon/event_samples.h"

#include <gtest/gtest.h>

namespace baudgate {
namespace {

events::FedEvent Event(std::int64_t seq, const std::string& line, const std::string& device,
                       events::Source source) {
  events::FedEvent event{source, {}};
  event.record.seq = seq;
  event.record.line = line;
  event.record.device = device;
  event.record.text = "what it is";
  return event;
}

TEST(EventSamples, SayWhoseEventItIs) {
  const auto feed = std::make_shared<events::EventFeed>();
  feed->Add({Event(1, "bay-1", "feeder-1", 0), Event(2, "bay-1", "", events::kGateway),
             Event(3, "", "", events::kGateway), Event(4, "bay-1", "gone", events::kGateway)});
  const auto samples = EventSamples("plant", feed).Take(0, 10);
  ASSERT_EQ(samples.size(), 4U);
  EXPECT_EQ(samples[0].gateway, "plant");
  EXPECT_EQ(samples[0].device, "feeder-1");
  EXPECT_EQ(samples[0].text, "what it is");
  EXPECT_EQ(samples[1].gateway, "plant");
  EXPECT_EQ(samples[1].device, "");
  EXPECT_EQ(samples[1].text, "line bay-1: what it is");
  EXPECT_EQ(samples[2].gateway, "plant");
  EXPECT_EQ(samples[2].text, "what it is");
  EXPECT_EQ(samples[3].gateway, "") << "not configured any more: not published";
}

}  // namespace
}  // namespace baudgate
