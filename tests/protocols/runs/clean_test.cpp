// Real protocols on a good line: every point of the reference profiles becomes good, soon, and the
// wire is what limits it.
// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <set>

#include "gateway/bus/poller/poller.h"
#include "tests/protocols/runs/rig.h"

namespace baudgate {
namespace {

class CleanRun : public ::testing::TestWithParam<Setup> {};

/// Time that all bytes so far took on the wire, both ways.
Duration WireTime(Rig& rig) {
  const LineCounters& counters = rig->poller().accounts().line.counters();
  return static_cast<std::int64_t>(counters.bytes_in + counters.bytes_out) *
         rig.setup().serial.CharacterTime();
}

TEST_P(CleanRun, EveryPointBecomesGoodAndIsWhatTheTwinMeasures) {
  Rig rig(GetParam());
  rig.LearnTruth();
  for (std::uint32_t device = 0; device < rig.devices(); ++device) {
    const DeviceStatus status = rig->StatusOf(device);
    EXPECT_EQ(status.retries, 0U);
    EXPECT_EQ(status.state, DeviceState::online);
    EXPECT_EQ(status.Count(Outcome::ok), status.exchanges);
  }
  EXPECT_EQ(rig->poller().accounts().line.counters().stray_bytes, 0U);
}

/// No query waits for a second cycle of the slow or once group, and fast ones hold no line up.
TEST_P(CleanRun, TheFirstRoundTakesHardlyMoreThanItsBytes) {
  Rig rig(GetParam(), [](config::Line& line) {
    for (config::Device& device : line.devices) device.poll = 1h;
  });
  rig.LearnTruth();
  const Duration pause = *GetParam().protocol->timing(GetParam().serial).quiet +
                         rig->twin(0).manner.think + rig.setup().serial.CharacterTime();
  EXPECT_LE(rig->elapsed(), WireTime(rig) + static_cast<std::int64_t>(rig->sent.size()) * pause);
  std::set<std::string> different;
  for (const Sent& sent : rig->sent) different.insert(sent.text);
  const std::size_t probes = 3 * rig.devices();  // of each device but the first
  // Who a device is, is asked first, and once more where a point shows it; what its inputs are, in
  // between.
  const std::size_t identity = 4 * rig.devices();
  EXPECT_LE(rig->sent.size(), different.size() + probes + identity + 4) << "requests made twice";
}

TEST_P(CleanRun, TheLineIsNeverIdleWhereMoreIsWantedThanItCarries) {
  Rig rig(GetParam(), [](config::Line& line) {
    for (config::Device& device : line.devices) device.poll = 1ms;
  });
  rig.LearnTruth();
  rig.Watch();
  const Duration busy = rig->poller().accounts().line.counters().busy;
  rig->RunFor(30s);
  const double share =
      std::chrono::duration<double>(rig->poller().accounts().line.counters().busy - busy) / 30s;
  EXPECT_GT(share, 0.99);
  EXPECT_TRUE(rig.AllGood()) << "the slow group has its turn";
  EXPECT_EQ(rig->StatusOf(0).retries, 0U);
}

TEST_P(CleanRun, APollPeriodIsKept) {
  Rig rig(GetParam(), [](config::Line& line) {
    for (config::Device& device : line.devices) device.poll = 5s;
  });
  rig.LearnTruth();
  rig.Watch();
  const std::uint64_t before = rig->poller().accounts().line.counters().exchanges;
  rig->RunFor(10s);
  const std::uint64_t two_rounds = rig->poller().accounts().line.counters().exchanges - before;
  rig->RunFor(10min - 10s);
  const std::uint64_t all = rig->poller().accounts().line.counters().exchanges - before;
  EXPECT_GE(all, 48 * two_rounds);
  for (std::uint32_t device = 0; device < rig.devices(); ++device) {
    EXPECT_EQ(rig->StatusOf(device).missed, 0U);
    EXPECT_TRUE(rig.AllGood(device));
  }
}

/// A USB adapter hands over what it has every 16 ms, wherever that cuts a reply.
TEST_P(CleanRun, BurstsOfAUsbAdapterAreNoErrorAndCostNoMoreThanThemselves) {
  constexpr Duration kLatency = 16ms;
  Rig clean(GetParam());
  clean.LearnTruth();
  clean->RunFor(2min);
  Rig rig(GetParam());
  rig.LearnTruth();
  rig.Watch();
  const Duration character = GetParam().serial.CharacterTime();
  for (std::uint32_t device = 0; device < rig.devices(); ++device) {
    rig->twin(device).manner.deliver = [&, character](View, const Bytes& reply, Instant end) {
      std::vector<TimedPiece> pieces;
      Duration at = 5ms;
      for (const std::uint8_t byte : reply) {
        at += character;
        const Instant handed_over = std::chrono::ceil<std::chrono::milliseconds>(end + at);
        const Duration after_grid = handed_over.time_since_epoch() % kLatency;
        const Duration after = handed_over - end + (kLatency - after_grid) % kLatency;
        if (pieces.empty() || pieces.back().after != after) pieces.push_back({after, {}});
        pieces.back().bytes.push_back(byte);
      }
      return pieces;
    };
  }
  const std::uint64_t stray = rig->poller().accounts().line.counters().stray_bytes;
  rig->RunFor(2min);
  for (std::uint32_t device = 0; device < rig.devices(); ++device) {
    const DeviceStatus status = rig->StatusOf(device);
    EXPECT_EQ(status.Count(Outcome::ok), status.exchanges);
    EXPECT_LE(status.round_trips.mean(),
              clean->StatusOf(device).round_trips.mean() + kLatency + 1ms);
  }
  EXPECT_EQ(rig->poller().accounts().line.counters().stray_bytes, stray);
  EXPECT_EQ(rig.wrong(), 0U);
}

INSTANTIATE_TEST_SUITE_P(Real, CleanRun, ::testing::ValuesIn(RealLines()), SetupName);
INSTANTIATE_TEST_SUITE_P(Network, CleanRun, ::testing::Values(TcpLine()), SetupName);

}  // namespace
}  // namespace baudgate
