// SPDX-License-Identifier: Apache-2.0
#include "gateway/outputs/web/web_server.h"

#include <zlib.h>

#include <algorithm>
#include <array>
#include <asio/post.hpp>
#include <utility>

#include "gateway/base/text.h"

namespace baudgate::web {
namespace {

// Size of the end of a gzip file: checksum and length of the content.
constexpr std::size_t kTrailer = 8;

struct FileType {
  std::string_view ending;
  std::string_view type;
};
constexpr std::array<FileType, 8> kTypes = {{{".html", "text/html; charset=utf-8"},
                                             {".css", "text/css; charset=utf-8"},
                                             {".js", "text/javascript; charset=utf-8"},
                                             {".svg", "image/svg+xml"},
                                             {".png", "image/png"},
                                             {".ico", "image/x-icon"},
                                             {".json", "application/json"},
                                             {".webmanifest", "application/manifest+json"}}};

std::string TagOf(std::string_view packed) {
  std::string tag = "\"";
  for (const char c : packed.substr(packed.size() - std::min(packed.size(), kTrailer))) {
    tag += HexByte(static_cast<std::uint8_t>(c));
  }
  return tag + "\"";
}

/// Decompresses a file, for the few clients that do not accept gzip.
std::string Unpacked(std::string_view packed) {
  z_stream stream{};
  if (inflateInit2(&stream, 16 + MAX_WBITS) != Z_OK) return {};
  stream.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(packed.data()));
  stream.avail_in = static_cast<uInt>(packed.size());
  std::string text;
  std::array<char, 16384> chunk{};
  int step = Z_OK;
  while (step == Z_OK) {
    stream.next_out = reinterpret_cast<Bytef*>(chunk.data());
    stream.avail_out = static_cast<uInt>(chunk.size());
    step = inflate(&stream, Z_NO_FLUSH);
    text.append(chunk.data(), chunk.size() - stream.avail_out);
  }
  inflateEnd(&stream);
  return text;
}

bool TakesGzip(const Request& request) {
  return request.Header("accept-encoding").value_or("").find("gzip") != std::string::npos;
}

}  // namespace

std::string_view TypeOf(std::string_view path) {
  const auto found = std::ranges::find_if(
      kTypes, [path](const FileType& type) { return path.ends_with(type.ending); });
  return found == kTypes.end() ? "application/octet-stream" : found->type;
}

std::optional<Response> AssetResponse(const Request& request) {
  const std::string path = request.path == "/" ? "/index.html" : request.path;
  const auto files = PackedFiles();
  const auto found = std::ranges::find(files, std::string_view(path), &PackedFile::path);
  if (found == files.end()) return std::nullopt;
  const std::string_view packed(found->begin, static_cast<std::size_t>(found->end - found->begin));
  const std::string tag = TagOf(packed);
  Response response;
  const bool known = request.Header("if-none-match") == tag;
  if (known) {
    response.status = 304;
  } else if (TakesGzip(request)) {
    response.body = packed;
    response.headers.emplace_back("Content-Encoding", "gzip");
  } else {
    response = TextResponse(200, "", Unpacked(packed));
  }
  if (!known) response.type = TypeOf(path);
  response.headers.emplace_back("ETag", tag);
  response.headers.emplace_back("Vary", "Accept-Encoding");
  response.headers.emplace_back("Cache-Control", "no-cache");
  return response;
}

namespace {

constexpr Duration kLook = 1s;
/// The most requests that wait for the two threads; further requests get 503.
constexpr std::size_t kMostWaiting = 256;

}  // namespace

Result<transports::ListenSocket> WebServer::ListenAt(const config::HostPort& at) {
  asio::error_code failed;
  const auto address = asio::ip::make_address(at.host, failed);
  if (failed)
    return Error{"'" + at.host +
                 "' is not an IP address; write an IP address of this machine in web.listen"};
  return transports::ListenSocket::Open({address, at.port}, "web.listen");
}

Result<WebServer::Opened> WebServer::Open(const config::Web& next, const config::Web* now) {
  Opened opened;
  if (!next.token_file.empty()) {
    auto token = ReadToken(next.token_file);
    if (!token) return Error{"web: " + token.error()};
    opened.token = std::move(*token);
  }
  if (!next.tls.certificate.empty()) {
    auto tls = tls::ReadTls(next.tls);
    if (!tls) return Error{"web: " + tls.error()};
    opened.tls = std::move(*tls);
  }
  if (now == nullptr || now->listen != next.listen) {
    auto socket = ListenAt(next.listen);
    if (!socket) return Error{"web: " + next.Address() + ": " + socket.error()};
    opened.socket = std::move(*socket);
  }
  return opened;
}

WebServer::WebServer(const config::Config& config, LiveApi::Links links, const Limits& limits)
    : limits_(limits),
      access_(config.web.listen.port, links.info.version, links.info.events, links.info.journal),
      live_(config, links, live_loop_.io()),
      past_(config, links.store, links.lines, links.info, past_loop_.io()) {
  access_.SetHistory(links.info.history != nullptr);
}

