// Which clients have shown the token: browsers by the random number in their cookie, programs by
// the token itself with each request. A client that shows a wrong one too often must wait. Any
// thread; time is an argument.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <deque>
#include <map>
#include <optional>
#include <string>
#include <string_view>

#include "gateway/base/guarded.h"
#include "gateway/base/time.h"
#include "gateway/outputs/web/request.h"

namespace baudgate::web {

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

}  // namespace baudgate::web
