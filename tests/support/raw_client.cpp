// SPDX-License-Identifier: Apache-2.0
#include "tests/support/raw_client.h"

#include <arpa/inet.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <array>
#include <cerrno>

namespace baudgate {
namespace {

constexpr int kPatience = 20'000;
constexpr std::size_t kLengthPlace = 4;  // position of the length in a Modbus TCP header
constexpr std::size_t kChunk = 4096;

bool Readable(int socket) {
  pollfd waited{socket, POLLIN, 0};
  return ::poll(&waited, 1, kPatience) > 0;
}

bool Fill(int socket, Bytes& bytes, std::size_t from) {
  while (from < bytes.size()) {
    if (!Readable(socket)) return false;
    const ssize_t count = ::recv(socket, bytes.data() + from, bytes.size() - from, 0);
    if (count <= 0) return false;
    from += static_cast<std::size_t>(count);
  }
  return true;
}

}  // namespace

RawClient::RawClient(std::uint16_t port, int receive_buffer)
    : socket_(::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0)) {
  if (receive_buffer > 0) {
    ::setsockopt(socket_, SOL_SOCKET, SO_RCVBUF, &receive_buffer, sizeof receive_buffer);
  }
  const int on = 1;
  ::setsockopt(socket_, IPPROTO_TCP, TCP_NODELAY, &on, sizeof on);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(port);
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  Connect(&address, sizeof address);
}

RawClient::RawClient(std::uint16_t port, const std::string& from)
    : socket_(::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0)) {
  sockaddr_in address{};
  address.sin_family = AF_INET;
  ::inet_pton(AF_INET, from.c_str(), &address.sin_addr);
  ::bind(socket_, reinterpret_cast<const sockaddr*>(&address), sizeof address);
  address.sin_port = htons(port);
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  Connect(&address, sizeof address);
}

RawClient::RawClient(const std::string& path)
    : socket_(::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0)) {
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  path.copy(address.sun_path, sizeof address.sun_path - 1);
  Connect(&address, sizeof address);
}

void RawClient::Connect(const void* address, std::size_t size) {
  const auto name = static_cast<const sockaddr*>(address);
  if (::connect(socket_, name, static_cast<socklen_t>(size)) != 0) Close();
}

void RawClient::Close() {
  if (socket_ >= 0) ::close(std::exchange(socket_, -1));
}

std::size_t RawClient::Send(View bytes) const {
  std::size_t sent = 0;
  while (sent < bytes.size()) {
    const ssize_t count = ::send(socket_, bytes.data() + sent, bytes.size() - sent, MSG_NOSIGNAL);
    if (count <= 0) break;
    sent += static_cast<std::size_t>(count);
  }
  return sent;
}

std::size_t RawClient::Send(std::string_view text) const { return Send(View(ToBytes(text))); }

bool RawClient::SendSome(View bytes) const {
  const ssize_t count = ::send(socket_, bytes.data(), bytes.size(), MSG_NOSIGNAL | MSG_DONTWAIT);
  return count >= 0 || errno == EAGAIN;
}

Bytes RawClient::Receive(std::size_t count) const {
  Bytes bytes(count);
  return Fill(socket_, bytes, 0) ? bytes : Bytes();
}

Bytes RawClient::ReceiveFrame() const {
  Bytes frame = Receive(kLengthPlace + 2);
  if (frame.empty()) return {};
  const std::size_t head = frame.size();
  frame.resize(head + *ByteReader(frame).U16Be(kLengthPlace));
  return Fill(socket_, frame, head) ? frame : Bytes();
}

std::optional<std::string> RawClient::ReceiveLine() const {
  std::string line;
  std::string chunk(kChunk, '\0');
  while (Readable(socket_)) {
    const ssize_t seen = ::recv(socket_, chunk.data(), chunk.size(), MSG_PEEK);
    if (seen <= 0) break;
    const auto end = std::string_view(chunk.data(), static_cast<std::size_t>(seen)).find('\n');
    const bool whole = end != std::string_view::npos;
    const std::size_t take = whole ? end + 1 : static_cast<std::size_t>(seen);
    const ssize_t taken = ::recv(socket_, chunk.data(), take, 0);
    if (taken <= 0) break;
    line.append(chunk, 0, static_cast<std::size_t>(taken));
    if (!whole) continue;
    line.pop_back();
    return line;
  }
  return std::nullopt;
}

bool RawClient::IsClosed() const {
  std::array<char, 4096> bytes;
  while (Readable(socket_)) {
    const ssize_t count = ::recv(socket_, bytes.data(), bytes.size(), 0);
    if (count <= 0) return count == 0 || errno == ECONNRESET;
  }
  return false;
}

}  // namespace baudgate
