// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "gateway/records/events/alarm.h"

namespace baudgate::events {
namespace {

Alarm AlarmOf(const std::string& name, AlarmState state) {
  Alarm alarm;
  alarm.name = name;
  alarm.state = state;
  return alarm;
}

TEST(AlarmBoard, GivesEachAsItIsNow) {
  AlarmBoard board;
  board.Update(AlarmOf("a", AlarmState::active));
  board.Update(AlarmOf("b", AlarmState::active));
  board.Update(AlarmOf("a", AlarmState::acknowledged));
  const auto all = board.Take(0, 10);
  ASSERT_EQ(all.size(), 2U);
  EXPECT_EQ(all[0].alarm.name, "b");
  EXPECT_EQ(all[1].alarm.state, AlarmState::acknowledged);
  EXPECT_EQ(board.Take(0, 1).size(), 1U);
  EXPECT_EQ(board.Take(2, 10).size(), 1U);
  EXPECT_TRUE(board.Take(3, 10).empty());
  board.Update(AlarmOf("a", AlarmState::normal));
  EXPECT_EQ(board.Take(3, 10).front().alarm.state, AlarmState::normal) << "its end is told";
}

TEST(AlarmBoard, ForgetsThoseThatAreOverFirst) {
  AlarmBoard board;
  for (std::size_t i = 0; i < AlarmBoard::kMost; ++i) {
    board.Update(AlarmOf(std::to_string(i), i % 2 == 0 ? AlarmState::active : AlarmState::normal));
  }
  board.Update(AlarmOf("new", AlarmState::active));
  const auto all = board.Take(0, 2 * AlarmBoard::kMost);
  EXPECT_EQ(all.size(), AlarmBoard::kMost);
  EXPECT_EQ(all[0].alarm.name, "0");
  EXPECT_EQ(all[1].alarm.name, "2");
}

}  // namespace
}  // namespace baudgate::events
