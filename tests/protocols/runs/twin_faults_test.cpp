// Tests every fault of `baudgate simulate --fault` on the line of every protocol.
// tests/gateway/tools/simulate/twin_faults_test.cpp tests the faults alone.
// SPDX-License-Identifier: Apache-2.0
#include "gateway/tools/simulate/twin_faults.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <deque>
#include <optional>
#include <utility>
#include <vector>

#include "gateway/base/text.h"
#include "gateway/bus/poller/poller.h"
#include "protocols/dcon/protocol.h"
#include "tests/protocols/runs/misbehaving_twin.h"
#include "tests/protocols/runs/rig.h"

namespace baudgate::protocols {
namespace {

TEST_P(MisbehavingTwin, LostRepliesAreNoReply) {
  Misbehave("loss");
  OnlyThese({Outcome::ok, Outcome::no_reply});
  EXPECT_GT(own_[Outcome::no_reply], 5U);
  EXPECT_EQ(end_state_, bus::DeviceState::offline);
  TheNeighbourWasServed();
  EverythingComesBack();
}

TEST_P(MisbehavingTwin, RetriesCompensateSomeLostReplies) {
  Misbehave("loss:rate=0.15,seed=3");
  // A reply without a tag can belong to any earlier request. After a lost reply, it may be
  // rejected.
  OnlyThese({Outcome::ok, Outcome::no_reply, Outcome::unexpected});
  EXPECT_EQ(own_[Outcome::no_reply], struck_);
  EXPECT_TRUE(rig_.FastUsable(kTroubled));
  TheNeighbourWasServed();
  EverythingComesBack();
}

/// Every checksum detects a single wrong bit.
TEST_P(MisbehavingTwin, BitErrorsAreCorrupt) {
  Misbehave("bits");
  // A damaged identification with a valid check value is rejected as unexpected.
  OnlyThese({Outcome::ok, Outcome::corrupt, Outcome::partial, Outcome::unexpected});
  EXPECT_GT(own_[Outcome::corrupt], own_.all() / 2);
  TheNeighbourWasServed();
  EverythingComesBack();
}

/// Some protocols identify a reply by its length only. Their request, returned as an echo, can look
/// like a reply.
TEST_P(MisbehavingTwin, AnEchoIsNeverAValue) {
  Misbehave("echo");
  if (echo_hides_ > 0) {
    OnlyThese({Outcome::ok, Outcome::unexpected});
    EXPECT_GT(own_[Outcome::unexpected], 0U);
  } else {
    OnlyThese({Outcome::ok});
    TheNeighbourWasServed();
  }
  EverythingComesBack();
}

TEST_P(MisbehavingTwin, AStallBeyondTheGapIsPartial) {
  Misbehave("stall:pause=300ms");
  OnlyThese({Outcome::ok, Outcome::partial, Outcome::corrupt});
  EXPECT_GT(own_[Outcome::partial], 10U);
  // The fault delays all bytes behind the first few. Short replies such as the identification are
  // complete before.
  EXPECT_NE(end_state_, bus::DeviceState::online);
  // The neighbour is polled before the retries, and can collide with the rest of a stalled reply.
  TheNeighbourWasServed(4);
  EverythingComesBack();
}

TEST_P(MisbehavingTwin, AStallWithinTheGapIsHarmless) {
  Misbehave("stall:pause=" + FormatDuration(*Times().gap / 2));
  OnlyThese({Outcome::ok});
  TheNeighbourWasServed();
  EverythingComesBack();
}

TEST_P(MisbehavingTwin, DribbleWithinTheGapIsASlowReply) {
  Misbehave("dribble:pause=1ms");
  OnlyThese({Outcome::ok});
  TheNeighbourWasServed();
  EverythingComesBack();
}

/// Late bytes of the dribbling device collide with replies of the neighbour.
TEST_P(MisbehavingTwin, DribbleBeyondTheGapIsPartial) {
  Misbehave("dribble:pause=80ms");
  if (zeros_harmless_ > 0) {
    OnlyThese({Outcome::ok, Outcome::partial, Outcome::no_reply});
  } else {
    OnlyThese({Outcome::ok, Outcome::partial});
  }
  EXPECT_GE(own_[Outcome::partial], 3U) << "it is not repeated while the neighbour waits";
  EXPECT_EQ(end_state_, bus::DeviceState::offline);
  TheNeighbourWasServed(neighbour_.all() / 2);
  EverythingComesBack();
}

TEST_P(MisbehavingTwin, GarbageBeforeAReplyDoesNotHideTheReply) {
  Misbehave("garbage_before");
  OnlyThese({Outcome::ok});
  TheNeighbourWasServed();
  EverythingComesBack();
}

TEST_P(MisbehavingTwin, GarbageAfterAReplyAffectsNoOtherReply) {
  Misbehave("garbage_after");
  OnlyThese({Outcome::ok});
  EXPECT_GT(rig_->poller().accounts().line.counters().stray_bytes, struck_);
  TheNeighbourWasServed();
  EverythingComesBack();
}

TEST_P(MisbehavingTwin, DoubledRepliesAffectNoOtherReply) {
  Misbehave("double");
  // Replies of some protocols do not contain their device. A second copy of their reply can be
  // accepted for the next request.
  if (untagged_ > 0) {
    OnlyThese({Outcome::ok, Outcome::unexpected});
  } else {
    OnlyThese({Outcome::ok});
  }
  EXPECT_GT(own_[Outcome::ok], own_.all() / 2);
  EXPECT_GT(rig_->poller().accounts().line.counters().stray_bytes, struck_);
  // A second copy in pieces 16 ms apart can look like the beginning of the neighbour's reply.
  TheNeighbourWasServed(neighbour_.all() / 2);
  EverythingComesBack();
}

TEST_P(MisbehavingTwin, LateRepliesAreAwaitedAndReportedInAWarning) {
  Misbehave("late:delay=" + FormatDuration(*Times().reply + 200ms));
  OnlyThese({Outcome::ok, Outcome::no_reply});
  EXPECT_GE(own_[Outcome::no_reply], 1U);
  EXPECT_FALSE(rig_->warnings.empty());
  TheNeighbourWasServed();
  EverythingComesBack();
}

/// The device stays one request behind, even after silence. A probe shows this.
TEST_P(MisbehavingTwin, RepliesOneRequestBehindAreNeverAccepted) {
  Misbehave("late:exchanges=1");
  EXPECT_GT(own_[Outcome::no_reply], 0U) << "the first";
  EXPECT_EQ(rig_.wrong(), 0U);
  TheNeighbourWasServed(1);
  EverythingComesBack();
}

/// DCON numbers contain no address, so a wrong address cannot be detected.
TEST_P(MisbehavingTwin, AWrongAddressIsUnexpectedInAddressedReplies) {
  rig_.Watch([this](std::uint32_t device) { return device == kTroubled && untagged_ > 0; });
  Misbehave("wrong_address");
  EXPECT_EQ(rig_.wrong() > 0, untagged_ > 0);
  OnlyThese({Outcome::ok, Outcome::unexpected});
  if (untagged_ == 0) {
    EXPECT_GT(own_[Outcome::unexpected], 5U);
    EXPECT_EQ(end_state_, bus::DeviceState::offline);
  }
  TheNeighbourWasServed();
  EverythingComesBack();
}

TEST_P(MisbehavingTwin, ADeadDeviceRecoversAfterItsReturn) {
  Misbehave("death");
  OnlyThese({Outcome::ok, Outcome::no_reply});
  EXPECT_EQ(end_state_, bus::DeviceState::offline);
  EXPECT_GT(own_[Outcome::no_reply], 5U);
  TheNeighbourWasServed();
  EverythingComesBack();
}

TEST_P(MisbehavingTwin, ItsStrangerSendsValidFrames) {
  const tools::TwinFaults::Stranger stranger = MeetStranger();
  const Protocol& protocol = *GetParam().protocol;
  const config::Device devices[] = {rig_.device(kTroubled), rig_.device(kNeighbour)};
  const auto copy = protocol.make_twin(rig_.device(kTroubled), rig_->twin(kTroubled).values);
  copy->ReplyAs(tools::FreeAddress(protocol, devices).value());
  ASSERT_FALSE(rig_->sent.empty());
  std::size_t own = 0;
  bool any_same = false;
  bool any_untagged = false;
  for (const Sent& sent : rig_->sent) {
    const Bytes request = ToBytes(sent.text);
    const Bytes reply = rig_->twin(kTroubled).twin->Answer(request, rig_->now().instant);
    if (reply.empty()) continue;
    ++own;
    const Bytes foreign = stranger(request, rig_->now().instant);
    EXPECT_TRUE(GetParam().good_checksum(foreign)) << AsText(foreign);
    EXPECT_TRUE(foreign != reply || !CarriesAddress(request)) << AsText(foreign);
    const bool same = copy->Answer(request, rig_->now().instant) == reply;
    EXPECT_FALSE(same && CarriesAddress(request)) << AsText(reply);
    any_same = any_same || same;
    any_untagged = any_untagged || !CarriesAddress(request);
  }
  EXPECT_GT(own, 0U);
  EXPECT_EQ(any_same, any_untagged);
}

std::vector<Setup> FaultyLines() {
  return {RealLine("Spa9600"),    RealLine("Dcon9600"),       RealLine("Dcon115200"),
          RealLine("Set4tm9600"), RealLine("ModbusRtu19200"), RealLine("ModbusAscii9600")};
}
INSTANTIATE_TEST_SUITE_P(Real, MisbehavingTwin, ::testing::ValuesIn(FaultyLines()), SetupName);

// ---------------- Host watchdogs of DCON modules must not trip on a fully loaded line.

constexpr Duration kPeriod = 500ms;
constexpr std::uint32_t kWritten = 0;
constexpr std::uint32_t kDead = 2;

Setup TwoModules(Duration period) {
  config::SerialSettings serial;
  serial.baud = 9600;
  return {"HostWatchdog",
          &DconProtocol(),
          nullptr,
          "icpdas-i-7060",
          serial,
          {"1", "2", "3", "4"},
          {{"host_watchdog", std::int64_t{period.count()}}}};
}

class HostWatchdog : public ::testing::Test {
 protected:
  explicit HostWatchdog(Duration period = kPeriod)
      : rig_(TwoModules(period), [](config::Line& line) {
          for (config::Device& device : line.devices) device.poll = 300ms;
        }) {}

