// `Access` decides which requests are let in, by address, method and login, and handles login,
// session and logout. May be called on any thread. `ReadToken` reads the token, `IsAllowed` checks
// the address, and `Logins` contains the sessions.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <deque>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

#include "config/model/config.h"
#include "config/model/outputs.h"
#include "gateway/base/guarded.h"
#include "gateway/base/result.h"
#include "gateway/base/time.h"
#include "gateway/outputs/web/request.h"
#include "gateway/records/events/event_source.h"

namespace baudgate::web {

/// Returns the first line of the file: the token that HTTP clients must send. The error contains
/// the remedy: the file cannot be read, others may read it too (it needs mode 0600), the token is
/// too short, …
Result<std::string> ReadToken(const std::string& file);

// Refusal decides before any login, by the client's address and by the Origin and Host headers of a
// browser. It protects a browser inside the network from being used by a page from outside (DNS
// rebinding), or by a page on another port of this machine. Pure.

/// Returns the answer that refuses the request; empty: the request is let in.
std::optional<Response> Refusal(const config::Web& web, const Request& request);

bool IsLoopbackPeer(const std::string& peer);
/// True if web.allow contains the address, or is empty.
bool IsAllowed(const config::Web& web, const std::string& peer);

/// True if this request may acknowledge alarms: web.acknowledge is on, and the connection cannot be
/// listened to. Such connections are local ones, and TLS up to a proxy that is listed in `allow` or
/// runs on this machine.
bool MayAcknowledge(const config::Web& web, const Request& request);

// `Logins` remembers which clients have sent the token: browsers by the random number in their
// cookie, programs by the token in each request. An address with too many wrong tokens must wait.
// May be called on any thread; time is an argument.
class Logins {
 public:
  static constexpr Duration kSession = 12h;
  static constexpr Duration kWindow = 1min;
  static constexpr std::size_t kMostFailures = 5;  ///< of one address in kWindow
  static constexpr std::size_t kMostSessions = 256;
  static constexpr std::size_t kMostAddresses = 1024;

  /// `port` is a part of the cookie's name, because browsers send the cookies of a machine to all
  /// its ports.
  explicit Logins(std::uint16_t port) : cookie_("baudgate-" + std::to_string(port)) {}

  /// Sets the token; another token ends all sessions. Empty: no login is needed.
  void SetToken(std::optional<std::string> token);
  bool NeedsToken() const;

  enum class Verdict : std::uint8_t { yes, no, wait };
  /// Checks the cookie or the bearer token. A request without either gets "no" and counts as no
  /// failure.
  Verdict Check(const Request& request, Instant now);
  struct Opened {
    Verdict verdict = Verdict::no;
    std::string cookie{};  ///< the value of Set-Cookie
  };
  /// Opens a session if `token` is right. `secure`: the browser may send the cookie by TLS only.
  Opened Open(const Request& request, std::string_view token, bool secure, Instant now);
  /// Ends the session of the request. Returns the value of Set-Cookie that removes the cookie.
  std::string Close(const Request& request);

 private:
  std::optional<std::string> SessionOf(const Request& request) const;
  bool MustWait(const std::string& peer, Instant now) BAUDGATE_REQUIRES(mutex_);
  void NoteFailure(const std::string& peer, Instant now) BAUDGATE_REQUIRES(mutex_);
  Verdict Judge(const std::string& peer, std::string_view shown, Instant now)
      BAUDGATE_REQUIRES(mutex_);

  const std::string cookie_;
  mutable Mutex mutex_;
  std::optional<std::string> token_ BAUDGATE_GUARDED_BY(mutex_);
  std::map<std::string, Instant> sessions_ BAUDGATE_GUARDED_BY(mutex_);  ///< session and its end
  std::map<std::string, std::deque<Instant>> failures_ BAUDGATE_GUARDED_BY(mutex_);
};

class Access {
 public:
  static constexpr std::string_view kAcknowledge = "/api/v1/alarms/ack";

  /// `events` must outlive this object; null: no events are recorded. `version`: of the gateway.
  Access(std::uint16_t port, std::string version, const events::EventSource* events)
      : version_(std::move(version)), events_(events), logins_(port) {}

  /// An empty `token`: no login is needed.
  void Set(const config::Config& config, std::optional<std::string> token);
  void SetHistory(bool kept);

  /// Returns the answer that refuses the request; empty: the request is let in.
  std::optional<Response> Refuse(const Request& request, Instant now);
  /// Answers requests for login, logout, session and a refused acknowledgement; empty: the request
  /// is for another part.
  std::optional<Response> Answer(const Request& request, Instant now);

 private:
  std::shared_ptr<const config::Web> web() const;
  std::optional<Response> NeedsLogin(const Request& request, Instant now);
  Response Session(const Request& request, Instant now);
  Response Login(const Request& request, Instant now);
  Response Logout(const Request& request);
  std::optional<Response> MayNotAcknowledge(const Request& request) const;

  const std::string version_;
  const events::EventSource* const events_;
  Logins logins_;
  mutable Mutex mutex_;
  std::shared_ptr<const config::Web> web_ BAUDGATE_GUARDED_BY(mutex_);
  std::string gateway_ BAUDGATE_GUARDED_BY(mutex_);
  bool history_ BAUDGATE_GUARDED_BY(mutex_) = false;
};

}  // namespace baudgate::web
