// What a job says of itself: how urgent it is, and until when it may be sent.
// SPDX-License-Identifier: Apache-2.0
#include "gateway/bus/jobs/job.h"

#include <gtest/gtest.h>

#include "gateway/base/text.h"
#include "tests/gateway/bus/poller/part_fixture.h"
#include "tests/support/times.h"

namespace baudgate {
namespace {

class JobTest : public ::testing::Test, protected ToyMembers {
 protected:
  template <typename Kind>
  Job Make(Kind kind) {
    return Job(a, std::move(kind), Task{}, kStart);
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
  Job poll(a, Job::Poll{}, Task{.query = 1}, kStart);
  FollowPlan(poll);
  EXPECT_EQ(poll.task.query, 1U) << "nothing has changed";
  a.conversation->OnFrame(Task{.query = 0}, AskFor("?A1\r"), ToyReply("A1~replan"), kStart);
  ASSERT_EQ(a.conversation->Queries().size(), 1U);
  FollowPlan(poll);
  EXPECT_EQ(poll.task.query, 0U) << "another number";
  a.conversation->OnFrame(Task{.query = 0}, AskFor("?A2\r"), ToyReply("A2~replan"), kStart);
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
  probe.task.kind = Task::Kind::probe;
  EXPECT_TRUE(probe.asked().lone_probe);
  probe.postponed = std::make_unique<Job>(Make(WriteUntil(kStart)));
  EXPECT_NE(probe.goal().As<Job::Write>(), nullptr);
  EXPECT_TRUE(probe.asked().probe);
  EXPECT_FALSE(probe.asked().lone_probe);
}

}  // namespace
}  // namespace baudgate
