// The protocols whose frames masters of the gateway may send. Null: the module is not loaded.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "config/model/modbus_framing.h"
#include "protocols/protocol.h"

namespace baudgate::modbus {

struct Frames {
  const Protocol* rtu = nullptr;
  const Protocol* ascii = nullptr;

  /// Null, too, of Modbus TCP, which needs none.
  const Protocol* Of(Framing framing) const {
    return framing == Framing::rtu ? rtu : framing == Framing::ascii ? ascii : nullptr;
  }
};

}  // namespace baudgate::modbus
