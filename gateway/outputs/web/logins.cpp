// SPDX-License-Identifier: Apache-2.0
#include "gateway/outputs/web/logins.h"

#include <algorithm>
#include <tuple>
#include <utility>

#include "gateway/base/fair_places.h"
#include "gateway/base/secrets.h"
#include "gateway/base/text.h"

namespace baudgate::web {

std::optional<std::string> BearerOf(const Request& request) {
  const auto header = request.Header("authorization");
  if (!header || header->size() < 7 || Lower(header->substr(0, 7)) != "bearer ") {
    return std::nullopt;
  }
  return std::string(Trim(std::string_view(*header).substr(7)));
}

void Logins::SetToken(std::optional<std::string> token) {
  const MutexLock lock(mutex_);
  if (token_ != token) {
    std::erase_if(sessions_, [](const auto& entry) { return entry.second.login.user.empty(); });
  }
  token_ = std::move(token);
}

bool Logins::NeedsLogin() const {
  const MutexLock lock(mutex_);
  return token_.has_value() || users_.is_used();
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

bool Logins::MustWait(const std::string& client, Instant now) {
  while (!failures_.empty() && now - failures_.front().at >= kWindow) failures_.pop_front();
  const std::uint64_t host = HostNumberOf(client);
  const auto own = static_cast<std::size_t>(std::ranges::count(failures_, host, &Failure::host));
  return own >= kMostFailures || failures_.size() >= kMostGuesses;
}

Logins::Verdict Logins::NoteFailure(const std::string& client, Instant now) {
  if (MustWait(client, now)) return Verdict::wait;
  failures_.push_back({HostNumberOf(client), now});
  return Verdict::no;
}

Logins::Who Logins::ByToken(const std::string& client, std::string_view token, const Now& now,
                            users::UserDirectory::Login* login) {
  if (const auto known = users_.ByToken(token, now)) {
    if (login != nullptr) *login = known->login;
    return {Verdict::yes, known->user.name, known->user.role};
  }
  const MutexLock lock(mutex_);
  if (token_ && SameSecret(token, *token_)) return {Verdict::yes};
  return {NoteFailure(client, now.instant)};
}

Logins::Who Logins::Check(const Request& request, const Now& now, bool counts) {
  if (!NeedsLogin()) return {Verdict::yes};
  if (const auto bearer = BearerOf(request)) return ByToken(request.client(), *bearer, now);
  const auto number = SessionOf(request);
  if (!number) return {};
  users::UserDirectory::Login login;
  {
    const MutexLock lock(mutex_);
    const auto found = sessions_.find(*number);
    if (found == sessions_.end() || found->second.IsOver(now.instant)) return {};
    login = found->second.login;
  }
  std::optional<Role> role;
  const bool holds = login.user.empty() || (role = users_.RoleOf(login, now)).has_value();
  const MutexLock lock(mutex_);
  const auto found = sessions_.find(*number);
  if (found == sessions_.end()) return {};
  if (!holds) {
    sessions_.erase(found);  // so that a new user of the same name does not get the session
    return {};
  }
  if (counts) found->second.last = now;
  return {Verdict::yes, login.user, role};
}

Logins::Opened Logins::Begin(const Request& request, users::UserDirectory::Login login, bool secure,
                             const Now& now) {
  constexpr std::size_t kRandomBytes = 16;
  std::erase_if(sessions_, [&](const auto& entry) { return entry.second.IsOver(now.instant); });
  std::map<std::string, std::size_t> of_user;
  for (const auto& [number, session] : sessions_) ++of_user[session.login.user];
  const bool full = sessions_.size() >= kMostSessions;
  if (full || of_user[login.user] >= kMostOfUser) {
    // The longest idle session of this user ends, or of the user with the most sessions.
    const auto rank = [&](const auto& entry) {
      const std::string& user = entry.second.login.user;
      const bool own = user == login.user && of_user[user] >= kMostOfUser;
      return std::tuple(!own, -static_cast<long>(of_user[user]), entry.second.last.instant);
    };
    sessions_.erase(std::ranges::min_element(sessions_, {}, rank));
  }
  const std::string session = RandomHex(kRandomBytes);
  sessions_[session] = {std::move(login), request.client(), now, now};
  return {Verdict::yes, cookie_ + "=" + session + "; HttpOnly; SameSite=Strict; Max-Age=" +
                            std::to_string(kSession / 1s) + (secure ? "; Secure" : "")};
}

Logins::Opened Logins::Open(const Request& request, std::string_view token, bool secure,
                            const Now& now) {
  if (!NeedsLogin()) return {Verdict::yes, {}};
  users::UserDirectory::Login login;
  const Who who = ByToken(request.client(), token, now, &login);
  if (who.verdict != Verdict::yes) return {who.verdict, {}};
  const MutexLock lock(mutex_);
  return Begin(request, std::move(login), secure, now);
}

Logins::Opened Logins::OpenOf(const Request& request, const std::string& user,
                              const std::string& password, bool secure, const Now& now) {
  {
    const MutexLock lock(mutex_);
    if (MustWait(request.client(), now.instant)) return {Verdict::wait, {}};
  }
  const auto known = users_.ByPassword(user, password, now.instant);
  const MutexLock lock(mutex_);
  if (!known) return {NoteFailure(request.client(), now.instant), {}};
  return Begin(request, known->login, secure, now);
}

Logins::Closed Logins::Close(const Request& request) {
  const MutexLock lock(mutex_);
  const auto session = SessionOf(request);
  return {session && sessions_.erase(*session) > 0,
          cookie_ + "=; HttpOnly; SameSite=Strict; Max-Age=0"};
}

namespace {

std::string IdOf(const std::string& session) { return Sha256Hex(session).substr(0, 16); }

}  // namespace

std::vector<Logins::Shown> Logins::Sessions(const Now& now) {
  std::vector<std::pair<std::string, Session>> all;
  {
    const MutexLock lock(mutex_);
    all.assign(sessions_.begin(), sessions_.end());
  }
  std::vector<Shown> shown;
  for (const auto& [number, session] : all) {
    const auto role = users_.RoleOf(session.login, now);
    const bool holds = session.login.user.empty() || role;
    if (session.IsOver(now.instant) || !holds) continue;
    shown.push_back({IdOf(number), session.login.user, role, session.from, session.since.wall,
                     session.last.wall});
  }
  return shown;
}

bool Logins::End(const std::string& id) {
  const MutexLock lock(mutex_);
  return std::erase_if(sessions_, [&](const auto& entry) { return IdOf(entry.first) == id; }) > 0;
}

}  // namespace baudgate::web
