// `NetStream` is a TCP connection, with or without TLS, with the functions of asio's sockets that
// `StreamPump` calls.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <sys/socket.h>

#include <asio/buffer.hpp>
#include <asio/ip/tcp.hpp>
#include <asio/post.hpp>
#include <memory>
#include <system_error>
#include <utility>

#include "gateway/base/bytes.h"
#include "transports/tls_context.h"

namespace baudgate::tls {

/// Returns the socket of `channel`, whose handshake has succeeded, for the loop `io`.
inline asio::ip::tcp::socket SocketOf(Channel& channel, asio::io_context& io) {
  const int owned = channel.Release();
  int family = AF_INET;
  socklen_t size = sizeof family;
  (void)::getsockopt(owned, SOL_SOCKET, SO_DOMAIN, &family, &size);
  return {io, family == AF_INET6 ? asio::ip::tcp::v6() : asio::ip::tcp::v4(), owned};
}

/// The stream must exist, and must not be moved, until the handlers of its pending operations were
/// called: each handler must keep the stream alive, for example by a shared_ptr to its owner. All
/// calls must come from one thread.
class NetStream {
 public:
  using Socket = asio::ip::tcp::socket;
  static constexpr auto wait_read = Socket::wait_read;
  static constexpr auto wait_write = Socket::wait_write;

  /// Without a channel, the bytes are not encrypted.
  explicit NetStream(Socket socket, std::unique_ptr<Channel> channel = {})
      : socket_(std::move(socket)), channel_(std::move(channel)) {}

  auto get_executor() { return socket_.get_executor(); }
  int native_handle() { return socket_.native_handle(); }
  /// Null: the connection is not encrypted.
  const Channel* channel() const { return channel_.get(); }
  void non_blocking(bool mode, std::error_code& error) { socket_.non_blocking(mode, error); }
  /// Closes the connection with a reset: the kernels of both ends drop what was not delivered.
  void Reset() {
    std::error_code ignored;
    socket_.set_option(asio::socket_base::linger(true, 0), ignored);
    socket_.close(ignored);
  }
  void close(std::error_code& error) {
    if (channel_ && socket_.is_open()) channel_->End();
    socket_.close(error);
  }

  std::size_t write_some(asio::const_buffer bytes, std::error_code& error) {
    if (!channel_) return socket_.write_some(bytes, error);
    const auto* const data = static_cast<const std::uint8_t*>(bytes.data());
    std::size_t taken = 0;
    error = {};
    while (taken < bytes.size() && !error) {
      const auto moved = channel_->Write(View(data + taken, bytes.size() - taken));
      taken += moved.count;
      error = moved.error;
    }
    if (taken > 0) error = {};
    return taken;
  }

  template <typename Handler>
  void async_read_some(asio::mutable_buffer space, Handler handler) {
    if (!channel_) return socket_.async_read_some(space, std::move(handler));
    if (channel_->HasPending()) {
      return asio::post(get_executor(), [this, space, handler = std::move(handler)]() mutable {
        Read(space, std::move(handler));
      });
    }
    socket_.async_wait(wait_read, [this, space, handler = std::move(handler)](
                                      const std::error_code& error) mutable {
      if (error) return handler(error, std::size_t{0});
      Read(space, std::move(handler));
    });
  }

  template <typename Handler>
  void async_wait(Socket::wait_type which, Handler handler) {
    socket_.async_wait(which, std::move(handler));
  }

 private:
  template <typename Handler>
  void Read(asio::mutable_buffer space, Handler handler) {
    // The number of a closed socket can belong to another connection.
    if (!socket_.is_open()) return handler(asio::error::operation_aborted, std::size_t{0});
    const auto moved = channel_->Read({static_cast<std::uint8_t*>(space.data()), space.size()});
    if (moved.error == asio::error::would_block) {
      return async_read_some(space, std::move(handler));
    }
    handler(moved.error, moved.count);
  }

  Socket socket_;
  std::unique_ptr<Channel> channel_;
};

}  // namespace baudgate::tls
