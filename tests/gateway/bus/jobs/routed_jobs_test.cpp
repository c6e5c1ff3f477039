// Requests of routes become jobs in the right order.
// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <utility>

#include "gateway/base/text.h"
#include "gateway/bus/jobs/chooser.h"
#include "protocols/modbus/protocol.h"
#include "tests/gateway/bus/poller/routed_line.h"
#include "tests/support/times.h"

namespace baudgate {
namespace {

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
  Roster roster_{line_, 0,
                 [](const std::string&) -> const Protocol& { return ModbusRtuProtocol(); }};
  LateReplies late_{roster_};
  Agenda agenda_{roster_, late_};
  RoutedJobs jobs_{roster_, agenda_, late_};
  const Idle idle_{kStart, kStart};
};

TEST_F(RoutedJobsTest, AReadBecomesAJobThatHasItsRequest) {
  Push(kRead);
  EXPECT_TRUE(jobs_.AnyMayGo(kStart));
  EXPECT_FALSE(jobs_.Waiting().short_write);
  EXPECT_EQ(jobs_.TakeUrgent(kStart), nullptr);
  const auto job = jobs_.Take(config::Priority::normal, kStart);
  ASSERT_NE(job, nullptr);
  EXPECT_EQ(ToHex(job->step.request.bytes), "14 03 00 00 00 01 86 CF");
  EXPECT_TRUE(job->As<Job::Routed>()->is_read);
  EXPECT_TRUE(job->step.waiting);
  EXPECT_FALSE(jobs_.AnyMayGo(kStart));
}

TEST_F(RoutedJobsTest, AWriteWaitsForAnEarlierOneToAPointOfTheSameDevice) {
  PushPointWrite();
  Push(kStop);
  EXPECT_TRUE(jobs_.ShortWriteWaits());
  EXPECT_FALSE(jobs_.ShortWriteMayGo(kStart));
  EXPECT_EQ(jobs_.TakeUrgent(kStart), nullptr);
  Push(kStop, 21);
  EXPECT_TRUE(jobs_.ShortWriteMayGo(kStart));
  EXPECT_EQ(jobs_.TakeUrgent(kStart)->member->slave, 21);
}

TEST_F(RoutedJobsTest, AWriteGoesBeforeALaterOneToAPointOfTheSameDevice) {
  Push(kStop);
  PushPointWrite();
  EXPECT_NE(jobs_.TakeUrgent(kStart), nullptr);
}

TEST_F(RoutedJobsTest, ASlaveThatIsOfflineIsAskedAsItsProbeOnly) {
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
}  // namespace baudgate
