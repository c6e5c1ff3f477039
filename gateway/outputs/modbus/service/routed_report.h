// The result of a request that was passed on: for the part that raises alarms of slaves that do not
// answer their clients (gateway/daemon/alarm_service.h).
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <functional>

#include "config/model/route.h"
#include "gateway/base/time.h"
#include "gateway/bus/writes/routed.h"
#include "gateway/outputs/modbus/service/traffic_book.h"

namespace baudgate::modbus {

struct RoutedReport {
  const config::Route& route;
  std::uint8_t unit = 0;  ///< as the client asked for it
  RouteOutcome end = RouteOutcome::no_reply;
  const RoutedReply& reply;
};

/// On the server's thread; returns at once.
using OnRoutedReport = std::function<void(const RoutedReport& end, Now now)>;

}  // namespace baudgate::modbus
