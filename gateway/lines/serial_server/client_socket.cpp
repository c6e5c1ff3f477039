// SPDX-License-Identifier: Apache-2.0
#include "gateway/lines/serial_server/client_socket.h"

#include <sys/socket.h>

#include <utility>

#include "transports/tcp_watch.h"

namespace baudgate::serial_server {
namespace {

/// A session with a fast port costs fewer calls so.
constexpr std::size_t kReadAtMost = 16 * 1024;

std::string HowOf(const std::error_code& error) {
  if (error == asio::error::timed_out || error == asio::error::no_buffer_space) {
    return "it reads nothing of what the port has received";
  }
  if (error == asio::error::connection_reset) return "it has left";
  return "its connection failed: " + error.message();
}

}  // namespace

ClientSocket::ClientSocket(asio::ip::tcp::socket socket, Events events) {
  KeepWatch(socket.native_handle());
  pump_ = std::make_shared<StreamPump<asio::ip::tcp::socket>>(
      std::move(socket), std::move(events.bytes),
      [end = std::move(events.end)](const std::error_code& error) {
        end(error != asio::error::eof, HowOf(error));
      },
      std::move(events.room), kStall, kReadAtMost);
}

ClientSocket::~ClientSocket() {
  pump_->Stop();
  std::error_code ignored;
  pump_->stream().close(ignored);
}

bool ClientSocket::HasLeft() {
  char byte = 0;
  return ::recv(pump_->stream().native_handle(), &byte, 1, MSG_PEEK | MSG_DONTWAIT) == 0;
}

}  // namespace baudgate::serial_server
