// `ListenSocket` opens a TCP port for a server, before the server accepts clients.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <netinet/in.h>
#include <netinet/tcp.h>
#include <sys/socket.h>

#include <asio/ip/tcp.hpp>
#include <cstdint>
#include <string_view>
#include <utility>

#include "gateway/base/result.h"

namespace baudgate::transports {

// `KeepWatch` sets up a TCP connection: small messages are sent at once, and a peer that vanished
// without closing the connection is noticed within about 25 s instead of hours.

inline void KeepWatch(int socket) {
  constexpr int kIdleSeconds = 10;
  constexpr int kIntervalSeconds = 5;
  constexpr int kProbes = 3;
  constexpr unsigned kUserTimeoutMs = 15'000;  // the longest time without an acknowledgement
  const auto set = [socket](int level, int name, auto value) {
    (void)setsockopt(socket, level, name, &value, sizeof value);
  };
  set(IPPROTO_TCP, TCP_NODELAY, 1);
  set(SOL_SOCKET, SO_KEEPALIVE, 1);
  set(IPPROTO_TCP, TCP_KEEPIDLE, kIdleSeconds);
  set(IPPROTO_TCP, TCP_KEEPINTVL, kIntervalSeconds);
  set(IPPROTO_TCP, TCP_KEEPCNT, kProbes);
  set(IPPROTO_TCP, TCP_USER_TIMEOUT, kUserTimeoutMs);
}

class ListenSocket {
 public:
  ListenSocket() = default;
  ~ListenSocket();
  ListenSocket(ListenSocket&& other) noexcept : descriptor_(std::exchange(other.descriptor_, -1)) {}
  ListenSocket& operator=(ListenSocket&& other) noexcept {
    std::swap(descriptor_, other.descriptor_);
    return *this;
  }

  /// Opens a listening socket at `at`. A socket with an IPv6 address also accepts IPv4 clients if
  /// the system allows it. The error names the fault and the remedy; `key` is the configuration key
  /// of the address, such as "web.listen".
  static Result<ListenSocket> Open(const asio::ip::tcp::endpoint& at, std::string_view key);
  /// Takes over a descriptor that listens already.
  static ListenSocket Of(int descriptor) { return ListenSocket(descriptor); }
  bool is_open() const { return descriptor_ >= 0; }
  /// Returns the port number, even if `at` had port 0 and the system has chosen the number.
  std::uint16_t port() const;
  /// Passes the descriptor to the caller, who must close it.
  int Release() { return std::exchange(descriptor_, -1); }

 private:
  explicit ListenSocket(int descriptor) : descriptor_(descriptor) {}
  int descriptor_ = -1;
};

/// Opens a socket with ListenSocket::Open and lets `acceptor` listen on it.
Status Listen(asio::ip::tcp::acceptor& acceptor, const asio::ip::tcp::endpoint& at,
              std::string_view key);

/// Returns an error if this machine no longer has the address on which `acceptor` listens. Clients
/// cannot connect until the address is back, and the system does not report this.
Status HasAddressOf(const asio::ip::tcp::acceptor& acceptor);

}  // namespace baudgate::transports
