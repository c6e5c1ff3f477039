// What bytes are that came in place of a Modbus reply: another framing, another slave, another
// master, a header that does not fit.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

#include "gateway/base/bytes.h"
#include "protocols/modbus/codec.h"
#include "protocols/protocol.h"

namespace baudgate::protocols::modbus {

/// `request`: one of this framing.
std::optional<Recognised> Recognise(Framing framing, View request, View heard);

}  // namespace baudgate::protocols::modbus
