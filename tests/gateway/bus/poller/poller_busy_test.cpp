// Devices that are busy, under virtual time: they get the pause that they ask for, and nobody pays
// for it.
// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "tests/gateway/bus/poller/poller_fixture.h"

namespace baudgate {
namespace {

TEST(Poller, BusyParksTheQueryAndResumesIt) {
  config::Device device = ToyDevice("a", "A", {"1"});
  VirtualLine line(ToyLine({Polled(device, 10s), ToyDevice("b", "B", {"1"})}), {&ToyProtocol()});
  int busy = 2;
  line.twin(0).values.Set(0, 4.0);
  line.twin(0).manner.instead = [&](View request) -> std::optional<Bytes> {
    if (busy == 0 || request[0] != '?') return std::nullopt;
    --busy;
    return ToyReply("A1~busy");
  };
  line.Open();
  line.RunFor(500ms);
  EXPECT_EQ(line.CountSent("?A1"), 3U) << "two pauses, then the value, long before the next period";
  EXPECT_EQ(line.ValueOf(0, 0), Value(4.0));
  EXPECT_EQ(line.StatusOf(0).Count(Outcome::busy), 2U);
  EXPECT_EQ(line.ValueOf(1, 0), Value(0.0)) << "the others were asked meanwhile";
}

TEST(Poller, ADeviceThatIsBusyForEverStaysOnlineAndIsNotHammered) {
  config::Line config = ToyLine({ToyDevice("a", "A", {"1", "2"})});
  config.retries = 20;
  VirtualLine line(config, {&ToyProtocol()});
  Say(line.twin(0), "busy");
  line.Open();
  line.RunFor(60s);
  EXPECT_EQ(line.StatusOf(0).state, DeviceState::online);
  EXPECT_EQ(line.StatusOf(0).Count(Outcome::busy), line.StatusOf(0).exchanges - 4) << "the probes";
  EXPECT_LE(line.sent.size(), 60s / 50ms) << "the pause that it asked for is kept";
  EXPECT_EQ(line.StatusOf(0).findings.Last(Symptom::refusal).outcome, Outcome::busy);
  EXPECT_EQ(line.QualityOf(0, 0), Quality::bad_waiting);
}

TEST(Poller, ADeviceThatAsksForPeaceInItsProbeIsLeftInPeace) {
  config::Device device = ToyDevice("a", "A", {"1"});
  device.options.Set("wait", std::int64_t{Duration(5min).count()});
  VirtualLine line(ToyLine({device}), {&ToyProtocol()});
  line.twin(0).manner.instead = [](View) -> std::optional<Bytes> { return ToyReply("A0~busy"); };
  line.Open();
  line.RunFor(4min);
  EXPECT_EQ(line.sent.size(), 1U);
}

// A meter that is busy asks for 15 s of peace, twice: none of that is the line's.
TEST(Poller, WaitingMakesNoValueLastLonger) {
  config::Device device = ToyDevice("a", "A", {"1"});
  device.options = ToyOptions();
  device.options.Set("wait", std::int64_t{Duration(15s).count()});
  VirtualLine line(ToyLine({device}), {&ToyProtocol()});
  line.Open();
  line.RunFor(5s);
  int busy = 2;
  line.twin(0).manner.instead = [&busy](View request) -> std::optional<Bytes> {
    if (request[0] != '?' || busy-- <= 0) return std::nullopt;
    return ToyReply("A1~busy");
  };
  line.always = [&] {
    line.store().Read(0, [](const DeviceRecord& record) {
      EXPECT_EQ(record.age_limits[static_cast<std::size_t>(config::Group::fast)].uncertain_after,
                3s);
    });
  };
  line.RunFor(1min);
  EXPECT_LT(busy, 0);
}

}  // namespace
}  // namespace baudgate
