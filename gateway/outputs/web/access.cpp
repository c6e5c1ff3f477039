// SPDX-License-Identifier: Apache-2.0
#include "gateway/outputs/web/access.h"

#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <utility>

#include "gateway/base/fair_places.h"
#include "gateway/base/log.h"
#include "gateway/base/secret_file.h"
#include "gateway/base/text.h"
#include "gateway/outputs/status/status_json.h"
#include "gateway/outputs/status/value_json.h"

namespace baudgate::web {
namespace {

constexpr std::size_t kShortestToken = 16;

/// Returns the path of a file or of a credential (config::kCredentials). An error: systemd has
/// passed no credentials.
Result<std::string> PathOf(const std::string& file) {
  if (!file.starts_with(config::kCredentials)) return file;
  const std::string credential = file.substr(config::kCredentials.size());
  const char* const folder = std::getenv("CREDENTIALS_DIRECTORY");
  if (folder != nullptr) return std::string(folder) + "/" + credential;
  return Error{"systemd has passed no credential '" + credential +
               "'; add it to the service: LoadCredential=" + credential +
               ":/etc/baudgate/web.token"};
}

}  // namespace

Result<std::string> ReadToken(const std::string& configured) {
  const auto path = PathOf(configured);
  if (!path) return Error{path.error()};
  const std::string& file = *path;
  const bool is_credential = file != configured;
  const std::string name = "the token file " + file;
  auto token = ReadSecretFile("the token file", file, is_credential);
  if (!token && ::access(file.c_str(), F_OK) != 0) {
    return Error{token.error() + "; create it with: install -m 0600 -o baudgate /dev/null " + file +
                 " && openssl rand -hex 32 > " + file};
  }
  if (!token) return token;
  if (token->size() < kShortestToken) {
    return Error{name + " contains a token of " + std::to_string(token->size()) +
                 " characters; its first line needs at least " + std::to_string(kShortestToken) +
                 ", as openssl rand -hex 32 makes them"};
  }
  const auto fits = [](char c) { return c > 0x20 && c < 0x7F; };
  if (!std::ranges::all_of(*token, fits)) {
    return Error{name +
                 " contains a token with spaces or other characters that no header can carry"};
  }
  return token;
}

namespace {

/// Returns the name or address in a Host header without the port: "gate:8502" → "gate",
/// "[::1]:8502" → "::1". Empty: the port is invalid or a bracket is missing.
std::string NameOf(std::string_view host) {
  std::string_view name = host.substr(0, host.find(':'));
  std::string_view port = host.substr(name.size());
  if (host.starts_with('[')) {
    const std::size_t end = host.find(']');
    if (end == std::string_view::npos) return {};
    name = host.substr(1, end - 1);
    port = host.substr(end + 1);
  }
  const auto digit = [](char c) { return c >= '0' && c <= '9'; };
  if (port.starts_with(':')) port.remove_prefix(1);
  if (port.size() > 5 || !std::ranges::all_of(port, digit)) return {};
  return std::string(name);
}

/// True if the Host header is allowed: a name of web.hosts, "localhost" from this machine, or the
/// IP address to which the client has connected or on which the server listens. The port of an
/// address does not matter, because ports can be forwarded; DNS rebinding needs a name.
bool IsOurs(const config::Web& web, const Request& request, const std::string& host) {
  const std::string name = NameOf(host);
  if (name.empty()) return false;
  const auto listed = [&](const std::string& one) { return one == host || one == name; };
  if (std::ranges::any_of(web.hosts, listed)) return true;
  if (config::IsIpAddress(name)) {
    return config::Canonical(name) == config::Canonical(request.local) ||
           config::Canonical(name) == config::Canonical(web.listen.host);
  }
  return name == "localhost" && IsLoopbackPeer(request.peer);
}

/// True if the browser opens the page itself. A link on any site may open the page, because the
/// page contains no data.
bool OpensAPage(const Request& request) {
  return request.method == "GET" && request.Header("sec-fetch-mode") == "navigate" &&
         request.Header("sec-fetch-dest") == "document" && !request.path.starts_with("/api/") &&
         request.path != "/metrics";
}

bool IsSameOrigin(const std::string& origin, const std::string& host) {
  for (const std::string_view scheme : {"http://", "https://"}) {
    if (origin.starts_with(scheme)) return Lower(origin.substr(scheme.size())) == host;
  }
  return false;
}

bool Has(const std::vector<config::Network>& networks, const std::string& address) {
  if (!config::IsIpAddress(address)) return false;
  const config::Network reach = config::ReachOf(address);
  return std::ranges::any_of(
      networks, [&](const config::Network& network) { return config::Covers(network, reach); });
}

/// True if the request came by TLS, also if only a trusted proxy reports it. Trusted are proxies on
/// this machine and those of web.proxies.
bool CameByTls(const config::Web& web, const Request& request) {
  if (request.tls) return true;
  const bool proxy = IsLoopbackPeer(request.peer) || Has(web.proxies, request.peer);
  return proxy && Lower(request.Header("x-forwarded-proto").value_or("")) == "https";
}

}  // namespace

bool IsLoopbackPeer(const std::string& peer) {
  return config::IsIpAddress(peer) && config::IsLoopback(config::ReachOf(peer));
}

bool IsAllowed(const config::Web& web, const std::string& peer) {
  return web.allow.empty() || Has(web.allow, peer);
}

std::string ForwardedFor(const config::Web& web, const Request& request) {
  if (!Has(web.proxies, request.peer)) return {};
  const std::string list = request.Header("x-forwarded-for").value_or("");
  const auto addresses = Split(list, ',');
  for (std::size_t i = addresses.size(); i-- > 0;) {
    const std::string address = AddressIn(Trim(addresses[i]));  // some proxies add the port
    if (!config::IsIpAddress(address)) return {};
    if (!Has(web.proxies, address)) return address;
  }
  return {};
}

std::optional<Response> Refusal(const config::Web& web, const Request& request) {
  if (!IsAllowed(web, request.peer)) {
    return Problem(403, request.peer + " is not in web.allow of this gateway");
  }
  const std::string host = Lower(request.Header("host").value_or(""));
  if (!IsOurs(web, request, host)) {
    return Problem(421, "this gateway does not accept the host name " + Quoted(host) +
                            "; add the name to web.hosts of its configuration");
  }
  const auto origin = request.Header("origin");
  if (origin && !IsSameOrigin(*origin, host)) {
    return Problem(403,
                   "a page from " + Quoted(*origin) + " may not send requests to this gateway");
  }
  const auto site = request.Header("sec-fetch-site");
  if (site && *site != "same-origin" && *site != "none" && !OpensAPage(request)) {
    return Problem(403, "a page of another site may not send requests to this gateway");
  }
  return std::nullopt;
}

bool IsPrivate(const config::Web& web, const Request& request) {
  const bool forwarded = request.Header("x-forwarded-proto") || request.Header("x-forwarded-for") ||
                         request.Header("forwarded");
  return CameByTls(web, request) || (IsLoopbackPeer(request.peer) && !forwarded);
}

bool MayAcknowledge(const config::Web& web, const Request& request) {
  return web.acknowledge && IsPrivate(web, request);
}

namespace {

using status::Json;

constexpr std::string_view kLogin = "/login";
constexpr std::string_view kLogout = "/logout";
constexpr std::string_view kSession = "/api/v1/session";
constexpr std::string_view kSessions = "/api/v1/sessions";
constexpr std::string_view kWrites = "/api/v1/writes";
constexpr std::string_view kEndSession = "/api/v1/sessions/end";

bool IsPost(std::string_view path) {
  return path == kLogin || path == kLogout || path == Access::kAcknowledge || path == kEndSession ||
         OperationAt(path) != nullptr;
}

bool MayAudit(const Request& request) { return request.role && May(*request.role, Act::audit); }

/// Decodes a value of an HTML form, e.g. "a%20b+c".
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

/// Returns a field of the request's body, which is a form or JSON; empty: there is no such field.
std::string FieldOf(const Request& request, const std::string& name) {
  const auto json = status::ParseJson(request.body);
  if (!json) return {};
  if (json->is_object()) {
    const auto found = json->find(name);
    return found != json->end() && found->is_string() ? found->get<std::string>() : std::string();
  }
  for (const std::string_view part : Split(request.body, '&')) {
    if (part.starts_with(name + "=")) return Unescaped(Trim(part.substr(name.size() + 1)));
  }
  return {};
}

Response Empty(int status) {
  Response response;
  response.status = status;
  return response;
}

Response WaitAMinute() {
  Response response = Problem(429, "too many wrong tokens or passwords; wait a minute");
  response.headers.emplace_back("Retry-After", "60");
  return response;
}

}  // namespace

const Operation* OperationAt(std::string_view path) {
  const auto found = std::ranges::find(kOperations, path, &Operation::path);
  return found == kOperations.end() ? nullptr : &*found;
}

std::shared_ptr<const config::Web> Access::web() const {
  const MutexLock lock(mutex_);
  return web_;
}

void Access::Set(const config::Config& config, std::optional<std::string> token) {
  logins_.SetToken(std::move(token));
  logins_.users().SetFile(config.users.file);
  const MutexLock lock(mutex_);
  web_ = std::make_shared<const config::Web>(config.web);
  gateway_ = config.name;
}

void Access::SetHistory(bool kept) {
  const MutexLock lock(mutex_);
  history_ = kept;
}

std::optional<Response> Access::Refuse(const Request& request, const Now& now) {
  const auto its = web();
  if (auto refused = Refusal(*its, request)) {
    if (IsAllowed(*its, request.peer)) {
      const Json problem = Json::parse(refused->body, nullptr, false);
      Note("denied", "unknown", request, request.path, problem.value("detail", ""), now);
    }
    return refused;
  }
  if (journal_ != nullptr) journal_->NoteHost(request.client(), "web " + its->Address(), now.wall);
  const std::string_view method = IsPost(request.path) ? "POST" : "GET";
  if (request.method != method) {
    Response wrong = Problem(405, request.path + " needs the method " + std::string(method));
    wrong.headers.emplace_back("Allow", method);
    return wrong;
  }
  if (request.path == kLogin) return std::nullopt;
  return NeedsLogin(request, now);
}

Response Access::NeedsRole(const Request& request, Act act) const {
  const std::string who = request.user.empty() ? "this client" : request.user;
  const std::string has = request.role ? " has the role " + std::string(Name(*request.role))
                                       : " is not logged in as a user";
  const std::string why =
      who + has + "; " + request.path + " needs the role " + std::string(Name(NeededFor(act)));
  return Denied(request, why);
}

/// Refuses an act, and records the refusal.
Response Access::Denied(const Request& request, const std::string& why) const {
  Note("denied", request.user, request, request.path, why, ReadClocks());
  return Problem(403, why);
}

bool Access::MayGoOn(const Request& request, const Now& now) {
  return logins_.Check(request, now, false).verdict == Logins::Verdict::yes;
}

/// Returns an error if the request needs a login that it does not have. The files of the page need
/// no login, because they contain no data and are needed for the login.
std::optional<Response> Access::NeedsLogin(const Request& request, const Now& now) {
  const bool open =
      !request.path.starts_with("/api/") && request.path != "/metrics" && request.path != kLogout;
  if (open || request.path == kSession) return std::nullopt;
  switch (logins_.Check(request, now).verdict) {
    case Logins::Verdict::yes:
      return std::nullopt;
    case Logins::Verdict::wait:
      return WaitAMinute();
    case Logins::Verdict::no:
      break;
  }
  if (BearerOf(request)) Note("login", {}, request, request.path, "wrong token", now);
  Response response = Problem(401, "log in as a user or with the token of this gateway");
  response.headers.emplace_back("WWW-Authenticate", "Bearer");
  return response;
}

void Access::WhoAsks(Request& request, const Now& now) {
  Logins::Who who = logins_.Check(request, now, false);
  request.logged_in = who.verdict == Logins::Verdict::yes;
  request.user = std::move(who.user);
  request.role = who.role;
}

bool Access::IsSlow(const Request& request) {
  return request.path == kLogin && !FieldOf(request, "user").empty();
}

std::optional<Response> Access::Answer(const Request& request, const Now& now) {
  if (request.path == kSession) return Session(request);
  if (request.path == kSessions) return Sessions(request, now);
  if (request.path == kWrites && !MayAudit(request)) return NeedsRole(request, Act::audit);
  if (request.path == kEndSession) return EndSession(request, now);
  if (request.path == kLogin) return Login(request, now);
  if (request.path == kLogout) return Logout(request, now);
  if (request.path == kAcknowledge) return MayNotAcknowledge(request);
  if (const Operation* const its = OperationAt(request.path)) return MayNot(request, its->act);
  return std::nullopt;
}

Response Access::Sessions(const Request& request, const Now& now) {
  const bool may = MayAudit(request) || (request.role && May(*request.role, Act::configure));
  if (!may) return NeedsRole(request, Act::audit);
  Json sessions = Json::array();
  for (const Logins::Shown& one : logins_.Sessions(now)) {
    sessions.push_back({{"id", one.id},
                        {"user", one.user},
                        {"role", one.role ? Name(*one.role) : ""},
                        {"from", one.from},
                        {"since", FormatWallTime(one.since)},
                        {"last", FormatWallTime(one.last)}});
  }
  return TextResponse(200, kJson, Json{{"sessions", sessions}}.dump());
}

Response Access::EndSession(const Request& request, const Now& now) {
  if (!request.role || !May(*request.role, Act::configure)) {
    return NeedsRole(request, Act::configure);
  }
  const std::string id = FieldOf(request, "id");
  if (!logins_.End(id)) return Problem(404, "there is no session with the id " + Quoted(id));
  Note("session", request.user, request, "end session " + id, "ok", now);
  return Empty(204);
}

std::optional<Response> Access::MayNotAcknowledge(const Request& request) const {
  const auto its = web();
  if (MayOperate(request, its->acknowledge)) return std::nullopt;
  if (request.role && !May(*request.role, Act::operate)) return NeedsRole(request, Act::operate);
  return Denied(
      request,
      its->acknowledge || request.role
          ? "alarms can be acknowledged only over TLS (web.certificate, or a proxy in "
            "web.proxies), "
            "or from the gateway's machine"
          : "alarms cannot be acknowledged on this page; see web.acknowledge in the configuration");
}

std::optional<Response> Access::MayNot(const Request& request, Act act) const {
  if (MayDo(request, act)) return std::nullopt;
  if (!request.role || !May(*request.role, act)) return NeedsRole(request, act);
  return Denied(request, request.path +
                             " is possible only over TLS (web.certificate, or a proxy in "
                             "web.proxies), or from the gateway's machine");
}

/// True if the request comes from a user with the role for this act, and nobody can read it.
bool Access::MayDo(const Request& request, Act act) const {
  return request.role && May(*request.role, act) && IsPrivate(*web(), request);
}

/// True if the request comes from a user who may operate, or from a client without a user if
/// `everybody`, and nobody can read it.
bool Access::MayOperate(const Request& request, bool everybody) const {
  if (request.role) return MayDo(request, Act::operate);
  return everybody && IsPrivate(*web(), request);
}

Response Access::Session(const Request& request) {
  const auto its = web();
  Json json = {{"needs_token", logins_.NeedsLogin()},
               {"users", logins_.users().is_used()},
               {"logged_in", request.logged_in},
               {"user", request.user},
               {"role", request.role ? Name(*request.role) : ""},
               {"acknowledge", MayOperate(request, its->acknowledge)},
               {"write", MayDo(request, Act::operate)}};
  Json& may = json["may"] = Json::array();
  if (MayOperate(request, its->acknowledge)) may.push_back("acknowledge");
  for (const Operation& one : kOperations) {
    if (MayDo(request, one.act) && (may.empty() || may.back() != one.may)) may.push_back(one.may);
  }
  const bool configures = request.role && May(*request.role, Act::configure);
  if (configures || MayAudit(request)) may.push_back("sessions");
  if (configures) may.push_back("end_sessions");
  if (MayAudit(request)) may.push_back("writes");
  const bool events = events_ != nullptr && !events_->state().in_memory;
  const MutexLock lock(mutex_);
  json["gateway"] = gateway_;
  json["version"] =
      request.logged_in ? version_ : "";  // clients that are not logged in do not need the version
  json["history"] = history_;
  json["events"] = events;
  return TextResponse(200, kJson, json.dump());
}

Response Access::Login(const Request& request, const Now& now) {
  const bool secure = CameByTls(*web(), request);
  const std::string user = FieldOf(request, "user");
  const auto opened =
      user.empty() ? logins_.Open(request, FieldOf(request, "token"), secure, now)
                   : logins_.OpenOf(request, user, FieldOf(request, "password"), secure, now);
  if (opened.verdict == Logins::Verdict::wait) return WaitAMinute();
  if (opened.verdict == Logins::Verdict::no) {
    Note("login", user, request, "page", user.empty() ? "wrong token" : "wrong user or password",
         now);
    return user.empty() ? Problem(401, "wrong token; enter the token of this gateway")
                        : Problem(401, "wrong user or password");
  }
  Note("login", user, request, "page", "ok", now);
  Response response = Empty(204);
  if (!opened.cookie.empty()) response.headers.emplace_back("Set-Cookie", opened.cookie);
  return response;
}

void Access::Note(const char* kind, const std::string& who, const Request& request,
                  const std::string& what, const std::string& result, const Now& now) const {
  if (journal_ != nullptr) {
    journal_->Note({kind, who.empty() ? "token" : who, request.client(), what, result}, now.wall);
  } else if (result != "ok") {
    log::WarnFolded("web: login of " + HostOf(request.client()), "web: {} from {}: {}", kind,
                    request.client(), result);
  }
}

Response Access::Logout(const Request& request, const Now& now) {
  const Logins::Closed closed = logins_.Close(request);
  if (closed.was_open) Note("logout", request.user, request, "page", "ok", now);
  Response response = Empty(204);
  response.headers.emplace_back("Set-Cookie", closed.cookie);
  return response;
}

}  // namespace baudgate::web