  /// Sends a watchdog command: "~04310F" sets 1.5 s and on; "~040" reads whether it has tripped.
  std::string Tell(std::uint32_t module, const std::string& command) {
    const std::string address = "0" + std::to_string(module + 1);
    const Bytes request = ToBytes("~" + address + command + "\r");
    return std::string(AsText(rig_->twin(module).twin->Answer(request, rig_->now().instant)));
  }

  void RunUnderLoad() {
    rig_.LearnTruth();
    for (std::uint32_t module = 0; module < rig_.devices(); ++module) {
      EXPECT_EQ(Tell(module, "310F").front(), '!');
    }
    const auto& points = rig_.device(kWritten).points;
    const auto relay = std::ranges::find(points, std::string("relay_0"), &config::Point::name);
    ASSERT_NE(relay, points.end());
    const auto point = static_cast<std::uint32_t>(relay - points.begin());
    rig_->twin(kDead).manner.dead = true;
    rig_->sent.clear();
    bool on = false;
    rig_->always = [&, end = rig_->now().instant + 1min] {
      while (rig_->now().instant < end && rig_->Write(kWritten, point, on = !on)) {
      }
    };
    rig_->RunFor(1min);
    rig_->always = nullptr;
  }

  Rig rig_;
};

TEST_F(HostWatchdog, IsFedAtItsIntervalUnderLoad) {
  RunUnderLoad();
  const std::vector<Sent>& sent = rig_->sent;
  ASSERT_GT(sent.size(), 1000U) << "it was a busy minute";
  std::optional<Instant> told;
  std::size_t times = 0;
  std::size_t late = 0;
  for (const Sent& one : sent) {
    if (one.text != "~**\r") {
      if (told && one.at - *told >= kPeriod) ++late;
      EXPECT_LE(late, 1U) << one.text << ": only what waited for the line already goes before it";
      continue;
    }
    if (told) {
      EXPECT_GE(one.at - *told, kPeriod) << "not more often than it has to";
    }
    told = one.at;
    late = 0;
    ++times;
  }
  EXPECT_GE(times, 60U);
  for (std::uint32_t module = 0; module < rig_.devices(); ++module) {
    if (module == kDead) continue;
    EXPECT_EQ(Tell(module, "0").substr(3, 2), "00") << module << " has tripped";
    EXPECT_TRUE(rig_.FastUsable(module)) << module;
  }
  EXPECT_GT(std::ranges::count(rig_->ends, WriteEnd::ok), 100);
}

class NoHostWatchdog : public HostWatchdog {
 protected:
  NoHostWatchdog() : HostWatchdog(Duration::zero()) {}
};

TEST_F(NoHostWatchdog, LetsModulesTrip) {
  RunUnderLoad();
  EXPECT_EQ(rig_->CountSent("~**"), 0U);
  EXPECT_EQ(Tell(1, "0").substr(3, 2), "04");
}

// ---------------- Devices whose replies are late by some requests.

/// Delays the replies of these devices by `requests` requests, in one common queue.
class Shifted {
 public:
  Shifted(Rig& rig, std::vector<std::uint32_t> devices, std::size_t requests)
      : rig_(rig), devices_(std::move(devices)), requests_(requests) {
    for (const std::uint32_t device : devices_) {
      rig_->twin(device).manner.distort = [this](Bytes reply) {
        return Exchange(std::move(reply));
      };
    }
  }
  ~Shifted() {
    for (const std::uint32_t device : devices_) rig_->twin(device).manner.distort = {};
  }

