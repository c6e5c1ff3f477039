// Who may come in: by address, method and login; and the login itself, its session and its end.
// Any thread. ReadToken reads the token, IsAllowed judges the address, and Logins keeps the
// sessions.
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

// The file with the token that clients must show by HTTP.

/// Its first line. The error says what to do: it cannot be read, others may read it too (it needs
/// mode 0600), the token is too short, …
Result<std::string> ReadToken(const std::string& file);

// Which requests are let in before any login: by the client's address, and by the Origin and Host
// that a browser sends. A browser inside the network must not be led by a page from outside
// (DNS rebinding), nor by another port of the same machine. Pure.

/// Why not; empty: it may.
std::optional<Response> Refusal(const config::Web& web, const Request& request);

bool IsLoopbackPeer(const std::string& peer);
/// With an empty list everybody.
bool IsAllowed(const config::Web& web, const std::string& peer);

/// Alarms may be acknowledged: in the configuration, and on a way that cannot be listened to. That
/// is this machine, or TLS up to a proxy that is named in `allow` or stands here.
bool MayAcknowledge(const config::Web& web, const Request& request);

// Which clients have shown the token: browsers by the random number in their cookie, programs by
// the token itself with each request. A client that shows a wrong one too often must wait. Any
// thread; time is an argument.
class Logins {
 public:
  static constexpr Duration kSession = 12h;
  static constexpr Duration kWindow = 1min;
  static constexpr std::size_t kMostFailures = 5;  ///< of one address in a window
  static constexpr std::size_t kMostSessions = 256;
  static constexpr std::size_t kMostAddresses = 1024;

  /// `port`: cookies are the same for all ports of a machine, so their names differ.
  explicit Logins(std::uint16_t port) : cookie_("baudgate-" + std::to_string(port)) {}

  /// Another token ends all sessions; empty: none is needed.
  void SetToken(std::optional<std::string> token);
  bool NeedsToken() const;

  enum class Verdict : std::uint8_t { yes, no, wait };
  /// By cookie or bearer. A request without either is "no", and no failure.
  Verdict Check(const Request& request, Instant now);
  struct Opened {
    Verdict verdict = Verdict::no;
    std::string cookie{};  ///< the value of Set-Cookie
  };
  /// `secure`: the browser sends it by TLS only.
  Opened Open(const Request& request, std::string_view token, bool secure, Instant now);
  /// The value of Set-Cookie that ends it.
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
  std::map<std::string, Instant> sessions_ BAUDGATE_GUARDED_BY(mutex_);  ///< until when
  std::map<std::string, std::deque<Instant>> failures_ BAUDGATE_GUARDED_BY(mutex_);
};

class Access {
 public:
  static constexpr std::string_view kAcknowledge = "/api/v1/alarms/ack";

  /// `events` outlives it; null: none are kept. `version`: of the gateway.
  Access(std::uint16_t port, std::string version, const events::EventSource* events)
      : version_(std::move(version)), events_(events), logins_(port) {}

  /// `token` empty: no login.
  void Set(const config::Config& config, std::optional<std::string> token);
  void SetHistory(bool kept);

  /// Why the request is not let in; empty: it is.
  std::optional<Response> Refuse(const Request& request, Instant now);
  /// Login, its session and its end; empty: the request is for something else.
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
