// `Handshakes` makes TLS connections of TCP connections, on a thread of its own, so that a client
// that is slow, or a flood of clients, delays nothing that is connected already. Modbus listeners,
// the servers of ports, lines on serial servers and routes to Modbus servers use it.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <asio/io_context.hpp>
#include <cstddef>
#include <functional>
#include <memory>
#include <string>
#include <utility>

#include "gateway/base/fair_places.h"
#include "gateway/base/guarded.h"
#include "gateway/base/result.h"
#include "gateway/base/time.h"
#include "transports/tls_context.h"

namespace baudgate::tls {

/// The thread starts with the first call of Begin. Any thread may call the functions.
class Handshakes {
 public:
  /// A handshake that takes longer fails.
  static constexpr Duration kDeadline = std::chrono::seconds(10);
  /// The most handshakes with clients at the same time. One host has at most half of the places
  /// that other hosts leave (FairPlaces).
  static constexpr std::size_t kMost = 128;

  /// Error: what failed, such as "it has sent no certificate"; "it" is the peer. The socket is
  /// closed then.
  using Done = std::function<void(Result<std::unique_ptr<Channel>>)>;

  /// The caller holds a ticket while it waits. After the ticket is destroyed, `done` is not called
  /// any more, and the socket is closed. Only the thread of the loop may use the ticket.
  struct Attempt;
  class Ticket {
   public:
    Ticket() = default;
    Ticket(Ticket&&) noexcept = default;
    Ticket& operator=(Ticket&& other) noexcept {
      if (this != &other) {
        Drop();
        attempt_ = std::move(other.attempt_);
      }
      return *this;
    }
    ~Ticket() { Drop(); }

   private:
    friend class Handshakes;
    void Drop();
    std::shared_ptr<Attempt> attempt_;
  };

  /// Begins the handshake on the connected TCP socket `owned`. `done` is called once, on the thread
  /// of `io`, never inside this call. `files` are looked at on the thread of the handshakes, so a
  /// disk that does not answer delays only new connections. `peer`: the address of a client, for
  /// the share of its host, or the name or address of a server, which its certificate must contain.
  [[nodiscard]] Ticket Begin(int owned, std::shared_ptr<ContextFiles> files,
                             const std::string& peer, asio::io_context& io, Done done);

  /// Returns the instance that the whole process shares.
  static Handshakes& OfProcess();

  Handshakes();
  ~Handshakes();
  Handshakes(const Handshakes&) = delete;
  Handshakes& operator=(const Handshakes&) = delete;

 private:
  struct Loop;
  /// Returns the loop of the handshakes; the first call starts the loop and its thread. Null: the
  /// system has no threads or file descriptors left; the next call tries again.
  Loop* Running();

  Mutex mutex_;
  std::unique_ptr<Loop> loop_ BAUDGATE_GUARDED_BY(mutex_);
};

}  // namespace baudgate::tls
