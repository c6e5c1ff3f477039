// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "gateway/lines/lines.h"

namespace baudgate {
namespace {

std::vector<config::Line> LinesOn(const std::vector<std::string>& ports) {
  std::vector<config::Line> lines(ports.size());
  for (std::size_t i = 0; i < ports.size(); ++i) lines[i].port = ports[i];
  return lines;
}

struct Row {
  std::string port;
  ThreadKind place;
};

TEST(Placement, FollowsTheFormOfThePort) {
  const std::vector<Row> rows = {
      {"tcp://moxa:4001", ThreadKind::shared_loop},
      {"tcp://[::1]:4001", ThreadKind::shared_loop},
      {"/dev/pts/7", ThreadKind::shared_loop},
      {"/dev/ttyUSB0", ThreadKind::own_thread},
      {"/dev/ttyS1", ThreadKind::own_thread},
      {"/dev/serial/by-id/usb-FTDI", ThreadKind::own_thread},
      {"/tmp/port", ThreadKind::own_thread},  // a link to anything
      {"ttyUSB0", ThreadKind::own_thread},
      {"", ThreadKind::own_thread},
  };
  for (const Row& row : rows) EXPECT_EQ(ThreadKindOf(row.port), row.place) << row.port;
}

TEST(Placement, LoopsAreAsFewAsThereIsUseFor) {
  const auto loops = [](std::size_t lines, std::size_t cores) {
    return SharedLoops(LinesOn(std::vector<std::string>(lines, "tcp://a:1")), cores);
  };
  EXPECT_EQ(loops(1000, 64), 4U);
  EXPECT_EQ(loops(1000, 2), 2U);
  EXPECT_EQ(loops(1000, 0), 1U) << "nobody knows how many cores there are";
  EXPECT_EQ(loops(3, 8), 3U);
  EXPECT_EQ(loops(0, 8), 1U) << "for what is not a line";
  EXPECT_EQ(SharedLoops(LinesOn({"tcp://a:1", "/dev/ttyS0", "/dev/ttyS1", "tcp://b:1"}), 8), 2U)
      << "others have their own";
}

}  // namespace
}  // namespace baudgate
