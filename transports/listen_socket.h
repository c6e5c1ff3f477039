// A TCP port that is open for a server, before anybody is accepted there.
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

// Small messages go out at once over a TCP connection, and a peer that has vanished without a word
// is noticed within about 25 s, where TCP alone would wait for hours.

inline void KeepWatch(int socket) {
  constexpr int kIdleSeconds = 10;
  constexpr int kIntervalSeconds = 5;
  constexpr int kProbes = 3;
  constexpr unsigned kUserTimeoutMs = 15'000;  // unacknowledged data, and probes alike
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

  /// An IPv6 address takes clients of both kinds where the system allows it. The error says what is
  /// wrong with the place and what to do; `key` is where the configuration says the place, as
  /// "web.listen".
  static Result<ListenSocket> Open(const asio::ip::tcp::endpoint& at, std::string_view key);
  bool is_open() const { return descriptor_ >= 0; }
  /// The one that the system has chosen, where 0 was asked for.
  std::uint16_t port() const;
  /// The caller owns the descriptor from now on.
  int Release() { return std::exchange(descriptor_, -1); }

 private:
  explicit ListenSocket(int descriptor) : descriptor_(descriptor) {}
  int descriptor_ = -1;
};

/// Opens `acceptor` at `at`: errors as above.
Status Listen(asio::ip::tcp::acceptor& acceptor, const asio::ip::tcp::endpoint& at,
              std::string_view key);

/// The address can leave the machine while a socket listens there: no client reaches it until the
/// address is back, and the system reports nothing. The error says so.
Status HasAddressOf(const asio::ip::tcp::acceptor& acceptor);

}  // namespace baudgate::transports
