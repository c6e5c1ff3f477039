// What a subscriber does with thousands of samples, with what cannot be read, and with the names
// of writers.
// SPDX-License-Identifier: Apache-2.0
#include "gateway/outputs/dds/fast/subscriber.h"

#include <gtest/gtest.h>

#include <future>

#include "gateway/outputs/dds/published_types.h"
#include "tests/gateway/outputs/dds/fixture.h"
#include "tests/gateway/outputs/dds/raw_writer.h"

namespace baudgate::dds {
namespace {

using testing::Published;
using testing::RawWriter;
using testing::TestSubscriber;

PointSample Named(std::string point, std::uint64_t seq) {
  PointSample sample;
  sample.gateway = "g", sample.device = "d", sample.point = std::move(point), sample.seq = seq;
  return sample;
}

Bytes Encoded(const PointSample& sample) {
  Bytes bytes(kMaxBytes<PointSample>);
  bytes.resize(Encode(sample, bytes));
  return bytes;
}

// While a callback takes its time, five thousand points change: nobody waits for it, and the rest
// comes in a few takes.
TEST(Subscriber, FiveThousandPointsComeInAFewTakes) {
  constexpr std::size_t kPoints = 5000;
  Published heard;
  std::promise<void> first;
  std::promise<void> go_on;
  SubscriberCallbacks callbacks = heard.Callbacks();
  callbacks.on_point = [&, note = callbacks.on_point](const PointSample& sample,
                                                      const Origin& origin) {
    if (sample.seq == 0) first.set_value(), go_on.get_future().wait();
    note(sample, origin);
  };
  auto writer = CreateFastWriter(TestSubscriber().participant, {.points = kPoints, .devices = 1});
  ASSERT_TRUE(writer.ok()) << writer.error();
  const auto subscriber = DdsSubscriber::Create(TestSubscriber(), callbacks);
  ASSERT_TRUE(subscriber.ok()) << subscriber.error();
  ASSERT_EQ((*writer)->Write(Named("p0", 0)), Sent::yes);
  first.get_future().wait();
  for (std::size_t i = 0; i < kPoints; ++i) {
    ASSERT_EQ((*writer)->Write(Named("p" + std::to_string(i), 1)), Sent::yes);
  }
  EXPECT_TRUE((*writer)->WaitAcknowledged(20s));
  go_on.set_value();
  ASSERT_TRUE(heard.WaitFor([&] { return heard.samples == 1 + kPoints; }));
  EXPECT_EQ(heard.points.size(), kPoints);
  EXPECT_LE((*subscriber)->counters().takes, 1U + 2U);
  EXPECT_EQ((*subscriber)->counters().refused, 0U);
}

TEST(Subscriber, WhatCanNotBeReadIsCountedAndNotShown) {
  Published heard;
  const auto subscriber = DdsSubscriber::Create(TestSubscriber(), heard.Callbacks());
  ASSERT_TRUE(subscriber.ok()) << subscriber.error();
  RawWriter writer(kPointTopic, "baudgate::v1::PointSample");
  Bytes strange = Encoded(Named("strange", 1));
  strange[1] = 3;  // a parameter list
  Bytes cut = Encoded(Named("cut", 1));
  cut.pop_back();
  // The longest name that fits, made one longer.
  Bytes over_long = Encoded(Named(std::string(kMaxKey, 'x'), 1));
  const auto name = std::search_n(over_long.begin(), over_long.end(), kMaxKey, 'x');
  *(name - 4) += 1;
  *(name + kMaxKey) = 'x';
  for (const Bytes& bytes : {strange, cut, over_long, Encoded(Named("good", 1))}) {
    ASSERT_TRUE(writer.Write(bytes));
  }
  // What came before a sample is taken before the next one.
  ASSERT_TRUE(heard.WaitFor([&] { return heard.samples == 1; }));
  ASSERT_TRUE(writer.Write(Encoded(Named("good too", 1))));
  ASSERT_TRUE(heard.WaitFor([&] { return heard.samples == 2; }));
  EXPECT_EQ((*subscriber)->counters().refused, 3U);
  EXPECT_TRUE(heard.points.contains({"d", "good"}));
}

TEST(Subscriber, NamesTheWriterAndSaysWhenItLeaves) {
  Published heard;
  const auto subscriber = DdsSubscriber::Create(TestSubscriber(), heard.Callbacks());
  ASSERT_TRUE(subscriber.ok()) << subscriber.error();
  auto writer = std::make_unique<RawWriter>(kPointTopic, "baudgate::v1::PointSample");
  ASSERT_TRUE(writer->Write(Encoded(Named("p", 1))));
  ASSERT_TRUE(heard.WaitFor([&] { return heard.writers.size() == 1; }));
  const WriterId id = *heard.writers.begin();
  EXPECT_EQ(Text(id), writer->guid());
  EXPECT_EQ(Text(id.publisher), writer->guid().substr(0, writer->guid().find('|')));
  writer.reset();
  EXPECT_TRUE(heard.WaitFor([&] { return heard.publishers_left.contains(id.publisher); }));
}

}  // namespace
}  // namespace baudgate::dds
