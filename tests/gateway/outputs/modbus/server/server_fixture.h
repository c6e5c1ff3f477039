// A Modbus server on loopback, with a store and a scripted command sink.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <gtest/gtest.h>

#include <asio/executor_work_guard.hpp>
#include <asio/io_context.hpp>
#include <condition_variable>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "gateway/outputs/modbus/server/modbus_server.h"
#include "tests/gateway/outputs/modbus/registers/points.h"
#include "tests/support/raw_client.h"

namespace baudgate::modbus {

class ScriptedSink : public bus::CommandSink {
 public:
  bool Submit(bus::WriteCommand command) override {
    std::unique_lock lock(mutex_);
    if (full) return false;
    if (answer) {
      const WriteEnd end = *answer;
      lock.unlock();
      WriteResult result{end, end == WriteEnd::ok ? "" : "because"};
      result.unfit = unfit;
      command.done(result);
      lock.lock();
    }
    commands_.push_back(std::move(command));
    arrived_.notify_all();
    return true;
  }

  bus::WriteCommand Wait(std::size_t number) {
    std::unique_lock lock(mutex_);
    arrived_.wait(lock, [&] { return commands_.size() > number; });
    return commands_[number];
  }

  std::size_t count() {
    const std::lock_guard lock(mutex_);
    return commands_.size();
  }

  // The three members below must be set before clients start.
  bool full = false;
  std::optional<WriteEnd> answer;
  bool unfit = false;

 private:
  std::mutex mutex_;
  std::condition_variable arrived_;
  std::vector<bus::WriteCommand> commands_;
};

inline std::string Ask(const RawClient& client, std::uint8_t unit, const std::string& pdu) {
  client.Send(Frame(unit, pdu));
  const Bytes answer = client.ReceiveFrame();
  return answer.size() > kMbapHeader ? ToHex(View(answer).subspan(kMbapHeader)) : ToHex(answer);
}

/// Unit 1: int16 at 0 (rw), float at 1-2 (rw), int16 at 3 (has no value yet); coils 0 (rw) and 1.
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
    const bus::Sample samples[] = {{0, std::int64_t{-2}, Quality::good},
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
  std::optional<bus::PointStore> store_;
  asio::io_context io_;
  asio::executor_work_guard<asio::io_context::executor_type> work_{io_.get_executor()};
  std::optional<ModbusServer> server_;
  std::thread thread_;
};

}  // namespace baudgate::modbus
