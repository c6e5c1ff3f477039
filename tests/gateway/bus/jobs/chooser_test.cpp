// Tests of `Chooser` and `RoutedJobs`, which choose the next job of a line.
// SPDX-License-Identifier: Apache-2.0
#include "gateway/bus/jobs/chooser.h"

#include <gtest/gtest.h>

#include <utility>

#include "gateway/base/text.h"
#include "gateway/bus/jobs/line_context.h"
#include "gateway/bus/jobs/poll.h"
#include "protocols/modbus/protocol.h"
#include "tests/gateway/bus/poller/part_fixture.h"
#include "tests/gateway/bus/poller/routed_line.h"
#include "tests/support/times.h"

namespace baudgate::bus {
namespace {

class ChooserTest : public ::testing::Test, protected PollerListener {
 protected:
  ChooserTest() {
    for (const auto& device : line_.roster.devices()) {
      schedule_.SetQueries(device->place, {config::Group::fast});
    }
  }
  void OnDeviceState(std::uint32_t, DeviceState, DeviceState, const std::string&, Now) override {}
  void OnWarning(std::uint32_t, const std::string&) override {}
  std::unique_ptr<Job> NextAt(Duration at) { return chooser_.Next({kStart + at, kStart + at}); }
  static WriteCommand To(std::uint32_t device) {
    WriteCommand command;
    command.device = device;
    command.kind = Writes{{0, 1.0}};
    command.deadline = kStart + 1h;
    return command;
  }

  config::Config config_ = ToyConfig();
  PointStore store_{config_};
  LineContext line_{config_.lines[0], 0,
                    [](const std::string&) -> const protocols::Protocol& { return ToyProtocol(); },
                    store_, *this};
  Device& a = line_.roster.device(0);
  Device& b = line_.roster.device(1);
  LateReplies& late_ = line_.owed.late_replies;
  Schedule& schedule_ = line_.agenda.schedule;
  WriteQueue& writes_ = line_.agenda.write_queue;
  Chooser& chooser_ = line_.chooser;
};

TEST_F(ChooserTest, AnEmptyAgendaHasNoNextJob) {
  EXPECT_EQ(NextAt(0s), nullptr);
  EXPECT_FALSE(chooser_.NextAt({kStart, kStart}));
}

TEST_F(ChooserTest, APollIsChosenWhenItIsDue) {
  schedule_.Restart(0, kStart + 1s);
  EXPECT_EQ(chooser_.NextAt({kStart, kStart}), kStart + 1s);
  EXPECT_EQ(NextAt(0s), nullptr);
  const auto job = NextAt(1s);
  ASSERT_NE(job, nullptr);
  EXPECT_EQ(job->member, &a);
  EXPECT_EQ(job->group(), config::Group::fast);
  EXPECT_TRUE(job->EffectsOf({Outcome::ok}, kStart).fast_poll->last_of_round);
}

TEST_F(ChooserTest, AReadBackWaitsForALateReplyAndThenWakesTheLine) {
  writes_.AddReadBack({1, 0});
  late_.OnUnknownRequest(b, kStart);
  const Instant until = late_.LateUntil(b);
  ASSERT_GT(until, kStart);
  EXPECT_EQ(NextAt(0s), nullptr);
  EXPECT_EQ(chooser_.NextAt({kStart, kStart}), until);
  const auto job = NextAt(until - kStart);
  ASSERT_NE(job, nullptr);
  EXPECT_TRUE(job->is_read_back());
}

TEST_F(ChooserTest, AWriteGoesBeforeAPollAndItsReadBackBeforeTheNextWrite) {
  schedule_.Restart(0, kStart);
  writes_.Push(To(1));
  const auto write = NextAt(0s);
  ASSERT_TRUE(write->writes());
  EXPECT_EQ(write->member, &b);
  writes_.Push(To(1));
  writes_.AddReadBack({1, 0});
  EXPECT_TRUE(NextAt(0s)->is_read_back());
  EXPECT_TRUE(NextAt(0s)->writes());
  EXPECT_TRUE(NextAt(0s)->group());
}

TEST_F(ChooserTest, AWriteWaitsForTheLateAnswerOfItsDevice) {
  late_.OnClosed(b, kStart);
  writes_.Push(To(1));
  EXPECT_EQ(NextAt(0s), nullptr);
  EXPECT_EQ(chooser_.NextAt({kStart, kStart}), kStart + 1s);
  EXPECT_NE(NextAt(1s), nullptr);
}

TEST_F(ChooserTest, AnOfflineDeviceIsProbed) {
  a.health.OnTask(Outcome::no_reply, kStart);
  const auto job = NextAt(0s);
  ASSERT_NE(job, nullptr);
  EXPECT_TRUE(job->is_probe());
  EXPECT_EQ(job->probe_budget, Probes::Kind::look);
  a.in_use = false;
  EXPECT_EQ(NextAt(1s), nullptr) << "nobody looks for it";
}

TEST_F(ChooserTest, AParkedJobComesBackAtItsTimeUnlessItIsDropped) {
  const auto poll = [this] { return std::make_unique<PollJob>(a, Schedule::Pick{}, kStart); };
  line_.agenda.parked.Park(poll(), kStart + 1s);
  EXPECT_EQ(chooser_.NextAt({kStart, kStart}), kStart + 1s);
  EXPECT_EQ(NextAt(0s), nullptr);
  EXPECT_NE(NextAt(1s), nullptr);
  line_.agenda.parked.Park(poll(), kStart + 1s);
  line_.agenda.parked.Drop(a);
  EXPECT_EQ(NextAt(1s), nullptr);
}

TEST_F(ChooserTest, WaitingTimeCountsFromTheMomentAJobIsDue) {
  schedule_.Restart(1, kStart + 100ms);
  EXPECT_EQ(chooser_.Waited(kStart, kStart + 300ms), 200ms);
  EXPECT_EQ(chooser_.Waited(kStart, kStart + 50ms), 0ms);
  writes_.Push(To(1));
  EXPECT_EQ(chooser_.Waited(kStart, kStart + 50ms), 50ms);
}

class RoutedJobsTest : public ::testing::Test {
 protected:
  RoutedJobsTest() { agenda_.schedule.AddDevice(1s, 1min); }

