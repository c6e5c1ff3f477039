// One Modbus request in its frame, checked byte for byte before anything acts on it; pure. Frames
// come from mbap.h; checked requests go to gateway/outputs/modbus/service/local_units.h. What may
// stand in a PDU is decided by protocols/modbus/pdu/modbus_pdu.h.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>

#include "config/model/point.h"
#include "gateway/base/bytes.h"
#include "gateway/outputs/modbus/wire/mbap.h"
#include "protocols/modbus/pdu/modbus_pdu.h"

namespace baudgate::modbus {

/// A checked request of function 1-6, 15 or 16 and the frame that it came in.
struct ModbusRequest : PlainRequest {
  View frame;  ///< header included; valid as long as the frame is
  std::uint8_t unit = 0;

  config::Table table() const {
    return IsAboutBits(function) ? config::Table::bits : config::Table::registers;
  }
};

/// The unit that a whole frame is for.
inline std::uint8_t UnitOf(View frame) { return frame[kMbapHeader - 1]; }
inline std::uint8_t FunctionOf(View frame) { return frame[kMbapHeader]; }
inline std::uint16_t TransactionOf(View frame) {
  return static_cast<std::uint16_t>(frame[0] << 8U | frame[1]);
}
inline Bytes CopyOf(View bytes) { return Bytes(bytes.begin(), bytes.end()); }
inline View PduOf(View frame) { return frame.subspan(kMbapHeader); }

/// Fills `request` from a whole frame (MbapAssembler::Take), or says with which exception to
/// answer it.
ExceptionCode ParseRequest(View frame, ModbusRequest& request);

/// Bytes of the whole frame that answers a checked request.
std::size_t ReplySize(const ModbusRequest& request);

/// The nine bytes that answer `frame` with an exception.
std::array<std::uint8_t, 9> ExceptionReply(View frame, ExceptionCode code);

}  // namespace baudgate::modbus
