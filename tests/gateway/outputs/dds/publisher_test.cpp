// The publisher's thread: what it refuses to start with, and that it sends and ends. What it sends
// is judged in sample_sender_test.cpp.
// SPDX-License-Identifier: Apache-2.0
#include "gateway/outputs/dds/publisher.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <condition_variable>
#include <future>
#include <mutex>

#include "tests/gateway/outputs/dds/fixture.h"
#include "tests/gateway/outputs/dds/remembering_writer.h"

namespace baudgate::dds {
namespace {

using testing::MakeConfig;
using testing::RememberingWriter;

/// Lets the test wait until a value has been sent.
class TellingWriter : public RememberingWriter {
 public:
  Sent Write(const PointSample& sample) override {
    if (sample.value == 2.5) told.set_value();
    return RememberingWriter::Write(sample);
  }
  using RememberingWriter::Write;

  std::promise<void> told;
};

TEST(Publisher, SendsOnItsThreadUntilItIsStopped) {
  const config::Config config = MakeConfig(2, 2);
  PointStore store(config);
  const auto writer = std::make_shared<TellingWriter>();
  auto publisher = std::move(*DdsPublisher::Create(config, store, writer));
  testing::Set(store, 1, 1, 2.5);
  writer->told.get_future().wait();
  publisher->Stop();
  publisher->Stop();
  EXPECT_GE(publisher->counters().written, 1U);
}

TEST(Publisher, RefusesNamesThatAreNoKeys) {
  config::Config config = MakeConfig(1, 1);
  config.lines[0].devices[0].points[0].name = std::string(65, 'p');
  PointStore store(config);
  const auto publisher = DdsPublisher::Create(config, store, std::make_unique<RememberingWriter>());
  ASSERT_FALSE(publisher.ok());
  EXPECT_THAT(publisher.error(), ::testing::HasSubstr("longer than 64"));
}

/// One with listeners that come and go.
class ChangingWriter : public RememberingWriter {
 public:
  Sent Write(const PointSample& sample) override {
    const std::lock_guard lock(mutex_);
    got_.emplace_back(session_, sample.value);
    changed_.notify_all();
    return Sent::yes;
  }
  using RememberingWriter::Write;
  std::uint64_t session() const override {
    const std::lock_guard lock(mutex_);
    return session_;
  }
  void OnSession(const std::function<void()>& changed) override { changed_session_ = changed; }

  void SetSession(std::uint64_t session) {
    {
      const std::lock_guard lock(mutex_);
      session_ = session;
    }
    changed_session_();
  }
  void WaitFor(std::pair<std::uint64_t, double> wanted) {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [&] { return std::find(got_.begin(), got_.end(), wanted) != got_.end(); });
  }
  std::vector<std::pair<std::uint64_t, double>> got() {
    const std::lock_guard lock(mutex_);
    return got_;
  }

 private:
  mutable std::mutex mutex_;
  std::condition_variable changed_;
  std::uint64_t session_ = 0;
  std::vector<std::pair<std::uint64_t, double>> got_;
  std::function<void()> changed_session_;
};

TEST(Publisher, SendsEverythingToWhoeverComesAndNothingToNobody) {
  const config::Config config = MakeConfig(1, 1);
  PointStore store(config);
  auto writer = std::make_shared<ChangingWriter>();
  auto publisher = std::move(*DdsPublisher::Create(config, store, writer));
  testing::Set(store, 0, 0, 1.5);
  writer->SetSession(3);
  writer->WaitFor({3, 1.5});
  writer->SetSession(0);
  testing::Set(store, 0, 0, 2.5);
  writer->SetSession(4);
  writer->WaitFor({4, 2.5});
  publisher->Stop();
  for (const auto& [session, value] : writer->got()) EXPECT_NE(session, 0U) << value;
}

}  // namespace
}  // namespace baudgate::dds
