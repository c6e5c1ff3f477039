// A port whose driver blocks, and what its owner on the other thread hears of it.
// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <asio/executor_work_guard.hpp>
#include <future>
#include <optional>
#include <string>

#include "tests/transports/far_end.h"
#include "transports/port_keeper.h"

namespace baudgate {
namespace {

using test::RunReady;
using test::RunUntil;

/// What the test and the driver say to each other.
struct Driver {
  std::promise<void> called;
  std::promise<void> answers;
  std::future<void> answer = answers.get_future();
  std::size_t brings = 0;  ///< bytes, once it is open
  std::promise<void> brought;
};

class SickPort final : public Transport {
 public:
  SickPort(asio::io_context& io, TransportListener& listener, Driver& driver)
      : io_(io), listener_(listener), driver_(driver) {}

  void Open() override {
    asio::post(io_, [this] {
      driver_.called.set_value();
      driver_.answer.wait();
      open_ = true;
      listener_.OnOpened();
      for (std::size_t i = 0; i < driver_.brings; i += kRead) listener_.OnBytes(Bytes(kRead));
      driver_.brought.set_value();
    });
  }
  void Close() override { open_ = false; }
  bool is_open() const override { return open_; }
  void Send(View) override {}
  void DropUnsent() override {}
  Status Apply(const config::SerialSettings&) override { return {}; }
  Status Reset(const config::SerialSettings&) override { return {}; }
  std::string Describe() const override { return "sick"; }

 private:
  static constexpr std::size_t kRead = 4096;

  asio::io_context& io_;
  TransportListener& listener_;
  Driver& driver_;
  bool open_ = false;
};

class SerialThreadTest : public testing::Test, public PortThread::Owner {
 protected:
  SerialThreadTest() {
    const auto make = [this](asio::io_context& io, TransportListener& listener) {
      return std::make_unique<SickPort>(io, listener, driver_);
    };
    port_.emplace(io_, "/dev/sick", make, *this);
  }
  ~SerialThreadTest() override { Answer(); }

  void OnOpened(const std::string& description) override { opened_ = description; }
  void OnDown(const std::string&, bool) override {}
  void OnBytes(View bytes, Instant) override { heard_ += bytes.size(); }

  void StartAndBlock() {
    port_->Start();
    driver_.called.get_future().wait();
  }
  void Answer() {
    if (!std::exchange(answered_, true)) driver_.answers.set_value();
  }

  asio::io_context io_;
  asio::executor_work_guard<asio::io_context::executor_type> work_{io_.get_executor()};
  Driver driver_;
  bool answered_ = false;
  std::string opened_;
  std::size_t heard_ = 0;
  std::optional<PortThread> port_;
};

TEST_F(SerialThreadTest, TheServerGoesOnWhileTheDriverBlocks) {
  StartAndBlock();
  bool served = false;
  asio::post(io_, [&] { served = true; });
  ASSERT_TRUE(RunUntil(io_, [&] { return served; }));
  EXPECT_EQ(opened_, "");
  Answer();
  ASSERT_TRUE(RunUntil(io_, [&] { return !opened_.empty(); }));
  EXPECT_EQ(opened_, "sick");
}

TEST_F(SerialThreadTest, AfterStopTheOwnerHearsNothing) {
  driver_.brings = 4096;
  StartAndBlock();
  Answer();
  port_->Stop();
  port_.reset();
  RunReady(io_);
  EXPECT_EQ(opened_, "");
  EXPECT_EQ(heard_, 0U);
}

TEST_F(SerialThreadTest, BytesThatAreNotHeardTakeBoundedMemory) {
  driver_.brings = 1024 * 1024;
  StartAndBlock();
  Answer();
  driver_.brought.get_future().wait();
  RunReady(io_);
  EXPECT_EQ(heard_, 64U * 1024);
}

}  // namespace
}  // namespace baudgate