Result<std::unique_ptr<WebServer>> WebServer::Start(
    const std::shared_ptr<const config::Config>& config, Opened opened, LiveApi::Links links,
    const Limits& limits) {
  const auto history = links.info.history;
  std::unique_ptr<WebServer> server(new WebServer(*config, std::move(links), limits));
  server->access_.Set(*config, std::move(opened.token));
  server->live_.Apply(config, history);
  server->past_.Apply(config, history);
  auto http = HttpServer::Start(std::move(opened.socket), *server, limits, opened.tls);
  if (!http) return Error{http.error()};
  server->tls_ = std::move(opened.tls);
  server->http_ = std::move(*http);
  server->live_loop_.Start();
  server->past_loop_.Start();
  server->login_loop_.Start();
  asio::post(server->live_loop_.io(), [raw = server.get()] { raw->Look(); });
  return server;
}

WebServer::~WebServer() { Stop(); }

void WebServer::Stop() {
  if (!http_) return;
  http_->Stop();
  past_loop_.Stop();
  login_loop_.Stop();
  live_loop_.Stop([this] {
    live_.EndStreams();
    tick_.cancel();
    look_.cancel();
  });
  http_.reset();
}

Status WebServer::Apply(const std::shared_ptr<const config::Config>& config, Opened opened,
                        const std::shared_ptr<const history::HistorySource>& history) {
  access_.Set(*config, std::move(opened.token));
  ApplyHistory(config, history);
  if (!opened.socket.is_open()) {
    if (opened.tls == tls_) return {};
    opened.socket = http_->TakeSocket();
  }
  auto next = HttpServer::Start(std::move(opened.socket), *this, limits_, opened.tls);
  if (!next) return Error{next.error()};
  tls_ = std::move(opened.tls);
  std::unique_ptr<HttpServer> before;
  transports::RunOn(live_loop_.io(), [&] { before = std::exchange(http_, std::move(*next)); });
  before->Stop();
  return {};
}

void WebServer::ApplyHistory(const std::shared_ptr<const config::Config>& config,
                             const std::shared_ptr<const history::HistorySource>& history) {
  past_.Apply(config, history);
  transports::RunOn(live_loop_.io(), [&] { live_.Apply(config, history); });
  access_.SetHistory(history != nullptr);
}

std::string WebServer::ClientBehind(const Request& request) {
  return access_.ClientBehind(request);
}

bool WebServer::MayGoOn(const Request& request) { return access_.MayGoOn(request, ReadClocks()); }

std::optional<Response> WebServer::Refuse(const Request& request) {
  return access_.Refuse(request, ReadClocks());
}

void WebServer::Handle(const Request& as_sent, Answered answered) {
  Request request = as_sent;
  access_.WhoAsks(request, ReadClocks());
  if (Access::IsSlow(request)) return LogIn(std::move(request), std::move(answered));
  if (auto response = access_.Answer(request, ReadClocks())) {
    return answered(*std::move(response));
  }
  if (auto asset = AssetResponse(request)) return answered(std::move(*asset));
  if (!request.path.starts_with("/api/") && request.path != "/metrics") {
    return answered(Problem(404, "there is nothing at " + request.path));
  }
  Ask(request, std::move(answered));
}

/// Checks a password on a thread of its own, one after the other, because each check takes a tenth
/// of a second.
void WebServer::LogIn(Request request, Answered answered) {
  constexpr std::size_t kMostLogins = 16;
  if (logins_ >= kMostLogins) return answered(Problem(503, "too many logins at once; try again"));
  ++logins_;
  asio::post(login_loop_.io(),
             [this, request = std::move(request), answered = std::move(answered)] {
               --logins_;
               answered(*access_.Answer(request, ReadClocks()));
             });
}

void WebServer::Ask(const Request& request, Answered answered) {
  if (waiting_ >= kMostWaiting)
    return answered(Problem(503, "too many requests at once; try again"));
  ++waiting_;
  const bool past = PastApi::Has(request.path);
  asio::post(
      (past ? past_loop_ : live_loop_).io(), [this, past, request, answered = std::move(answered)] {
        --waiting_;
        const Now now = ReadClocks();
        if (request.path == Access::kAcknowledge) return live_.Acknowledge(request, answered);
        if (const Operation* const its = OperationAt(request.path)) {
          return live_.Operate(*its, request, answered);
        }
        const bool known =
            past ? past_.Answer(request, now, answered) : live_.Answer(request, now, answered);
        if (!known) answered(Problem(404, "there is nothing at " + request.path));
        if (!past) Tick();
      });
}

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

/// Runs every kLook: closes slow connections and sends the heartbeat of traces.
void WebServer::Look() {
  if (http_) {
    http_->EndOverdue(ReadClocks().instant);
    http_->EndLoggedOut();
  }
  live_.Beat();
  look_.expires_after(kLook);
  look_.async_wait([this](const asio::error_code& stopped) {
    if (!stopped) Look();
  });
}

}  // namespace baudgate::web
