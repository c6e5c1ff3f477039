// A gateway for the Modbus fuzz targets, with all kinds of points and slaves.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <deque>
#include <map>

#include "config/model/config.h"
#include "gateway/bus/points/point_store.h"
#include "gateway/bus/writes/route_queue.h"
#include "gateway/bus/writes/write_command.h"
#include "gateway/outputs/modbus/service/client_requests.h"

namespace baudgate::fuzz {

const config::Config& ModbusConfig();
bus::PointStore& FilledStore();
Instant ModbusNow();

class FuzzSink final : public bus::CommandSink {
 public:
  bool Submit(bus::WriteCommand command) override;

  std::uint8_t turn = 0;
  std::deque<bus::WriteCommand> kept;
};

class FuzzTarget final : public bus::RouteTarget {
 public:
  bool Submit(bus::RoutedRequest request) override;
  void Abandon(std::uint64_t client) override;
  void AnswerKept(Outcome outcome);

  std::uint8_t turn = 0;
  std::deque<bus::RoutedRequest> kept;
};

void CheckModbusAnswer(View request, View answer);

}  // namespace baudgate::fuzz
