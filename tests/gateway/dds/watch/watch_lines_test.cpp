// Which samples `watch` prints.
// SPDX-License-Identifier: Apache-2.0
#include "gateway/dds/watch/watch_lines.h"

#include <gtest/gtest.h>

#include <functional>
#include <limits>

namespace baudgate {
namespace {

PointEvent Reading() {
  PointEvent event;
  event.sample.value = 2.5;
  event.sample.quality = 0xC0;
  event.sample.seq = 7;
  return event;
}

TEST(WatchLines, TellNewsFromRepeats) {
  const struct {
    const char* what;
    std::function<void(PointEvent&)> change;
    bool same_reading;
    bool looks_alike;
  } rows[] = {
      {"a heartbeat", [](PointEvent&) {}, true, true},
      {"read once more", [](PointEvent& event) { event.sample.seq = 8; }, false, true},
      {"another value", [](PointEvent& event) { event.sample.value = 3; }, false, false},
      {"another text", [](PointEvent& event) { event.sample.text = "3"; }, false, false},
      {"another quality", [](PointEvent& event) { event.sample.quality = 0x18; }, false, false},
      {"gone", [](PointEvent& event) { event.gone = dds::Gone::no_writers; }, false, false},
  };
  for (const auto& row : rows) {
    PointEvent now = Reading();
    row.change(now);
    EXPECT_EQ(IsSameReading(Reading(), now), row.same_reading) << row.what;
    EXPECT_EQ(LooksAlike(Reading(), now), row.looks_alike) << row.what;
  }
  PointEvent unread;
  unread.sample.value = std::numeric_limits<double>::quiet_NaN();
  EXPECT_TRUE(LooksAlike(unread, unread)) << "no value is no news either";
}

}  // namespace
}  // namespace baudgate
