// A gateway for the Modbus targets: devices with points of every type, table and access, values of
// every kind, lines that answer writes at once, routes to slaves of all tempers, and the promises
// that every answer keeps.
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

/// Kept for ever.
const config::Config& ModbusConfig();
bus::PointStore& FilledStore();
/// Between the values' times: some are young, some old, some were never read.
Instant ModbusNow();

/// Takes, refuses or keeps writes, by turns that the input sets.
class FuzzSink final : public bus::CommandSink {
 public:
  bool Submit(bus::WriteCommand command) override;

  std::uint8_t turn = 0;
  std::deque<bus::WriteCommand> kept;  ///< not answered yet
};

/// Takes, refuses or keeps routed requests, by turns that the input sets.
class FuzzTarget final : public bus::RouteTarget {
 public:
  bool Submit(bus::RoutedRequest request) override;
  void Abandon(std::uint64_t client) override;
  /// Answers the oldest request that was kept.
  void AnswerKept(Outcome outcome);

  std::uint8_t turn = 0;
  std::deque<bus::RoutedRequest> kept;
};

/// `answer` is a whole frame that answers `request`: the same ids and function, or an exception,
/// and as long as it says.
void CheckModbusAnswer(View request, View answer);

}  // namespace baudgate::fuzz
