// A blocking client that knows nothing but bytes, for the tests of every server: over TCP to this
// machine, or a Unix socket. It waits 20 s at most for whatever it waits for, so that no test
// hangs.
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
  /// `receive_buffer`: how many bytes the kernel may hold for it; 0: as many as it likes.
  explicit RawClient(std::uint16_t port, int receive_buffer = 0);
  explicit RawClient(const std::string& path);
  RawClient(RawClient&& other) noexcept : socket_(std::exchange(other.socket_, -1)) {}
  ~RawClient() { Close(); }

  bool connected() const { return socket_ >= 0; }
  int socket() const { return socket_; }
  void Close();

  /// How many of the bytes were taken before the other side closed.
  std::size_t Send(View bytes) const;
  std::size_t Send(std::string_view text) const;
  /// As many as fit now, without waiting; false once the other side has closed.
  bool SendSome(View bytes) const;

  /// Exactly so many bytes; none when the other side closes before.
  Bytes Receive(std::size_t count) const;
  /// One frame of Modbus TCP, header included; no bytes when the other side closes before its end.
  Bytes ReceiveFrame() const;
  /// One line without its end; nothing when the other side closes before its end.
  std::optional<std::string> ReceiveLine() const;
  /// The other side has closed; bytes before the end are passed over.
  bool IsClosed() const;

 private:
  void Connect(const void* address, std::size_t size);

  int socket_;
};

}  // namespace baudgate
