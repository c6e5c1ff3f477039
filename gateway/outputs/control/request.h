// One request of the control socket: what it is answered from, and its answer.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

#include "gateway/lines/line_control.h"
#include "gateway/outputs/control/point_requests.h"
#include "gateway/outputs/control/reload_requests.h"
#include "gateway/outputs/control/request_text.h"
#include "gateway/outputs/status/status_json.h"

namespace baudgate::control {

/// After its answer a trace goes on with the records of this line, until the client leaves.
struct TraceWish {
  std::uint32_t line = 0;
  std::string device;  ///< only its records, and those that concern no device; empty: all
};

struct Reply {
  std::string text;  ///< one line of JSON without its end; empty: it comes later
  std::optional<TraceWish> trace{};
  /// The answer if the later one does not come in time. Empty: the client waits on.
  std::string late{};
};

/// The parts of the gateway that requests use, as they are now. A request has it until it is
/// answered: a reload makes another one, and waits for nobody. What it does not share outlives the
/// requests.
struct Gateway {
  std::shared_ptr<const config::Config> config;
  const PointStore& store;
  LineControl& control;
  CommandSink& sink;
  GatewayInfo info;
  PointRequests& points;
  ReloadService* reload = nullptr;  ///< null: nothing is reloaded
};

struct Request {
  const Json& json;
  const Writer& client;
  Now now;
  /// Takes an answer that does not come at once, on any thread.
  std::function<void(const Json&)> later;
};

/// Bytes of a device may stand in a reason: what is no UTF-8 is replaced.
inline std::string OneLine(const Json& json) {
  return json.dump(-1, ' ', false, Json::error_handler_t::replace);
}

/// {"error":"usage","message":"…"}; the kinds are usage, unknown, busy and unavailable.
inline std::string ErrorLine(std::string_view kind, std::string_view message) {
  return OneLine(ErrorJson(kind, message));
}

inline Reply Refused(std::string_view kind, std::string_view message) {
  return {ErrorLine(kind, message)};
}

}  // namespace baudgate::control
