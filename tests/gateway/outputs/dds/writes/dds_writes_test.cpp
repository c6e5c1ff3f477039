// The thread between a writer of samples and the service: replies come, also after they found no
// room, and nothing goes to a line after the end. Waited for by what happens, nothing by time.
// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>

#include <condition_variable>
#include <mutex>

#include "gateway/outputs/dds/writes/write_service.h"
#include "tests/gateway/outputs/dds/writes/service_fixture.h"

namespace baudgate::dds {
namespace {

using testing::ServiceConfig;

/// Where replies go, and where requests come from.
class PlayedWriter : public SampleWriter {
 public:
  Sent Write(const PointSample&) override { return Sent::yes; }
  Sent Write(const DeviceSample&) override { return Sent::yes; }
  Sent Write(const GatewaySample&) override { return Sent::yes; }
  Sent Write(const ReplySample& reply) override {
    const std::lock_guard lock(mutex_);
    if (later_-- > 0) return Sent::later;
    replies_.push_back(reply);
    changed_.notify_all();
    return Sent::yes;
  }
  bool WaitAcknowledged(Duration) override { return true; }
  Subscribers subscribers() const override { return {}; }
  void OnRequest(TakeRequest take) override {
    const std::lock_guard lock(mutex_);
    take_ = std::move(take);
  }

  bool Request(WriteArrival arrival) {
    const std::lock_guard lock(mutex_);
    if (!take_) return false;
    arrival.received = ReadClocks().instant;
    take_(std::move(arrival));
    return true;
  }
  void FindNoRoom(int times) {
    const std::lock_guard lock(mutex_);
    later_ = times;
  }
  std::vector<ReplySample> WaitFor(std::size_t count) {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [&] { return replies_.size() >= count; });
    return replies_;
  }

 private:
  std::mutex mutex_;
  std::condition_variable changed_;
  TakeRequest take_;
  int later_ = 0;
  std::vector<ReplySample> replies_;
};

/// Confirms at once, on the thread that asks.
class ConfirmingSink final : public CommandSink {
 public:
  bool Submit(WriteCommand command) override {
    ++done;
    command.done({WriteEnd::ok});
    return true;
  }
  std::atomic<int> done = 0;
};

WriteArrival AskNow(std::uint64_t seq, const std::string& point, double value) {
  WriteArrival arrival = testing::Ask(seq, point, value);
  arrival.published = ReadClocks().wall;
  return arrival;
}

class DdsWritesTest : public ::testing::Test {
 protected:
  const config::Config config_ = ServiceConfig();
  PointStore store_{config_};
  ConfirmingSink sink_;
  std::shared_ptr<PlayedWriter> writer_ = std::make_shared<PlayedWriter>();
  DdsWrites writes_{config_, store_, sink_, {}, writer_};
};

TEST_F(DdsWritesTest, RepliesComeInTheirOrderAlsoWhereThereWasNoRoom) {
  writer_->FindNoRoom(3);
  for (std::uint64_t seq = 1; seq <= 5; ++seq) {
    ASSERT_TRUE(writer_->Request(AskNow(seq, "setting", 1)));
  }
  const auto replies = writer_->WaitFor(5);
  for (std::size_t i = 0; i < 5; ++i) {
    EXPECT_EQ(replies[i].seq, i + 1);
    EXPECT_EQ(replies[i].outcome, "ok");
  }
  EXPECT_EQ(sink_.done, 5);
  EXPECT_EQ(writes_.taken(), 5U);
  EXPECT_EQ(writes_.dropped(), 0U);
}

TEST_F(DdsWritesTest, NothingIsTakenAfterTheEnd) {
  ASSERT_TRUE(writer_->Request(AskNow(1, "setting", 1)));
  writer_->WaitFor(1);
  writes_.StopTaking();
  EXPECT_FALSE(writer_->Request(AskNow(2, "setting", 1)));
  writes_.Stop();
  EXPECT_EQ(sink_.done, 1);
}

TEST_F(DdsWritesTest, OfAFloodSomeAreCountedOnly) {
  for (std::uint64_t seq = 1; seq <= 10'000; ++seq) writer_->Request(AskNow(seq, "setting", 1));
  writer_->WaitFor(1);
  writes_.StopTaking();
  writes_.Stop();
  EXPECT_GT(writes_.dropped(), 0U);
  EXPECT_LE(writes_.taken() + writes_.dropped(), 10'000U);
  EXPECT_LE(static_cast<std::uint64_t>(sink_.done), writes_.taken());
}

}  // namespace
}  // namespace baudgate::dds
