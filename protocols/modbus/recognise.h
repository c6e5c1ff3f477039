// Explains bytes that came in place of a Modbus reply: another framing, another slave, another
// master, or a wrong header.
#pragma once

#include <optional>
#include <string>

#include "gateway/base/bytes.h"
#include "protocols/modbus/codec.h"
#include "protocols/protocol.h"

namespace baudgate::protocols::modbus {

/// Explains `heard`, which came after `request`, a whole frame of this framing. Empty: no
/// explanation.
std::optional<Recognised> Recognise(Framing framing, View request, View heard);

/// A ForeignRule (protocols/protocol.h): recognises requests that read, or write one value, and
/// replies to reads.
std::optional<std::string> ForeignRtu(View heard);

}  // namespace baudgate::protocols::modbus
