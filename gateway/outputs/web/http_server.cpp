// SPDX-License-Identifier: Apache-2.0
#include "gateway/outputs/web/http_server.h"

#include <gnutls/x509.h>
#include <microhttpd.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <charconv>
#include <utility>

#include "gateway/base/fair_places.h"
#include "gateway/base/guarded.h"
#include "gateway/outputs/web/access.h"
#include "gateway/outputs/web/exchange.h"

namespace baudgate::web {

Limits Limits::Of(std::size_t descriptors) {
  constexpr std::size_t kFew = 4;
  Limits limits;
  limits.at_all = std::clamp(descriptors, kFew, limits.at_all);
  limits.connections = std::min(limits.connections, limits.at_all * 4 / 5);
  limits.of_host = std::min(limits.of_host, limits.connections);
  return limits;
}

std::optional<Connections::Id> Connections::Open(Id id, const std::string& peer, Instant now) {
  std::optional<Id> ends;
  if (all_.size() >= limits_.at_all) {
    std::map<std::uint64_t, std::size_t> hosts;
    for (const auto& [other, connection] : all_) ++hosts[connection.host];
    std::pair<std::size_t, Instant> worst{0, Instant::max()};
    for (const auto& [other, connection] : all_) {
      if (connection.busy()) continue;
      const std::size_t its = hosts[connection.host];
      if (its < worst.first || (its == worst.first && connection.since >= worst.second)) continue;
      worst = {its, connection.since};
      ends = other;
    }
  }
  all_[id] = {peer, HostNumberOf(peer), now};
  return ends;
}

void Connections::Receive(Id id, Instant now) {
  const auto found = all_.find(id);
  if (found == all_.end()) return;
  found->second.state = Connection::State::receives;
  found->second.since = now;
}

bool Connections::Begin(Id id, const std::string& client, Instant now) {
  const auto found = all_.find(id);
  if (found == all_.end()) return false;
  Connection& own = found->second;
  own.client = client;
  own.host = HostNumberOf(client);
  std::size_t busy = 0;
  std::size_t of_host = 0;
  for (const auto& [other, connection] : all_) {
    if (!connection.busy()) continue;
    ++busy;
    if (connection.host == own.host) ++of_host;
  }
  const bool fits =
      busy < limits_.connections && (IsLoopbackPeer(client) || of_host < limits_.of_host);
  own.state = Connection::State::answered;  // a refusal with 503 is an answer as well
  own.since = now;
  return fits;
}

void Connections::Stream(Id id) {
  const auto found = all_.find(id);
  if (found != all_.end()) found->second.state = Connection::State::streams;
}

void Connections::End(Id id, Instant now) {
  const auto found = all_.find(id);
  if (found == all_.end()) return;
  found->second.state = Connection::State::waits;
  found->second.since = now;
}

std::vector<Connections::Id> Connections::Overdue(Instant now) const {
  std::vector<Id> overdue;
  for (const auto& [id, connection] : all_) {
    if (connection.state == Connection::State::streams) continue;
    const Duration most = connection.busy() ? limits_.answer : limits_.request;
    if (now - connection.since >= most) overdue.push_back(id);
  }
  return overdue;
}

namespace {

using Kept = std::shared_ptr<Exchange>;

/// Limits the memory and the time that a client can use up by not reading.
void SetUp(int socket, const Limits& limits) {
  const int buffer = limits.send_buffer;
  const auto timeout = static_cast<unsigned>(limits.idle / 1ms);
  ::setsockopt(socket, SOL_SOCKET, SO_SNDBUF, &buffer, sizeof(buffer));
  ::setsockopt(socket, IPPROTO_TCP, TCP_USER_TIMEOUT, &timeout, sizeof(timeout));
}

/// TLS 1.2 and 1.3 (gnutls_priority_init).
const std::string kVersions = "SECURE128:-VERS-ALL:+VERS-TLS1.3:+VERS-TLS1.2";

/// True if the client has sent a certificate of an authority of web.client_ca. libmicrohttpd asks
/// for the certificate, but leaves the check to the application.
bool HasCertificate(MHD_Connection* connection) {
  const auto* const info = MHD_get_connection_info(connection, MHD_CONNECTION_INFO_GNUTLS_SESSION);
  if (info == nullptr || info->tls_session == nullptr) return false;
  unsigned status = 0;
  auto* const session = static_cast<gnutls_session_t>(info->tls_session);
  gnutls_typed_vdata_st purpose{};
  purpose.type = GNUTLS_DT_KEY_PURPOSE_OID;
  purpose.data = reinterpret_cast<unsigned char*>(const_cast<char*>(GNUTLS_KP_TLS_WWW_CLIENT));
  return gnutls_certificate_verify_peers(session, &purpose, 1, &status) == 0 && status == 0;
}

Response TooManyConnections() {
  Response busy = Problem(503, "too many connections; try again in a few seconds");
  busy.headers.emplace_back("Retry-After", "5");
  return busy;
}

/// Returns the answer that refuses the body of a request because its length is unknown or too
/// great; nothing: the body is accepted.
std::optional<Response> WrongContent(const Request& request, const Limits& limits) {
  if (request.Header("transfer-encoding")) {
    return Problem(411, "the content of a request needs a Content-Length");
  }
  const auto length = request.Header("content-length");
  if (!length) return std::nullopt;
  std::size_t bytes = 0;
  const char* const end = length->data() + length->size();
  const auto read = std::from_chars(length->data(), end, bytes);
  if (read.ec == std::errc() && read.ptr == end && bytes <= limits.body) return std::nullopt;
  return Problem(413,
                 "the content of a request has at most " + std::to_string(limits.body) + " bytes");
}

}  // namespace

class HttpServer::Impl : public std::enable_shared_from_this<HttpServer::Impl> {
 public:
  Impl(HttpHandler& handler, const Limits& limits, const tls::TlsTexts& tls)
      : handler_(handler), limits_(limits), tls_(tls), connections_(limits) {}

