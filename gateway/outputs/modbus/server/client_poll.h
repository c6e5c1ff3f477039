// Tells clients that their sockets can be read or written, many at a time: one epoll set of their
// own inside the server's io_context. asio alone would cost one more system call a request.
// Sockets come from listener.cpp; client_socket.cpp reads and writes them.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <sys/epoll.h>

#include <array>
#include <asio/io_context.hpp>
#include <asio/posix/stream_descriptor.hpp>
#include <asio/post.hpp>
#include <cstdint>
#include <memory>
#include <span>
#include <utility>

#include "gateway/base/result.h"
#include "gateway/base/time.h"

namespace baudgate::modbus {

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

}  // namespace baudgate::modbus
