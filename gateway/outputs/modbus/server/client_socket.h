// The socket of one client: what the poll watches it for, and the answers that are not sent yet.
// The socket is closed with this.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <utility>

#include "gateway/base/bytes.h"
#include "gateway/base/time.h"
#include "gateway/outputs/modbus/server/client_poll.h"

namespace baudgate::modbus {

class ClientSocket {
 public:
  /// `socket` is connected and non-blocking. The poll and the client, which it tells, outlive this.
  ClientSocket(int socket, ClientPoll& poll, ClientPoll::Client& client, Instant now)
      : socket_(socket), poll_(poll), client_(client), blocked_since_(now) {}
  ~ClientSocket() { Close(); }
  ClientSocket(const ClientSocket&) = delete;
  ClientSocket& operator=(const ClientSocket&) = delete;

  int number() const { return socket_; }
  /// False when the kernel has no memory for it.
  bool Start();
  bool Watch(std::uint32_t events);
  bool is_read() const { return (watched_ & EPOLLIN) != 0; }
  void Close();

  /// How many bytes came to `space`; 0: the connection has ended. Empty: none are there now.
  std::optional<std::size_t> Receive(std::span<std::uint8_t> space);

  /// Answers that are not sent yet.
  Bytes& unsent() { return unsent_; }
  /// Sends as much of them as the client takes. False: the connection has ended.
  bool Flush(Instant now);
  /// The client's buffers are full: nothing is to be read or answered.
  bool is_blocked() const { return blocked_; }
  bool IsBlockedLonger(Duration time, Instant now) const {
    return blocked_ && now - blocked_since_ > time;
  }

  /// Runs `turn`, which takes a `const Now&` and keeps this alive, after whatever else is due. Does
  /// nothing if one is to be run already.
  template <typename Turn>
  void PostTurn(Turn turn) {
    if (std::exchange(turn_posted_, true)) return;
    poll_.Post([this, turn = std::move(turn)](const Now& now) {
      turn_posted_ = false;
      turn(now);
    });
  }

 private:
  int socket_;
  ClientPoll& poll_;
  ClientPoll::Client& client_;
  std::uint32_t watched_ = 0;  ///< events that the poll knows of
  Bytes unsent_;
  bool blocked_ = false;
  Instant blocked_since_;
  bool turn_posted_ = false;
};

}  // namespace baudgate::modbus
