// SPDX-License-Identifier: Apache-2.0
#include "gateway/outputs/web/exchange.h"

#include <arpa/inet.h>
#include <netinet/in.h>
#include <sys/socket.h>

#include <array>
#include <cstring>
#include <map>

#include "gateway/base/text.h"

namespace baudgate::web {

void Exchange::Resume() {
  if (!std::exchange(suspended_, false)) return;
  MHD_resume_connection(connection_);
}

std::optional<Response> Exchange::TakeOrSuspend() {
  const MutexLock lock(mutex_);
  if (response_) return std::exchange(response_, std::nullopt);
  if (ended_) return Problem(503, "the gateway is stopping");
  suspended_ = true;
  MHD_suspend_connection(connection_);
  return std::nullopt;
}

void Exchange::Answer(Response response) {
  const MutexLock lock(mutex_);
  if (completed_) return;
  response_ = std::move(response);
  Resume();
}

void Exchange::Attach(std::shared_ptr<Stream> stream) {
  stream_ = std::move(stream);
  stream_->SetWake([weak = weak_from_this()] {
    if (const auto self = weak.lock()) self->Wake();
  });
}

std::ptrdiff_t Exchange::Read(std::span<char> into) {
  for (;;) {
    {
      const MutexLock lock(mutex_);
      if (ended_) return Stream::kEnd;
      woken_ = false;
    }
    const std::ptrdiff_t got = stream_->Read(into);
    if (got != 0) return got;
    const MutexLock lock(mutex_);
    if (woken_ || ended_) continue;
    suspended_ = true;
    MHD_suspend_connection(connection_);
    return 0;
  }
}

void Exchange::Wake() {
  const MutexLock lock(mutex_);
  woken_ = true;
  if (!completed_) Resume();
}

void Exchange::End() {
  const MutexLock lock(mutex_);
  ended_ = true;
  if (!completed_) Resume();
}

void Exchange::Complete() {
  std::shared_ptr<Stream> ends;
  const MutexLock lock(mutex_);
  completed_ = true;
  // The stream is destroyed after the lock is released, because another thread may end the stream
  // at the same time.
  ends = std::move(stream_);
}

namespace {

/// Returns e.g. "10.0.0.7", also for an IPv4 address in its mapped IPv6 form.
std::string AddressText(const sockaddr* address) {
  std::array<char, INET6_ADDRSTRLEN> text{};
  if (address != nullptr && address->sa_family == AF_INET) {
    ::inet_ntop(AF_INET, &reinterpret_cast<const sockaddr_in*>(address)->sin_addr, text.data(),
                text.size());
  } else if (address != nullptr && address->sa_family == AF_INET6) {
    const auto& six = reinterpret_cast<const sockaddr_in6*>(address)->sin6_addr;
    if (IN6_IS_ADDR_V4MAPPED(&six)) {
      ::inet_ntop(AF_INET, &six.s6_addr[12], text.data(), text.size());
    } else {
      ::inet_ntop(AF_INET6, &six, text.data(), text.size());
    }
  }
  return text.data();
}

std::string LocalAddress(int socket) {
  sockaddr_storage address{};
  socklen_t size = sizeof(address);
  if (::getsockname(socket, reinterpret_cast<sockaddr*>(&address), &size) != 0) return {};
  return AddressText(reinterpret_cast<const sockaddr*>(&address));
}

MHD_Result AddHeader(void* to, MHD_ValueKind, const char* key, const char* value) {
  auto& headers = *static_cast<std::map<std::string, std::string>*>(to);
  const auto [found, is_new] = headers.emplace(Lower(key), value == nullptr ? "" : value);
  // Repeated headers are joined to one value, which is then refused if the header must have a
  // single value.
  if (!is_new) found->second += std::string(", ") + (value == nullptr ? "" : value);
  return MHD_YES;
}

int HexDigit(char c) {
  if (c >= '0' && c <= '9') return c - '0';
  const int letter = (c | 0x20) - 'a';
  return letter >= 0 && letter < 6 ? letter + 10 : -1;
}

MHD_Result AddQuery(void* to, MHD_ValueKind, const char* key, const char* value) {
  auto& query = *static_cast<std::map<std::string, std::string>*>(to);
  query.emplace(key, value == nullptr ? "" : value);
  return MHD_YES;
}

}  // namespace

int SocketOf(MHD_Connection* connection) {
  const auto* info = MHD_get_connection_info(connection, MHD_CONNECTION_INFO_CONNECTION_FD);
  return info == nullptr ? -1 : info->connect_fd;
}

std::string PeerOf(MHD_Connection* connection) {
  const auto* info = MHD_get_connection_info(connection, MHD_CONNECTION_INFO_CLIENT_ADDRESS);
  return info == nullptr ? std::string() : AddressText(info->client_addr);
}

std::size_t Unescape(void*, MHD_Connection*, char* text) {
  char* to = text;
  for (const char* from = text; *from != '\0'; ++from) {
    const int high = *from == '%' ? HexDigit(from[1]) : -1;
    const int low = high >= 0 ? HexDigit(from[2]) : -1;
    if (low < 0 || high + low == 0) {
      *to++ = *from;
      continue;
    }
    *to++ = static_cast<char>(high * 16 + low);
    from += 2;
  }
  *to = '\0';
  return static_cast<std::size_t>(to - text);
}

Request RequestOf(MHD_Connection* connection, const char* url, const char* method) {
  Request request;
  request.method = std::strcmp(method, "HEAD") == 0 ? "GET" : method;
  request.path = url;
  request.peer = PeerOf(connection);
  request.tls = MHD_get_connection_info(connection, MHD_CONNECTION_INFO_PROTOCOL) != nullptr;
  request.local = LocalAddress(SocketOf(connection));
  MHD_get_connection_values(connection, MHD_HEADER_KIND, AddHeader, &request.headers);
  MHD_get_connection_values(connection, MHD_GET_ARGUMENT_KIND, AddQuery, &request.query);
  return request;
}

namespace {

constexpr std::size_t kStreamBlock = 16 * 1024;

using Kept = std::shared_ptr<Exchange>;

ssize_t ReadStream(void* kept, std::uint64_t, char* into, std::size_t most) {
  const std::ptrdiff_t got = (*static_cast<Kept*>(kept))->Read({into, most});
  return got == Stream::kEnd ? MHD_CONTENT_READER_END_OF_STREAM : got;
}
void FreeStream(void* kept) { delete static_cast<Kept*>(kept); }

/// Keeps the bytes of an answer, and counts them in `all`, until they have been sent.
struct Owner {
  Owner(const Response& response, BytesUnderWay bytes)
      : held(response.owner), size(response.body.size()), all(std::move(bytes)) {
    *all += size;
  }
  ~Owner() { *all -= size; }
  Owner(const Owner&) = delete;
  Owner& operator=(const Owner&) = delete;

