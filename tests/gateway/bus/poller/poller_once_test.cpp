// What is read once or daily, and what is known of a device that may be another one, under virtual
// time.
// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "gateway/bus/poller/poller.h"
#include "tests/support/virtual_line.h"

namespace baudgate {
namespace {

/// Point 1 is read once, point 2 every second.
VirtualLine OneOnce() {
  config::Device device = ToyDevice("a", "A", {"1", "2"});
  device.points[0].group = config::Group::once;
  device.slow = 1min;
  return {ToyLine({device}), {&ToyProtocol()}};
}

/// Silence in place of the answer to what begins with `start`, as long as `times` lasts.
void Swallow(VirtualLine::WireTwin& twin, std::string start, int times) {
  twin.manner.instead = [start = std::move(start), times](View request) mutable {
    if (!AsText(request).starts_with(start) || times == 0) return std::optional<Bytes>();
    --times;
    return std::optional(Bytes());
  };
}

TEST(PollerOnce, IsReadOnceForEachOpening) {
  VirtualLine line = OneOnce();
  line.Open();
  line.RunFor(1h);
  EXPECT_EQ(line.CountSent("?A1"), 1U);
  EXPECT_EQ(line.QualityOf(0, 0), Quality::good);
  line.Close();
  line.Open();
  line.RunFor(10s);
  EXPECT_EQ(line.CountSent("?A1"), 2U) << "it may have been replaced";
}

TEST(PollerOnce, ALostReplyIsMadeGoodLater) {
  VirtualLine line = OneOnce();
  Swallow(line.twin(0), "?A1", 3);
  line.Open();
  line.RunFor(50s);
  EXPECT_EQ(line.QualityOf(0, 0), Quality::bad_waiting);
  EXPECT_EQ(line.CountSent("?A1"), 3U) << "two retries";
  line.RunFor(30s);
  EXPECT_EQ(line.QualityOf(0, 0), Quality::good);
  line.RunFor(1h);
  EXPECT_EQ(line.CountSent("?A1"), 4U);
}

TEST(PollerOnce, WhatIsNeverAnsweredIsAskedForOnceInASlowPeriod) {
  VirtualLine line = OneOnce();
  Swallow(line.twin(0), "?A1", -1);
  line.Open();
  line.RunFor(1h);
  const std::size_t tasks = line.CountSent("?A1") / 3;
  EXPECT_GE(tasks, 50U);
  EXPECT_LE(tasks, 61U);
}

// A device that is swapped while the port is lent, and does not tell its number at once.
TEST(PollerOnce, WhatTheDeviceBeforeHasSaidIsNotGoodAgainUnread) {
  VirtualLine line = OneOnce();
  line.twin(0).values.Set(0, 1001.0);
  line.Open();
  line.RunFor(10s);
  ASSERT_EQ(line.QualityOf(0, 0), Quality::good);
  line.Close();
  line.RunFor(1s);
  line.twin(0).values.Set(0, 2002.0);
  Swallow(line.twin(0), "?A1", 3);
  line.Open();
  line.always = [&] {
    if (line.QualityOf(0, 0) == Quality::good) {
      EXPECT_EQ(line.ValueOf(0, 0), Value(2002.0));
    }
  };
  line.RunFor(2min);
  EXPECT_EQ(line.QualityOf(0, 0), Quality::good);
}

TEST(PollerOnce, OfAnotherDeviceWhatIsOnlyWrittenIsNotKnown) {
  VirtualLine line(ToyLine({ToyDevice("a", "A", {"1", "V2"})}), {&ToyProtocol()});
  line.Open();
  line.RunFor(10s);
  line.twin(0).manner.instead = [](View request) -> std::optional<Bytes> {
    if (AsText(request) != "PA0\r") return std::nullopt;
    return ToyReply("A0=2");
  };
  bool swapped = false;
  line.always = [&] {
    swapped = swapped || line.QualityOf(0, 0).reason == Reason::swapped;
    EXPECT_EQ(line.QualityOf(0, 1), Quality::bad_waiting) << "nobody would read it again";
  };
  line.RunFor(2min);
  EXPECT_TRUE(swapped);
  EXPECT_EQ(line.QualityOf(0, 0), Quality::good);
}

TEST(PollerOnce, NorAfterItWasTakenOutOfUse) {
  VirtualLine line = OneOnce();
  line.Open();
  line.RunFor(10s);
  line.poller().SetInUse(0, false, line.now());
  line.RunFor(1s);
  Swallow(line.twin(0), "?A1", 3);
  line.poller().SetInUse(0, true, line.now());
  EXPECT_EQ(line.QualityOf(0, 0), Quality::uncertain);
  EXPECT_EQ(line.QualityOf(0, 1), Quality::uncertain);
  line.RunFor(10s);
  EXPECT_EQ(line.QualityOf(0, 0), Quality::uncertain);
  EXPECT_EQ(line.QualityOf(0, 1), Quality::good);
}

/// Point 1 is read daily, point 2 every second.
VirtualLine OneDaily() {
  config::Device device = ToyDevice("a", "A", {"1", "2"});
  device.points[0].group = config::Group::daily;
  return {ToyLine({device}), {&ToyProtocol()}};
}

TEST(PollerDaily, IsReadAtTheStartAndOnceADay) {
  VirtualLine line = OneDaily();
  line.Open();
  line.RunFor(25h);
  EXPECT_EQ(line.CountSent("?A1"), 2U);
  EXPECT_EQ(line.QualityOf(0, 0), Quality::good);
}

TEST(PollerDaily, WhatIsNeverAnsweredIsAskedForEveryFiveMinutes) {
  VirtualLine line = OneDaily();
  Swallow(line.twin(0), "?A1", -1);
  line.Open();
  line.RunFor(10h);
  EXPECT_EQ(line.QualityOf(0, 0), Quality::bad_waiting);
  const std::size_t tasks = line.CountSent("?A1") / 3;
  EXPECT_GE(tasks, 110U);
  EXPECT_LE(tasks, 121U);
}

// It has been silent for one poll: the value of this morning may be another device's.
TEST(PollerDaily, IsReadAnewAfterSilence) {
  VirtualLine line = OneDaily();
  line.Open();
  line.RunFor(10s);
  ASSERT_EQ(line.QualityOf(0, 0), Quality::good);
  Swallow(line.twin(0), "?A2", 3);
  line.RunFor(10s);
  EXPECT_EQ(line.QualityOf(0, 0), Quality::uncertain);
  line.RunFor(1min);
  EXPECT_EQ(line.QualityOf(0, 0), Quality::good);
  line.RunFor(1h);
  EXPECT_EQ(line.CountSent("?A1"), 2U);
}

/// A second, different reply of B comes at `doubled`: what A has refused is asked again.
struct Doubled {
  explicit Doubled(config::Device a)
      : line(ToyLine({std::move(a), ToyDevice("b", "B", {"1"})}), {&ToyProtocol()}) {
    line.twin(1).manner.deliver = [this](View, Bytes reply, Instant) {
      std::vector<TimedPiece> said = {{20ms, reply}};
      if (!reply.empty() && std::exchange(doubled, false)) {
        said.push_back({21ms, ToyReply("B1=77")});
      }
      return said;
    };
    line.Open();
  }
  bool Double() {
    doubled = true;
    return line.RunUntil([&] { return line.StatusOf(1).doubled > 0; }, 3s);
  }

