// Which job a line does next, from what waits.
// SPDX-License-Identifier: Apache-2.0
#include "gateway/bus/jobs/chooser.h"

#include <gtest/gtest.h>

#include "tests/gateway/bus/poller/part_fixture.h"
#include "tests/support/times.h"

namespace baudgate {
namespace {

class ChooserTest : public ::testing::Test, protected ToyMembers {
 protected:
  ChooserTest() {
    for (const auto& device : roster.devices()) {
      schedule_.AddDevice(device->config->poll, device->config->slow);
      schedule_.SetQueries(device->place, {config::Group::fast});
    }
  }
  std::unique_ptr<Job> NextAt(Duration at) { return chooser_.Next({kStart + at, kStart + at}); }
  static WriteCommand To(std::uint32_t device) {
    WriteCommand command;
    command.device = device;
    command.kind = Writes{{0, 1.0}};
    command.deadline = kStart + 1h;
    return command;
  }

  LateReplies late_{roster};
  Agenda agenda_{roster, late_};
  Schedule& schedule_ = agenda_.schedule;
  WriteQueue& writes_ = agenda_.write_queue;
  Chooser chooser_{roster, agenda_, late_};
};

TEST_F(ChooserTest, NothingWaits) {
  EXPECT_EQ(NextAt(0s), nullptr);
  EXPECT_FALSE(chooser_.NextAt({kStart, kStart}));
}

TEST_F(ChooserTest, APollThatIsDue) {
  schedule_.Restart(0, kStart + 1s);
  EXPECT_EQ(chooser_.NextAt({kStart, kStart}), kStart + 1s);
  EXPECT_EQ(NextAt(0s), nullptr);
  const auto job = NextAt(1s);
  ASSERT_NE(job, nullptr);
  EXPECT_EQ(job->member, &a);
  ASSERT_NE(job->As<Job::Poll>(), nullptr);
  EXPECT_TRUE(job->As<Job::Poll>()->last_of_round);
}

TEST_F(ChooserTest, AReadBackThatWaitsForALateReplyWakesTheLine) {
  writes_.AddReadBack({1, 0});
  late_.OnUnknownRequest(b, kStart);
  const Instant until = late_.LateUntil(b);
  ASSERT_GT(until, kStart);
  EXPECT_EQ(NextAt(0s), nullptr);
  EXPECT_EQ(chooser_.NextAt({kStart, kStart}), until);
  const auto job = NextAt(until - kStart);
  ASSERT_NE(job, nullptr);
  EXPECT_NE(job->As<Job::ReadBack>(), nullptr);
}

TEST_F(ChooserTest, AWriteGoesBeforeAPollAndItsReadBackBeforeTheNextWrite) {
  schedule_.Restart(0, kStart);
  writes_.Push(To(1));
  const auto write = NextAt(0s);
  ASSERT_NE(write->As<Job::Write>(), nullptr);
  EXPECT_EQ(write->member, &b);
  writes_.Push(To(1));
  writes_.AddReadBack({1, 0});
  EXPECT_NE(NextAt(0s)->As<Job::ReadBack>(), nullptr);
  EXPECT_NE(NextAt(0s)->As<Job::Write>(), nullptr);
  EXPECT_NE(NextAt(0s)->As<Job::Poll>(), nullptr);
}

TEST_F(ChooserTest, AWriteWaitsForTheLateAnswerOfItsDevice) {
  late_.OnClosed(b, kStart);
  writes_.Push(To(1));
  EXPECT_EQ(NextAt(0s), nullptr);
  EXPECT_EQ(chooser_.NextAt({kStart, kStart}), kStart + 1s);
  EXPECT_NE(NextAt(1s), nullptr);
}

TEST_F(ChooserTest, ADeviceThatIsOfflineIsProbed) {
  a.health.OnTask(Outcome::no_reply, kStart);
  const auto job = NextAt(0s);
  ASSERT_NE(job, nullptr);
  EXPECT_TRUE(job->is_probe());
  EXPECT_EQ(job->probe_budget, Probes::Kind::look);
  a.in_use = false;
  EXPECT_EQ(NextAt(1s), nullptr) << "nobody looks for it";
}

TEST_F(ChooserTest, AParkedJobComesBackAtItsTimeUnlessItIsDropped) {
  const auto poll = [this] { return std::make_unique<Job>(a, Job::Poll{}, Task{}, kStart); };
  agenda_.parked.Park(poll(), kStart + 1s);
  EXPECT_EQ(chooser_.NextAt({kStart, kStart}), kStart + 1s);
  EXPECT_EQ(NextAt(0s), nullptr);
  EXPECT_NE(NextAt(1s), nullptr);
  agenda_.parked.Park(poll(), kStart + 1s);
  agenda_.parked.Drop(a);
  EXPECT_EQ(NextAt(1s), nullptr);
}

TEST_F(ChooserTest, OthersWaitForAProbeFromTheMomentTheyAreDue) {
  schedule_.Restart(1, kStart + 100ms);
  EXPECT_EQ(chooser_.Waited(kStart, kStart + 300ms), 200ms);
  EXPECT_EQ(chooser_.Waited(kStart, kStart + 50ms), 0ms);
  writes_.Push(To(1));
  EXPECT_EQ(chooser_.Waited(kStart, kStart + 50ms), 50ms);
}

}  // namespace
}  // namespace baudgate
