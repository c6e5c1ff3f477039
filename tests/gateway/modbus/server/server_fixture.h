// A Modbus server on loopback with a store, a scripted command sink and raw clients, for the tests.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <asio/executor_work_guard.hpp>
#include <asio/io_context.hpp>
#include <condition_variable>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "gateway/modbus/server/modbus_server.h"
#include "tests/gateway/modbus/registers/points.h"

namespace baudgate::modbus {

/// Keeps commands until the test answers them, or answers at once, or is full.
class ScriptedSink : public CommandSink {
 public:
  bool Submit(WriteCommand command) override {
    std::unique_lock lock(mutex_);
    if (full) return false;
    if (answer) {
      const Outcome outcome = *answer;
      lock.unlock();
      command.done(outcome, outcome == Outcome::ok ? "" : "because");
      lock.lock();
    }
    commands_.push_back(std::move(command));
    arrived_.notify_all();
    return true;
  }

  /// Waits for the command with this number; the test's own timeout is the bound.
  WriteCommand Wait(std::size_t number) {
    std::unique_lock lock(mutex_);
    arrived_.wait(lock, [&] { return commands_.size() > number; });
    return commands_[number];
  }

  std::size_t count() {
    const std::lock_guard lock(mutex_);
    return commands_.size();
  }

  // Set before the clients start.
  bool full = false;
  std::optional<Outcome> answer;

 private:
  std::mutex mutex_;
  std::condition_variable arrived_;
  std::vector<WriteCommand> commands_;
};

/// A client that sends what it likes. Receiving gives up after a while, so that no test hangs.
class RawClient {
 public:
  explicit RawClient(std::uint16_t port, int receive_buffer = 0)
      : socket_(::socket(AF_INET, SOCK_STREAM, 0)) {
    const timeval patience{20, 0};
    ::setsockopt(socket_, SOL_SOCKET, SO_RCVTIMEO, &patience, sizeof patience);
    if (receive_buffer > 0) {
      ::setsockopt(socket_, SOL_SOCKET, SO_RCVBUF, &receive_buffer, sizeof receive_buffer);
    }
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_port = htons(port);
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    connected_ =
        ::connect(socket_, reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0;
  }
  RawClient(RawClient&& other) noexcept
      : socket_(std::exchange(other.socket_, -1)), connected_(other.connected_) {}
  ~RawClient() { Close(); }

  void Close() {
    if (socket_ >= 0) ::close(std::exchange(socket_, -1));
  }
  bool connected() const { return connected_; }

  /// False once the server has closed.
  bool Send(View bytes) const {
    return ::send(socket_, bytes.data(), bytes.size(), MSG_NOSIGNAL) ==
           static_cast<ssize_t>(bytes.size());
  }
  /// False when the connection is gone or the bytes do not fit into its buffers now.
  bool SendSome(View bytes) const {
    return ::send(socket_, bytes.data(), bytes.size(), MSG_NOSIGNAL | MSG_DONTWAIT) > 0;
  }

  /// Hex of exactly one answer; empty when the server has closed.
  std::string Receive() const {
    Bytes frame(6);
    if (!ReceiveExactly(frame, 0)) return {};
    const std::size_t length = *ByteReader(frame).U16Be(4);
    frame.resize(6 + length);
    return ReceiveExactly(frame, 6) ? ToHex(frame) : std::string();
  }
  /// Hex of the next `count` bytes; empty when the server has closed.
  std::string ReceiveBytes(std::size_t count) const {
    Bytes bytes(count);
    return ReceiveExactly(bytes, 0) ? ToHex(bytes) : std::string();
  }
  /// The PDU of the answer to one request.
  std::string Ask(std::uint8_t unit, const std::string& pdu) const {
    Send(Frame(unit, pdu));
    const std::string answer = Receive();
    constexpr std::size_t kHeaderText = 7 * 3;
    return answer.size() > kHeaderText ? answer.substr(kHeaderText) : answer;
  }
  /// Waits until the server closes, reading what still comes.
  bool IsClosed() const {
    char bytes[4096];
    ssize_t count = 0;
    do {
      count = ::recv(socket_, bytes, sizeof bytes, 0);
    } while (count > 0);
    return count == 0 || errno == ECONNRESET;
  }

 private:
  bool ReceiveExactly(Bytes& into, std::size_t from) const {
    while (from < into.size()) {
      const ssize_t count = ::recv(socket_, into.data() + from, into.size() - from, 0);
      if (count <= 0) return false;
      from += static_cast<std::size_t>(count);
    }
    return true;
  }

  int socket_;
  bool connected_ = false;
};

/// Unit 1: int16 at 0 (rw), float at 1-2 (rw), int16 at 3, never read; coils 0 (rw) and 1.
class ServerTest : public testing::Test {
 protected:
  using Type = config::Type;
  using Access = config::Access;

  ServerTest()
      : config_(MakeConfig({MakeDevice(
            1, {MakePoint(Type::int16, 0, Access::read_write),
                MakePoint(Type::float32, 1, Access::read_write), MakePoint(Type::int16, 3),
                MakePoint(Type::boolean, 0, Access::read_write), MakePoint(Type::boolean, 1)})})) {
    config_.lines[0].devices[0].max_age = config_.lines[0].devices[0].dead_age = 24h;
    config_.modbus.listen.resize(1);
    config_.modbus.listen[0].port = 0;
  }
  ~ServerTest() override { StopServer(); }

  config::Listener& listener() { return config_.modbus.listen[0]; }

  void StartServer(ModbusLimits limits = {}) {
    store_.emplace(config_);
    const Sample samples[] = {{0, std::int64_t{-2}, Quality::good},
                              {1, 123456.0, Quality::good},
                              {3, true, Quality::good},
                              {4, false, Quality::good}};
    store_->Update(0, samples, ReadClocks(), 5ms);
    server_.emplace(
        config_, *store_, sink_, [] { return GatewayFigures{0, 1, 0, 90s, 1, 1, 1, 1}; }, limits,
        links_);
    const Status listening = server_->Listen(io_);
    ASSERT_TRUE(listening.ok()) << listening.error();
    thread_ = std::thread([this] { io_.run(); });
  }

  void StopServer() {
    io_.stop();
    if (thread_.joinable()) thread_.join();
    server_.reset();
  }

  RawClient Connect() { return RawClient(server_->port()); }

  ScriptedSink sink_;
  ModbusLinks links_;
  config::Config config_;
  std::optional<PointStore> store_;
  asio::io_context io_;
  asio::executor_work_guard<asio::io_context::executor_type> work_{io_.get_executor()};
  std::optional<ModbusServer> server_;
  std::thread thread_;
};

}  // namespace baudgate::modbus
