// Every fault of `baudgate simulate --fault` on the line of every protocol: what the gateway makes
// of it, what it calls it, that the neighbour is served meanwhile, and that all is well afterwards.
// tests/gateway/tools/simulate/twin_faults_test.cpp has the faults by themselves.
// SPDX-License-Identifier: Apache-2.0
#include "gateway/tools/simulate/twin_faults.h"

#include <gtest/gtest.h>

#include <vector>

#include "gateway/bus/poller/poller.h"
#include "tests/protocols/runs/misbehaving_twin.h"

namespace baudgate {
namespace {

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
  // Within a task a reply behind a lost one may be anybody's where none says whose it is.
  OnlyThese({Outcome::ok, Outcome::no_reply, Outcome::unexpected});
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

/// Text begins with a start character; where nothing but the length tells what is a reply, some
/// requests look like one.
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
  // Short replies come whole before the stall: who it is, it may tell.
  EXPECT_NE(end_state_, DeviceState::online);
  // It has its turn before the retries, and may meet the rest of what had stalled.
  TheNeighbourWasServed(4);
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
  // A zero that comes alone may pass for a driver that is switched on.
  if (zeros_harmless_ > 0) {
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
  EXPECT_GT(rig_->poller().accounts().line.counters().stray_bytes, struck_);
  TheNeighbourWasServed();
  EverythingComesBack();
}

TEST_P(MisbehavingTwin, DoubledRepliesSpoilNoOther) {
  Misbehave("double");
  // The second copy of a probe's answer can meet the next request, and a number that does not say
  // whose it is passes for its answer.
  if (untagged_ > 0) {
    OnlyThese({Outcome::ok, Outcome::unexpected});
  } else {
    OnlyThese({Outcome::ok});
  }
  EXPECT_GT(own_[Outcome::ok], own_.all() / 2);
  EXPECT_GT(rig_->poller().accounts().line.counters().stray_bytes, struck_);
  // A second copy in bursts 16 ms apart can pass for the beginning of the neighbour's reply.
  TheNeighbourWasServed(neighbour_.all() / 2);
  EverythingComesBack();
}

TEST_P(MisbehavingTwin, LateRepliesAreWaitedForAndTheUserIsTold) {
  Misbehave("late:delay=" + FormatDuration(*Times().reply + 200ms));
  OnlyThese({Outcome::ok, Outcome::no_reply});
  EXPECT_GE(own_[Outcome::no_reply], 1U);
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
  TheNeighbourWasServed(1);  // what is owed in the end may meet its reply
  EverythingComesBack();
}

/// Numbers of DCON modules say nothing about who sends them: if a module answers with the address
/// of another, no master can know. Where the reply carries an address, it is unexpected.
TEST_P(MisbehavingTwin, AWrongAddressIsUnexpectedWhereTheReplyCarriesOne) {
  rig_.Watch([this](std::uint32_t device) { return device == kTroubled && untagged_ > 0; });
  Misbehave("wrong_address");
  EXPECT_EQ(rig_.wrong() > 0, untagged_ > 0);
  OnlyThese({Outcome::ok, Outcome::unexpected});
  if (untagged_ == 0) {
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

/// Its frames are valid ones of another device, and of the form that was asked for. With the same
/// values they differ by the address alone, wherever the protocol says that they carry one.
TEST_P(MisbehavingTwin, ItsStrangerSpeaksTheProtocol) {
  const TwinFaults::Stranger stranger = MeetStranger();
  const Protocol& protocol = *GetParam().protocol;
  const config::Device devices[] = {rig_.device(kTroubled), rig_.device(kNeighbour)};
  const auto copy = protocol.make_twin(rig_.device(kTroubled), rig_->twin(kTroubled).values);
  copy->ReplyAs(FreeAddress(protocol, devices).value());
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

}  // namespace
}  // namespace baudgate
