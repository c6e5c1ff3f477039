// What the Modbus server is joined with beside store and command sink: the composition root hands
// it to gateway/outputs/modbus/server/modbus_server.h. RoutedReport is the result of a request that
// was passed on.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <vector>

#include "config/model/outputs.h"
#include "gateway/base/time.h"
#include "gateway/bus/writes/route_queue.h"
#include "gateway/outputs/modbus/service/traffic_book.h"
#include "gateway/outputs/modbus/wire/client_framing.h"
#include "gateway/records/audit/write_log.h"
#include "gateway/records/events/event_feed.h"
#include "gateway/records/events/event_source.h"

namespace baudgate::modbus {

// The result of a request that was passed on: for the part that raises alarms of slaves that do not
// answer their clients (gateway/records/event_path.h).
struct RoutedReport {
  const config::Route& route;
  std::uint8_t unit = 0;  ///< as the client asked for it
  RouteOutcome end = RouteOutcome::no_reply;
  const RoutedReply& reply;
};

/// On the server's thread; returns at once.
using OnRoutedReport = std::function<void(const RoutedReport& end, Now now)>;

/// What routes, RTU clients, events and alarms need beside the store; all of it outlives the
/// server.
struct ModbusLinks {
  std::vector<RouteTarget*> lines;  ///< by index in config.lines; empty when no route leads to one
  Frames frames{};                  ///< of clients that speak as on a serial line
  /// Of routed writes and acknowledgements; null: they are not recorded.
  audit::WriteLog* writes = nullptr;
  std::shared_ptr<const events::EventFeed> events{};  ///< null: none are kept
  events::EventSource* alarms = nullptr;              ///< to be acknowledged; null: likewise
  OnRoutedReport routed{};                            ///< may be null
};

}  // namespace baudgate::modbus
