// A gateway behind a serial master. Unit 1 is a device with an int16 at 0 (rw) whose value is -2;
// unit 20 is routed to a line. `MasterSessionTest` has a master under virtual time.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <asio/io_context.hpp>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "gateway/outputs/modbus/serial/serial_listener.h"
#include "protocols/modbus/protocol.h"
#include "tests/gateway/outputs/modbus/registers/points.h"
#include "tests/support/keeping_sink.h"

namespace baudgate::modbus {

class KeepingTarget final : public bus::RouteTarget {
 public:
  bool Submit(bus::RoutedRequest request) override {
    requests.push_back(std::move(request));
    return true;
  }
  void Abandon(std::uint64_t) override { ++forgotten; }

  void Answer(std::size_t number, const std::string& pdu) {
    bus::RoutedReply reply;
    reply.outcome = Outcome::ok;
    reply.pdu = ParseHex(pdu).value();
    reply.sent = true;
    requests.at(number).done(std::move(reply));
  }
  std::vector<bus::RoutedRequest> requests;
  int forgotten = 0;
};

class MasterTest : public testing::Test {
 protected:
  MasterTest() {
    config_.lines[0].devices[0].max_age = config_.lines[0].devices[0].dead_age = 24h;
    config_.modbus.listen.resize(1);
    listener().path = "/dev/ttyS1";
    listener().serial.baud = 19200;
    listener().serial.parity = config::Parity::even;
    listener().framing = Framing::rtu;
    listener().errors = config::Listener::Errors::silent;
    config::Route& route = config_.modbus.routes.emplace_back();
    route.first = route.last = 20;
    route.line = "drive";
    route.deadline = 1h;
  }

  config::Listener& listener() { return config_.modbus.listen[0]; }

  void MakeShared(const Now& now) {
    store_.emplace(config_);
    const bus::Sample samples[] = {{0, std::int64_t{-2}, Quality::good}};
    store_->Update(0, samples, now, 5ms);
    ModbusLinks links;
    links.lines = {&target_};
    links.frames = {&protocols::ModbusRtuProtocol(), &protocols::ModbusAsciiProtocol()};
    shared_.emplace(
        config_, *store_, sink_, [] { return GatewayFigures{}; }, ModbusLimits{}, links);
  }
  MasterStatus Master() const { return shared_->book()->Status({}).masters.at(0); }
  ClientStatus Client() const { return shared_->book()->Status({}).clients.at(0); }

  static Bytes Rtu(std::uint8_t unit, const std::string& pdu) {
    return protocols::ModbusRtuProtocol().carrier->wrap(unit, ParseHex(pdu).value());
  }
  static Bytes Ascii(std::uint8_t unit, const std::string& pdu) {
    return protocols::ModbusAsciiProtocol().carrier->wrap(unit, ParseHex(pdu).value());
  }

  asio::io_context io_;
  config::Config config_ =
      MakeConfig({MakeDevice(1, {MakePoint(config::Type::int16, 0, config::Access::read_write)})});
  std::optional<bus::PointStore> store_;
  KeepingSink sink_;
  KeepingTarget target_;
  std::optional<ServerShared> shared_;
};

/// A character takes 573 us: 11 bits at 19200 bit/s.
class MasterSessionTest : public MasterTest, private MasterSession::Owner {
 protected:
  ~MasterSessionTest() override { session_.reset(); }

  void Begin() {
    MakeShared(now_);
    shared_->inbox()->Open(io_, [this] { return now_; });
    const std::size_t port = shared_->book()->AddMaster(listener(), now_.wall);
    session_.emplace(listener(), *shared_, port, static_cast<MasterSession::Owner&>(*this), now_);
  }

  Duration LineTime(std::size_t bytes) { return bytes * listener().serial.CharacterTime(); }

  void Pass(Duration time) {
    const Instant end = now_.instant + time;
    for (Poll();; Poll()) {
      const auto due = session_->Deadline();
      if (!due || *due > end) break;
      now_.instant = std::max(now_.instant, *due);
      session_->OnTime(now_);
    }
    now_.instant = end;
  }
  void Poll() {
    io_.restart();
    io_.poll();
  }
  void Hear(const Bytes& bytes) {
    Pass(LineTime(bytes.size()));
    session_->OnBytes(bytes, now_);
    Poll();
  }
  void Say(std::uint8_t unit, const std::string& pdu) { Hear(Rtu(unit, pdu)); }
  void Expect(std::uint8_t unit, const std::string& pdu) {
    Pass(100ms);
    EXPECT_THAT(std::exchange(sent_, {}), testing::ElementsAre(ToHex(Rtu(unit, pdu))));
  }
  void ExpectSilence() {
    Pass(100ms);
    EXPECT_THAT(sent_, testing::IsEmpty());
  }
  void AskForTheValue() {
    Say(1, "03 00 00 00 01");
    Expect(1, "03 02 FF FE");
  }
  std::size_t commands() const { return sink_.commands.size(); }

  Now now_{Instant(1h), WallTime(2h)};
  std::vector<std::string> sent_;
  std::vector<Instant> sent_at_;
  std::optional<MasterSession> session_;

 private:
  void Send(Bytes frame) override {
    sent_.push_back(ToHex(frame));
    sent_at_.push_back(now_.instant);
  }
  void Rearm() override {}
};

}  // namespace baudgate::modbus
