// Who may still wait for a line.
// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>

#include <vector>

#include "gateway/bus/writes/write_command.h"

namespace baudgate {
namespace {

using ::testing::SizeIs;

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
  std::vector<CommandRoom::Ticket> tickets;
  while (const auto ticket = room.Take("a")) tickets.push_back(*ticket);
  EXPECT_THAT(tickets, SizeIs(4));
  for (const CommandRoom::Ticket ticket : tickets) room.Give(ticket);
  EXPECT_EQ(TakeAll(room, "b"), 4U);
}

/// A client that connects, writes and leaves, over and over, before the line could look at it.
TEST(CommandRoom, ThoseWhoHaveLeftTakeNone) {
  CommandRoom room(4);
  for (std::size_t i = 0; i < CommandRoom::kMostAbandoned; ++i) {
    const auto left = std::make_shared<std::atomic<bool>>(false);
    ASSERT_TRUE(room.Take("b" + std::to_string(i), left)) << i;
    *left = true;
  }
  EXPECT_FALSE(room.Take("a")) << "memory is bounded";
  room.Give(1);
  EXPECT_TRUE(room.Take("a"));
}

TEST(CommandRoom, EndsWhereAllOfItIsTaken) {
  CommandRoom room(4);
  for (const char* client : {"a", "b", "c"}) room.Take(client);
  EXPECT_TRUE(room.Take("d"));
  EXPECT_FALSE(room.Take("e"));
}

}  // namespace
}  // namespace baudgate
