// Tests of `WhoseReply`, by the table in gateway/bus/replies/whose_reply.cpp. "?A…" polls device a,
// "PA…" asks for its name. A reply "!=1*XX" can answer any request "U…", because it does not
// contain what was read.
#include "gateway/bus/replies/whose_reply.h"

#include <gtest/gtest.h>

#include <ostream>
#include <sstream>
#include <string>

#include "tests/gateway/bus/poller/part_fixture.h"

namespace baudgate::bus {
namespace {

class WhoseReplyTest : public ::testing::Test, protected ToyMembers {
 protected:
  Asked Of(const Member& member, const protocols::Request& request) const {
    return {
        .member = &member, .request = &request, .first = !request.steady, .probe = request.steady};
  }
  void Send(const Asked& asked) { order_.OnSent(asked, kStart + ++sent_ * 1s); }
  void Silence(const Member& member, const protocols::Request& request) {
    const Asked asked = Of(member, request);
    Send(asked);
    order_.NoteOutcome(asked, Outcome::no_reply, true, kStart + sent_ * 1s);
  }
  WhoseReply::Verdict Reply(const Member& member, const protocols::Request& request,
                            std::string_view body, Outcome outcome = Outcome::ok) {
    const Asked asked = Of(member, request);
    Send(asked);
    const auto verdict = order_.OnReply(asked, ToyReply(body), outcome);
    order_.NoteOutcome(asked, verdict.elsewhere ? Outcome::unexpected : outcome, true,
                       kStart + sent_ * 1s);
    return verdict;
  }
  /// Runs exchanges and returns the verdict on the last reply. "PA0:A0" is a request and its reply;
  /// "UA1:" is not answered; "*UA1:=1" is a probe that reads a point; "-UA1:=1" has a reply without
  /// an address; "WA1:A1=1" is a write. "open" opens the port. "back" says that the device was
  /// absent and may have been replaced.
  std::string Run(const std::string& history) {
    std::istringstream words(history);
    std::string follows;
    for (std::string word; words >> word;) {
      if (word == "open") {
        order_.OnOpened(a, kStart);
        continue;
      }
      if (word == "back") {
        order_.OnReconnect(a);
        continue;
      }
      const bool probe = word[0] == '*';
      const bool named = word[0] != '-';
      if (probe || !named) word.erase(0, 1);
      const std::string reply = word.substr(word.find(':') + 1);
      protocols::Request request = AskFor(word.substr(0, word.find(':')) + "\r", named);
      request.steady = word[0] == 'P';
      Device& device = word[1] == 'A' ? a : b;
      Asked asked = Of(device, request);
      asked.probe = asked.probe || probe;
      asked.writes = word[0] == 'W';
      Send(asked);
      WhoseReply::Verdict verdict;
      Outcome outcome = Outcome::no_reply;
      if (!reply.empty()) {
        const Bytes frame = ToyReply(reply);
        outcome = device.conversation->Check(request.bytes, frame);
        verdict = order_.OnReply(asked, frame, outcome);
        if (verdict.elsewhere) outcome = Outcome::unexpected;
        follows = InWords(verdict);
        if (follows == "proven" && orders_.Owed(asked) > 0) follows += ", owed";
      }
      order_.NoteOutcome(asked, outcome, true, kStart + sent_ * 1s);
    }
    return follows;
  }
  static std::string InWords(const WhoseReply::Verdict& verdict) {
    if (verdict.replaced) return "replaced";
    if (verdict.shifted) return "shifted";
    if (verdict.odd) return "odd";
    if (verdict.elsewhere) return "elsewhere";
    if (!verdict.proven) return "not proven";
    return verdict.older > 0s ? "proven, older" : "proven";
  }
  Asked ProbeWithARead(int times) {
    const Asked probe{.member = &a, .request = &one_, .probe = true};
    for (int i = 0; i < times; ++i) {
      Send(probe);
      order_.OnReply(probe, ToyReply("=1"), Outcome::ok);
      order_.NoteOutcome(probe, Outcome::ok, true, kStart + sent_ * 1s);
    }
    return probe;
  }
  bool NeedsProbe(const Member& member, const protocols::Request& request) const {
    return order_.NeedsProbeFirst(Of(member, request), kStart + sent_ * 1s);
  }
  static protocols::Request Identification(std::string_view bytes) {
    protocols::Request request = AskFor(bytes);
    request.steady = true;
    return request;
  }
  static constexpr Instant kStart = Instant() + 1h;

