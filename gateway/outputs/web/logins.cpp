// SPDX-License-Identifier: Apache-2.0
#include "gateway/outputs/web/logins.h"

#include <sys/random.h>

#include <algorithm>
#include <array>

#include "gateway/base/spelling.h"
#include "gateway/base/text.h"

namespace baudgate::web {
namespace {

/// 128 random bits as hex.
std::string NewSession() {
  std::array<std::uint8_t, 16> bytes{};
  std::size_t have = 0;
  while (have < bytes.size()) {
    const ssize_t got = ::getrandom(bytes.data() + have, bytes.size() - have, 0);
    if (got > 0) have += static_cast<std::size_t>(got);
  }
  std::string text;
  for (const std::uint8_t byte : bytes) text += HexByte(byte);
  return text;
}

/// In a time that says nothing of where they differ.
bool SameSecret(std::string_view a, std::string_view b) {
  unsigned different = a.size() == b.size() ? 0 : 1;
  for (std::size_t i = 0; i < a.size(); ++i) {
    const char other = b.empty() ? '\0' : b[i % b.size()];
    different |=
        static_cast<unsigned>(static_cast<unsigned char>(a[i]) ^ static_cast<unsigned char>(other));
  }
  return different == 0;
}

/// "Bearer abc": nothing where it is anything else.
std::optional<std::string> BearerOf(const Request& request) {
  const auto header = request.Header("authorization");
  if (!header || header->size() < 7 || config::Lower(header->substr(0, 7)) != "bearer ") {
    return std::nullopt;
  }
  return std::string(Trim(std::string_view(*header).substr(7)));
}

}  // namespace

void Logins::SetToken(std::optional<std::string> token) {
  const MutexLock lock(mutex_);
  if (token_ != token) sessions_.clear();
  token_ = std::move(token);
}

bool Logins::NeedsToken() const {
  const MutexLock lock(mutex_);
  return token_.has_value();
}

std::optional<std::string> Logins::SessionOf(const Request& request) const {
  const auto header = request.Header("cookie");
  if (!header) return std::nullopt;
  for (const std::string_view part : Split(*header, ';')) {
    const std::string_view cookie = Trim(part);
    const std::size_t equals = cookie.find('=');
    if (equals == std::string_view::npos || cookie.substr(0, equals) != cookie_) continue;
    return std::string(cookie.substr(equals + 1));
  }
  return std::nullopt;
}

bool Logins::MustWait(const std::string& peer, Instant now) {
  const auto found = failures_.find(peer);
  if (found == failures_.end()) return false;
  std::deque<Instant>& times = found->second;
  while (!times.empty() && now - times.front() >= kWindow) times.pop_front();
  const bool wait = times.size() >= kMostFailures;
  if (times.empty()) failures_.erase(found);
  return wait;
}

void Logins::NoteFailure(const std::string& peer, Instant now) {
  if (failures_.size() >= kMostAddresses && !failures_.contains(peer)) {
    const auto oldest = std::ranges::min_element(
        failures_, {}, [](const auto& entry) { return entry.second.back(); });
    failures_.erase(oldest);
  }
  failures_[peer].push_back(now);
}

Logins::Verdict Logins::Judge(const std::string& peer, std::string_view shown, Instant now) {
  if (MustWait(peer, now)) return Verdict::wait;
  if (SameSecret(shown, *token_)) return Verdict::yes;
  NoteFailure(peer, now);
  return Verdict::no;
}

Logins::Verdict Logins::Check(const Request& request, Instant now) {
  const MutexLock lock(mutex_);
  if (!token_) return Verdict::yes;
  if (const auto bearer = BearerOf(request)) return Judge(request.peer, *bearer, now);
  const auto session = SessionOf(request);
  if (!session) return Verdict::no;
  const auto found = sessions_.find(*session);
  return found != sessions_.end() && now < found->second ? Verdict::yes : Verdict::no;
}

Logins::Opened Logins::Open(const Request& request, std::string_view token, bool secure,
                            Instant now) {
  const MutexLock lock(mutex_);
  if (!token_) return {Verdict::yes, {}};
  const Verdict verdict = Judge(request.peer, token, now);
  if (verdict != Verdict::yes) return {verdict, {}};
  std::erase_if(sessions_, [now](const auto& entry) { return now >= entry.second; });
  if (sessions_.size() >= kMostSessions) {
    sessions_.erase(
        std::ranges::min_element(sessions_, {}, [](const auto& entry) { return entry.second; }));
  }
  const std::string session = NewSession();
  sessions_[session] = now + kSession;
  return {Verdict::yes, cookie_ + "=" + session + "; HttpOnly; SameSite=Strict; Max-Age=" +
                            std::to_string(kSession / 1s) + (secure ? "; Secure" : "")};
}

std::string Logins::Close(const Request& request) {
  const MutexLock lock(mutex_);
  if (const auto session = SessionOf(request)) sessions_.erase(*session);
  return cookie_ + "=; HttpOnly; SameSite=Strict; Max-Age=0";
}

}  // namespace baudgate::web
