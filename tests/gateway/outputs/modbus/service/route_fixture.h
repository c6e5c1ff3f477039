// The server of tests/gateway/outputs/modbus/server/server_fixture.h, with routes to the lines
// "drive" and "pumps".
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "protocols/modbus/protocol.h"
#include "tests/gateway/outputs/modbus/server/server_fixture.h"
#include "tests/gateway/outputs/modbus/service/fake_target.h"

namespace baudgate::modbus {

class RouteTest : public ServerTest {
 protected:
  RouteTest() {
    AddRoutedLines(config_);
    links_.lines = {nullptr, &drive_, &pumps_};
    links_.frames.rtu = &protocols::ModbusRtuProtocol();
  }
  ~RouteTest() override { StopServer(); }

  config::Route& Add(std::size_t line, std::uint8_t first, std::uint8_t last) {
    config::Route& route = config_.modbus.routes.emplace_back(RouteTo(config_, line, first, last));
    route.deadline = 1h;
    return route;
  }

  /// Answers like a slave with the value N in holding register N.
  static bus::RoutedReply Count(const bus::RoutedRequest& request) {
    const ByteReader pdu(request.pdu);
    const std::size_t start = pdu.U16Be(1).value_or(0);
    const std::size_t count = pdu.U16Be(3).value_or(0);
    Bytes reply = {request.pdu[0], static_cast<std::uint8_t>(count * 2)};
    for (std::size_t i = start; i < start + count; ++i) {
      reply.push_back(static_cast<std::uint8_t>(i >> 8));
      reply.push_back(static_cast<std::uint8_t>(i));
    }
    return GoodReply(std::move(reply));
  }

  FakeTarget drive_;
  FakeTarget pumps_;
};

}  // namespace baudgate::modbus
