// `Access` decides which requests are accepted, by address, method and login. It answers requests
// for login, session and logout. Any thread may call it. `ReadToken` reads the token, `IsAllowed`
// checks the address, and `Logins` contains the sessions.
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

/// True if this request may acknowledge alarms: web.acknowledge is on, and nobody can listen to the
/// connection. This is the case for connections from this machine, and for TLS up to a proxy that
/// runs on this machine or is listed in web.proxies.
bool MayAcknowledge(const config::Web& web, const Request& request);

// `Logins` stores which clients have sent the token: browsers by the random number in their cookie,
// programs by the token in each request. A host with too many wrong tokens is told to wait, and so
// is every host if all together have sent too many. The right token is accepted even then, so
// nobody can lock its owner out. Any thread may call it; the time is an argument.
class Logins {
 public:
  static constexpr Duration kSession = 12h;
  static constexpr Duration kWindow = 1min;
  static constexpr std::size_t kMostFailures = 5;   ///< wrong tokens of one host in kWindow
  static constexpr std::size_t kMostGuesses = 100;  ///< wrong tokens of all hosts in kWindow
  static constexpr std::size_t kMostSessions = 256;

  /// `port` is part of the cookie's name, because browsers send the cookies of a machine to all its
  /// ports.
  explicit Logins(std::uint16_t port) : cookie_("baudgate-" + std::to_string(port)) {}

  /// Sets the token; a changed token ends all sessions. Nothing: no login is needed.
  void SetToken(std::optional<std::string> token);
  bool NeedsToken() const;

  enum class Verdict : std::uint8_t { yes, no, wait };
  /// Checks the cookie or the bearer token. A request without both gets "no", but does not count as
  /// a failure.
  Verdict Check(const Request& request, Instant now);
  struct Opened {
    Verdict verdict = Verdict::no;
    std::string cookie{};  ///< value for the header Set-Cookie
  };
  /// Opens a session if `token` is right. `secure`: the browser must send the cookie only by TLS.
  Opened Open(const Request& request, std::string_view token, bool secure, Instant now);
  /// Ends the session of the request. Returns the value of Set-Cookie that deletes the cookie.
  std::string Close(const Request& request);

 private:
  std::optional<std::string> SessionOf(const Request& request) const;
  Verdict Judge(const std::string& client, std::string_view shown, Instant now)
      BAUDGATE_REQUIRES(mutex_);

  const std::string cookie_;
  mutable Mutex mutex_;
  std::optional<std::string> token_ BAUDGATE_GUARDED_BY(mutex_);
  /// The end time of each session, by the random number of its cookie.
  std::map<std::string, Instant> sessions_ BAUDGATE_GUARDED_BY(mutex_);
  struct Failure {
    std::uint64_t host = 0;
    Instant at{};
  };
  /// The wrong tokens of the last kWindow, the oldest first; at most kMostGuesses.
  std::deque<Failure> failures_ BAUDGATE_GUARDED_BY(mutex_);
};

class Access {
 public:
  static constexpr std::string_view kAcknowledge = "/api/v1/alarms/ack";

  /// `events` must outlive this object; null: no events are recorded. `version` is that of the
  /// gateway.
  Access(std::uint16_t port, std::string version, const events::EventSource* events)
      : version_(std::move(version)), events_(events), logins_(port) {}

  void Set(const config::Config& config, std::optional<std::string> token);
  void SetHistory(bool kept);

  /// Returns Request::forwarded_for of the request.
  std::string ClientBehind(const Request& request) const { return ForwardedFor(*web(), request); }
  std::optional<Response> Refuse(const Request& request, Instant now);
  /// Answers requests for login, logout and session, and acknowledgements that are not allowed.
  /// Returns nothing if another part must answer the request.
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
