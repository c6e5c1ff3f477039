// A gateway for the Modbus fuzz targets, with points of every type, values of every kind, and
// routes to slaves of different behaviour; and checks of its answers.
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
/// A time at which some values are young, some are old, and some were never read.
Instant ModbusNow();

/// Accepts, refuses or stores writes, as `turn` (set from the input) chooses.
class FuzzSink final : public bus::CommandSink {
 public:
  bool Submit(bus::WriteCommand command) override;

  std::uint8_t turn = 0;
  std::deque<bus::WriteCommand> kept;  ///< stored writes, not answered yet
};

/// Accepts, refuses or stores routed requests, as `turn` (set from the input) chooses.
class FuzzTarget final : public bus::RouteTarget {
 public:
  bool Submit(bus::RoutedRequest request) override;
  void Abandon(std::uint64_t client) override;
  void AnswerKept(Outcome outcome);

  std::uint8_t turn = 0;
  std::deque<bus::RoutedRequest> kept;
};

/// Checks that `answer` is a whole frame that answers `request`: the same ids and function, or an
/// exception, and the length that it declares.
void CheckModbusAnswer(View request, View answer);

}  // namespace baudgate::fuzz
