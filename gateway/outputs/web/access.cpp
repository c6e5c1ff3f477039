// SPDX-License-Identifier: Apache-2.0
#include "gateway/outputs/web/access.h"

#include <utility>

#include "gateway/base/log.h"
#include "gateway/base/text.h"
#include "gateway/outputs/status/status_json.h"
#include "gateway/outputs/web/front_door.h"

namespace baudgate::web {
namespace {

using control::Json;

constexpr std::string_view kLogin = "/login";
constexpr std::string_view kLogout = "/logout";
constexpr std::string_view kSession = "/api/v1/session";

bool IsPost(std::string_view path) {
  return path == kLogin || path == kLogout || path == Access::kAcknowledge;
}

/// "a%20b+c" of a form.
std::string Unescaped(std::string_view text) {
  std::string plain;
  for (std::size_t i = 0; i < text.size(); ++i) {
    const auto digit = [&](std::size_t at) {
      const char c = at < text.size() ? text[at] : 'x';
      if (c >= '0' && c <= '9') return c - '0';
      const int letter = (c | 0x20) - 'a';
      return letter >= 0 && letter < 6 ? letter + 10 : -1;
    };
    if (text[i] == '+') {
      plain += ' ';
    } else if (text[i] == '%' && digit(i + 1) >= 0 && digit(i + 2) >= 0) {
      plain += static_cast<char>(digit(i + 1) * 16 + digit(i + 2));
      i += 2;
    } else {
      plain += text[i];
    }
  }
  return plain;
}

/// The token in a form or in JSON; empty: there is none.
std::string TokenOf(const Request& request) {
  const Json json = Json::parse(request.body, nullptr, false);
  if (json.is_object()) {
    const auto found = json.find("token");
    return found != json.end() && found->is_string() ? found->get<std::string>() : std::string();
  }
  for (const std::string_view part : Split(request.body, '&')) {
    if (part.starts_with("token=")) return Unescaped(Trim(part.substr(6)));
  }
  return {};
}

Response Empty(int status) {
  Response response;
  response.status = status;
  return response;
}

Response WaitAMinute() {
  Response response = Problem(429, "too many wrong tokens from this address; wait a minute");
  response.headers.emplace_back("Retry-After", "60");
  return response;
}

}  // namespace

std::shared_ptr<const config::Web> Access::web() const {
  const MutexLock lock(mutex_);
  return web_;
}

void Access::Set(const config::Config& config, std::optional<std::string> token) {
  logins_.SetToken(std::move(token));
  const MutexLock lock(mutex_);
  web_ = std::make_shared<const config::Web>(config.web);
  gateway_ = config.name;
}

void Access::SetHistory(bool kept) {
  const MutexLock lock(mutex_);
  history_ = kept;
}

std::optional<Response> Access::Refuse(const Request& request, Instant now) {
  if (auto refused = Refusal(*web(), request)) return refused;
  const std::string_view method = IsPost(request.path) ? "POST" : "GET";
  if (request.method != method) {
    Response wrong = Problem(405, std::string(method) + " is the method of " + request.path);
    wrong.headers.emplace_back("Allow", method);
    return wrong;
  }
  if (request.path == kLogin) return std::nullopt;
  return NeedsLogin(request, now);
}

/// The files of the page have no data, and are there for the login.
std::optional<Response> Access::NeedsLogin(const Request& request, Instant now) {
  const bool open =
      !request.path.starts_with("/api/") && request.path != "/metrics" && request.path != kLogout;
  if (open || request.path == kSession) return std::nullopt;
  switch (logins_.Check(request, now)) {
    case Logins::Verdict::yes:
      return std::nullopt;
    case Logins::Verdict::wait:
      return WaitAMinute();
    case Logins::Verdict::no:
      break;
  }
  Response response = Problem(401, "log in with the token of this gateway");
  response.headers.emplace_back("WWW-Authenticate", "Bearer");
  return response;
}

std::optional<Response> Access::Answer(const Request& request, Instant now) {
  if (request.path == kSession) return Session(request, now);
  if (request.path == kLogin) return Login(request, now);
  if (request.path == kLogout) return Logout(request);
  if (request.path == kAcknowledge) return MayNotAcknowledge(request);
  return std::nullopt;
}

std::optional<Response> Access::MayNotAcknowledge(const Request& request) const {
  const auto its = web();
  if (web::MayAcknowledge(*its, request)) return std::nullopt;
  return Problem(403, its->acknowledge ? "alarms are acknowledged from this machine, or by TLS "
                                         "through a proxy that web.allow names"
                                       : "alarms cannot be acknowledged here; see web.acknowledge");
}

Response Access::Session(const Request& request, Instant now) {
  const bool in = logins_.Check(request, now) == Logins::Verdict::yes;
  Json json = {{"needs_token", logins_.NeedsToken()},
               {"logged_in", in},
               {"acknowledge", MayAcknowledge(*web(), request)}};
  const bool events = events_ != nullptr && !events_->state().in_memory;
  const MutexLock lock(mutex_);
  json["gateway"] = gateway_;
  json["version"] = in ? version_ : "";  // others need not know it
  json["history"] = history_;
  json["events"] = events;
  return TextResponse(200, kJson, json.dump());
}

Response Access::Login(const Request& request, Instant now) {
  const auto opened = logins_.Open(request, TokenOf(request), CameByTls(*web(), request), now);
  if (opened.verdict == Logins::Verdict::wait) return WaitAMinute();
  if (opened.verdict == Logins::Verdict::no) {
    log::Warn("web: a wrong token from {}", request.peer);
    return Problem(401, "that is not the token of this gateway");
  }
  Response response = Empty(204);
  if (!opened.cookie.empty()) response.headers.emplace_back("Set-Cookie", opened.cookie);
  return response;
}

Response Access::Logout(const Request& request) {
  Response response = Empty(204);
  response.headers.emplace_back("Set-Cookie", logins_.Close(request));
  return response;
}

}  // namespace baudgate::web
