// What the Modbus server is joined with beside store and command sink: the composition root hands
// it to gateway/outputs/modbus/server/modbus_server.h.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <vector>

#include "gateway/bus/writes/routed.h"
#include "gateway/outputs/modbus/service/routed_report.h"
#include "gateway/outputs/modbus/wire/frames.h"
#include "gateway/records/audit/write_log.h"
#include "gateway/records/events/event_feed.h"
#include "gateway/records/events/event_source.h"

namespace baudgate::modbus {

/// What routes and RTU clients need beside the store; all of it outlives the server.
struct ModbusLinks {
  std::vector<RouteTarget*> lines;  ///< by index in config.lines; empty when no route leads to one
  Frames frames{};                  ///< of clients that speak as on a serial line
  audit::WriteLog* writes = nullptr;  ///< of routed writes; null: they are not recorded
  std::shared_ptr<const events::EventFeed> events{};  ///< null: none are kept
  events::EventSource* alarms = nullptr;              ///< to be acknowledged; null: likewise
  OnRoutedReport routed{};                            ///< may be null
};

}  // namespace baudgate::modbus