 private:
  Bytes Exchange(Bytes reply) {
    replies_.push_back(std::move(reply));
    if (replies_.size() <= requests_) return {};
    Bytes earlier = std::move(replies_.front());
    replies_.pop_front();
    return earlier;
  }

  Rig& rig_;
  std::vector<std::uint32_t> devices_;
  std::size_t requests_;
  std::deque<Bytes> replies_;
};

class ShiftedRun : public ::testing::TestWithParam<Setup> {};

TEST_P(ShiftedRun, NoShiftedReplyIsTakenForAnotherPoint) {
  for (const std::size_t requests : {1U, 2U, 3U, 5U}) {
    Rig rig(GetParam());
    rig.LearnTruth();
    rig.Watch();
    {
      const Shifted shifted(rig, {0}, requests);
      const std::uint32_t neighbour = rig->StatusOf(1).Count(Outcome::ok);
      rig->RunFor(10min);
      EXPECT_EQ(rig.wrong(), 0U) << requests << " requests late";
      const bus::DeviceStatus status = rig->StatusOf(0);
      EXPECT_LT(status.Count(Outcome::ok), status.exchanges) << "it is found out";
      EXPECT_GT(rig->StatusOf(1).Count(Outcome::ok), neighbour + 150) << "it is served";
    }
    EXPECT_TRUE(rig->RunUntil([&] { return rig.AllGood(); }, 5min)) << "in step again";
    EXPECT_EQ(rig.wrong(), 0U);
    if (HasFailure()) return;
  }
}

TEST_P(ShiftedRun, NoReplyShiftedByASerialServerIsTakenForAnotherPoint) {
  for (const std::size_t requests : {1U, 2U, 3U, 5U}) {
    Rig rig(GetParam());
    rig.LearnTruth();
    rig.Watch();
    {
      const Shifted shifted(rig, {0, 1}, requests);
      rig->RunFor(10min);
      EXPECT_EQ(rig.wrong(), 0U) << requests << " requests late";
      for (const std::uint32_t device : {0U, 1U}) {
        const bus::DeviceStatus status = rig->StatusOf(device);
        EXPECT_LT(status.Count(Outcome::ok), status.exchanges) << "it is found out";
      }
    }
    EXPECT_TRUE(rig->RunUntil([&] { return rig.AllGood(); }, 5min)) << "in step again";
    EXPECT_EQ(rig.wrong(), 0U);
    if (HasFailure()) return;
  }
}

INSTANTIATE_TEST_SUITE_P(Real, ShiftedRun, ::testing::ValuesIn(RealLines()), SetupName);
INSTANTIATE_TEST_SUITE_P(Network, ShiftedRun, ::testing::Values(TcpLine()), SetupName);

TEST(ReplacedDevice, IsAcceptedAfterAWhile) {
  Rig rig(RealLine("Spa9600"));
  rig.LearnTruth();
  std::string other = "<1D:SPCX 1C1:";
  std::uint8_t sum = 0;
  for (const char c : other) sum ^= static_cast<std::uint8_t>(c);
  other += HexByte(sum) + "\r\n";
  rig->twin(0).manner.instead = [&](View request) -> std::optional<Bytes> {
    if (!AsText(request).starts_with(">1RF:")) return std::nullopt;
    return ToBytes(other);
  };
  rig->twin(0).manner.dead = true;
  rig->RunFor(1min);
  rig->twin(0).manner.dead = false;
  EXPECT_TRUE(rig->RunUntil([&] { return rig.AllGood(0); }, 15min));
}

}  // namespace
}  // namespace baudgate::protocols
