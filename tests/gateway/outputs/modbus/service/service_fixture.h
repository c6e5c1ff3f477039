// `ServiceTest`: a request service without sockets and threads, with fake route targets.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <gtest/gtest.h>

#include <asio/io_context.hpp>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "gateway/outputs/modbus/service/client_requests.h"
#include "tests/gateway/outputs/modbus/registers/points.h"
#include "tests/gateway/outputs/modbus/service/fake_target.h"

namespace baudgate::modbus {

class KeptWire final : public ClientWire {
 public:
  void Answer(const ModbusRequest& request, Responder& responder, Instant) override {
    Bytes frame;
    responder.Append(request, frame);
    answers.push_back(ToHex(frame));
  }
  void Answer(View frame, Instant) override { answers.push_back(ToHex(frame)); }
  void AnswerNothing(Instant) override { answers.push_back("nothing"); }
  void SweepAt(Instant at) override { sweeps.push_back(at); }

  std::vector<std::string> Take() { return std::exchange(answers, {}); }

  std::vector<std::string> answers;
  std::vector<Instant> sweeps;
};

class WriteSink final : public bus::CommandSink {
 public:
  bool Submit(bus::WriteCommand command) override {
    commands.push_back(std::move(command));
    return true;
  }
  void OnNotTaken(const bus::DeniedWrite& write) override { denied.push_back(write); }

  std::vector<bus::WriteCommand> commands;
  std::vector<bus::DeniedWrite> denied;
};

class ServiceTest : public testing::Test {
 protected:
  using Answers = std::vector<std::string>;

  ServiceTest()
      : config_(MakeConfig(
            {MakeDevice(1, {MakePoint(config::Type::int16, 0, config::Access::read_write)})})) {
    AddRoutedLines(config_);
    config_.lines[0].devices[0].max_age = config_.lines[0].devices[0].dead_age = 24h;
    config_.modbus.listen.resize(1);
  }
  ~ServiceTest() override {
    for (const auto& service : services_) service->Close();
  }

  config::Listener& listener() { return config_.modbus.listen[0]; }
  config::Route& Add(std::size_t line, std::uint8_t first, std::uint8_t last) {
    return config_.modbus.routes.emplace_back(RouteTo(config_, line, first, last));
  }

  std::shared_ptr<ClientRequests> Enter(KeptWire& wire,
                                        config::Priority priority = config::Priority::normal) {
    if (!shared_) MakeShared();
    return services_.emplace_back(std::make_shared<ClientRequests>(
        listener(), *shared_, wire, "10.0.0.7:40112", priority, nullptr, Clocks()));
  }
  void MakeShared() {
    store_.emplace(config_);
    const bus::Sample sample{0, std::int64_t{-2}, Quality::good};
    store_->Update(0, std::span(&sample, 1), Clocks(), 5ms);
    shared_.emplace(config_, *store_, sink_, std::function<GatewayFigures()>(), ModbusLimits{},
                    links_);
    shared_->inbox()->Open(io_, [this] { return Clocks(); });
  }
  /// The wall clock is one hour ahead of the steady clock.
  Now Clocks() const { return {now_, WallTime(now_.time_since_epoch() + 1h)}; }

  Answers Ask(View frame) {
    if (services_.empty()) Enter(wire_);
    services_[0]->Handle(frame, Clocks());
    return Settle();
  }
  Answers Ask(std::uint8_t unit, const std::string& pdu) { return Ask(Frame(unit, pdu)); }
  Answers Settle() {
    io_.restart();
    io_.poll();
    return wire_.Take();
  }
  std::uint64_t IdOf(std::size_t client) { return Traffic().clients.at(client).id; }
  TrafficStatus Traffic() { return shared_->book()->Status(Clocks()); }

  Instant now_{100h};
  config::Config config_;
  std::optional<bus::PointStore> store_;
  WriteSink sink_;
  FakeTarget drive_;
  FakeTarget pumps_;
  asio::io_context io_;
  ModbusLinks links_{{nullptr, &drive_, &pumps_}, nullptr};
  KeptWire wire_;
  std::optional<ServerShared> shared_;
  std::vector<std::shared_ptr<ClientRequests>> services_;
};

}  // namespace baudgate::modbus