  const std::shared_ptr<const void> held;
  const std::size_t size;
  const BytesUnderWay all;
};
void FreeOwner(void* owner) { delete static_cast<Owner*>(owner); }

MHD_Response* MakeBody(const Response& response, const BytesUnderWay& bytes_sent) {
  void* const bytes = const_cast<char*>(response.body.data());
  if (!response.owner) {
    return MHD_create_response_from_buffer(response.body.size(), bytes, MHD_RESPMEM_PERSISTENT);
  }
  auto owner = std::make_unique<Owner>(response, bytes_sent);
  MHD_Response* const made = MHD_create_response_from_buffer_with_free_callback_cls(
      response.body.size(), bytes, FreeOwner, owner.get());
  if (made != nullptr) owner.release();
  return made;
}

MHD_Response* Make(const Response& response, const Kept& exchange,
                   const BytesUnderWay& bytes_sent) {
  if (!response.stream) return MakeBody(response, bytes_sent);
  exchange->Attach(response.stream);
  auto kept = std::make_unique<Kept>(exchange);
  MHD_Response* const made = MHD_create_response_from_callback(MHD_SIZE_UNKNOWN, kStreamBlock,
                                                               ReadStream, kept.get(), FreeStream);
  if (made != nullptr) kept.release();
  return made;
}

/// Headers of every answer: the page must not load anything from other machines, and other pages
/// must not show it in a frame.
constexpr std::array<std::pair<const char*, const char*>, 6> kHeaders = {{
    {"Content-Security-Policy",
     "default-src 'self'; base-uri 'none'; form-action 'self'; frame-ancestors 'none'; "
     "object-src 'none'"},
    {"X-Content-Type-Options", "nosniff"},
    {"X-Frame-Options", "DENY"},
    {"Referrer-Policy", "no-referrer"},
    {"Cross-Origin-Resource-Policy", "same-origin"},
    {"Cross-Origin-Opener-Policy", "same-origin"},
}};

}  // namespace

MHD_Result Send(MHD_Connection* connection, const Response& response, const Kept& exchange,
                const BytesUnderWay& bytes_sent, bool last) {
  MHD_Response* const made = Make(response, exchange, bytes_sent);
  if (made == nullptr) return MHD_NO;
  for (const auto& [name, value] : kHeaders) MHD_add_response_header(made, name, value);
  if (!response.type.empty()) {
    MHD_add_response_header(made, "Content-Type", response.type.c_str());
  }
  bool cached = false;
  for (const auto& [name, value] : response.headers) {
    MHD_add_response_header(made, name.c_str(), value.c_str());
    cached = cached || name == "Cache-Control";
  }
  if (!cached) MHD_add_response_header(made, "Cache-Control", "no-store");
  if (last) MHD_add_response_header(made, "Connection", "close");
  const MHD_Result queued =
      MHD_queue_response(connection, static_cast<unsigned>(response.status), made);
  MHD_destroy_response(made);
  return queued;
}

}  // namespace baudgate::web
