// Polls of a whole line under virtual time: on the grid, in any chunking, or of nothing at all.
// SPDX-License-Identifier: Apache-2.0
#include "gateway/bus/poller/poller.h"

#include <gtest/gtest.h>

#include "tests/gateway/bus/poller/poller_fixture.h"

namespace baudgate {
namespace {

TEST(Poller, PollsOnTheGridAndStoresGoodValues) {
  VirtualLine line(ToyLine({ToyDevice("a", "A", {"1", "2"})}), {&ToyProtocol()});
  line.twin(0).values.Set(0, 1.5);
  line.twin(0).values.Set(1, -2.0);
  const Instant opened = line.now().instant;
  line.Open();
  line.RunFor(10s - 1ms);
  EXPECT_EQ(line.CountSent("?A1"), 10U);
  EXPECT_EQ(line.CountSent("?A2"), 10U);
  for (const Sent& sent : line.sent) {
    if (sent.text == "?A1\r" && sent.at > opened + 500ms) {
      EXPECT_LE((sent.at - opened) % 1s, 30ms) << "drifts";
    }
  }
  EXPECT_EQ(line.ValueOf(0, 0), Value(1.5));
  EXPECT_EQ(line.ValueOf(0, 1), Value(-2.0));
  EXPECT_EQ(line.QualityOf(0, 0), Quality::good);
  const DeviceStatus status = line.StatusOf(0);
  EXPECT_EQ(status.state, DeviceState::online);
  EXPECT_GE(status.exchanges, 20U);
  EXPECT_LE(status.exchanges, 24U) << "20 polls, and the probes that go first";
  EXPECT_EQ(status.Count(Outcome::ok), status.exchanges);
  EXPECT_EQ(status.missed, 0U);
  EXPECT_GT(status.round_trips.mean(), 10ms) << "4 + 9 characters at 9600 bit/s and 5 ms to think";
  EXPECT_LT(status.round_trips.mean(), 30ms);
}

TEST(Poller, AnyFragmentationGivesTheSame) {
  for (const std::size_t fragment : {1U, 2U, 3U, 5U}) {
    VirtualLine line(ToyLine({ToyDevice("a", "A", {"1"})}), {&ToyProtocol()});
    line.twin(0).values.Set(0, 7.25);
    line.twin(0).manner.fragment = fragment;
    line.twin(0).manner.pause = 10ms;
    line.Open();
    line.RunFor(5s);
    EXPECT_EQ(line.ValueOf(0, 0), Value(7.25));
    EXPECT_EQ(line.StatusOf(0).Count(Outcome::ok), line.StatusOf(0).exchanges);
  }
}

TEST(Poller, DisabledDeviceIsLeftAlone) {
  config::Device off = ToyDevice("b", "B", {"1"});
  off.enabled = false;
  VirtualLine line(ToyLine({ToyDevice("a", "A", {"1"}), off}), {&ToyProtocol()});
  line.Open();
  line.RunFor(5s);
  line.Close();
  line.Open();
  line.RunFor(5s);
  EXPECT_EQ(line.twin(1).answered, 0U);
  EXPECT_EQ(line.QualityOf(1, 0), Quality::bad_out_of_service);
  EXPECT_EQ(line.StatusOf(1).state, DeviceState::disabled);
  EXPECT_EQ(line.StatusOf(1).last_outcome, Outcome::none);
}

TEST(Poller, MissedPeriodsAreCounted) {
  VirtualLine line(ToyLine({Polled(ToyDevice("a", "A", {"1", "2", "3", "4"}), 40ms)}),
                   {&ToyProtocol()});
  line.Open();
  line.RunFor(10s);
  EXPECT_GT(line.StatusOf(0).missed, 50U);
  EXPECT_EQ(line.QualityOf(0, 3), Quality::good) << "max_age follows the measured cycle";
}

TEST(Poller, ALineWithoutDevicesIsIdleForEver) {
  VirtualLine line(ToyLine({}), {&ToyProtocol()});
  line.Open();
  line.Inject(ToBytes("noise"), 1s);
  line.RunFor(1min);
  EXPECT_FALSE(line.poller().Deadline());
  EXPECT_EQ(line.poller().accounts().line.counters().stray_bytes, 5U);
}

TEST(Poller, SilenceOfTheWholeLineShows) {
  VirtualLine line(ToyLine({ToyDevice("a", "A", {"1"})}), {&ToyProtocol()});
  line.Open();
  line.RunFor(10s);
  EXPECT_FALSE(line.poller().accounts().line.SilentSince(line.now().instant - 2s));
  line.twin(0).manner.dead = true;
  line.RunFor(30s);
  EXPECT_TRUE(line.poller().accounts().line.SilentSince(line.now().instant - 20s));
}

}  // namespace
}  // namespace baudgate