  VirtualLine line;
  bool doubled = false;
};

TEST(PollerOnce, WhatIsParkedIsAskedForAgainWhenItsQueriesChange) {
  config::Device device = ToyDevice("a", "A", {"3", "1"});
  device.points[1].group = config::Group::once;
  device.slow = 5s;
  device.options = ToyOptions();
  device.options.Set("wait", std::int64_t{Duration(2s).count()});
  Doubled at(device);
  bool refused = false;
  bool busy = false;
  at.line.twin(0).manner.instead = [&](View request) -> std::optional<Bytes> {
    if (AsText(request) == "?A3\r" && !std::exchange(refused, true)) return ToyReply("A3~replan");
    if (AsText(request) != "?A1\r") return std::nullopt;
    if (!refused) return Bytes();  // so it is the last to be read
    return std::exchange(busy, true) ? std::nullopt : std::optional(ToyReply("A1~busy"));
  };
  ASSERT_TRUE(at.line.RunUntil([&] { return busy; }, 20s));
  ASSERT_TRUE(at.Double());
  at.line.RunFor(10s);
  EXPECT_EQ(at.line.QualityOf(0, 1), Quality::good);
}

TEST(PollerOnce, WhatWasRefusedIsAskedForAgainWhereThatMayHaveBeenAnothersReply) {
  config::Device device = ToyDevice("a", "A", {"1", "3"});
  device.points[1].group = config::Group::once;
  Doubled at(device);
  bool refused = false;
  at.line.twin(0).manner.instead = [&](View request) -> std::optional<Bytes> {
    if (AsText(request) == "?A3\r" && !std::exchange(refused, true)) return ToyReply("A3~replan");
    return std::nullopt;
  };
  ASSERT_TRUE(at.line.RunUntil([&] { return refused; }, 5s));
  ASSERT_TRUE(at.Double());
  at.line.RunFor(10s);
  EXPECT_EQ(at.line.QualityOf(0, 1), Quality::good);
}

}  // namespace
}  // namespace baudgate
