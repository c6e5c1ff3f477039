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
#include <vector>

#include "config/model/config.h"
#include "config/model/outputs.h"
#include "gateway/base/guarded.h"
#include "gateway/base/result.h"
#include "gateway/base/time.h"
#include "gateway/outputs/users/user_file.h"
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

// `Logins` knows who is logged in: browsers by the random number in their cookie, programs by the
// token in each request. Tokens are the one of web.token, and those of users. A host with too many
// wrong tokens or passwords is told to wait, and so is every host if all together have sent too
// many. A right token is accepted even then, so nobody can lock its owner out; a password is not,
// because it can be guessed. Any thread may call it; the time is an argument.
class Logins {
 public:
  static constexpr Duration kSession = 12h;
  /// A session without a request for this time ends.
  static constexpr Duration kIdle = 30min;
  static constexpr Duration kWindow = 1min;
  static constexpr std::size_t kMostFailures = 5;   ///< wrong tokens of one host in kWindow
  static constexpr std::size_t kMostGuesses = 100;  ///< wrong tokens of all hosts in kWindow
  static constexpr std::size_t kMostSessions = 256;
  static constexpr std::size_t kMostOfUser = 16;  ///< sessions of one user

  /// `port` is part of the cookie's name, because browsers send the cookies of a machine to all its
  /// ports.
  explicit Logins(std::uint16_t port) : cookie_("baudgate-" + std::to_string(port)) {}

  /// Sets the token of web.token; a changed token ends its sessions. Nothing: there is no such
  /// token.
  void SetToken(std::optional<std::string> token);
  users::UserDirectory& users() { return users_; }
  /// True if clients must log in: web.token or users are configured.
  bool NeedsLogin() const;

  enum class Verdict : std::uint8_t { yes, no, wait };
  struct Who {
    Verdict verdict = Verdict::no;
    std::string user{};          ///< empty: the client has the token of web.token, or needs none
    std::optional<Role> role{};  ///< empty as `user`
  };
  /// Checks the cookie or the bearer token. A request without both gets "no", but does not count as
  /// a failure. `counts`: the request counts as activity of its session.
  Who Check(const Request& request, const Now& now, bool counts = true);
  struct Opened {
    Verdict verdict = Verdict::no;
    std::string cookie{};  ///< value for the header Set-Cookie
  };
  /// Opens a session if `token` is right. `secure`: the browser must send the cookie only by TLS.
  Opened Open(const Request& request, std::string_view token, bool secure, const Now& now);
  /// Opens a session of a user. Takes about a tenth of a second (HasHash).
  Opened OpenOf(const Request& request, const std::string& user, const std::string& password,
                bool secure, const Now& now);
  /// Ends the session of the request.
  struct Closed {
    bool was_open = false;
    std::string cookie;  ///< value of Set-Cookie that deletes the cookie
  };
  Closed Close(const Request& request);

  struct Shown {
    std::string id;    ///< names the session for End; does not open it
    std::string user;  ///< empty: the token of web.token
    std::optional<Role> role{};
    std::string from;
    WallTime since{};
    WallTime last{};
  };
  /// Returns the sessions that have not ended.
  std::vector<Shown> Sessions(const Now& now);
  /// Ends the session with this id. False: there is none.
  bool End(const std::string& id);

 private:
  struct Session {
    users::UserDirectory::Login login;  // without a user: the token of web.token
    std::string from;
    Now since{};
    Now last{};

    bool IsOver(Instant now) const {
      return now - since.instant >= kSession || now - last.instant >= kIdle;
    }
  };
  struct Failure {
    std::uint64_t host = 0;
    Instant at{};
  };

  std::optional<std::string> SessionOf(const Request& request) const;
  /// True if the host of the client must wait before its next guess.
  bool MustWait(const std::string& client, Instant now) BAUDGATE_REQUIRES(mutex_);
  Verdict NoteFailure(const std::string& client, Instant now) BAUDGATE_REQUIRES(mutex_);
  /// `login`: set to how the user of the token has logged in; may be null.
  Who ByToken(const std::string& client, std::string_view token, const Now& now,
              users::UserDirectory::Login* login = nullptr);
  Opened Begin(const Request& request, users::UserDirectory::Login login, bool secure,
               const Now& now) BAUDGATE_REQUIRES(mutex_);

  const std::string cookie_;
  users::UserDirectory users_;
  mutable Mutex mutex_;
  std::optional<std::string> token_ BAUDGATE_GUARDED_BY(mutex_);
  /// Key: the random number in the cookie.
  std::map<std::string, Session> sessions_ BAUDGATE_GUARDED_BY(mutex_);
  /// The wrong tokens and passwords of the last kWindow, the oldest first; at most kMostGuesses.
  std::deque<Failure> failures_ BAUDGATE_GUARDED_BY(mutex_);
};

class Access {
 public:
  static constexpr std::string_view kAcknowledge = "/api/v1/alarms/ack";
  static constexpr std::string_view kWrite = "/api/v1/write";

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
  Response Session(const Request& request);
  Response Sessions(const Request& request, const Now& now);
  Response EndSession(const Request& request, const Now& now);
  Response Login(const Request& request, const Now& now);
  Response Logout(const Request& request, const Now& now);
  /// Records what a client did, in the security journal or in the log.
  void Note(const char* kind, const std::string& who, const Request& request,
            const std::string& what, const std::string& result, const Now& now) const;
  std::optional<Response> MayNotAcknowledge(const Request& request) const;
  std::optional<Response> MayNotWrite(const Request& request) const;
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
