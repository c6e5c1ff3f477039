// One request of the control socket: what it is answered from, and its answer. ReloadService
// answers the requests `reload` and `confirm`.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstdint>
#include <functional>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "gateway/base/time.h"
#include "gateway/lines/line_control.h"
#include "gateway/outputs/control/point_requests.h"
#include "gateway/outputs/status/status_json.h"

namespace baudgate::control {

// Members of a request, and how one is refused.

// Why a request is refused.
inline constexpr std::string_view kUsage = "usage";
inline constexpr std::string_view kUnknown = "unknown";
inline constexpr std::string_view kUnavailable = "unavailable";
inline constexpr std::string_view kNoEvents =
    "no device of this gateway is asked for events: write 'events: {}' into its configuration, for "
    "all whose profiles say what their events mean, or 'events: on' at one device";

inline status::Json ErrorJson(std::string_view kind, std::string_view message) {
  return {{"error", kind}, {"message", message}};
}

/// What is no text, or not there, is empty.
inline std::string TextOf(const status::Json& request, const char* key) {
  const auto found = request.find(key);
  return found != request.end() && found->is_string() ? found->get<std::string>() : std::string();
}

/// Nothing where it is absent, or no whole number.
inline std::optional<std::int64_t> NumberOf(const status::Json& request, const char* key) {
  const auto found = request.find(key);
  if (found == request.end() || !found->is_number_integer()) return std::nullopt;
  return found->get<std::int64_t>();
}

inline std::optional<WallTime> TimeOf(const status::Json& request, const char* key) {
  const auto time = NumberOf(request, key);
  if (!time) return std::nullopt;
  constexpr std::int64_t kMost = std::numeric_limits<std::int64_t>::max() / 1'000'000;
  return WallTime(std::chrono::milliseconds(std::clamp(*time, -kMost, kMost)));
}

// The requests `reload` and `confirm` of the control socket: who asks is answered when the reload
// has ended, well or not. Implemented by gateway/daemon/reloader.h.
//
//   {"command":"reload","dry_run":false,"confirm_ms":60000}
//   {"ok":true,"applied":true,"changes":["line bay-1: begins anew: poll of feeder-1"],
//    "warnings":[],"text":"1 line begun anew; 3 lines untouched"}
//   {"ok":false,"exit":2,"text":"…baudgate.yaml:7:3: …"}
//
struct ReloadAsk {
  bool dry_run = false;
  Duration confirm{};  ///< zero: it needs no confirmation
  std::string by;      ///< "user:anna"
};

struct ReloadAnswer {
  bool ok = false;
  bool applied = false;                 ///< something is another than before
  int exit_code = 0;                    ///< of the command: 2: a bad file, 4: it cannot be had
  std::vector<std::string> changes;     ///< one sentence each
  std::vector<std::string> warnings{};  ///< of the file: "…baudgate.yaml:7:3: warning: …"
  std::string text;                     ///< one or more lines
  Duration confirm{};                   ///< time left for it; zero: it needs none
};

class ReloadService {
 public:
  using Answered = std::function<void(const ReloadAnswer&)>;
  virtual ~ReloadService() = default;
  /// From any thread; `answered` once, on any thread.
  virtual void Reload(const ReloadAsk& ask, Answered answered) = 0;
  /// What was applied stays.
  virtual void Confirm(const std::string& by, Answered answered) = 0;
};

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
  const bus::PointStore& store;
  lines::LineControl& control;
  bus::CommandSink& sink;
  status::GatewayInfo info;
  PointRequests& points;
  ReloadService* reload = nullptr;  ///< null: nothing is reloaded
};

struct Request {
  const status::Json& json;
  const bus::Writer& client;
  Now now;
  /// Takes an answer that does not come at once, on any thread.
  std::function<void(const status::Json&)> later;
};

/// Bytes of a device may stand in a reason: what is no UTF-8 is replaced.
inline std::string OneLine(const status::Json& json) {
  return json.dump(-1, ' ', false, status::Json::error_handler_t::replace);
}

/// {"error":"usage","message":"…"}; the kinds are usage, unknown, busy and unavailable.
inline std::string ErrorLine(std::string_view kind, std::string_view message) {
  return OneLine(ErrorJson(kind, message));
}

inline Reply Refused(std::string_view kind, std::string_view message) {
  return {ErrorLine(kind, message)};
}

}  // namespace baudgate::control
