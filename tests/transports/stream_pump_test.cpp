// How the errors of a dying tty end a session (once, at once, from reading as from writing), and
// what becomes of bytes that the stream does not take. The stream is a fake, because a pty does not
// know all of it.
// SPDX-License-Identifier: Apache-2.0
#include "transports/stream_pump.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <asio/io_context.hpp>

#include "tests/transports/far_end.h"

namespace baudgate {
namespace {

using Handler = std::function<void(const std::error_code&, std::size_t)>;

struct Wire {
  Handler reading;
  std::function<void(const std::error_code&)> waiting;  // for room
  std::size_t room = 0;
  std::error_code write_error;
  Bytes written;
};

class FakeStream {
 public:
  enum Wait { wait_write };

  FakeStream(asio::io_context& io, std::shared_ptr<Wire> wire) : io_(io), wire_(std::move(wire)) {}
  asio::io_context::executor_type get_executor() { return io_.get_executor(); }
  void non_blocking(bool, std::error_code&) {}
  template <typename Buffer>
  void async_read_some(const Buffer&, Handler handler) {
    wire_->reading = std::move(handler);
  }
  template <typename Buffer>
  std::size_t write_some(const Buffer& buffer, std::error_code& error) {
    error = wire_->room == 0 ? asio::error::would_block : wire_->write_error;
    if (error) return 0;
    const std::size_t count = std::min(wire_->room, buffer.size());
    Append(wire_->written, View(static_cast<const std::uint8_t*>(buffer.data()), count));
    wire_->room -= count;
    return count;
  }
  void async_wait(Wait, std::function<void(const std::error_code&)> handler) {
    wire_->waiting = std::move(handler);
  }

 private:
  asio::io_context& io_;
  std::shared_ptr<Wire> wire_;
};

class SessionTest : public testing::Test {
 protected:
  SessionTest() { session_->Start(); }
  /// Handlers hold the session, as those of a real stream do until it is closed.
  ~SessionTest() override {
    wire_->reading = {};
    wire_->waiting = {};
  }
  void MakeRoom(std::size_t count) {
    wire_->room = count;
    if (wire_->waiting) std::exchange(wire_->waiting, {})({});
  }

  asio::io_context io_;
  std::shared_ptr<Wire> wire_ = std::make_shared<Wire>();
  std::vector<std::error_code> ends_;
  std::size_t received_ = 0;
  std::shared_ptr<StreamPump<FakeStream>> session_ = std::make_shared<StreamPump<FakeStream>>(
      FakeStream(io_, wire_), [this](View bytes) { received_ += bytes.size(); },
      [this](const std::error_code& error) { ends_.push_back(error); });
};

TEST_F(SessionTest, WritesInPiecesAsThereIsRoom) {
  session_->Send(ToBytes("first"));
  session_->Send(ToBytes("second"));
  EXPECT_TRUE(wire_->written.empty());
  MakeRoom(3);
  MakeRoom(4);
  EXPECT_EQ(AsText(wire_->written), "firstse");
  EXPECT_EQ(session_->taken(), 7U);
  MakeRoom(100);
  EXPECT_EQ(AsText(wire_->written), "firstsecond");
  EXPECT_EQ(session_->taken(), 11U);
  session_->Send(ToBytes("third"));
  EXPECT_EQ(AsText(wire_->written), "firstsecondthird") << "at once";
}

/// A start that has been given up must not go out when there is room again.
TEST_F(SessionTest, WhatIsDroppedIsNeverWritten) {
  session_->Send(ToBytes("start"));
  session_->Send(ToBytes("more"));
  EXPECT_TRUE(session_->DropUnsent());
  EXPECT_FALSE(session_->DropUnsent()) << "nothing is left";
  MakeRoom(100);
  EXPECT_EQ(AsText(wire_->written), "");
  session_->Send(ToBytes("stop"));
  EXPECT_EQ(AsText(wire_->written), "stop");
}

TEST_F(SessionTest, TheRestOfARequestIsDroppedToo) {
  wire_->room = 2;
  session_->Send(ToBytes("start"));
  EXPECT_TRUE(session_->DropUnsent());
  EXPECT_EQ(session_->taken(), 2U);
  session_->Send(ToBytes("stop"));
  EXPECT_EQ(AsText(wire_->written), "st") << "there is no room yet";
  MakeRoom(100);
  EXPECT_EQ(AsText(wire_->written), "ststop");
  EXPECT_TRUE(ends_.empty());
}

/// As a pty after TCOFLUSH: there is room, and the wait for it does not end.
TEST_F(SessionTest, RoomThatNobodyTellsOfIsUsed) {
  session_->Send(ToBytes("start"));
  session_->DropUnsent();
  wire_->room = 100;
  session_->Send(ToBytes("stop"));
  EXPECT_EQ(AsText(wire_->written), "stop");
  EXPECT_TRUE(wire_->waiting);
}

TEST_F(SessionTest, WhatIsWrittenIsNotDropped) {
  wire_->room = 100;
  session_->Send(ToBytes("request"));
  EXPECT_FALSE(session_->DropUnsent());
  EXPECT_EQ(AsText(wire_->written), "request");
}

class DyingPort : public SessionTest, public testing::WithParamInterface<std::error_code> {};

TEST_P(DyingPort, IsLostByReading) {
  wire_->reading({}, 3);
  EXPECT_EQ(received_, 3U);
  std::exchange(wire_->reading, {})(GetParam(), 0);
  ASSERT_EQ(ends_.size(), 1U);
  EXPECT_EQ(ends_[0], GetParam());
  EXPECT_FALSE(wire_->reading) << "a dead tty is readable for ever";
}

TEST_P(DyingPort, IsLostByWriting) {
  wire_->room = 100;
  wire_->write_error = GetParam();
  session_->Send(ToBytes("request"));
  EXPECT_TRUE(ends_.empty()) << "no callback from within the call";
  test::RunReady(io_);
  ASSERT_EQ(ends_.size(), 1U);
  EXPECT_EQ(ends_[0], GetParam());
  std::exchange(wire_->reading, {})(GetParam(), 0);
  EXPECT_EQ(ends_.size(), 1U) << "told once";
  wire_->write_error.clear();
  session_->Send(ToBytes("more"));
  EXPECT_TRUE(wire_->written.empty());
}

TEST_P(DyingPort, IsLostByWaitingForRoom) {
  session_->Send(ToBytes("request"));
  ASSERT_TRUE(wire_->waiting);
  std::exchange(wire_->waiting, {})(GetParam());
  ASSERT_EQ(ends_.size(), 1U);
  EXPECT_EQ(ends_[0], GetParam());
}

/// Read 0 is end of file to asio.
INSTANTIATE_TEST_SUITE_P(Errors, DyingPort,
                         testing::Values(std::error_code(asio::error::eof),
                                         std::error_code(EIO, std::system_category()),
                                         std::error_code(ENODEV, std::system_category()),
                                         std::error_code(ENXIO, std::system_category())));

}  // namespace
}  // namespace baudgate
