// Every fault of `baudgate simulate --fault` on the line of every protocol: what the gateway makes
// of it, what it calls it, that the neighbour is served meanwhile, and that all is well afterwards.
// tests/gateway/simulate/twin_faults_test.cpp has the faults by themselves.
// SPDX-License-Identifier: Apache-2.0
#include "gateway/simulate/twin_faults.h"

#include <gtest/gtest.h>

#include <array>
#include <optional>

#include "gateway/poll/poller.h"
#include "gateway/simulate/fault_text.h"
#include "gateway/simulate/simulator.h"
#include "tests/protocols/runs/rig.h"

namespace baudgate {
namespace {

constexpr std::uint32_t kTroubled = 0;
constexpr std::uint32_t kNeighbour = 1;

/// How many exchanges of one device ended how.
class Tally {
 public:
  Tally() = default;
  Tally(const DeviceStatus& before, const DeviceStatus& after) {
    for (std::size_t i = 0; i < kOutcomeCount; ++i)
      counts_[i] = after.outcomes[i] - before.outcomes[i];
  }
  std::uint32_t operator[](Outcome outcome) const {
    return counts_[static_cast<std::size_t>(outcome)];
  }
  std::uint32_t all() const {
    std::uint32_t sum = 0;
    for (const std::uint32_t count : counts_) sum += count;
    return sum;
  }
  std::uint32_t failed() const { return all() - (*this)[Outcome::ok]; }

 private:
  std::array<std::uint32_t, kOutcomeCount> counts_{};
};

void PrintTo(const Tally& tally, std::ostream* out) {
  for (std::size_t i = 0; i < kOutcomeCount; ++i) {
    const auto outcome = static_cast<Outcome>(i);
    if (tally[outcome] > 0) *out << Name(outcome) << " " << tally[outcome] << " ";
  }
}

class MisbehavingTwin : public ::testing::TestWithParam<Setup> {
 protected:
  MisbehavingTwin() : rig_(GetParam()) {
    rig_.LearnTruth();
    rig_.Watch();
    // In pieces, as the FIFO of a UART hands them over.
    for (std::uint32_t device = 0; device < rig_.devices(); ++device)
      rig_->twin(device).manner.fragment = 16;
  }

  /// One device misbehaves for a minute as `text` says; own_ and neighbour_ are of that minute.
  void Misbehave(const std::string& text) {
    const std::string separator = text.find(':') == std::string::npos ? ":" : ",";
    const auto fault = ParseFault(text + separator + "after=10s,for=1min");
    ASSERT_TRUE(fault) << fault.error();
    const TwinWire wire{GetParam().serial, true, 5ms};
    faults_.emplace(std::vector{*fault}, wire, rig_->now().instant, MeetStranger());
    rig_->twin(kTroubled).manner.deliver = [this](View request, Bytes reply, Instant end) {
      if (faults_->IsDead(end)) PowerOff();
      if (!reply.empty() && !CarriesAddress(request)) ++untagged_;
      return faults_->Deliver(request, std::move(reply), end);
    };
    Begin();
    rig_->RunFor(9s);
    End();
    EXPECT_EQ(own_.failed(), 0U) << ::testing::PrintToString(own_) << ": it was not time yet";
    Begin();
    rig_->RunFor(1min);
    end_state_ = rig_->StatusOf(kTroubled).state;
    rig_->RunFor(2s);
    End();
    struck_ = faults_->Counts()[0].struck;
    EXPECT_GT(struck_, 0U);
  }

  void EverythingComesBack() {
    EXPECT_TRUE(rig_->RunUntil([&] { return rig_.AllGood(); }, 3min)) << "not all points are good";
    for (std::uint32_t device = 0; device < rig_.devices(); ++device) {
      const auto online = [&] { return rig_->StatusOf(device).state == DeviceState::online; };
      EXPECT_TRUE(rig_->RunUntil(online, 3min)) << "device " << device << " is not online";
    }
    rig_->RunFor(2min);  // whatever was read wrong has been read again
    rig_.Watch();
    Begin();
    rig_->RunFor(1min);
    End();
    EXPECT_EQ(own_.failed(), 0U) << ::testing::PrintToString(own_);
    EXPECT_EQ(neighbour_.failed(), 0U) << ::testing::PrintToString(neighbour_);
    EXPECT_EQ(faults_->Counts()[0].struck, struck_);
  }

