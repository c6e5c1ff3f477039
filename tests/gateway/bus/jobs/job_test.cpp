// Tests of `Job`: how urgent a job is, until when it may be sent, and what its end leads to.
// SPDX-License-Identifier: Apache-2.0
#include "gateway/bus/jobs/job.h"

#include <gtest/gtest.h>

#include "gateway/base/text.h"
#include "gateway/bus/jobs/background.h"
#include "gateway/bus/jobs/line_context.h"
#include "gateway/bus/jobs/poll.h"
#include "gateway/bus/jobs/probe.h"
#include "gateway/bus/jobs/read_back.h"
#include "gateway/bus/jobs/routed.h"
#include "gateway/bus/jobs/write.h"
#include "tests/gateway/bus/poller/part_fixture.h"
#include "tests/support/times.h"

namespace baudgate::bus {
namespace {

class JobTest : public ::testing::Test, protected ToyMembers {
 protected:
  std::unique_ptr<PollJob> Poll(config::Group group = config::Group::fast) {
    return std::make_unique<PollJob>(
        a, Schedule::Pick{.query = 0, .group = group, .last_of_round = true}, kStart);
  }
  static WriteCommand Until(Instant deadline) {
    WriteCommand command;
    command.kind = Writes{{0, 1.0}};
    command.deadline = deadline;
    return command;
  }
  std::unique_ptr<WriteJob> Write(WriteCommand command) {
    return std::make_unique<WriteJob>(a, std::move(command), kStart);
  }
  static RoutedRequest Request(const std::string& pdu, Instant deadline) {
    RoutedRequest request;
    request.pdu = ParseHex(pdu).value();
    request.deadline = deadline;
    return request;
  }
  std::unique_ptr<RoutedJob> Routed(RouteQueue::Batch batch, bool is_read = true) {
    return std::make_unique<RoutedJob>(a, std::move(batch), true, is_read, protocols::Request{},
                                       kStart);
  }
};

TEST_F(JobTest, WritesTheirReadBacksAndShortRoutedWritesAreUrgent) {
  EXPECT_TRUE(Write(Until(kStart))->is_urgent());
  EXPECT_TRUE(ReadBackJob(a, 0, kStart).is_urgent());
  EXPECT_TRUE(Routed({Request("06 00 08 00 00", kStart)})->is_urgent());
  EXPECT_FALSE(Routed({Request("03 00 00 00 01", kStart)})->is_urgent());
  EXPECT_FALSE(Routed({})->is_urgent());
  EXPECT_FALSE(Poll()->is_urgent());
  EXPECT_FALSE(ProbeJob(a, kStart).is_urgent());
}

TEST_F(JobTest, APollFollowsItsPointsWhenTheQueriesAreReplanned) {
  PollJob poll(a, {.query = 1}, kStart);
  poll.FollowPlan();
  EXPECT_EQ(poll.task.query, 1U) << "nothing has changed";
  a.conversation->OnFrame(protocols::Task{.query = 0}, AskFor("?A1\r"), ToyReply("A1~replan"),
                          kStart);
  ASSERT_EQ(a.conversation->Queries().size(), 1U);
  poll.FollowPlan();
  EXPECT_EQ(poll.task.query, 0U) << "another number";
  a.conversation->OnFrame(protocols::Task{.query = 0}, AskFor("?A2\r"), ToyReply("A2~replan"),
                          kStart);
  poll.FollowPlan();
  EXPECT_GE(poll.task.query, a.conversation->Queries().size()) << "it is gone";
  a.conversation->ForgetRefusals();
  poll.FollowPlan();
  EXPECT_EQ(poll.task.query, 1U);
}

TEST_F(JobTest, APollMayBeSentAtAnyTime) {
  EXPECT_FALSE(Poll()->LatestStart());
  EXPECT_FALSE(Poll()->WhyNotSend(kStart + 1h));
}

TEST_F(JobTest, AWriteIsNotSentFromItsDeadlineOn) {
  const auto write = Write(Until(kStart));
  EXPECT_FALSE(write->WhyNotSend(kStart - 1ns));
  EXPECT_TRUE(write->WhyNotSend(kStart));
}

TEST_F(JobTest, ASharedRequestMayStartUntilItsLatestDeadline) {
  const auto job =
      Routed({Request("03 00 00 00 01", kStart + 1s), Request("03 00 00 00 01", kStart + 3s)});
  EXPECT_EQ(job->LatestStart(), kStart + 3s);
}

TEST_F(JobTest, ARoutedRequestWithoutWaitingClientsIsNotSent) {
  EXPECT_TRUE(Routed({})->WhyNotSend(kStart));
}

TEST_F(JobTest, AClosingRequestIsSentWhateverForbidsTheWrite) {
  WriteCommand command = Until(kStart);
  command.abandoned = std::make_shared<std::atomic<bool>>(true);
  command.why_not = [](Instant) {
    return std::optional(Withheld{WriteEnd::denied, "an interlock"});
  };
  const auto write = Write(std::move(command));
  EXPECT_TRUE(write->WhyNotSend(kStart - 1ns));
  write->step.request.closes = true;
  EXPECT_FALSE(write->WhyNotSend(kStart - 1ns));
  EXPECT_FALSE(write->WhyNotSend(kStart + 1h)) << "after its deadline";
}

TEST_F(JobTest, ADisabledDeviceAcceptsRoutedRequestsButNoPolls) {
  a.in_use = false;
  EXPECT_EQ(Poll()->WhyNotSend(kStart)->why,
            "the device is disabled; 'baudgate enable' takes it into use");
  EXPECT_FALSE(Routed({Request("03 00 00 00 01", kStart + 1s)})->WhyNotSend(kStart));
}

TEST_F(JobTest, AnAbandonedWriteIsSentOnlyIfItHasBegun) {
  WriteCommand command = Until(kStart + 1s);
  command.abandoned = std::make_shared<std::atomic<bool>>(true);
  EXPECT_EQ(Write(command)->WhyNotSend(kStart)->why, "the client has disconnected");
  command.state = WriteState::sent;
  EXPECT_FALSE(Write(command)->WhyNotSend(kStart)) << "it has been sent";
}

TEST_F(JobTest, TheGoalOfAProbeIsTheJobThatWaitsForIt) {
  ProbeJob probe(a, kStart);
  EXPECT_EQ(&probe.goal(), &probe);
  EXPECT_TRUE(probe.asked().lone_probe);
  ProbeJob before(a, kStart, Write(Until(kStart)));
  EXPECT_TRUE(before.goal().writes());
  EXPECT_TRUE(before.asked().probe);
  EXPECT_FALSE(before.asked().lone_probe);
}

using Next = EndEffects::Write::Next;

class JobEndTest : public JobTest {
 protected:
  static EndEffects End(Job& job, Outcome outcome) {
    job.wire = 40ms;
    return job.EffectsOf({outcome}, kStart);
  }
  EndEffects EndOfPoll(config::Group group, Outcome outcome) { return End(*Poll(group), outcome); }
  EndEffects EndOfReadBack(Outcome outcome, bool unplanned = false) {
    ReadBackJob back(a, 0, kStart);
    back.unplanned = unplanned;
    return End(back, outcome);
  }
};

TEST_F(JobEndTest, TheEndOfAPollDependsOnItsGroupAndOutcome) {
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
    const EndEffects effects = EndOfPoll(row.group, row.outcome);
    EXPECT_EQ(effects.fast_poll.has_value(), row.fast);
    EXPECT_EQ(effects.repeat.has_value(), row.repeats);
    ASSERT_TRUE(effects.poll);
    EXPECT_EQ(effects.poll->answered, ProvesLife(row.outcome));
    EXPECT_TRUE(effects.judges_member);
    EXPECT_FALSE(effects.polls_first);
    EXPECT_TRUE(effects.doubt.empty());
  }
}

TEST_F(JobEndTest, AMuteJobJudgesNeitherItsMemberNorItsQuery) {
  const auto job = Poll();
  job->judges_member = false;
  const EndEffects effects = End(*job, Outcome::no_reply);
  EXPECT_FALSE(effects.judges_member);
  EXPECT_FALSE(effects.poll);
  EXPECT_TRUE(effects.fast_poll) << "its round goes on";
}

TEST_F(JobEndTest, AReplyOfUnexpectedFormDoesNotCountAgainstTheDevice) {
  const auto job = Poll();
  job->attempt.verdict.odd = true;
  EXPECT_FALSE(End(*job, Outcome::unexpected).judges_member);
}

TEST_F(JobEndTest, AFailedReadBackMakesItsPointsDoubtful) {
  EXPECT_TRUE(EndOfReadBack(Outcome::ok).doubt.empty());
  EXPECT_EQ(EndOfReadBack(Outcome::no_reply).doubt, std::vector<std::size_t>{0});
  EXPECT_FALSE(EndOfReadBack(Outcome::no_reply).polls_first);
}

/// Another query can have the number of the removed query, so it is unknown which points were read.
TEST_F(JobEndTest, AReadWhoseQueryIsGoneIsRepeated) {
  EXPECT_EQ(EndOfReadBack(Outcome::ok, true).read_again, std::vector<std::size_t>{0});
  EXPECT_TRUE(EndOfReadBack(Outcome::ok).read_again.empty());
  const auto once = Poll(config::Group::once);
  once->unplanned = true;
  EXPECT_EQ(End(*once, Outcome::ok).repeat->group, config::Group::once);
}

TEST_F(JobEndTest, ABackgroundTaskReportsItsDurationAndWhetherItWasSent) {
  const auto end = [this](Outcome outcome) {
    BackgroundJob job(a, kStart);
    return End(job, outcome).background;
  };
  EXPECT_EQ(end(Outcome::ok)->took, 40ms);
  EXPECT_EQ(end(Outcome::no_reply)->took, 0ms) << "lost";
  EXPECT_FALSE(end(Outcome::unsupported)->sent) << "it cannot be asked";
  EventsJob events(a, kStart);
  EXPECT_FALSE(End(events, Outcome::ok).background);
}

TEST_F(JobEndTest, TheEndOfAWriteDependsOnItsProgressAndOutcome) {
  struct Row {
    const char* what;
    std::size_t points;
    std::size_t next;  // the point that is being written, counted from 1
    bool sent;         // a request that may have changed the device has been sent
    Outcome outcome;
    Next follows;
    WriteEnd end;
    std::size_t unknown;
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
    WriteCommand command;
    auto& writes = command.kind.emplace<Writes>();
    for (std::uint32_t i = 0; i < row.points; ++i) writes.push_back({i % 2, 1.0});
    command.deadline = kStart + 1s;
    command.state = row.sent ? WriteState::sent : WriteState::queued;
    WriteJob job(a, std::move(command), kStart, row.next - 1);
    const EndEffects effects = End(job, row.outcome);
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

struct Told : WriteJob {
  using WriteJob::NoteTold;
  using WriteJob::WriteJob;
};

TEST_F(JobEndTest, AWriteWithoutANextRequestEndsUnknownUnlessRefused) {
  const std::pair<std::optional<JobEnd>, WriteEnd> kRows[] = {
      {std::nullopt, WriteEnd::unknown},
      {JobEnd{Outcome::ok}, WriteEnd::unknown},
      {JobEnd{Outcome::refused, "no"}, WriteEnd::refused},
  };
  for (const auto& [told, expected] : kRows) {
    WriteCommand command = Until(kStart + 1s);
    command.state = WriteState::sent;
    Told job(a, std::move(command), kStart);
    if (told) job.NoteTold(*told, false);
    job.has_no_request = true;
    const EndEffects effects = End(job, Outcome::unsupported);
    ASSERT_TRUE(effects.write);
    EXPECT_EQ(effects.write->next, Next::answer);
    EXPECT_EQ(effects.write->result.end, expected);
    EXPECT_FALSE(effects.write->result.unfit);
    const bool may_be_open =
        effects.write->result.reason.find("still be open") != std::string::npos;
    EXPECT_EQ(may_be_open, expected == WriteEnd::refused);
  }
}

/// The device has answered the requests that prepare the write, so its refusal is none of the
/// value.
TEST_F(JobEndTest, AWriteWhoseOnlyRequestsPrepareItWasNotSent) {
  const auto write = Write(Until(kStart + 1s));
  write->was_sent = true;
  write->has_no_request = true;
  EXPECT_EQ(End(*write, Outcome::unsupported).write->result.end, WriteEnd::not_sent);
}

TEST_F(JobEndTest, ARoutedRequestAnswersEachOfItsClients) {
  const auto end = [this](const std::string& pdu, Outcome outcome) {
    RoutedRequest request = Request(pdu, {});
    request.arrived = kStart - 30ms;
    const bool is_read = !IsWrite(request);
    const auto job = Routed({request, request}, is_read);
    job->attempt.sent_at = kStart;
    job->was_sent = true;
    return End(*job, outcome);
  };
  const EndEffects read = end("03 00 00 00 01", Outcome::ok);
  ASSERT_EQ(read.replies.size(), 2U);
  EXPECT_EQ(read.replies[0].second.waited, 30ms);
  EXPECT_FALSE(read.replies[0].second.shared);
  EXPECT_TRUE(read.replies[1].second.shared);
  const EndEffects silent = end("03 00 00 00 01", Outcome::no_reply);
  EXPECT_TRUE(silent.replies[0].second.pdu.empty());
  EXPECT_EQ(silent.replies[0].second.reason, "no reply");
  EXPECT_FALSE(silent.polls_first) << "a read";
  EXPECT_TRUE(end("06 00 08 00 00", Outcome::no_reply).polls_first);
  const auto behind_probe = Routed({Request("06 00 08 00 00", {})}, false);
  const EndEffects refused = End(*behind_probe, Outcome::refused);
  EXPECT_EQ(refused.replies[0].second.outcome, Outcome::no_reply) << "the probe was refused";
  EXPECT_FALSE(refused.replies[0].second.sent);
  EXPECT_FALSE(End(*Routed({}), Outcome::no_reply).polls_first)
      << "a read whose clients have left is a read";
}

}  // namespace
}  // namespace baudgate::bus
