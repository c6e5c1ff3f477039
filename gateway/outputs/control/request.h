// `Request` is a request of the control socket, `Gateway` contains the parts of the gateway that
// requests use, and `Reply` is the answer to a request. ReloadService carries out the requests
// `reload`, `confirm` and `revert`.
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

inline constexpr std::string_view kUsage = "usage";
inline constexpr std::string_view kUnknown = "unknown";
inline constexpr std::string_view kUnavailable = "unavailable";
inline constexpr std::string_view kDenied = "denied";
inline constexpr std::string_view kNoEvents =
    "this gateway records no events: add 'events: {}' to its configuration for all devices whose "
    "profiles describe events, or 'events: on' at one device";

inline status::Json ErrorJson(std::string_view kind, std::string_view message) {
  return {{"error", kind}, {"message", message}};
}

inline std::string TextOf(const status::Json& request, const char* key) {
  const auto found = request.find(key);
  return found != request.end() && found->is_string() ? found->get<std::string>() : std::string();
}

inline std::optional<std::int64_t> NumberOf(const status::Json& request, const char* key) {
  const auto found = request.find(key);
  if (found == request.end() || !found->is_number_integer()) return std::nullopt;
  return found->get<std::int64_t>();
}

/// Returns the time of member `key`, which is in ms since 1970. The value is limited to the range
/// of WallTime.
inline std::optional<WallTime> TimeOf(const status::Json& request, const char* key) {
  const auto time = NumberOf(request, key);
  if (!time) return std::nullopt;
  constexpr std::int64_t kMost = std::numeric_limits<std::int64_t>::max() / 1'000'000;
  return WallTime(std::chrono::milliseconds(std::clamp(*time, -kMost, kMost)));
}

// The requests `reload`, `confirm` and `revert`. The client gets its answer when the reload has
// ended, with or without success. gateway/daemon/reloader.h carries them out.
//
//   {"command":"reload","dry_run":false,"confirm_ms":60000}
//   {"ok":true,"applied":true,"changes":["line bay-1: restarts; changed: poll of feeder-1"],
//    "warnings":[],"text":"1 line restarted; 3 lines untouched"}
//   {"ok":false,"exit":2,"text":"…baudgate.yaml:7:3: …"}
//
struct ReloadAsk {
  bool dry_run = false;
  Duration confirm{};  ///< time to confirm the reload; zero: no confirmation is needed
  std::string by;      ///< the client, e.g. "user:anna"
  /// `applied` of the configuration that the person has seen in the status, for `confirm` and
  /// `revert`. If another configuration is on trial now, nothing is done. Empty: any configuration.
  std::string applied{};
};

struct ReloadAnswer {
  bool ok = false;
  bool applied = false;
  /// Exit code of `baudgate reload`: 2: faulty file; 4: the reload cannot be done.
  int exit_code = 0;
  std::vector<std::string> changes;  ///< one sentence for each change
  /// Warnings about the configuration file, e.g. "…baudgate.yaml:7:3: warning: …".
  std::vector<std::string> warnings{};
  std::string text;
  Duration confirm{};  ///< zero: no confirmation is needed; else the time that is left for it
};

class ReloadService {
 public:
  using Answered = std::function<void(const ReloadAnswer&)>;
  virtual ~ReloadService() = default;
  /// Carries out a reload. Any thread may call it; `answered` is called once, on any thread.
  virtual void Reload(const ReloadAsk& ask, Answered answered) = 0;
  /// Confirms the last reload, so that it is not rolled back. Any thread may call it; `answered` is
  /// called once, on any thread.
  virtual void Confirm(const ReloadAsk& ask, Answered answered) = 0;
  /// Takes back a configuration on trial before its time is over. Any thread may call it;
  /// `answered` is called once, on any thread.
  virtual void Revert(const ReloadAsk& ask, Answered answered) = 0;
};

/// The request for a trace of line `line`: after the answer, the client gets the line's records
/// (gateway/records/trace/trace_text.h) until it disconnects.
struct TraceWish {
  std::uint32_t line = 0;
  /// Only records of this device and of the line itself are sent; empty: all records.
  std::string device;
};

struct Reply {
  std::string text;  ///< one line of JSON without its line end; empty: the answer comes later
  std::optional<TraceWish> trace{};
  /// The answer that is sent if `text` is empty and the disk has not answered within Limits::disk.
  /// `late` empty: the session is closed without an answer after Limits::patience.
  std::string late{};
};

/// The parts of the gateway that requests use. A request holds its Gateway until it is answered; a
/// reload creates a new Gateway without waiting for requests. References and pointers must outlive
/// all requests.
struct Gateway {
  std::shared_ptr<const config::Config> config;
  const bus::PointStore& store;
  lines::LineControl& control;
  bus::CommandSink& sink;
  status::GatewayInfo info;
  PointRequests& points;
  ReloadService* reload = nullptr;  ///< null: the gateway does not support reloads
};

struct Request {
  const status::Json& json;
  const bus::Writer& client;
  Now now;
  /// Takes the answer of a request that is answered later, on any thread.
  std::function<void(const status::Json&)> later;
};

/// Returns the JSON in one line. Bytes that are not UTF-8 (e.g. from a device) are replaced.
inline std::string OneLine(const status::Json& json) {
  return json.dump(-1, ' ', false, status::Json::error_handler_t::replace);
}

inline std::string ErrorLine(std::string_view kind, std::string_view message) {
  return OneLine(ErrorJson(kind, message));
}

inline Reply Refused(std::string_view kind, std::string_view message) {
  return {ErrorLine(kind, message)};
}

}  // namespace baudgate::control
