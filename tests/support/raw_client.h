// `RawClient` is a blocking client for bytes over TCP to this machine or over a Unix socket. No
// call waits longer than 20 s, so that no test hangs.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <utility>

#include "gateway/base/bytes.h"

namespace baudgate {

class RawClient {
 public:
  /// `receive_buffer` is the size of the kernel's receive buffer in bytes; 0: the default.
  explicit RawClient(std::uint16_t port, int receive_buffer = 0);
  explicit RawClient(const std::string& path);
  /// Connects from another address of this machine, such as "127.0.0.2".
  RawClient(std::uint16_t port, const std::string& from);
  RawClient(RawClient&& other) noexcept : socket_(std::exchange(other.socket_, -1)) {}
  ~RawClient() { Close(); }

  bool connected() const { return socket_ >= 0; }
  int socket() const { return socket_; }
  void Close();

  /// Returns how many of the bytes were sent before the other side closed.
  std::size_t Send(View bytes) const;
  std::size_t Send(std::string_view text) const;
  /// Sends as many bytes as fit now, without waiting. Returns false if the other side has closed.
  bool SendSome(View bytes) const;

  /// Returns exactly `count` bytes, or none if the other side closes before.
  Bytes Receive(std::size_t count) const;
  /// Returns one Modbus TCP frame with its header; empty if the connection ends before.
  Bytes ReceiveFrame() const;
  /// Returns one line without its end; nothing if the other side closes before.
  std::optional<std::string> ReceiveLine() const;
  bool IsClosed() const;

 private:
  void Connect(const void* address, std::size_t size);

  int socket_;
};

}  // namespace baudgate
