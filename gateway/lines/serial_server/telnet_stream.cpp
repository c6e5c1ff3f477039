// SPDX-License-Identifier: Apache-2.0
#include "gateway/lines/serial_server/telnet_stream.h"

namespace baudgate::serial_server {

std::optional<TelnetStream::Part> TelnetStream::Next(View& input, Bytes& answers) {
  while (const auto item = decoder_.Next(input)) {
    switch (item->what) {
      case TelnetItem::What::data:
        return Part{.bytes = item->bytes};
      case TelnetItem::What::negotiation:
        Append(answers, options_.On(item->verb, item->option));
        // A program for serial ports sends bytes, not lines of text.
        if (options_.theirs(telnet::kBinary) || options_.theirs(telnet::kComPort)) {
          decoder_.SetBinary();
        }
        break;
      case TelnetItem::What::subnegotiation:
        if (item->option == telnet::kComPort) return Part{Part::Kind::command, item->bytes};
        break;
      case TelnetItem::What::break_key:
        return Part{.kind = Part::Kind::break_key};
    }
  }
  return std::nullopt;
}

}  // namespace baudgate::serial_server
