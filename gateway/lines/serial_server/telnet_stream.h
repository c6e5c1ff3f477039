// What a client sends by telnet: data and commands for the port. What the client and the server
// negotiate is answered here.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>

#include "gateway/base/bytes.h"
#include "gateway/lines/serial_server/telnet.h"

namespace baudgate::serial_server {

class TelnetStream {
 public:
  /// For the port.
  struct Part {
    enum class Kind : std::uint8_t {
      data,
      command,    ///< of RFC 2217
      break_key,  ///< IAC BRK
    };
    Kind kind = Kind::data;
    View bytes{};  ///< valid until the next call
  };

  /// What the server offers and asks for at the start.
  Bytes Begin() { return options_.Begin(); }
  /// Takes the next part from the front of `input`; empty: all of it is used up. Appends what the
  /// client is to be sent before the part is handled.
  std::optional<Part> Next(View& input, Bytes& answers);

 private:
  TelnetDecoder decoder_;
  TelnetOptions options_;
};

}  // namespace baudgate::serial_server
