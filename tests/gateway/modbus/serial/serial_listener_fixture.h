// A scripted master at the far end of a pty, for the tests of
// gateway/modbus/serial/serial_listener.h.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <gtest/gtest.h>
#include <stdlib.h>

#include <asio/executor_work_guard.hpp>
#include <asio/posix/stream_descriptor.hpp>
#include <filesystem>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "gateway/modbus/serial/serial_listener.h"
#include "gateway/simulate/pty.h"
#include "protocols/modbus/protocol.h"
#include "tests/gateway/modbus/registers/points.h"
#include "tests/transports/far_end.h"

namespace baudgate::modbus {

namespace fs = std::filesystem;
using Descriptor = asio::posix::stream_descriptor;
using test::RunReady;
using test::RunUntil;

class KeepingSink : public CommandSink {
 public:
  bool Submit(WriteCommand command) override {
    commands.push_back(std::move(command));
    return true;
  }
  std::vector<WriteCommand> commands;
};

class KeepingTarget : public RouteTarget {
 public:
  bool Submit(RoutedRequest request) override {
    requests.push_back(std::move(request));
    return true;
  }
  void Forget(std::uint64_t) override { ++forgotten; }

  void Answer(std::size_t number, const std::string& pdu) {
    RoutedReply reply;
    reply.outcome = Outcome::ok;
    reply.pdu = ParseHex(pdu).value();
    reply.sent = true;
    requests.at(number).done(std::move(reply));
  }
  std::vector<RoutedRequest> requests;
  int forgotten = 0;
};

/// Unit 1: int16 at 0 (rw) with the value -2. Unit 20 goes to a line.
class SerialListenerTest : public testing::Test {
 protected:
  SerialListenerTest() {
    std::string form = (fs::temp_directory_path() / "baudgate-master-XXXXXX").string();
    folder_ = mkdtemp(form.data());
    config_.lines[0].devices[0].max_age = config_.lines[0].devices[0].dead_age = 24h;
    config_.modbus.listen.resize(1);
    listener().path = (folder_ / "port").string();
    listener().serial.baud = 19200;
    listener().serial.parity = config::Parity::even;
    listener().protocol = config::Listener::Protocol::rtu;
    listener().errors = config::Listener::Errors::silent;
    config::Route& route = config_.modbus.routes.emplace_back();
    route.first = route.last = 20;
    route.line = "drive";
    route.deadline = 1h;
  }
  ~SerialListenerTest() override {
    if (serial_) serial_->Stop();
    pty_.reset();
    fs::remove_all(folder_);
  }

  config::Listener& listener() { return config_.modbus.listen[0]; }

  void PlugIn() {
    auto pty = Pty::Create(listener().path);
    ASSERT_TRUE(pty.ok()) << pty.error();
    pty_.emplace(std::move(*pty));
    master_.emplace(Descriptor(io_, pty_->TakeMaster()));
    master_->Start();
  }
  void Unplug() {
    master_->stream().close();
    pty_->Unplug();
  }
  void Open() {
    store_.emplace(config_);
    const Sample samples[] = {{0, std::int64_t{-2}, Quality::good}};
    store_->Update(0, samples, ReadClocks(), 5ms);
    ModbusLinks links;
    links.lines = {&target_};
    points_.emplace(
        config_, *store_, sink_, [] { return GatewayFigures{}; }, ModbusLimits{}, links);
    points_->inbox()->Open(io_);
    serial_ = std::make_shared<SerialListener>(io_, listener(), *points_, ModbusRtuProtocol());
    serial_->Open();
  }
  void Begin() {
    PlugIn();
    Open();
    ASSERT_TRUE(RunUntil(io_, [&] { return serial_->is_open(); }));
  }

  std::uint64_t Damaged() const { return Master().damaged; }
  MasterStatus Master() const { return points_->book()->Status(ReadClocks()).masters.at(0); }

  static Bytes Rtu(std::uint8_t unit, const std::string& pdu) {
    return ModbusRtuProtocol().carrier->wrap(unit, ParseHex(pdu).value());
  }
  void Say(std::uint8_t unit, const std::string& pdu) { master_->Write(Rtu(unit, pdu)); }

  /// The next frame with this PDU, and nothing before it.
  void Expect(std::uint8_t unit, const std::string& pdu) {
    const Bytes frame = Rtu(unit, pdu);
    ASSERT_TRUE(RunUntil(io_, [&] { return master_->received().size() >= heard_ + frame.size(); }));
    EXPECT_EQ(ToHex(View(master_->received()).subspan(heard_)), ToHex(frame));
    heard_ = master_->received().size();
  }
  /// The master sends a write that is confirmed.
  void WriteOnce(std::size_t number) {
    Say(1, "06 00 00 00 07");
    ASSERT_TRUE(Commanded(number));
    sink_.commands[number - 1].done(Outcome::ok, "");
    Expect(1, "06 00 00 00 07");
  }
  /// An answer that is wrongly given would come within this time, on most machines.
  void ExpectSilence() {
    asio::steady_timer timer(io_, 50ms);
    bool over = false;
    timer.async_wait([&](const asio::error_code&) { over = true; });
    RunUntil(io_, [&] { return over; });
    EXPECT_EQ(ToHex(View(master_->received()).subspan(heard_)), "");
  }
  bool Asked(std::size_t count) {
    return RunUntil(io_, [&] { return target_.requests.size() >= count; });
  }
  bool Commanded(std::size_t count) {
    return RunUntil(io_, [&] { return sink_.commands.size() >= count; });
  }
  void AskForTheValue() {
    Say(1, "03 00 00 00 01");
    Expect(1, "03 02 FF FE");
  }

  asio::io_context io_;
  asio::executor_work_guard<asio::io_context::executor_type> work_{io_.get_executor()};
  fs::path folder_;
  config::Config config_ =
      MakeConfig({MakeDevice(1, {MakePoint(config::Type::int16, 0, config::Access::read_write)})});
  std::optional<PointStore> store_;
  KeepingSink sink_;
  KeepingTarget target_;
  std::optional<PointDesk> points_;
  std::optional<Pty> pty_;
  std::optional<test::FarEnd<Descriptor>> master_;
  std::shared_ptr<SerialListener> serial_;
  std::size_t heard_ = 0;
};

}  // namespace baudgate::modbus
