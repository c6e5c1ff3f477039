// What comes back for a request, on its way through the echo, the examination and the judgement.
// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <string_view>
#include <vector>

#include "gateway/bus/poller/poller.h"
#include "gateway/bus/replies/whose_reply.h"
#include "gateway/diagnosis/observer.h"
#include "tests/gateway/bus/poller/part_fixture.h"
#include "tests/support/times.h"

namespace baudgate {
namespace {

class ReceptionTest : public ::testing::Test, protected ToyMembers {
 protected:
  Job Ask(std::string_view bytes, bool mirrors = false) {
    Job job(a, Job::Poll{}, Task{}, kStart);
    job.step.request = AskFor(bytes);
    job.step.request.expect.mirrors = mirrors;
    return job;
  }
  Reception::Seen End(Reception& reception, const Job& job, Outcome outcome) {
    ExchangeEnd end;
    end.outcome = outcome;
    Reception::Seen seen = reception.Assess(job, end);
    reason_ = end.reason;
    return seen;
  }

  OwedReplies owed_{roster};
  std::string reason_;
};

TEST_F(ReceptionTest, AReplyThatEqualsItsRequestIsRefusedOnceTheBusWasSeenToEcho) {
  for (const bool echoes : {false, true}) {
    Observer observer(roster);
    Reception reception(config::Echo::off, observer, owed_.whose);
    Job read = Ask("?A1\r");
    reception.OnSend(read, kStart);
    if (echoes) reception.TakeOutEcho(read.step.request.bytes, &read, kStart);
    End(reception, read, Outcome::no_reply);
    Job write = Ask("!A1=7\r", true);
    reception.OnSend(write, kStart + 1s);
    const Bytes frame = write.step.request.bytes;
    EXPECT_EQ(reception.TakeOutEcho(frame, &write, kStart + 1s).bytes, frame)
        << "it may be the reply";
    reception.Judge(write, frame, kStart + 1s);
    EXPECT_EQ(write.attempt.answer.reason.find("echoes requests") != std::string::npos, echoes);
  }
}

/// Another device may answer the probe of one that is away; only its name tells.
TEST_F(ReceptionTest, AProbeThatAsksForNoNameGivesNoReadingsOfADeviceThatHasOne) {
  Observer observer(roster);
  Reception reception(config::Echo::off, observer, owed_.whose);
  const auto readings = [&](std::string_view bytes, std::string_view reply) {
    Job probe(a, Job::Probe{}, Task{.kind = Task::Kind::probe}, kStart);
    probe.step.request = AskFor(bytes);
    probe.step.request.steady = bytes[0] == 'P';
    owed_.whose.OnSent(probe.asked(), kStart);
    reception.OnSend(probe, kStart);
    const Bytes frame = ToyReply(reply);
    reception.TakeOutEcho(frame, &probe, kStart);
    EXPECT_EQ(reception.Judge(probe, frame, kStart), Outcome::ok);
    return probe.attempt.answer.readings.size();
  };
  EXPECT_EQ(readings("?A1\r", "A1=5"), 1U) << "it has no name yet";
  EXPECT_EQ(readings("PA0\r", "A0"), 0U);
  EXPECT_EQ(readings("?A1\r", "A1=5"), 0U);
}

TEST_F(ReceptionTest, TheEndSaysThatTheEchoIsMissing) {
  Observer observer(roster);
  Reception reception(config::Echo::verify, observer, owed_.whose);
  Job job = Ask("?A1\r");
  reception.OnSend(job, kStart);
  EXPECT_TRUE(reception.TakeOutEcho(job.step.request.bytes, &job, kStart).bytes.empty());
  EXPECT_FALSE(End(reception, job, Outcome::no_reply).no_echo);
  for (const bool cut : {false, false, true}) {
    reception.OnSend(job, kStart + 1s);
    const Reception::Seen seen = End(reception, job, Outcome::no_reply);
    EXPECT_TRUE(seen.no_echo);
    EXPECT_EQ(seen.cut, cut);
    EXPECT_NE(reason_.find("echo"), std::string::npos);
  }
}

TEST_F(ReceptionTest, WhatComesBehindTheEndIsToldBeforeTheNextRequest) {
  Observer observer(roster);
  Reception reception(config::Echo::off, observer, owed_.whose);
  Job job = Ask("?A1\r");
  reception.OnSend(job, kStart);
  EXPECT_EQ(End(reception, job, Outcome::no_reply).finding.symptom, Symptom::silence);
  EXPECT_TRUE(reception.TakeChanged().empty());
  reception.TakeOutEcho(ToyReply("A1=5"), nullptr, kStart + 500ms);
  const std::vector<EarlierFinding> changed = reception.TakeChanged();
  ASSERT_EQ(changed.size(), 1U);
  EXPECT_EQ(changed[0].member, &a);
  EXPECT_EQ(changed[0].finding.symptom, Symptom::late);
  EXPECT_TRUE(reception.TakeChanged().empty()) << "told once";
}

TEST_F(ReceptionTest, ASecondReplyBehindARepeatWasLateWhereverItIsFound) {
  for (const bool repeated : {true, false}) {
    Observer observer(roster);
    Reception reception(config::Echo::off, observer, owed_.whose);
    Job job = Ask("?A1\r");
    const auto answer = [&](Job& to, std::string_view body, Instant now) {
      const Bytes frame = ToyReply(body);
      reception.TakeOutEcho(frame, &to, now);
      reception.Judge(to, frame, now);
      to.attempt.unproven.reset();
      return End(reception, to, Outcome::ok).finding.symptom;
    };
    if (repeated) {
      reception.OnSend(job, kStart);
      End(reception, job, Outcome::no_reply);
    }
    reception.OnSend(job, kStart + 1s);
    EXPECT_EQ(answer(job, "A1=5", kStart + 1100ms), Symptom::clean);
    Job next = Ask("?A2\r");
    reception.OnSend(next, kStart + 2s);
    reception.TakeOutEcho(ToyReply("A1=6"), &next, kStart + 2050ms);
    EXPECT_EQ(answer(next, "A2=5", kStart + 2100ms),
              repeated ? Symptom::clean : Symptom::others_beside);
    const std::vector<EarlierFinding> changed = reception.TakeChanged();
    ASSERT_EQ(changed.size(), repeated ? 1U : 0U);
    if (!repeated) continue;
    EXPECT_EQ(changed[0].finding.symptom, Symptom::late);
    EXPECT_EQ(changed[0].back, 2U);
  }
}

}  // namespace
}  // namespace baudgate