  Status Start(transports::ListenSocket socket);
  void Stop();
  int TakeSocket();
  void EndOverdue(Instant now);
  void EndLoggedOut();
  std::size_t connections() {
    const MutexLock lock(mutex_);
    return connections_.size();
  }

 private:
  struct Open {
    Connections::Id id = 0;
  };

  static MHD_Result OnRequest(void* self, MHD_Connection* connection, const char* url,
                              const char* method, const char* version, const char* upload,
                              std::size_t* upload_size, void** exchange);
  static void OnCompleted(void* self, MHD_Connection* connection, void** exchange,
                          MHD_RequestTerminationCode);
  static void OnConnection(void* self, MHD_Connection* connection, void** open,
                           MHD_ConnectionNotificationCode what);

  MHD_Result Queue(MHD_Connection* connection, const Response& response, const Kept& exchange,
                   bool last = false);
  MHD_Result Begin(MHD_Connection* connection, const char* url, const char* method, void** kept);
  MHD_Result Continue(MHD_Connection* connection, const Kept& exchange);
  void Opened(MHD_Connection* connection, void** open);
  void Closed(void** open);
  void End(Connections::Id id) BAUDGATE_REQUIRES(mutex_);

  HttpHandler& handler_;
  const Limits limits_;
  const tls::TlsTexts tls_;
  const BytesUnderWay bytes_ = std::make_shared<std::atomic<std::size_t>>(0);
  MHD_Daemon* daemon_ = nullptr;
  bool socket_taken_ = false;
  mutable Mutex mutex_;
  bool stopping_ BAUDGATE_GUARDED_BY(mutex_) = false;
  Connections::Id last_ BAUDGATE_GUARDED_BY(mutex_) = 0;
  Connections connections_ BAUDGATE_GUARDED_BY(mutex_);
  std::map<Connections::Id, int> sockets_ BAUDGATE_GUARDED_BY(mutex_);
  std::map<Exchange*, Kept> exchanges_ BAUDGATE_GUARDED_BY(mutex_);
};

Status HttpServer::Impl::Start(transports::ListenSocket socket) {
  const int listening = socket.Release();
  // The library's limit is greater than Limits::at_all, so that a further client gets 503 instead
  // of waiting without an answer.
  const auto most = static_cast<unsigned>(limits_.at_all * 2);
  const unsigned flags =
      MHD_USE_EPOLL_INTERNAL_THREAD | MHD_ALLOW_SUSPEND_RESUME | MHD_USE_ERROR_LOG;
  std::vector<MHD_OptionItem> tls;
  const auto add = [&tls](MHD_OPTION option, const std::string& text) {
    if (!text.empty()) tls.push_back({option, 0, const_cast<char*>(text.c_str())});
  };
  if (tls_.on()) {
    add(MHD_OPTION_HTTPS_MEM_CERT, tls_.certificate);
    add(MHD_OPTION_HTTPS_MEM_KEY, tls_.key);
    add(MHD_OPTION_HTTPS_MEM_TRUST, tls_.authorities);
    add(MHD_OPTION_HTTPS_PRIORITIES, kVersions);
  }
  tls.push_back({MHD_OPTION_END, 0, nullptr});
  daemon_ = MHD_start_daemon(
      flags | (tls_.on() ? static_cast<unsigned>(MHD_USE_TLS) : 0U), 0, nullptr, nullptr, OnRequest,
      this, MHD_OPTION_LISTEN_SOCKET, listening, MHD_OPTION_CONNECTION_LIMIT, most,
      MHD_OPTION_CONNECTION_TIMEOUT, static_cast<unsigned>(limits_.idle / 1s),
      MHD_OPTION_CONNECTION_MEMORY_LIMIT, limits_.header, MHD_OPTION_STRICT_FOR_CLIENT, 1,
      MHD_OPTION_UNESCAPE_CALLBACK, Unescape, nullptr, MHD_OPTION_NOTIFY_COMPLETED, OnCompleted,
      this, MHD_OPTION_NOTIFY_CONNECTION, OnConnection, this, MHD_OPTION_EXTERNAL_LOGGER,
      static_cast<MHD_LogCallback>([](void*, const char*, va_list) {}), nullptr, MHD_OPTION_ARRAY,
      tls.data(), MHD_OPTION_END);
  if (daemon_ != nullptr) return {};
  ::close(listening);
  return Error{"web: the server cannot be started: the system has no threads or files left"};
}

/// Returns the listening socket once. libmicrohttpd would return the same number again, although
/// its new owner may have closed it.
int HttpServer::Impl::TakeSocket() {
  const bool taken = std::exchange(socket_taken_, true);
  return daemon_ == nullptr || taken ? MHD_INVALID_SOCKET : MHD_quiesce_daemon(daemon_);
}

void HttpServer::Impl::Stop() {
  if (daemon_ == nullptr) return;
  const MHD_socket listening = TakeSocket();
  std::map<Exchange*, Kept> open;
  {
    const MutexLock lock(mutex_);
    stopping_ = true;
    open = exchanges_;
  }
  // No connection may stay suspended, because libmicrohttpd could not stop then.
  for (const auto& [raw, exchange] : open) exchange->End();
  MHD_stop_daemon(daemon_);
  if (listening >= 0) ::close(listening);
  daemon_ = nullptr;
}

void HttpServer::Impl::End(Connections::Id id) {
  const auto found = sockets_.find(id);
  if (found != sockets_.end()) ::shutdown(found->second, SHUT_RDWR);
}

void HttpServer::Impl::EndOverdue(Instant now) {
  const MutexLock lock(mutex_);
  for (const Connections::Id id : connections_.Overdue(now)) End(id);
}

void HttpServer::Impl::EndLoggedOut() {
  std::vector<std::pair<Connections::Id, Request>> streams;
  {
    const MutexLock lock(mutex_);
    for (const auto& [raw, exchange] : exchanges_) {
      if (exchange->streams) streams.emplace_back(exchange->connection_id, exchange->request);
    }
  }
  std::erase_if(streams, [this](const auto& one) { return handler_.MayGoOn(one.second); });
  const MutexLock lock(mutex_);
  for (const auto& [id, request] : streams) End(id);
}

void HttpServer::Impl::Opened(MHD_Connection* connection, void** open) {
  const int socket = SocketOf(connection);
  SetUp(socket, limits_);
  auto its = std::make_unique<Open>();
  const MutexLock lock(mutex_);
  its->id = ++last_;
  sockets_[its->id] = socket;
  const auto ends = connections_.Open(its->id, PeerOf(connection), ReadClocks().instant);
  if (ends) End(*ends);
  *open = its.release();
}

void HttpServer::Impl::Closed(void** open) {
  const std::unique_ptr<Open> its(static_cast<Open*>(std::exchange(*open, nullptr)));
  if (!its) return;
  const MutexLock lock(mutex_);
  sockets_.erase(its->id);
  connections_.Close(its->id);
}

void HttpServer::Impl::OnConnection(void* self, MHD_Connection* connection, void** open,
                                    MHD_ConnectionNotificationCode what) {
  auto& impl = *static_cast<Impl*>(self);
  if (what == MHD_CONNECTION_NOTIFY_STARTED) {
    impl.Opened(connection, open);
  } else {
    impl.Closed(open);
  }
}

MHD_Result HttpServer::Impl::OnRequest(void* self, MHD_Connection* connection, const char* url,
                                       const char* method, const char*, const char* upload,
                                       std::size_t* upload_size, void** kept) {
  auto& impl = *static_cast<Impl*>(self);
  if (*kept == nullptr) return impl.Begin(connection, url, method, kept);
  const Kept exchange = *static_cast<Kept*>(*kept);
  if (*upload_size > 0) {
    if (exchange->request.body.size() + *upload_size > impl.limits_.body) return MHD_NO;
    exchange->request.body.append(upload, *upload_size);
    *upload_size = 0;
    return MHD_YES;
  }
  return impl.Continue(connection, exchange);
}

MHD_Result HttpServer::Impl::Begin(MHD_Connection* connection, const char* url, const char* method,
                                   void** kept) {
  auto exchange = std::make_shared<Exchange>(connection, RequestOf(connection, url, method));
  Request& request = exchange->request;
  request.forwarded_for = handler_.ClientBehind(request);
  const auto length = request.Header("content-length");
  const bool has_body = length && length->find_first_not_of('0') != std::string::npos;
  const Instant now = ReadClocks().instant;
  const auto* const info = MHD_get_connection_info(connection, MHD_CONNECTION_INFO_SOCKET_CONTEXT);
  bool fits = false;
  {
    const MutexLock lock(mutex_);
    exchange->connection_id = info == nullptr || info->socket_context == nullptr
                                  ? 0
                                  : static_cast<Open*>(info->socket_context)->id;
    fits = !stopping_ &&
           (has_body || connections_.Begin(exchange->connection_id, request.client(), now));
    if (has_body) connections_.Receive(exchange->connection_id, now);
    exchange->begun = !has_body;
    exchanges_[exchange.get()] = exchange;
  }
  *kept = new Kept(exchange);
  if (!tls_.authorities.empty() && !HasCertificate(connection)) {
    return Queue(connection,
                 Problem(403, "this gateway needs a certificate of the authority in web.client_ca"),
                 exchange, true);
  }
  if (!fits) return Queue(connection, TooManyConnections(), exchange, true);
  if (const auto refused = handler_.Refuse(exchange->request)) {
    return Queue(connection, *refused, exchange, true);
  }
  if (const auto wrong = WrongContent(exchange->request, limits_)) {
    return Queue(connection, *wrong, exchange, true);
  }
  return MHD_YES;
}

/// Sends an answer. Sends 503 instead if the answers that clients have not read yet use too much
/// memory.
MHD_Result HttpServer::Impl::Queue(MHD_Connection* connection, const Response& response,
                                   const Kept& exchange, bool last) {
  if (response.owner && *bytes_ > 0 && *bytes_ + response.body.size() > limits_.answers) {
    Response busy = Problem(503, "too many answers are still being sent; try again in a minute");
    busy.headers.emplace_back("Retry-After", "60");
    return Send(connection, busy, exchange, bytes_, true);
  }
  if (response.stream) {
    const MutexLock lock(mutex_);
    exchange->streams = true;
    connections_.Stream(exchange->connection_id);
  }
  return Send(connection, response, exchange, bytes_, last);
}

MHD_Result HttpServer::Impl::Continue(MHD_Connection* connection, const Kept& exchange) {
  if (!std::exchange(exchange->asked, true)) {
    if (!std::exchange(exchange->begun, true)) {
      bool fits = false;
      {
        const MutexLock lock(mutex_);
        fits = connections_.Begin(exchange->connection_id, exchange->request.client(),
                                  ReadClocks().instant);
      }
      if (!fits) return Queue(connection, TooManyConnections(), exchange, true);
    }
    handler_.Handle(exchange->request,
                    [exchange](Response response) { exchange->Answer(std::move(response)); });
  }
  auto response = exchange->TakeOrSuspend();
  if (!response) return MHD_YES;
  return Queue(connection, *response, exchange);
}

void HttpServer::Impl::OnCompleted(void* self, MHD_Connection*, void** kept,
                                   MHD_RequestTerminationCode) {
  auto& impl = *static_cast<Impl*>(self);
  const std::unique_ptr<Kept> owned(static_cast<Kept*>(std::exchange(*kept, nullptr)));
  if (!owned) return;
  (*owned)->Complete();
  const MutexLock lock(impl.mutex_);
  impl.exchanges_.erase(owned->get());
  impl.connections_.End((*owned)->connection_id, ReadClocks().instant);
}

Result<std::unique_ptr<HttpServer>> HttpServer::Start(transports::ListenSocket socket,
                                                      HttpHandler& handler, const Limits& limits,
                                                      const tls::TlsTexts& tls) {
  auto impl = std::make_shared<Impl>(handler, limits, tls);
  if (const Status status = impl->Start(std::move(socket)); !status) return Error{status.error()};
  return std::unique_ptr<HttpServer>(new HttpServer(std::move(impl)));
}

HttpServer::~HttpServer() { Stop(); }
void HttpServer::Stop() { impl_->Stop(); }
transports::ListenSocket HttpServer::TakeSocket() {
  return transports::ListenSocket::Of(impl_->TakeSocket());
}
void HttpServer::EndOverdue(Instant now) { impl_->EndOverdue(now); }
void HttpServer::EndLoggedOut() { impl_->EndLoggedOut(); }
std::size_t HttpServer::connections() const { return impl_->connections(); }

}  // namespace baudgate::web
