// Events as registers, field by field.
// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>

#include <span>
#include <vector>

#include "gateway/outputs/modbus/registers/register_contents.h"

namespace baudgate::modbus {
namespace {

using ::testing::Each;
using ::testing::ElementsAreArray;

std::vector<std::uint16_t> Part(const EventBlock& block, std::size_t from, std::size_t count) {
  return {block.begin() + static_cast<std::ptrdiff_t>(from),
          block.begin() + static_cast<std::ptrdiff_t>(from + count)};
}

TEST(EventBlockTest, HasTheFieldsInTheirPlaces) {
  events::EventFeed::Page shown{.newest = 0x12345, .oldest = 0x10002, .lost = 0x30004};
  auto& event = shown.events.emplace_back();
  event.seq = 0x10003;
  event.device_time = WallTime(std::chrono::seconds(0x6A2B3C4D) + 678ms + 999us);
  event.clock = events::ClockQuality::minute_guessed;
  event.channel = 2;
  event.code = 0x70008;
  event.state = config::EventState::message;
  const EventBlock block = EventBlockOf(shown, 0x10003);
  const std::uint16_t head[] = {1, 3, 1, 0x2345, 1, 2, 3, 4, 1, 0};
  EXPECT_THAT(Part(block, 0, 10), ElementsAreArray(head));
  const std::uint16_t record[] = {1, 3, 0x6A2B, 0x3C4D, 678, 3, 2, 7, 8, 2};
  EXPECT_THAT(Part(block, 10, 10), ElementsAreArray(record));
  EXPECT_THAT(Part(block, 20, 60), Each(0));
}

TEST(EventBlockTest, HasSevenRecordsAndNoMore) {
  events::EventFeed::Page shown;
  for (std::int64_t seq = 1; seq <= 9; ++seq) shown.events.emplace_back().seq = seq;
  const EventBlock block = EventBlockOf(shown, 0);
  EXPECT_EQ(block[8], 7);
  for (std::size_t i = 0; i < 7; ++i) EXPECT_EQ(block[11 + 10 * i], i + 1);
}

TEST(EventBlockTest, ShowsWhatDoesNotFitAsFarAsItCan) {
  events::EventFeed::Page shown{.newest = (std::int64_t{1} << 32) + 5, .lost = ~0ULL};
  auto& event = shown.events.emplace_back();
  event.seq = shown.newest;
  event.device_time = WallTime(-5s);
  event.channel = 70000;
  event.state = config::EventState::on;
  const EventBlock block = EventBlockOf(shown, 0xFFFFFFFF);
  const std::uint16_t expected[] = {0xFFFF, 0xFFFF, 0, 5, 0, 0, 0xFFFF, 0xFFFF, 1, 0,
                                    0,      5,      0, 0, 0, 0, 0xFFFF, 0,      0, 1};
  EXPECT_THAT(Part(block, 0, 20), ElementsAreArray(expected));
}

}  // namespace
}  // namespace baudgate::modbus
