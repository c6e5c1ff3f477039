// SPDX-License-Identifier: Apache-2.0
#include "gateway/web/web_server.h"

#include <asio/post.hpp>
#include <utility>

#include "gateway/base/log.h"
#include "gateway/base/text.h"
#include "gateway/web/assets.h"
#include "gateway/web/front_door.h"
#include "gateway/web/token_file.h"
#include "transports/run_on.h"

namespace baudgate::web {
namespace {

using control::Json;

constexpr Duration kLook = 1s;
/// Requests that wait for the two threads; beyond, 503.
constexpr std::size_t kMostWaiting = 256;

constexpr std::string_view kLogin = "/login";
constexpr std::string_view kLogout = "/logout";
constexpr std::string_view kSession = "/api/v1/session";
constexpr std::string_view kAcknowledge = "/api/v1/alarms/ack";

bool IsPost(std::string_view path) {
  return path == kLogin || path == kLogout || path == kAcknowledge;
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

Result<ListenSocket> WebServer::ListenAt(const config::HostPort& at) {
  asio::error_code failed;
  const auto address = asio::ip::make_address(at.host, failed);
  if (failed) return Error{"'" + at.host + "' is no address; check web.listen"};
  return ListenSocket::Open({address, at.port}, "web.listen");
}

Result<WebServer::Opened> WebServer::Open(const config::Web& next, const config::Web* now) {
  Opened opened;
  if (!next.token_file.empty()) {
    auto token = ReadToken(next.token_file);
    if (!token) return Error{"web: " + token.error()};
    opened.token = std::move(*token);
  }
  if (now == nullptr || now->listen != next.listen) {
    auto socket = ListenAt(next.listen);
    if (!socket) return Error{"web: " + next.Place() + ": " + socket.error()};
    opened.socket = std::move(*socket);
  }
  return opened;
}

WebServer::WebServer(const config::Config& config, LiveApi::Links links, const Limits& limits)
    : limits_(limits),
      version_(links.info.version),
      events_(links.info.events),
      logins_(config.web.listen.port),
      live_(config, links, live_loop_.io()),
      past_(config, links.store, links.lines, links.info, past_loop_.io()) {
  const MutexLock lock(mutex_);
  history_ = links.info.history != nullptr;
}

Result<std::unique_ptr<WebServer>> WebServer::Start(
    const std::shared_ptr<const config::Config>& config, Opened opened, LiveApi::Links links,
    const Limits& limits) {
  const auto history = links.info.history;
  std::unique_ptr<WebServer> server(new WebServer(*config, std::move(links), limits));
  server->Set(*config, std::move(opened.token));
  server->live_.Apply(config, history);
  server->past_.Apply(config, history);
  auto http = HttpServer::Start(std::move(opened.socket), *server, limits);
  if (!http) return Error{http.error()};
  server->http_ = std::move(*http);
  server->live_loop_.Start();
  server->past_loop_.Start();
  asio::post(server->live_loop_.io(), [raw = server.get()] { raw->Look(); });
  return server;
}

WebServer::~WebServer() { Stop(); }

void WebServer::Stop() {
  if (!http_) return;
  http_->Stop();
  past_loop_.Stop();
  live_loop_.Stop([this] {
    live_.EndStreams();
    tick_.cancel();
    look_.cancel();
  });
  http_.reset();
}

std::shared_ptr<const config::Web> WebServer::web() const {
  const MutexLock lock(mutex_);
  return web_;
}

void WebServer::Set(const config::Config& config, std::optional<std::string> token) {
  logins_.SetToken(std::move(token));
  const MutexLock lock(mutex_);
  web_ = std::make_shared<const config::Web>(config.web);
  gateway_ = config.name;
}

Status WebServer::Apply(const std::shared_ptr<const config::Config>& config, Opened opened,
                        const std::shared_ptr<const history::HistorySource>& history) {
  Set(*config, std::move(opened.token));
  ApplyHistory(config, history);
  if (!opened.socket.is_open()) return {};
  auto next = HttpServer::Start(std::move(opened.socket), *this, limits_);
  if (!next) return Error{next.error()};
  std::unique_ptr<HttpServer> before;
  RunOn(live_loop_.io(), [&] { before = std::exchange(http_, std::move(*next)); });
  before->Stop();
  return {};
}

void WebServer::ApplyHistory(const std::shared_ptr<const config::Config>& config,
                             const std::shared_ptr<const history::HistorySource>& history) {
  past_.Apply(config, history);
  RunOn(live_loop_.io(), [&] { live_.Apply(config, history); });
  const MutexLock lock(mutex_);
  history_ = history != nullptr;
}

std::optional<Response> WebServer::Refuse(const Request& request) {
  if (auto refused = Refusal(*web(), request)) return refused;
  const std::string_view method = IsPost(request.path) ? "POST" : "GET";
  if (request.method != method) {
    Response wrong = Problem(405, std::string(method) + " is the method of " + request.path);
    wrong.headers.emplace_back("Allow", method);
    return wrong;
  }
  if (request.path == kLogin) return std::nullopt;
  return NeedsLogin(request);
}

/// The files of the page have no data, and are there for the login.
std::optional<Response> WebServer::NeedsLogin(const Request& request) {
  const bool open =
      !request.path.starts_with("/api/") && request.path != "/metrics" && request.path != kLogout;
  if (open || request.path == kSession) return std::nullopt;
  switch (logins_.Check(request, ReadClocks().instant)) {
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

void WebServer::Handle(const Request& request, Answered answered) {
  if (request.path == kSession) return answered(Session(request));
  if (request.path == kLogin) return answered(Login(request));
  if (request.path == kLogout) return answered(Logout(request));
  if (auto asset = AssetResponse(request)) return answered(std::move(*asset));
  if (request.path == kAcknowledge && !MayAcknowledge(*web(), request)) {
    return answered(Problem(403, web()->acknowledge
                                     ? "alarms are acknowledged from this machine, or by TLS "
                                       "through a proxy that web.allow names"
                                     : "alarms cannot be acknowledged here; see web.acknowledge"));
  }
  if (!request.path.starts_with("/api/") && request.path != "/metrics") {
    return answered(Problem(404, "there is nothing at " + request.path));
  }
  Ask(request, std::move(answered));
}

void WebServer::Ask(const Request& request, Answered answered) {
  if (waiting_ >= kMostWaiting) return answered(Problem(503, "too many requests at once"));
  ++waiting_;
  const bool past = PastApi::Has(request.path);
  asio::post(
      (past ? past_loop_ : live_loop_).io(), [this, past, request, answered = std::move(answered)] {
        --waiting_;
        const Now now = ReadClocks();
        if (request.path == kAcknowledge) return live_.Acknowledge(request, answered);
        const bool known =
            past ? past_.Answer(request, now, answered) : live_.Answer(request, now, answered);
        if (!known) answered(Problem(404, "there is nothing at " + request.path));
        if (!past) Tick();
      });
}

Response WebServer::Session(const Request& request) {
  const bool in = logins_.Check(request, ReadClocks().instant) == Logins::Verdict::yes;
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

Response WebServer::Login(const Request& request) {
  const auto opened =
      logins_.Open(request, TokenOf(request), CameByTls(*web(), request), ReadClocks().instant);
  if (opened.verdict == Logins::Verdict::wait) return WaitAMinute();
  if (opened.verdict == Logins::Verdict::no) {
    log::Warn("web: a wrong token from {}", request.peer);
    return Problem(401, "that is not the token of this gateway");
  }
  Response response = Empty(204);
  if (!opened.cookie.empty()) response.headers.emplace_back("Set-Cookie", opened.cookie);
  return response;
}

Response WebServer::Logout(const Request& request) {
  Response response = Empty(204);
  response.headers.emplace_back("Set-Cookie", logins_.Close(request));
  return response;
}

/// While anybody looks.
void WebServer::Tick() {
  if (ticking_) return;
  ticking_ = live_.Tick(ReadClocks());
  if (!ticking_) return;
  tick_.expires_after(LivePoints::kTick);
  tick_.async_wait([this](const asio::error_code& stopped) {
    ticking_ = false;
    if (!stopped) Tick();
  });
}

/// Once a second.
void WebServer::Look() {
  if (http_) http_->EndOverdue(ReadClocks().instant);
  live_.Beat();
  look_.expires_after(kLook);
  look_.async_wait([this](const asio::error_code& stopped) {
    if (!stopped) Look();
  });
}

}  // namespace baudgate::web
