// The socket of one client: what the poll watches it for, and the answers that are not sent yet.
// The socket is closed with this. ClientPoll is the epoll set of all clients.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <sys/epoll.h>

#include <array>
#include <asio/io_context.hpp>
#include <asio/posix/stream_descriptor.hpp>
#include <asio/post.hpp>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <utility>

#include "gateway/base/bytes.h"
#include "gateway/base/result.h"
#include "gateway/base/time.h"

namespace baudgate::modbus {

// Tells clients that their sockets can be read or written, many at a time: one epoll set of their
// own inside the server's io_context. asio alone would cost one more system call a request.
// Sockets come from listener.cpp; ClientSocket reads and writes them.

/// All but Open on the thread that runs the io_context.
class ClientPoll : public std::enable_shared_from_this<ClientPoll> {
 public:
  class Client {
   public:
    /// Some of EPOLLIN, EPOLLOUT, EPOLLERR and EPOLLHUP; the last two come unasked. Comes again
    /// for as long as it holds. `now` is read once for all that are ready together. The client may
    /// remove itself and others.
    virtual void OnEvents(std::uint32_t events, const Now& now) = 0;

   protected:
    ~Client() = default;
  };

  explicit ClientPoll(asio::io_context& io) : set_(io) {}

  /// Takes what it needs of the system.
  Status Open();
  /// Clients are served from now on, until Close.
  void Start() { Wait(); }
  void Close();

  /// False when the kernel has no memory for it. The client is removed before it or its socket
  /// goes.
  bool Add(int socket, Client& client, std::uint32_t events);
  bool Change(int socket, Client& client, std::uint32_t events);
  void Remove(int socket, Client& client);

  /// Runs `task`, which takes a `const Now&`, after whatever else is due.
  template <typename Task>
  void Post(Task task) {
    asio::post(set_.get_executor(), [task = std::move(task)] { task(ReadClocks()); });
  }

 private:
  void Wait();
  void Serve();
  /// Serves the clients that are ready now; returns how many.
  std::size_t ServeBatch();

  asio::posix::stream_descriptor set_;
  std::array<epoll_event, 128> events_{};
  std::span<epoll_event> unserved_;  ///< the rest of the batch in hand
  std::size_t count_ = 0;            ///< clients
  Client* only_ = nullptr;           ///< the one client that there is, when it waits to be read
};

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
