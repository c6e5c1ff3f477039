// Who may still wait for a line.
// SPDX-License-Identifier: Apache-2.0
#include "gateway/requests/command_room.h"

#include <gtest/gtest.h>

namespace baudgate {
namespace {

std::size_t TakeAll(CommandRoom& room, const std::string& client) {
  std::size_t taken = 0;
  while (room.Take(client)) ++taken;
  return taken;
}

TEST(CommandRoom, NobodyHasMoreThanIsLeftToOthers) {
  CommandRoom room(32);
  EXPECT_EQ(TakeAll(room, "a"), 16U);
  EXPECT_EQ(TakeAll(room, "b"), 8U);
  EXPECT_EQ(TakeAll(room, "c"), 4U);
  EXPECT_TRUE(room.Take("d"));
}

TEST(CommandRoom, IsGivenBack) {
  CommandRoom room(8);
  EXPECT_EQ(TakeAll(room, "a"), 4U);
  for (int i = 0; i < 4; ++i) room.Give("a");
  EXPECT_EQ(TakeAll(room, "b"), 4U);
  room.Give("b");
  EXPECT_TRUE(room.Take("b"));
}

TEST(CommandRoom, EndsWhereAllOfItIsTaken) {
  CommandRoom room(4);
  for (const char* client : {"a", "b", "c"}) room.Take(client);
  EXPECT_TRUE(room.Take("d"));
  EXPECT_FALSE(room.Take("e"));
}

}  // namespace
}  // namespace baudgate
