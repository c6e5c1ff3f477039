// What the control socket answers: one request line in, one answer line out. Knows nothing of
// sockets; gateway/control/control_session.h carries the lines. docs/status.md has the requests.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <string_view>

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
  std::string text;  ///< one line of JSON without its end
  std::optional<TraceWish> trace{};
};

/// {"error":"usage","message":"…"}; the kinds are usage, unknown and busy.
std::string ErrorLine(std::string_view kind, std::string_view message);

/// {"record":"…"}: a record of a trace as it travels.
std::string RecordLine(const TraceRecord& record);
bool Wanted(const TraceWish& wish, const TraceRecord& record);

class RequestHandler {
 public:
  /// All references outlive the service.
  RequestHandler(const config::Config& config, const PointStore& store, LineControl& control,
                 GatewayInfo info);

  Reply Answer(std::string_view request, Now now);
  LineControl& control() { return control_; }

 private:
  Reply Dispatch(const Json& request, Now now);
  Reply Settings(const Json& request, Now now) const;
  Reply Release(const Json& request, Now now);
  Reply TakeBack(const Json& request);
  Reply SetInUse(const Json& request, bool in_use);
  Reply Trace(const Json& request, bool recorded);
  Result<Target> TargetOf(const Json& request) const;
  /// A line as a whole.
  Result<Target> LineOf(const Json& request) const;
  Result<Target> DeviceOf(const Json& request) const;

  const config::Config& config_;
  const PointStore& store_;
  LineControl& control_;
  const GatewayInfo info_;
};

}  // namespace baudgate::control
