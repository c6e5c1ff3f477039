// How the errors of a dying tty end a session: once, at once, from reading as from writing. The
// stream is a fake, because a pty does not know them all.
// SPDX-License-Identifier: Apache-2.0
#include "transports/session.h"

#include <gtest/gtest.h>

#include <asio/io_context.hpp>
#include <asio/post.hpp>

#include "tests/transports/far_end.h"

namespace baudgate {
namespace {

using Handler = std::function<void(const std::error_code&, std::size_t)>;

struct Wire {
  Handler reading;
  Handler writing;
};

class FakeStream {
 public:
  FakeStream(asio::io_context& io, std::shared_ptr<Wire> wire) : io_(io), wire_(std::move(wire)) {}
  asio::io_context::executor_type get_executor() { return io_.get_executor(); }
  template <typename Buffer>
  void async_read_some(const Buffer&, Handler handler) {
    wire_->reading = std::move(handler);
  }
  template <typename Buffer>
  void async_write_some(const Buffer&, Handler handler) {
    wire_->writing = std::move(handler);
  }

 private:
  asio::io_context& io_;
  std::shared_ptr<Wire> wire_;
};

class DyingPort : public testing::TestWithParam<std::error_code> {
 protected:
  DyingPort() { session_->Start(); }
  asio::io_context io_;
  std::shared_ptr<Wire> wire_ = std::make_shared<Wire>();
  std::vector<std::error_code> ends_;
  std::size_t received_ = 0;
  std::shared_ptr<Session<FakeStream>> session_ = std::make_shared<Session<FakeStream>>(
      FakeStream(io_, wire_), [this](View bytes) { received_ += bytes.size(); },
      [this](const std::error_code& error) { ends_.push_back(error); });
};

TEST_P(DyingPort, IsLostByReading) {
  wire_->reading({}, 3);
  EXPECT_EQ(received_, 3U);
  std::exchange(wire_->reading, {})(GetParam(), 0);
  ASSERT_EQ(ends_.size(), 1U);
  EXPECT_EQ(ends_[0], GetParam());
  EXPECT_FALSE(wire_->reading) << "a dead tty is readable for ever";
}

TEST_P(DyingPort, IsLostByWriting) {
  session_->Send(ToBytes("request"));
  ASSERT_TRUE(wire_->writing);
  std::exchange(wire_->writing, {})(GetParam(), 0);
  EXPECT_EQ(ends_.size(), 1U);
  std::exchange(wire_->reading, {})(GetParam(), 0);
  EXPECT_EQ(ends_.size(), 1U) << "told once";
  session_->Send(ToBytes("more"));
  EXPECT_FALSE(wire_->writing);
}

/// Read 0 is end of file to asio.
INSTANTIATE_TEST_SUITE_P(Errors, DyingPort,
                         testing::Values(std::error_code(asio::error::eof),
                                         std::error_code(EIO, std::system_category()),
                                         std::error_code(ENODEV, std::system_category()),
                                         std::error_code(ENXIO, std::system_category())));

}  // namespace
}  // namespace baudgate
