// `Access` decides which requests are accepted, by address, method and login. It answers requests
// for login, session and logout. Any thread may call it. `ReadToken` reads the token, and
// `IsAllowed` checks the address.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

#include "config/model/config.h"
#include "config/model/outputs.h"
#include "gateway/base/guarded.h"
#include "gateway/base/result.h"
#include "gateway/base/time.h"
#include "gateway/outputs/web/logins.h"
#include "gateway/outputs/web/request.h"
#include "gateway/records/audit/security_journal.h"
#include "gateway/records/events/event_source.h"

namespace baudgate::web {

/// Returns the first line of the file: the token that HTTP clients must send. An error if the file
/// cannot be read, other users can read it (it needs mode 0600), or the token is too short or too
/// long; the error contains the remedy.
Result<std::string> ReadToken(const std::string& file);

// Refusal decides before any login, by the client's address and by the Origin and Host headers of a
// browser. It prevents a web page of another site (DNS rebinding), or of another port of this
// machine, from sending requests through a browser inside the network.

/// Returns the answer that refuses the request; nothing: the request is accepted.
std::optional<Response> Refusal(const config::Web& web, const Request& request);

bool IsLoopbackPeer(const std::string& peer);
/// Returns the address of the client that a proxy of web.proxies names in X-Forwarded-For: the last
/// address of the list that is no such proxy. Empty: no trusted proxy names a client.
std::string ForwardedFor(const config::Web& web, const Request& request);
/// True if web.allow contains the address or is empty.
bool IsAllowed(const config::Web& web, const std::string& peer);

/// True if nobody in the network can read the request: it came from this machine, or by TLS through
/// a proxy that runs on this machine or is listed in web.proxies.
bool IsPrivate(const config::Web& web, const Request& request);

/// True if a client without a user may acknowledge alarms: web.acknowledge is on, and the request
/// is private.
bool MayAcknowledge(const config::Web& web, const Request& request);

/// A request by which a user operates the gateway. It is carried out as a command of the control
/// socket (gateway/outputs/control).
struct Operation {
  std::string_view path;
  Act act;
  std::string_view may;      ///< the word for it in `may` of /api/v1/session
  std::string_view command;  ///< name of the command
  /// The member of the body that names the device or line; empty: the body is empty.
  std::string_view member{};
};
inline constexpr std::array<Operation, 6> kOperations = {{
    {"/api/v1/write", Act::operate, "write", "write", "point"},
    {"/api/v1/devices/disable", Act::operate, "disable", "disable", "device"},
    {"/api/v1/devices/enable", Act::operate, "disable", "enable", "device"},
    {"/api/v1/lines/release", Act::operate, "release", "take_back", "line"},
    {"/api/v1/reload/confirm", Act::configure, "confirm", "confirm"},
    {"/api/v1/reload/revert", Act::configure, "confirm", "revert"},
}};
/// Returns null if the path is none of kOperations.
const Operation* OperationAt(std::string_view path);

class Access {
 public:
  static constexpr std::string_view kAcknowledge = "/api/v1/alarms/ack";

  /// `journal` must outlive this object; null: logins are only in the log.
  /// `events` must outlive this object; null: no events are recorded. `version` is that of the
  /// gateway.
  Access(std::uint16_t port, std::string version, const events::EventSource* events,
         audit::SecurityJournal* journal = nullptr)
      : version_(std::move(version)), events_(events), journal_(journal), logins_(port) {}

  void Set(const config::Config& config, std::optional<std::string> token);
  void SetHistory(bool kept);

  /// Returns Request::forwarded_for of the request.
  std::string ClientBehind(const Request& request) const { return ForwardedFor(*web(), request); }
  std::optional<Response> Refuse(const Request& request, const Now& now);
  /// Sets logged_in, user and role of the request. Must be called before Answer.
  void WhoAsks(Request& request, const Now& now);
  /// True if the login of a request that is still being answered, such as a stream, is still valid.
  bool MayGoOn(const Request& request, const Now& now);
  /// True if the request is a login with a password, so Answer takes a tenth of a second.
  static bool IsSlow(const Request& request);
  /// Answers requests for login, logout and session, and acknowledgements that are not allowed.
  /// Returns nothing if another part must answer the request.
  std::optional<Response> Answer(const Request& request, const Now& now);

 private:
  std::shared_ptr<const config::Web> web() const;
  std::optional<Response> NeedsLogin(const Request& request, const Now& now);
  Response NeedsRole(const Request& request, Act act) const;
  Response Denied(const Request& request, const std::string& why) const;
  Response Session(const Request& request);
  Response Sessions(const Request& request, const Now& now);
  Response EndSession(const Request& request, const Now& now);
  Response Login(const Request& request, const Now& now);
  Response Logout(const Request& request, const Now& now);
  /// Records what a client did, in the security journal or in the log.
  void Note(const char* kind, const std::string& who, const Request& request,
            const std::string& what, const std::string& result, const Now& now) const;
  std::optional<Response> MayNotAcknowledge(const Request& request) const;
  std::optional<Response> MayNot(const Request& request, Act act) const;
  bool MayDo(const Request& request, Act act) const;
  bool MayOperate(const Request& request, bool everybody) const;

  const std::string version_;
  const events::EventSource* const events_;
  audit::SecurityJournal* const journal_;
  Logins logins_;
  mutable Mutex mutex_;
  std::shared_ptr<const config::Web> web_ BAUDGATE_GUARDED_BY(mutex_);
  std::string gateway_ BAUDGATE_GUARDED_BY(mutex_);
  bool history_ BAUDGATE_GUARDED_BY(mutex_) = false;
};

}  // namespace baudgate::web