  /// Its own exchanges all ended as one of these.
  void OnlyThese(std::initializer_list<Outcome> outcomes) {
    std::uint32_t sum = 0;
    for (const Outcome outcome : outcomes) sum += own_[outcome];
    EXPECT_EQ(sum, own_.all()) << ::testing::PrintToString(own_);
  }
  /// `failed`: how many of its exchanges may have met what the other one said out of turn.
  void TheNeighbourWasServed(std::uint32_t failed = 0) {
    EXPECT_GT(neighbour_[Outcome::ok], 20U);
    EXPECT_LE(neighbour_.failed(), failed) << ::testing::PrintToString(neighbour_);
  }
  bool Is(std::string_view protocol) const { return GetParam().protocol->name == protocol; }
  config::Timing Times() {
    return Merge(rig_.device(kTroubled).timing, GetParam().protocol->timing(GetParam().serial));
  }

  Rig rig_;
  std::optional<TwinFaults> faults_;
  std::unique_ptr<Twin> stranger_;
  Tally own_;
  Tally neighbour_;
  DeviceState end_state_ = DeviceState::never_seen;
  std::uint64_t struck_ = 0;
  std::size_t untagged_ = 0;  // requests whose replies do not say whose they are

  void Begin() {
    own_before_ = rig_->StatusOf(kTroubled);
    neighbour_before_ = rig_->StatusOf(kNeighbour);
  }
  void End() {
    own_ = Tally(own_before_, rig_->StatusOf(kTroubled));
    neighbour_ = Tally(neighbour_before_, rig_->StatusOf(kNeighbour));
  }

  /// Another device of the kind, which measures what the neighbour measures.
  TwinFaults::Stranger MeetStranger() {
    const Protocol& protocol = *GetParam().protocol;
    const config::Device devices[] = {rig_.device(kTroubled), rig_.device(kNeighbour)};
    stranger_ = protocol.make_twin(rig_.device(kTroubled), rig_->twin(kNeighbour).values);
    stranger_->ReplyAs(FreeAddress(protocol, devices).value());
    return [this](View request, Instant now) { return stranger_->Answer(request, now); };
  }

  /// What it knew of sessions is gone.
  void PowerOff() {
    auto& twin = rig_->twin(kTroubled);
    twin.twin = GetParam().protocol->make_twin(rig_.device(kTroubled), twin.values);
  }

  bool CarriesAddress(View request) {
    return !GetParam().protocol->expect(request, rig_.device(kTroubled).options).address.empty();
  }

