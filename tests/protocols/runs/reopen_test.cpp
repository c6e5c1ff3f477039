// A port that was lost in the middle of anything and returns: how soon its devices are served.
// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <string>

#include "tests/protocols/runs/rig.h"

namespace baudgate {
namespace {

constexpr Duration kWanted = 1500ms;
constexpr int kReturns = 30;

class Returning {
 public:
  Returning(const Setup& setup, const std::string& port)
      : rig_(setup, [&](config::Line& line) {
          line.port = port;
          for (config::Device& device : line.devices) device.poll = 10ms;
        }) {
    rig_->Open();
    rig_->RunFor(20s);
  }

  /// From the opening to the first answer of anybody; `phase`: how long after the last one the port
  /// was lost.
  Duration LoseAndReturn(Duration phase) {
    rig_->RunFor(phase);
    rig_->Close();
    rig_->RunFor(300ms);
    const std::size_t before = Answered();
    const Instant opened = rig_->now().instant;
    rig_->Open();
    EXPECT_TRUE(rig_->RunUntil([&] { return Answered() > before; }, 1min));
    return rig_->now().instant - opened;
  }

 private:
  std::size_t Answered() {
    std::size_t sum = 0;
    for (std::uint32_t i = 0; i < rig_.devices(); ++i) sum += rig_->twin(i).answered;
    return sum;
  }

  Rig rig_;
};

/// `settle`: at least so long after each return the port is lost again.
Duration Longest(Returning& line, Duration settle = {}) {
  std::mt19937 random(1);
  Duration longest{};
  for (int i = 0; i < kReturns; ++i) {
    longest = std::max(longest,
                       line.LoseAndReturn(settle + std::chrono::microseconds(random() % 700'000)));
  }
  return longest;
}

class APortThatReturns : public ::testing::TestWithParam<Setup> {};

/// Whatever exchange was under way when the port was lost.
TEST_P(APortThatReturns, IsServedAtOnce) {
  Returning line(GetParam(), "/dev/ttyTEST0");
  EXPECT_LE(Longest(line), kWanted);
}

/// A serial server keeps what comes while nobody is connected, for as long as a reply may take.
/// Only the device that owes it waits for that.
TEST_P(APortThatReturns, IsServedAtOnceBehindASerialServerToo) {
  Returning line(GetParam(), "tcp://server:4001");
  EXPECT_LE(Longest(line, 15s), kWanted);
}

INSTANTIATE_TEST_SUITE_P(RealLines, APortThatReturns, ::testing::ValuesIn(RealLines()), SetupName);
INSTANTIATE_TEST_SUITE_P(Network, APortThatReturns, ::testing::Values(TcpLine()), SetupName);

TEST(APortThatReturns, IsServedSoonWhereItHasOneDeviceOnly) {
  baudgate::Setup alone = RealLine("Spa9600");
  alone.addresses.resize(1);
  Returning line(alone, "/dev/ttyTEST0");
  EXPECT_LE(Longest(line), kWanted);
}

}  // namespace
}  // namespace baudgate
