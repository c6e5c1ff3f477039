// What the control socket answers: one request line in, one answer line out. Knows nothing of
// sockets; gateway/control/control_session.h carries the lines. docs/status.md has the requests.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <string_view>

#include "gateway/control/history_requests.h"
#include "gateway/control/point_requests.h"
#include "gateway/control/reload_requests.h"
#include "gateway/requests/line_control.h"
#include "gateway/status/status_json.h"

namespace baudgate::control {

/// The longest time that a port is lent; longer needs a second call.
inline constexpr Duration kMostRelease = 24h;

/// After its answer a trace goes on with the records of this line, until the client leaves.
struct TraceWish {
  std::uint32_t line = 0;
  std::string device;  ///< only its records, and those that concern no device; empty: all
};

struct Reply {
  std::string text;  ///< one line of JSON without its end; empty: it comes later
  std::optional<TraceWish> trace{};
};

/// {"error":"usage","message":"…"}; the kinds are usage, unknown, busy and unavailable.
std::string ErrorLine(std::string_view kind, std::string_view message);

/// {"record":"…"}: a record of a trace as it travels.
std::string RecordLine(const TraceRecord& record);
bool Wanted(const TraceWish& wish, const TraceRecord& record);

class RequestHandler {
 public:
  /// All references outlive the service.
  RequestHandler(const config::Config& config, const PointStore& store, LineControl& control,
                 CommandSink& sink, GatewayInfo info);

  /// Takes an answer that did not come at once, on any thread.
  using Later = std::function<void(std::string text)>;
  Reply Answer(std::string_view request, const Writer& client, Now now, const Later& later);
  void Forget(const Writer& client) { points_.Forget(client); }
  LineControl& control() { return control_; }
  /// It outlives this; without it nothing is reloaded.
  void SetReload(ReloadService& service) { reload_ = &service; }
  /// A reload: what can be named, by the numbers of the store.
  void Apply(const config::Config& config, const history::HistorySource* history) {
    config_ = &config;
    info_.history = history;
    points_.Apply(config);
  }

 private:
  Reply Dispatch(const Json& request, const Writer& client, Now now, const Later& later);
  Reply Settings(const Json& request, Now now) const;
  Reply Release(const Json& request, Now now);
  Reply TakeBack(const Json& request);
  Reply SetInUse(const Json& request, bool in_use);
  Reply Trace(const Json& request, bool recorded);
  Reply Writes(const Json& request);
  Reply Events(const Json& request);
  Reply Alarms(const Json& request);
  Reply Acknowledge(const Json& request, const Writer& client,
                    const std::function<void(const Json&)>& answered);
  Reply Reload(const Json& request, const Writer& client, bool confirm,
               const std::function<void(const Json&)>& answered);
  /// On the disk.
  bool KeepsEvents() const;
  KeptValues Kept() const {
    return {*config_, info_.history, KeepsEvents() ? info_.events : nullptr};
  }
  Result<Target> TargetOf(const Json& request) const;
  /// A line as a whole.
  Result<Target> LineOf(const Json& request) const;
  Result<Target> DeviceOf(const Json& request) const;

  const config::Config* config_;
  const PointStore& store_;
  LineControl& control_;
  CommandSink& sink_;
  GatewayInfo info_;
  PointRequests points_;
  ReloadService* reload_ = nullptr;
};

}  // namespace baudgate::control
