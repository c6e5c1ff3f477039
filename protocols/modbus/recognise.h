// Explains bytes that came in place of a Modbus reply: another framing, slave or master, a wrong
// header.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>

#include "gateway/base/bytes.h"
#include "protocols/modbus/codec.h"
#include "protocols/protocol.h"

namespace baudgate::protocols::modbus {

/// `request`: a frame of this framing.
std::optional<Recognised> Recognise(Framing framing, View request, View heard);

/// See ForeignRule. Recognises requests that read or write one value, and replies to reads.
std::optional<std::string> ForeignRtu(View heard);

}  // namespace baudgate::protocols::modbus