  void Push(const std::string& pdu, std::uint8_t slave = 20) {
    RoutedRequest request;
    request.slave = slave;
    request.pdu = ParseHex(pdu).value();
    request.sequence = agenda_.write_queue.NextSequence();
    request.deadline = kStart + 10s;
    agenda_.route_queue.Push(std::move(request));
  }
  void PushPointWrite() {
    WriteCommand command;
    command.kind = Writes{{0, 1.0}};
    command.deadline = kStart + 10s;
    agenda_.write_queue.Push(std::move(command));
  }

  config::Line line_ = DriveLine({Polled("20", 1)});
  Roster roster_{line_, 0, [](const std::string&) -> const protocols::Protocol& {
                   return protocols::ModbusRtuProtocol();
                 }};
  LateReplies late_{roster_};
  Agenda agenda_{roster_, late_};
  RoutedJobs jobs_{roster_, agenda_, late_};
  const Idle idle_{kStart, kStart};
};

TEST_F(RoutedJobsTest, ARoutedReadBecomesAJobWithItsRequest) {
  Push(kRead);
  EXPECT_TRUE(jobs_.AnyMayGo(kStart));
  EXPECT_FALSE(jobs_.Waiting().short_write);
  EXPECT_EQ(jobs_.TakeUrgent(kStart), nullptr);
  const auto job = jobs_.Take(config::Priority::normal, kStart);
  ASSERT_NE(job, nullptr);
  EXPECT_EQ(ToHex(job->step.request.bytes), "14 03 00 00 00 01 86 CF");
  EXPECT_TRUE(job->is_read());
  EXPECT_TRUE(job->step.waiting);
  EXPECT_FALSE(jobs_.AnyMayGo(kStart));
}

TEST_F(RoutedJobsTest, ARoutedWriteWaitsForAnEarlierPointWriteToTheSameDevice) {
  PushPointWrite();
  Push(kStop);
  EXPECT_TRUE(jobs_.ShortWriteWaits());
  EXPECT_FALSE(jobs_.ShortWriteMayGo(kStart));
  EXPECT_EQ(jobs_.TakeUrgent(kStart), nullptr);
  Push(kStop, 21);
  EXPECT_TRUE(jobs_.ShortWriteMayGo(kStart));
  EXPECT_EQ(jobs_.TakeUrgent(kStart)->member->slave, 21);
}

TEST_F(RoutedJobsTest, ARoutedWriteGoesBeforeALaterPointWriteToTheSameDevice) {
  Push(kStop);
  PushPointWrite();
  EXPECT_NE(jobs_.TakeUrgent(kStart), nullptr);
}

TEST_F(RoutedJobsTest, ARequestToAnOfflineSlaveIsSentOnlyAsItsProbe) {
  Member& slave = roster_.SlaveAt(21);
  slave.health.OnTask(Outcome::no_reply, kStart);
  EXPECT_FALSE(jobs_.IsLookedFor(slave, idle_));
  Push(kStop, 21);
  EXPECT_TRUE(jobs_.IsLookedFor(slave, idle_));
  EXPECT_FALSE(jobs_.ShortWriteWaits()) << "nothing has to make room for it";
  EXPECT_FALSE(jobs_.AnyMayGo(kStart));
  EXPECT_EQ(jobs_.TakeUrgent(kStart), nullptr);
  EXPECT_NE(jobs_.TakeShortWrite(21, kStart), nullptr);
  Push(kRead, 21);
  EXPECT_NE(jobs_.TakeProbe(slave, idle_), nullptr);
  EXPECT_EQ(jobs_.TakeProbe(slave, idle_), nullptr);
}

}  // namespace
}  // namespace baudgate::bus