  ReplyOrders orders_{roster};
  WhoseReply order_{roster, orders_};
  int sent_ = 0;
  const protocols::Request name_ = Identification("PA0\r");
  const protocols::Request one_ = AskFor("UA1\r");
  const protocols::Request two_ = AskFor("UA2\r");
};

struct WhoseReplyCase {
  int row;  // row of the table in gateway/bus/replies/whose_reply.cpp
  const char* history;
  const char* follows;
};

void PrintTo(const WhoseReplyCase& one, std::ostream* out) { *out << one.history; }

class WhoseReplyTable : public WhoseReplyTest,
                        public ::testing::WithParamInterface<WhoseReplyCase> {};

TEST_P(WhoseReplyTable, EachHistoryGivesItsVerdict) {
  EXPECT_EQ(Run(GetParam().history), GetParam().follows);
}

constexpr WhoseReplyCase kReplyRows[] = {
    {1, "PA0:A0 UA1:=1", "proven"},
    {1, "UA1:=1 UA1:=2", "proven"},
    {1, "*UA1:=1", "proven"},
    {2, "PA0:A0 UA1:=1 ?A3:=1", "shifted"},
    {2, "PA0:A0 UA1:=1 ?A3:=1 ?A3:=1", "elsewhere"},
    {3, "PA0:A0 UA1: UA2:=1", "not proven"},
    {4, "PA0:A0 UA1: UA1:=1", "proven, older"},
    {4, "PA0:A0 UA1: UA1:=1 UA2:=1", "not proven"},
    {5, "PA0:A0 UA1:=1 UA1: ?A1:A1=5", "proven"},
    {6, "PA0:A0 UA1: PA0:=1", "elsewhere"},
    {7, "PA0:A0 UA1: PA0:A0", "proven"},
    {7, "PA0:A0 PA0: PA0:A0", "proven, older"},
    {8, "PA0:A0 UA1: PA0:=1 UA1:A0", "elsewhere"},
    {9, "PA0:A0 UA1:=1 PA0:A0=2", "shifted"},
    {9, "PA0:A0 UA1:=1 PA0:A0=2 PA0:A0=2", "replaced"},
    {9, "PA0:A0 UA1:=1 PA0:A0=2 PA0:A0=3", "elsewhere"},
    {9, "PA0:A0 UA1:=1 PA0:A0=2 PA0:A0", "proven, older"},
    {9, "PA0:A0 UA1:=1 PA0:A0=2 PA0:A0 PA0:A0=2", "elsewhere"},
    {9, "PA0:A0=7 PA0:A0 PA0:A0", "proven, older"},
    {9, "PA0:A0 PA0:A0 PA0:A0=2 PA0:A0=2", "replaced"},
    {9, "PA0:A0 UA1:=1 PA0:A0=2 PA0:A0=2 PA0:A0=2", "proven, older"},
    {9, "PA0:A0 PA0:A0=2 PA0:A0=2 PA0:A0=2", "proven, older"},
    {9, "PA0:A0 ?A0:A0=7 PA0:A0=7 PA0:A0=7", "elsewhere"},
    {9, "PA0:A0~refused PA0:A0~replan", "shifted"},
    {9, "open PA0:A0 PA0:A0 PA0:A0 PA0:A0 UA1:=1 PA0:A0=2 PA0:A0=2", "replaced"},
    {10, "PA0:A0 *UA1:=1 *UA1:=1 *UA1:=1 *UA1:=1 *UA1:=1 *UA1:=1 *UA1:=1", "not proven"},
    {10, "PA0:A0 *UA1:=1 *UA1:=1 *UA1:=1 *UA1:=1 *UA1:=1 *UA1:=1 *UA1:=1 *UA1:=1", "replaced"},
    {10, "PA0:A0 *UA1:=1 *UA1:=1 *UA1:=1 *UA1:=1 *UA1:=1 *UA1:=1 *UA1:=1 *UA1:=1 *UA1:=1",
     "proven"},
    {10, "PA0:A0 *UA1:=1 *UA1:=1 *UA1:=1 *UA1:=1 PA0:A0 *UA1:=1 *UA1:=1 *UA1:=1 *UA1:=1",
     "not proven"},
    {10, "PA0:A0 *UA1:=1 *UA1:=1 *UA1:=1 *UA1:=1 back *UA1:=1 *UA1:=1 *UA1:=1 *UA1:=1",
     "not proven"},
    {11, "open PA0:A0 PA0:A0 PA0:A0", "not proven"},
    {11, "open PA0:A0 PA0:A0 PA0:A0 PA0:A0", "proven"},
    {11, "open PA0:A0 PA0:A0 PA0:A0 PA0:A0 PA0: PA0:A0", "proven, older"},
    {11, "open UA1:=1", "not proven"},
    {11, "open UA1:=1 UA1:=1 UA1:=1 UA1:=1", "proven, older"},
    {11, "open ?A1:~refused", "elsewhere"},
    {12, "PA0:A0 PB0:B0 -UB1: -UA1:=1", "not proven"},
    {13, "PA0:A0 PB0:B0 ?B1: ?A1:A1=5", "proven"},
    {13, "PA0:A0 PB0:B0 -?B1: -?A1:A1=5", "proven"},
    {14, "PA0:A0 UA1:A9", "odd"},
    {14, "UA1:A9 UA1:A9", "shifted"},
    {14, "PA0:A0 UA1:=1 UA2:A9 UA2:A9", "elsewhere"},
    {14, "PA0:A0~refused UA1:=1 UA2:A9 UA2:A9", "elsewhere"},
    {14, "PA0:A0 UA1:A9 UA1:A9 PA0:A0", "proven"},
    {14, "PA0:A0 UA1:A0", "shifted"},
    {14, "PA0:A0 UA2:=2 UA1:A9", "shifted"},
    {14, "PA0:A0 ?B1:B1=1 -UA1:A9", "shifted"},
    {14, "PA0:A0 UA1: UA1:A9", "odd"},
    {14, "PA0:A0 ?B1:B1=1 UA1:A9", "odd"},
    {14, "PA0:A0 *UA1:A9", "shifted"},
    {14, "PA0:A0~busy UA2:=2 UA1:A9 UA1:A9", "shifted"},
    {14, "UA1:=1 UA1:A9 UA1:A9", "elsewhere"},
    {15, "PA0:A0 UA1: ?A1:A1=5", "not proven"},
    {15, "PA0:A0 UA1: ?A1:A1=5 ?A1:A1=5", "proven, older"},
    {15, "PA0:A0 UA1: UA1: UA1: UA1: PA0:A0", "proven"},
    {15, "PA0:A0 UA1: ?A1: ?A1: ?A1:A1=5", "not proven"},
    {15, "PA0:A0 UA1: ?A1: ?A1: ?A1: ?A1:A1=5", "proven, older"},
    {15, "PA0:A0 UA1: PA0:A0 UA1: ?A1:A1=5", "not proven"},
    {15, "PA0:A0 UA1: PA0:A0 UA1: PA0:A0 UA1: ?A1:A1=5", "proven"},
    {15, "PA0:A0 UA1: UA1: UA1: back PA0:A0 UA1: ?A1:A1=5", "not proven"},
    {15, "PA0:A0 UA1:~busy UA1: ?A1:A1=5", "not proven"},
    {15, "PA0:A0 UA1: WA1:A1=5", "proven"},
    {15, "PA0:A0 UA2: UA1:=1 PA0:A0 UA1: ?A1:A1=5", "not proven"},
    {15, "UA1:A9 UA1: ?A1:A1=5", "not proven"},
    {15, "PA0:A0 UA1:=1 PA0:A0=2 PA0:A0=2 PA0:A0=2 UA1: ?A1:A1=5", "not proven"},
    {15, "PA0:A0 UA1:=1 open PA0:A0 PA0:A0 PA0:A0 PA0:A0 UA1: ?A1:A1=5", "not proven"},
    {15, "PA0:A0 UA1: UA1: UA1: PA0:A0 UA1:=1 open PA0:A0 PA0:A0 PA0:A0 PA0:A0 UA1: ?A1:A1=5",
     "not proven"},
    {16, "PA0:A0=7 ?A0:A0=7 ?A0: PA0:A0=7", "not proven"},
    {16, "PA0:A0=7 ?A0:A0=7 ?A0: PA0:A0=7 PA0:A0=7", "proven, older"},
    {16, "PA0:A0 PA0: ?A1:A1~refused", "not proven"},
    {16, "PA0:A0~refused PA0: ?A1:A1~refused", "proven"},
    {17, "PA0:A0 UA2:=2 UA1:=1 ?A1:=1 UA1:=1", "not proven"},
    {17, "PA0:A0 UA2:=2 UA1:=1 ?A1:=1 PA0:A0 PA0:A0 UA1:=1", "proven"},
    {17, "PA0:A0 ?A1:A1=1 UA2:=2 UA1:=1 ?A1:=1 UA1:=1", "not proven"},
    {17, "PA0:A0 PB0:B0 -UA2:=2 -?A1:=1 -UB1:=1", "not proven"},
    {18, "PA0:A0 PB0:B0 ?B1: ?A1:B1=5", "elsewhere"},
    {18, "PA0:A0 PB0:B0 UA1: ?B1: ?A1:B1=5 ?A1:A1=5", "not proven"},
    {18, "PA0:A0 PB0:B0 ?B1: ?A1:B1=5 ?A1:A1=5", "proven, older"},
};

INSTANTIATE_TEST_SUITE_P(Rows, WhoseReplyTable, ::testing::ValuesIn(kReplyRows));

TEST_F(WhoseReplyTest, AfterASecondReplyAProbeGoesFirst) {
  Run("PA0:A0 UA1:=1");
  order_.OnSecondReply(a);
  EXPECT_TRUE(NeedsProbe(a, two_));
}

TEST_F(WhoseReplyTest, ADeviceThatHasNeverAnsweredIsProbedFirst) {
  EXPECT_TRUE(NeedsProbe(a, one_));
  EXPECT_FALSE(Reply(a, name_, "A0").elsewhere);
  EXPECT_FALSE(NeedsProbe(a, one_));
}

TEST_F(WhoseReplyTest, AfterSilenceAProbeGoesFirst) {
  Reply(a, name_, "A0");
  Silence(a, one_);
  EXPECT_TRUE(NeedsProbe(a, two_));
  EXPECT_TRUE(NeedsProbe(a, one_)) << "a late reply would be an older value of its own";
  EXPECT_FALSE(Reply(a, name_, "A0").elsewhere);
  EXPECT_FALSE(NeedsProbe(a, two_));
  EXPECT_TRUE(orders_.Of(a).IsInStep());
}

TEST_F(WhoseReplyTest, ALaggingDeviceIsProbedWhenItsOutstandingRepliesGrow) {
  Reply(a, name_, "A0");
  Silence(a, one_);
  Reply(a, name_, "=1", Outcome::unexpected);
  Reply(a, name_, "A0");
  EXPECT_TRUE(order_.Lags(a));
  EXPECT_FALSE(NeedsProbe(a, one_));
  EXPECT_TRUE(Reply(a, one_, "A0", Outcome::unexpected).elsewhere);
  EXPECT_TRUE(Reply(a, one_, "=1").proven);
  EXPECT_FALSE(NeedsProbe(a, one_)) << "one is owed, as it was";
  Send(Of(a, one_));
  EXPECT_TRUE(NeedsProbe(a, one_));
}

TEST_F(WhoseReplyTest, AReplyOfAnotherDeviceDoesNotChangeTheOwnOrder) {
  Reply(b, Identification("PB0\r"), "B0");
  Reply(a, name_, "A0");
  Reply(b, Identification("PB0\r"), "A0", Outcome::unexpected);
  EXPECT_TRUE(Reply(a, AskFor("UA1\r", false), "B0", Outcome::unexpected).elsewhere);
  EXPECT_EQ(orders_.Owed(Of(a, AskFor("UA1\r"))), 1);
}

TEST_F(WhoseReplyTest, ARefusedIdentificationIsNoReplacement) {
  Reply(a, name_, "A0");
  EXPECT_FALSE(Reply(a, name_, "A0~refused", Outcome::refused).replaced);
  EXPECT_FALSE(NeedsProbe(a, one_));
}

TEST_F(WhoseReplyTest, ARepeatedRefusalOfTheNameIsAProof) {
  Reply(a, name_, "A0~refused", Outcome::refused);
  EXPECT_FALSE(NeedsProbe(a, one_));
  Silence(a, one_);
  Reply(a, name_, "A0~refused", Outcome::refused);
  EXPECT_FALSE(NeedsProbe(a, two_));
}

TEST_F(WhoseReplyTest, WithoutAProofAReplyIsProvenAfterAllOutstandingReplies) {
  ProbeWithARead(8);
  Silence(a, one_);
  ProbeWithARead(1);
  EXPECT_FALSE(NeedsProbe(a, two_));
  EXPECT_FALSE(Reply(a, two_, "=2").proven);
  EXPECT_TRUE(Reply(a, two_, "=2").proven) << "one reply was owed";
}

TEST_F(WhoseReplyTest, ANamedDeviceIsNotProvenByOtherAnswers) {
  Reply(a, name_, "A0");
  Silence(a, one_);
  ProbeWithARead(1);
  orders_.Reset(a);
  EXPECT_TRUE(NeedsProbe(a, one_));
}

TEST_F(WhoseReplyTest, AProofHoldsForAMinute) {
  Reply(a, name_, "A0");
  const Instant proven = kStart + 1s;
  Reply(a, one_, "=1");
  Asked asked = Of(a, two_);
  EXPECT_FALSE(order_.NeedsProbeFirst(asked, proven + 60s));
  EXPECT_TRUE(order_.NeedsProbeFirst(asked, proven + 60s + 1ms));
  EXPECT_EQ(order_.ProofEnds(a), proven + 60s);
  asked.renews_proof_early = true;
  EXPECT_FALSE(order_.NeedsProbeFirst(asked, proven + 45s));
  EXPECT_TRUE(order_.NeedsProbeFirst(asked, proven + 45s + 1ms)) << "the line has time";
  EXPECT_EQ(order_.ProofRenews(a), proven + 45s);
  Silence(a, one_);
  EXPECT_EQ(order_.ProofEnds(a), Instant{}) << "another device may be there now";
}

TEST_F(WhoseReplyTest, RequestsThatNeedNoProofAreNotProbed) {
  protocols::Request broadcast = AskFor("QA1\r");
  broadcast.expect.reply = protocols::Expectation::Reply::none;
  ASSERT_TRUE(NeedsProbe(a, one_));
  Asked asked = Of(a, one_);
  asked.first = false;
  EXPECT_FALSE(order_.NeedsProbeFirst(asked, kStart)) << "the task is under way";
  asked = Of(a, one_);
  asked.unprovable = true;
  EXPECT_FALSE(order_.NeedsProbeFirst(asked, kStart)) << "it cannot be probed";
  EXPECT_FALSE(NeedsProbe(a, broadcast)) << "nobody answers it";
  Reply(a, name_, "A0");
  Send(Of(a, one_));
  protocols::Request any_order = AskFor("?A9\r");
  any_order.any_order = true;
  EXPECT_TRUE(NeedsProbe(a, two_));
  EXPECT_FALSE(NeedsProbe(a, any_order)) << "its reply is true whichever request it answers";
  a.in_use = false;
  EXPECT_FALSE(NeedsProbe(a, one_));
}

TEST_F(WhoseReplyTest, ABroadcastLeavesNoReplyOutstanding) {
  protocols::Request broadcast = AskFor("QA1\r");
  broadcast.expect.reply = protocols::Expectation::Reply::none;
  Reply(a, name_, "A0");
  Send(Of(a, broadcast));
  EXPECT_TRUE(orders_.Of(a).IsInStep());
}

TEST_F(WhoseReplyTest, OnlySilenceRequiresANewProbe) {
  const Asked asked = Of(a, one_);
  const auto needs_probe_after = [&](Outcome outcome, bool silent) {
    Reply(a, name_, "A0");
    order_.NoteOutcome(asked, outcome, silent, kStart);
    return NeedsProbe(a, two_);
  };
  EXPECT_FALSE(needs_probe_after(Outcome::no_reply, false));
  EXPECT_FALSE(needs_probe_after(Outcome::corrupt, true));
  EXPECT_TRUE(needs_probe_after(Outcome::no_reply, true));
  order_.NoteOutcome(Of(a, name_), Outcome::no_reply, true, kStart);
  EXPECT_TRUE(NeedsProbe(a, two_)) << "nor was the probe answered";
}

/// A device may ignore a request for ever, but silence shows this only for the first try of a read
/// that was never answered (`known`).
TEST_F(WhoseReplyTest, OnlySilentFirstTriesOfReadsCountAsUnanswered) {
  struct Case {
    bool retry = false;
    bool writes = false;
    bool known = false;
    const char* follows;
  };
  for (const Case& one :
       {Case{false, false, false, "proven"}, Case{true, false, false, "not proven"},
        Case{false, true, false, "not proven"}, Case{false, false, true, "not proven"}}) {
    SCOPED_TRACE(testing::Message() << one.retry << one.writes << one.known);
    order_.OnReconnect(a);
    Run("open PA0:A0 PA0:A0 PA0:A0 PA0:A0");
    if (one.known) Run("UA1:=1");
    Asked asked = Of(a, one_);
    asked.retry = one.retry;
    asked.writes = one.writes;
    for (int task = 0; task < 3; ++task) order_.NoteOutcome(asked, Outcome::no_reply, true, kStart);
    Run("open PA0:A0 PA0:A0 PA0:A0 PA0:A0");
    Send(Of(a, one_));
    EXPECT_EQ(Run("?A1:A1=5"), one.follows);
  }
}

/// The device is five replies late. To get the reply to a request, the request would have to be
/// sent five times. Instead, a probe precedes each task.
TEST_F(WhoseReplyTest, ADeviceThatLagsByMoreThanFourIsProbedBeforeEachTask) {
  Run("PA0:A0 UA1: UA1: UA1: UA1: UA1: PA0:=1 PA0:=1 PA0:=1 PA0:=1 PA0:=1 PA0:A0");
  EXPECT_FALSE(NeedsProbe(a, one_)) << "names are owed, and these are recognised";
  Run("UA1:A0 UA1:A0 UA1:A0 UA1:A0 UA1:A0 UA1:=1");
  EXPECT_EQ(orders_.Owed(Of(a, one_)), 5);
  EXPECT_TRUE(order_.Lags(a));
  EXPECT_TRUE(NeedsProbe(a, two_));
}

TEST_F(WhoseReplyTest, OnlyAProofShowsThatADeviceLags) {
  Run("PA0:A0 UA1: UA1:=1");
  EXPECT_FALSE(order_.Lags(a)) << "the reply may be the own one";
  Run("UA1: PA0:=1 PA0:=1 PA0:A0");
  EXPECT_TRUE(order_.Lags(a));
  Run("?A1:A1=5");
  EXPECT_FALSE(order_.Lags(a)) << "nothing else is answered so";
}

TEST_F(WhoseReplyTest, AReconnectForgetsTheLag) {
  Run("PA0:A0 UA1: PA0:=1 PA0:A0");
  EXPECT_TRUE(order_.Lags(a));
  EXPECT_TRUE(order_.IsSettled(a)) << "waiting brings nothing";
  order_.OnReconnect(a);
  EXPECT_FALSE(order_.Lags(a));
  EXPECT_FALSE(order_.IsSettled(a)) << "a reply is owed";
  orders_.Reset(a);
  EXPECT_TRUE(order_.IsSettled(a));
}

TEST_F(WhoseReplyTest, RepliesBeforeTheAnswerDependOnTheSender) {
  const protocols::Request nameless = AskFor("UA1\r", false);
  Reply(a, name_, "A0");
  Send(Of(a, one_));
  EXPECT_EQ(order_.RepliesBefore(Of(a, one_), false), 0) << "somebody else, who owes nothing";
  EXPECT_EQ(order_.RepliesBefore(Of(a, one_), true), 1);
  EXPECT_EQ(order_.RepliesBefore(Of(a, nameless), false), 1);
  Send(Of(b, AskFor("UB1\r")));
  Send(Of(a, one_));
  EXPECT_EQ(order_.RepliesBefore(Of(a, one_), false), 2) << "b owes a reply";
}

TEST_F(WhoseReplyTest, ATrustedDeviceIsInStepAfterASilence) {
  Reply(a, name_, "A0");
  Silence(a, one_);
  orders_.Reset(a);
  EXPECT_TRUE(Reply(a, two_, "=2").proven);
}

TEST_F(WhoseReplyTest, NamedNeighboursAreNotInDoubt) {
  const protocols::Request of_b = AskFor("?B1\r");
  Reply(a, name_, "A0");
  Reply(b, Identification("PB0\r"), "B0");
  Silence(a, one_);
  EXPECT_FALSE(NeedsProbe(b, of_b));
}

TEST_F(WhoseReplyTest, NamelessNeighboursAreInDoubt) {
  const protocols::Request of_b = AskFor("UB1\r", false);
  Reply(a, name_, "A0");
  Reply(b, Identification("PB0\r"), "B0");
  Silence(a, one_);
  EXPECT_TRUE(NeedsProbe(b, of_b));
}

TEST_F(WhoseReplyTest, EntriesOfOneNameAreOneDevice) {
  Reply(a, name_, "A0");
  Reply(b, Identification("PA0\r"), "A0");
  orders_.Recognise(a, ToBytes("A"));
  orders_.Recognise(b, ToBytes("A"));
  Silence(a, one_);
  EXPECT_TRUE(NeedsProbe(b, two_));
}

TEST_F(WhoseReplyTest, ARequestAnsweredInAnOddFormIsSentAfterAProof) {
  Run("PA0:A0 UA2:=2 UA1:A9 PA0:A0");
  EXPECT_TRUE(NeedsProbe(a, one_));
  EXPECT_FALSE(NeedsProbe(a, two_));
  orders_.Reset(a);
  Run("UA2:=2 UA1:A9");
  orders_.Reset(a);
  Run("PA0:A0 UA1:=1");
  EXPECT_FALSE(NeedsProbe(a, one_)) << "it fits again";
  Run("PA0:A0 UA1:A9 PA0:A0");
  EXPECT_TRUE(NeedsProbe(a, one_)) << "though only the proof was before it";
  Asked asked = Of(a, one_);
  asked.proved = true;
  EXPECT_FALSE(order_.NeedsProbeFirst(asked, kStart)) << "the probe has been answered";
  order_.OnReconnect(a);
  orders_.Reset(a);
  Reply(a, name_, "A0");
  EXPECT_FALSE(NeedsProbe(a, one_)) << "another device may be there";
}

TEST_F(WhoseReplyTest, RepliesToOtherRequestsAndProbesCreateNoOddForm) {
  Run("PA0:A0 ?A2: UA1:A2=5 PA0:A0");
  EXPECT_FALSE(NeedsProbe(a, one_)) << "that was the reply to ?A2";
  Run("*UA1:A9 PA0:A0");
  orders_.Reset(a);
  EXPECT_FALSE(NeedsProbe(a, one_)) << "a probe tells nothing of the poll";
}

TEST_F(WhoseReplyTest, ADeviceWithoutProofsIsNotProbedForAnOddForm) {
  Run("UA2:A9");
  ProbeWithARead(1);
  EXPECT_FALSE(NeedsProbe(a, two_));
}

TEST_F(WhoseReplyTest, SixteenRequestsOfOddFormsAreRemembered) {
  Reply(a, name_, "A0");
  const auto request = [](int number) { return "UA" + std::to_string(number); };
  for (int i = 1; i <= 17; ++i) Run("PA0:A0 " + request(i) + ":A99");
  Run("PA0:A0");
  EXPECT_FALSE(NeedsProbe(a, one_)) << "the oldest of seventeen";
  EXPECT_TRUE(NeedsProbe(a, two_));
}

TEST_F(WhoseReplyTest, AReplyToAStrangerIsNotLearnedAsTheName) {
  order_.OnOpened(a, kStart);
  Reply(a, name_, "A0=17");
  EXPECT_FALSE(order_.HasName(a)) << "that may be another's";
  Reply(a, name_, "A0");
  Reply(a, name_, "A0");
  Reply(a, name_, "A0");
  EXPECT_TRUE(order_.HasName(a));
  EXPECT_FALSE(Reply(a, name_, "A0").replaced);
}

/// The device sends A0=7 twice, but the first A0=7 can be the reply to ?A0.
TEST_F(WhoseReplyTest, TheReplyToAnEarlierRequestIsNotTakenAsANewName) {
  Run("PA0:A0 UA1:=1 ?A0:A0=7 PA0:A0=7");
  orders_.Reset(a);
  EXPECT_EQ(Run("PA0:A0=7"), "shifted");
}

TEST_F(WhoseReplyTest, BusyAndRefusedRepliesAreNoName) {
  EXPECT_FALSE(order_.HasName(a));
  Reply(a, name_, "A0~busy", Outcome::busy);
  EXPECT_FALSE(order_.HasName(a));
  Reply(a, name_, "A0");
  EXPECT_TRUE(order_.HasName(a));
  Reply(b, Identification("PB0\r"), "B0~refused", Outcome::refused);
  EXPECT_FALSE(order_.HasName(b)) << "it has refused to say";
}

TEST_F(WhoseReplyTest, RefusalsDoNotCountAsRepliesToStrangers) {
  order_.OnOpened(a, kStart);
  for (int i = 0; i < 4; ++i) Reply(a, name_, "A0~refused", Outcome::refused);
  EXPECT_EQ(orders_.Owed(Of(a, one_)), 3);
}

/// The probe is a read of a length that regular polls do not use. A rare poll can have a reply of
/// the same length.
TEST_F(WhoseReplyTest, ProbesUnlikeThePollsLeaveThreeRepliesOutstanding) {
  protocols::Request longer = AskFor("UA9\r");
  longer.unlike_polls = true;
  order_.OnOpened(a, kStart);
  const Asked probe{.member = &a, .request = &longer, .probe = true};
  for (int i = 0; i < 4; ++i) {
    Send(probe);
    order_.OnReply(probe, ToyReply("=1"), Outcome::ok);
    order_.NoteOutcome(probe, Outcome::ok, true, kStart + sent_ * 1s);
  }
  EXPECT_EQ(orders_.Owed(probe), 3);
  EXPECT_FALSE(order_.Lags(a)) << "what other tries are owed is no lag";
  orders_.Reset(a);
  EXPECT_EQ(Run("UA2:=2 ?A1:A9 ?A1:A9"), "elsewhere") << "such a probe restores the order";
}

TEST_F(WhoseReplyTest, ADeviceWithoutAProofIsTrustedFromItsFirstReply) {
  order_.OnOpened(a, kStart);
  ProbeWithARead(1);
  EXPECT_TRUE(Reply(a, one_, "=1").proven);
}

/// A text in place of a number is odd: it can be the reply to an earlier request, unless no reply
/// is outstanding.
TEST_F(WhoseReplyTest, AnOddFormIsAcceptedOnlyAfterAReadInStep) {
  Reply(a, name_, "A0");
  Send(Of(a, one_));
  EXPECT_FALSE(order_.MayBeOdd(Of(a, one_))) << "it was never read";
  Reply(a, name_, "A0");
  Reply(a, one_, "=1");
  Send(Of(a, one_));
  EXPECT_TRUE(order_.MayBeOdd(Of(a, one_)));
  Send(Of(a, one_));
  EXPECT_FALSE(order_.MayBeOdd(Of(a, one_))) << "one reply is owed";
}

TEST_F(WhoseReplyTest, OddOutOfStepAndEarlierReadsDoNotCountAsReadInStep) {
  for (const char* history : {"UA1:A9", "PA0:A0 UA2: UA1:=1 PA0:A0", "PA0:A0 UA1:=1 back"}) {
    SCOPED_TRACE(history);
    order_.OnReconnect(a);
    orders_.Reset(a);
    Run(history);
    orders_.Reset(a);
    Send(Of(a, one_));
    EXPECT_FALSE(order_.MayBeOdd(Of(a, one_)));
  }
}

TEST_F(WhoseReplyTest, AfterAReconnectTheDeviceIsProbedFirst) {
  Reply(a, name_, "A0");
  Reply(a, one_, "=1");
  order_.OnReconnect(a);
  EXPECT_TRUE(NeedsProbe(a, two_));
  Reply(a, name_, "A0");
  EXPECT_FALSE(NeedsProbe(a, two_));
}

}  // namespace
}  // namespace baudgate::bus
