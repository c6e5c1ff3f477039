// `Logins` knows who is logged in: browsers by the random number in their cookie, programs by the
// token in each request. Valid tokens are the token of web.token, and those of users. A host with
// too many wrong tokens or passwords is told to wait, and so is every host if all together have
// sent too many. A right token is accepted even then, so nobody can lock its owner out; a password
// is not, because it can be guessed. Any thread may call it; the time is an argument.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <deque>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "gateway/base/guarded.h"
#include "gateway/base/role.h"
#include "gateway/base/time.h"
#include "gateway/outputs/users/user_file.h"
#include "gateway/outputs/web/request.h"

namespace baudgate::web {

/// Returns the token in the header Authorization; nothing: the request has none.
std::optional<std::string> BearerOf(const Request& request);

class Logins {
 public:
  static constexpr Duration kSession = 12h;
  /// A session without a request for this time ends.
  static constexpr Duration kIdle = 30min;
  static constexpr Duration kWindow = 1min;
  static constexpr std::size_t kMostFailures =
      5;  ///< wrong tokens and passwords of one host in kWindow
  static constexpr std::size_t kMostGuesses = 100;  ///< wrong tokens and passwords of all hosts
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

}  // namespace baudgate::web