  DeviceStatus own_before_;
  DeviceStatus neighbour_before_;
};

TEST_P(MisbehavingTwin, LostRepliesAreNoReply) {
  Misbehave("loss");
  OnlyThese({Outcome::ok, Outcome::no_reply});
  EXPECT_GT(own_[Outcome::no_reply], 5U);
  EXPECT_EQ(end_state_, DeviceState::offline);
  TheNeighbourWasServed();
  EverythingComesBack();
}

TEST_P(MisbehavingTwin, SomeLostRepliesAreMadeUpForByRetries) {
  Misbehave("loss:rate=0.15,seed=3");
  OnlyThese({Outcome::ok, Outcome::no_reply});
  EXPECT_EQ(own_[Outcome::no_reply], struck_);
  EXPECT_TRUE(rig_.FastUsable(kTroubled));
  TheNeighbourWasServed();
  EverythingComesBack();
}

/// One bit: no checksum lets that through, nor does any let it pass for another frame.
TEST_P(MisbehavingTwin, BitErrorsAreCorrupt) {
  Misbehave("bits");
  // A damaged identification with a good check value is no identification.
  OnlyThese({Outcome::ok, Outcome::corrupt, Outcome::partial, Outcome::unexpected});
  EXPECT_GT(own_[Outcome::corrupt], own_.all() / 2);
  TheNeighbourWasServed();
  EverythingComesBack();
}

/// Text begins with a start character; of a meter's requests some look like replies.
TEST_P(MisbehavingTwin, AnEchoIsNeverAValue) {
  Misbehave("echo");
  if (Is("set4tm")) {
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
  EXPECT_EQ(end_state_, DeviceState::offline);
  // It has its turn before the retries, and may meet the rest of what had stalled.
  TheNeighbourWasServed(3);
  EverythingComesBack();
}

TEST_P(MisbehavingTwin, AStallWithinTheGapIsNothing) {
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

/// What a dribbling device still says when its neighbour is asked meets the neighbour's replies.
TEST_P(MisbehavingTwin, DribbleBeyondTheGapIsPartial) {
  Misbehave("dribble:pause=80ms");
  // Single zero bytes in front of an RTU frame pass for a driver that is switched on.
  if (Is("modbus_rtu")) {
    OnlyThese({Outcome::ok, Outcome::partial, Outcome::no_reply});
  } else {
    OnlyThese({Outcome::ok, Outcome::partial});
  }
  EXPECT_GE(own_[Outcome::partial], 3U) << "it is not repeated while the neighbour waits";
  EXPECT_EQ(end_state_, DeviceState::offline);
  TheNeighbourWasServed(neighbour_.all() / 2);
  EverythingComesBack();
}

TEST_P(MisbehavingTwin, GarbageBeforeHidesNoReply) {
  Misbehave("garbage_before");
  OnlyThese({Outcome::ok});
  TheNeighbourWasServed();
  EverythingComesBack();
}

TEST_P(MisbehavingTwin, GarbageAfterSpoilsNoOther) {
  Misbehave("garbage_after");
  OnlyThese({Outcome::ok});
  EXPECT_GT(rig_->poller().ledger().counters().stray_bytes, struck_);
  TheNeighbourWasServed();
  EverythingComesBack();
}

TEST_P(MisbehavingTwin, DoubledRepliesSpoilNoOther) {
  Misbehave("double");
  // The second copy of a DCON probe's answer can meet the next request: no number says whose it is.
  if (Is("dcon")) {
    OnlyThese({Outcome::ok, Outcome::unexpected});
  } else {
    OnlyThese({Outcome::ok});
  }
  EXPECT_GT(own_[Outcome::ok], own_.all() / 2);
  EXPECT_GT(rig_->poller().ledger().counters().stray_bytes, struck_);
  // A second copy in bursts 16 ms apart can pass for the beginning of the neighbour's reply.
  TheNeighbourWasServed(neighbour_.all() / 2);
  EverythingComesBack();
}

TEST_P(MisbehavingTwin, LateRepliesAreNoReplyAndTheUserIsTold) {
  Misbehave("late:delay=" + FormatDuration(*Times().reply + 200ms));
  OnlyThese({Outcome::ok, Outcome::no_reply});
  EXPECT_GE(own_[Outcome::no_reply], 5U);
  EXPECT_FALSE(rig_->warnings.empty());
  TheNeighbourWasServed();
  EverythingComesBack();
}

/// A device that answers each request with the reply to the one before. No silence, however long,
/// makes it catch up; its probe shows it. shifted_test.cpp has more of them.
TEST_P(MisbehavingTwin, RepliesThatAreOneBehind) {
  Misbehave("late:exchanges=1");
  EXPECT_GT(own_[Outcome::no_reply], 0U) << "the first";
  EXPECT_EQ(rig_.wrong(), 0U);
  TheNeighbourWasServed();
  EverythingComesBack();
}

/// Numbers of DCON modules say nothing about who sends them: if a module answers with the address
/// of another, no master can know. Where the reply carries an address, it is unexpected.
TEST_P(MisbehavingTwin, AWrongAddressIsUnexpectedWhereTheReplyCarriesOne) {
  rig_.Watch([this](std::uint32_t device) { return device == kTroubled && untagged_ > 0; });
  Misbehave("wrong_address");
  EXPECT_EQ(untagged_ > 0, Is("dcon"));
  EXPECT_EQ(rig_.wrong() > 0, untagged_ > 0);
  OnlyThese({Outcome::ok, Outcome::unexpected});
  if (!Is("dcon")) {
    EXPECT_GT(own_[Outcome::unexpected], 5U);
    EXPECT_EQ(end_state_, DeviceState::offline);
  }
  TheNeighbourWasServed();
  EverythingComesBack();
}

TEST_P(MisbehavingTwin, DeathAndReturn) {
  Misbehave("death");
  OnlyThese({Outcome::ok, Outcome::no_reply});
  EXPECT_EQ(end_state_, DeviceState::offline);
  EXPECT_GT(own_[Outcome::no_reply], 5U);
  TheNeighbourWasServed();
  EverythingComesBack();
}

/// Its frames are valid ones of another device, and of the form that was asked for.
TEST_P(MisbehavingTwin, ItsStrangerSpeaksTheProtocol) {
  const TwinFaults::Stranger stranger = MeetStranger();
  ASSERT_FALSE(rig_->sent.empty());
  std::size_t own = 0;
  for (const Sent& sent : rig_->sent) {
    const Bytes request = ToBytes(sent.text);
    const Bytes reply = rig_->twin(kTroubled).twin->Answer(request, rig_->now().instant);
    if (reply.empty()) continue;
    ++own;
    const Bytes foreign = stranger(request, rig_->now().instant);
    EXPECT_TRUE(GetParam().good_checksum(foreign)) << AsText(foreign);
    EXPECT_TRUE(foreign != reply || !CarriesAddress(request)) << AsText(foreign);
  }
  EXPECT_GT(own, 0U);
}

std::vector<Setup> Lines() {
  return {RealLine("Spa9600"),    RealLine("Dcon9600"),       RealLine("Dcon115200"),
          RealLine("Set4tm9600"), RealLine("ModbusRtu19200"), RealLine("ModbusAscii9600")};
}
INSTANTIATE_TEST_SUITE_P(Real, MisbehavingTwin, ::testing::ValuesIn(Lines()), SetupName);

}  // namespace
}  // namespace baudgate
