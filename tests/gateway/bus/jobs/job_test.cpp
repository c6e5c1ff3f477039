// What a job says of itself: how urgent it is, and until when it may be sent.
// SPDX-License-Identifier: Apache-2.0
#include "gateway/bus/jobs/job.h"

#include <gtest/gtest.h>

#include "gateway/base/text.h"
#include "gateway/bus/jobs/job_end.h"
#include "tests/gateway/bus/poller/part_fixture.h"
#include "tests/support/times.h"

namespace baudgate::bus {
namespace {

class JobTest : public ::testing::Test, protected ToyMembers {
 protected:
  template <typename Kind>
  Job Make(Kind kind) {
    return Job(a, std::move(kind), protocols::Task{}, kStart);
  }
  static Job::Write WriteUntil(Instant deadline) {
    Job::Write write;
    write.command.kind = Writes{{0, 1.0}};
    write.command.deadline = deadline;
    return write;
  }
  static RoutedRequest Routed(const std::string& pdu, Instant deadline) {
    RoutedRequest request;
    request.pdu = ParseHex(pdu).value();
    request.deadline = deadline;
    return request;
  }
  static Job::Routed RoutedJob(RouteQueue::Batch batch) {
    return {.batch = std::move(batch), .every_slave_answers = true, .reply = {}};
  }
};

TEST_F(JobTest, WritesTheirReadBacksAndShortRoutedWritesAreUrgent) {
  EXPECT_TRUE(IsUrgent(Make(WriteUntil(kStart))));
  EXPECT_TRUE(IsUrgent(Make(Job::ReadBack{})));
  EXPECT_TRUE(IsUrgent(Make(RoutedJob({Routed("06 00 08 00 00", kStart)}))));
  EXPECT_FALSE(IsUrgent(Make(RoutedJob({Routed("03 00 00 00 01", kStart)}))));
  EXPECT_FALSE(IsUrgent(Make(RoutedJob({}))));
  EXPECT_FALSE(IsUrgent(Make(Job::Poll{})));
  EXPECT_FALSE(IsUrgent(Make(Job::Probe{})));
}

TEST_F(JobTest, APollKeepsItsPointsWhenItsDeviceIsPlannedAgain) {
  Job poll(a, Job::Poll{}, protocols::Task{.query = 1}, kStart);
  FollowPlan(poll);
  EXPECT_EQ(poll.task.query, 1U) << "nothing has changed";
  a.conversation->OnFrame(protocols::Task{.query = 0}, AskFor("?A1\r"), ToyReply("A1~replan"),
                          kStart);
  ASSERT_EQ(a.conversation->Queries().size(), 1U);
  FollowPlan(poll);
  EXPECT_EQ(poll.task.query, 0U) << "another number";
  a.conversation->OnFrame(protocols::Task{.query = 0}, AskFor("?A2\r"), ToyReply("A2~replan"),
                          kStart);
  FollowPlan(poll);
  EXPECT_FALSE(IsPlanned(poll.task, *a.conversation)) << "it is gone";
  a.conversation->ForgetRefusals();
  FollowPlan(poll);
  EXPECT_EQ(poll.task.query, 1U);
}

TEST_F(JobTest, APollMayBeSentAtAnyTime) {
  const Job job = Make(Job::Poll{});
  EXPECT_FALSE(LatestStart(job));
  EXPECT_FALSE(WhyNotSend(job, kStart + 1h));
}

TEST_F(JobTest, AWriteIsNotSentFromItsDeadlineOn) {
  const Job job = Make(WriteUntil(kStart));
  EXPECT_FALSE(WhyNotSend(job, kStart - 1ns));
  EXPECT_TRUE(WhyNotSend(job, kStart));
}

TEST_F(JobTest, OneExchangeServesWhoWaitsLongestForIt) {
  const Job job = Make(
      RoutedJob({Routed("03 00 00 00 01", kStart + 1s), Routed("03 00 00 00 01", kStart + 3s)}));
  EXPECT_EQ(LatestStart(job), kStart + 3s);
}

TEST_F(JobTest, WhatNobodyWaitsForIsNotSent) {
  EXPECT_TRUE(WhyNotSend(Make(RoutedJob({})), kStart));
}

TEST_F(JobTest, WhatEndsWhatWasBegunIsSentInAnyCase) {
  Job job = Make(WriteUntil(kStart));
  job.step.request.closes = true;
  EXPECT_FALSE(WhyNotSend(job, kStart + 1h));
}

TEST_F(JobTest, ADisabledDeviceIsAskedByRoutesOnly) {
  a.in_use = false;
  EXPECT_EQ(WhyNotSend(Make(Job::Poll{}), kStart)->why, "the device is disabled");
  EXPECT_FALSE(WhyNotSend(Make(RoutedJob({Routed("03 00 00 00 01", kStart + 1s)})), kStart));
}

TEST_F(JobTest, AWriteWhoseClientHasLeftIsNotBegunButEnded) {
  Job::Write write = WriteUntil(kStart + 1s);
  write.command.abandoned = std::make_shared<std::atomic<bool>>(true);
  Job job = Make(std::move(write));
  job.requests = 1;
  EXPECT_EQ(WhyNotSend(job, kStart)->why, "its client has left");
  job.As<Job::Write>()->command.state = WriteState::sent;
  EXPECT_FALSE(WhyNotSend(job, kStart)) << "it has been sent";
}

TEST_F(JobTest, TheGoalOfAProbeIsWhatWaitsBehindIt) {
  Job probe = Make(Job::Probe{});
  EXPECT_EQ(&probe.goal(), &probe);
  probe.task.kind = protocols::Task::Kind::probe;
  EXPECT_TRUE(probe.asked().lone_probe);
  probe.postponed = std::make_unique<Job>(Make(WriteUntil(kStart)));
  EXPECT_NE(probe.goal().As<Job::Write>(), nullptr);
  EXPECT_TRUE(probe.asked().probe);
  EXPECT_FALSE(probe.asked().lone_probe);
}

// ---------------- What the end of a job leads to: one table for each kind of job.

using Next = EndEffects::Write::Next;

/// Device a has a point of the fast group and one of the slow group.
class JobEndTest : public ::testing::Test, protected ToyMembers {
 protected:
  template <typename Kind>
  Job Make(Kind kind, protocols::Task::Kind task = protocols::Task::Kind::poll) {
    Job job(a, std::move(kind), protocols::Task{.kind = task}, kStart);
    job.wire = 40ms;
    return job;
  }
  EndEffects End(Job job, Outcome outcome) { return EffectsOf(job, {outcome}, kStart); }
};

TEST_F(JobEndTest, OfAPoll) {
  struct Row {
    const char* what;
    config::Group group;
    Outcome outcome;
    bool fast;
    bool repeats;
  };
  const Row kRows[] = {
      {"answered", config::Group::fast, Outcome::ok, true, false},
      {"silent", config::Group::fast, Outcome::no_reply, true, false},
      {"of a slow group", config::Group::slow, Outcome::no_reply, false, false},
      {"read once", config::Group::once, Outcome::ok, false, false},
      {"read once, silent", config::Group::once, Outcome::no_reply, false, true},
      {"read once, busy", config::Group::once, Outcome::busy, false, true},
      {"read once, refused", config::Group::once, Outcome::refused, false, false},
      {"read daily, silent", config::Group::daily, Outcome::no_reply, false, true},
  };
  for (const Row& row : kRows) {
    SCOPED_TRACE(row.what);
    const EndEffects effects = End(Make(Job::Poll{row.group, true}), row.outcome);
    EXPECT_EQ(effects.fast_poll.has_value(), row.fast);
    EXPECT_EQ(effects.repeat.has_value(), row.repeats);
    ASSERT_TRUE(effects.poll);
    EXPECT_EQ(effects.poll->answered, ProvesLife(row.outcome));
    EXPECT_TRUE(effects.judges_member);
    EXPECT_FALSE(effects.polls_first);
    EXPECT_TRUE(effects.doubt.empty());
  }
}

TEST_F(JobEndTest, AMuteJobSaysNothingOfItsMemberOrItsQuery) {
  Job job = Make(Job::Poll{});
  job.judges_member = false;
  const EndEffects effects = EffectsOf(job, {Outcome::no_reply}, kStart);
  EXPECT_FALSE(effects.judges_member);
  EXPECT_FALSE(effects.poll);
  EXPECT_TRUE(effects.fast_poll) << "its round goes on";
}

TEST_F(JobEndTest, OfAReadBack) {
  EXPECT_TRUE(End(Make(Job::ReadBack{}), Outcome::ok).doubt.empty());
  EXPECT_EQ(End(Make(Job::ReadBack{}), Outcome::no_reply).doubt, std::vector<std::size_t>{0});
  EXPECT_FALSE(End(Make(Job::ReadBack{}), Outcome::no_reply).polls_first);
}

/// Others may have taken its number: which points it has read is not known.
TEST_F(JobEndTest, OfAReadWhoseQueryIsGone) {
  Job back = Make(Job::ReadBack{});
  back.unplanned = true;
  EXPECT_EQ(End(std::move(back), Outcome::ok).read_again, std::vector<std::size_t>{0});
  EXPECT_TRUE(End(Make(Job::ReadBack{}), Outcome::ok).read_again.empty());
  Job once = Make(Job::Poll{config::Group::once, true});
  once.unplanned = true;
  EXPECT_EQ(End(std::move(once), Outcome::ok).repeat->group, config::Group::once);
}

TEST_F(JobEndTest, OfABackgroundTask) {
  const auto end = [this](Outcome outcome) {
    return End(Make(Job::Background{}, protocols::Task::Kind::background), outcome).background;
  };
  EXPECT_EQ(end(Outcome::ok)->took, 40ms);
  EXPECT_EQ(end(Outcome::no_reply)->took, 0ms) << "lost";
  EXPECT_FALSE(end(Outcome::unsupported)->sent) << "it cannot be asked";
  EXPECT_FALSE(End(Make(Job::Events{}, protocols::Task::Kind::events), Outcome::ok).background);
}

TEST_F(JobEndTest, OfAWrite) {
  struct Row {
    const char* what;
    std::size_t points;  // of the command
    std::size_t next;    // one was under way before this
    bool sent;           // a request that may have written
    Outcome outcome;
    Next follows;
    WriteEnd end;         // if it is answered
    std::size_t unknown;  // points
    bool polls_first;
    bool unfit = false;
  };
  const Row kRows[] = {
      {"no form", 1, 1, false, Outcome::unsupported, Next::answer, WriteEnd::refused, 0, false,
       true},
      {"no form for the second", 2, 2, false, Outcome::unsupported, Next::answer, WriteEnd::refused,
       0, false},
      {"another meter answers", 1, 1, false, Outcome::refused, Next::answer, WriteEnd::refused, 0,
       false},
      {"the last point", 2, 2, true, Outcome::ok, Next::confirm, WriteEnd::ok, 1, false},
      {"points remain", 3, 2, true, Outcome::ok, Next::go_on, WriteEnd::ok, 1, false},
      {"refused", 2, 2, true, Outcome::refused, Next::answer, WriteEnd::refused, 1, false},
      {"silent", 2, 2, true, Outcome::no_reply, Next::answer, WriteEnd::unknown, 1, true},
      {"not sent", 2, 2, false, Outcome::no_reply, Next::answer, WriteEnd::not_sent, 0, true},
  };
  for (const Row& row : kRows) {
    SCOPED_TRACE(row.what);
    Job::Write write;
    auto& writes = std::get<Writes>(write.command.kind);
    for (std::uint32_t i = 0; i < row.points; ++i) writes.push_back({i % 2, 1.0});
    write.command.deadline = kStart + 1s;
    write.first = row.next - 1;
    write.next = row.next;
    write.command.state = row.sent ? WriteState::sent : WriteState::queued;
    const EndEffects effects =
        End(Make(std::move(write), protocols::Task::Kind::write), row.outcome);
    ASSERT_TRUE(effects.write);
    EXPECT_EQ(effects.write->next, row.follows);
    if (row.follows == Next::answer) {
      EXPECT_EQ(effects.write->result.end, row.end);
      EXPECT_EQ(effects.write->result.unfit, row.unfit);
    }
    EXPECT_EQ(effects.write->unknown.size(), row.unknown);
    EXPECT_EQ(effects.polls_first, row.polls_first);
  }
}

/// The first step may have written.
TEST_F(JobEndTest, OfAWriteWhoseNextStepCannotBeAsked) {
  const std::pair<std::optional<JobEnd>, WriteEnd> kRows[] = {
      {std::nullopt, WriteEnd::unknown},
      {JobEnd{Outcome::ok}, WriteEnd::unknown},
      {JobEnd{Outcome::refused, "no"}, WriteEnd::refused},
  };
  for (const auto& [told, expected] : kRows) {
    Job::Write write;
    write.command.kind = Writes{{0, 1.0}};
    write.command.deadline = kStart + 1s;
    write.next = 1;
    write.told = told;
    write.command.state = WriteState::sent;
    Job job = Make(std::move(write), protocols::Task::Kind::write);
    job.unasked = true;
    const EndEffects effects = End(std::move(job), Outcome::unsupported);
    ASSERT_TRUE(effects.write);
    EXPECT_EQ(effects.write->next, Next::answer);
    EXPECT_EQ(effects.write->result.end, expected);
    EXPECT_FALSE(effects.write->result.unfit);
  }
}

TEST_F(JobEndTest, OfARoutedRequest) {
  const auto end = [this](const std::string& pdu, Outcome outcome) {
    RoutedRequest request;
    request.pdu = ParseHex(pdu).value();
    request.arrived = kStart - 30ms;
    RoutedRequest same = request;
    Job job = Make(Job::Routed{.batch = {},
                               .every_slave_answers = true,
                               .reply = Bytes{3, 2},
                               .is_read = !IsWrite(request)});
    job.As<Job::Routed>()->batch.push_back(std::move(request));
    job.As<Job::Routed>()->batch.push_back(std::move(same));
    job.attempt.sent_at = kStart;
    job.was_sent = true;
    return End(std::move(job), outcome);
  };
  const EndEffects read = end("03 00 00 00 01", Outcome::ok);
  ASSERT_EQ(read.replies.size(), 2U);
  EXPECT_EQ(read.replies[0].second.pdu, (Bytes{3, 2}));
  EXPECT_EQ(read.replies[0].second.waited, 30ms);
  EXPECT_FALSE(read.replies[0].second.shared);
  EXPECT_TRUE(read.replies[1].second.shared);
  const EndEffects silent = end("03 00 00 00 01", Outcome::no_reply);
  EXPECT_TRUE(silent.replies[0].second.pdu.empty());
  EXPECT_EQ(silent.replies[0].second.reason, "no_reply");
  EXPECT_FALSE(silent.polls_first) << "a read";
  EXPECT_TRUE(end("06 00 08 00 00", Outcome::no_reply).polls_first);
  RoutedRequest unsent;
  unsent.pdu = ParseHex("06 00 08 00 00").value();
  Job behind_probe = Make(Job::Routed{.batch = {}, .reply = {}, .is_read = false});
  behind_probe.As<Job::Routed>()->batch.push_back(std::move(unsent));
  const EndEffects refused = End(std::move(behind_probe), Outcome::refused);
  EXPECT_EQ(refused.replies[0].second.outcome, Outcome::no_reply) << "the probe was refused";
  EXPECT_FALSE(refused.replies[0].second.sent);
  const EndEffects left =
      End(Make(Job::Routed{.batch = {}, .reply = {}, .is_read = true}), Outcome::no_reply);
  EXPECT_FALSE(left.polls_first) << "a read whose clients have left is a read";
}

}  // namespace
}  // namespace baudgate::bus
