// MbapAssembler cuts the bytes of a client into frames, and ModbusRequest is one request in its
// frame, checked byte for byte before anything acts on it; pure. Checked requests go to
// gateway/outputs/modbus/service/own_units.h.
// What may stand in a PDU is decided by protocols/modbus_pdu/modbus_pdu.h.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <string_view>
#include <utility>

#include "config/model/point.h"
#include "gateway/base/bytes.h"
#include "protocols/modbus_pdu/modbus_pdu.h"

namespace baudgate::modbus {

// Cuts the bytes that a Modbus TCP client sends into frames; no sockets, bounded memory.
// Bytes come from client_framing.h, frames go back to it. Rule: MODBUS Messaging on
// TCP/IP 1.0b, 3.1.3.

/// Transaction, protocol, length and unit.
inline constexpr std::size_t kMbapHeader = 7;
/// The length field counts the unit and the PDU; it stands in front of them.
inline constexpr std::size_t kMbapPrefix = 6;
inline constexpr std::size_t kMaxAdu = 260;

/// A whole frame: the header in front of unit and PDU.
Bytes AduOf(std::uint16_t transaction, std::uint8_t unit, View pdu);

class MbapAssembler {
 public:
  enum class State : std::uint8_t {
    need_more,
    frame,
    malformed,  ///< no boundary can be trusted any more: close the connection
  };

  /// The length of the message that begins with `head`, header included; its header counts `told`
  /// bytes. It is at most so long.
  using Length = std::function<std::size_t(View head, std::size_t told)>;

  /// `length`: where headers may count too many. Then the next header is looked for among the bytes
  /// that were counted and not taken.
  explicit MbapAssembler(Length length = {}) : length_(std::move(length)) {}

  /// Where the next bytes from the socket go. Not empty after Take or Peek said need_more.
  /// Invalidates the last frame.
  std::span<std::uint8_t> Space();
  /// `count` bytes, at most Space().size(), were put there.
  void Commit(std::size_t count);

  /// Nothing is here but what may belong to the message before.
  bool empty() const { return begin_ + surplus_ >= end_; }
  /// The transaction of the next frame, if that much of it is here.
  std::optional<std::uint16_t> transaction() const { return ByteReader(Held()).U16Be(0); }
  /// What Take would say.
  State Peek() const;
  /// Hands out the next whole frame, header included; valid until Space.
  State Take(View& frame);
  /// Why Peek or Take says malformed; empty when it does not.
  std::string_view Defect() const;

 private:
  static constexpr std::size_t kCapacity = 8 * kMaxAdu;

  View Held() const { return View(buffer_).subspan(begin_, end_ - begin_); }

  std::size_t Size() const;
  void FindHeader();

  Length length_;
  std::array<std::uint8_t, kCapacity> buffer_;
  std::size_t begin_ = 0;
  std::size_t end_ = 0;
  std::size_t surplus_ = 0;  ///< so many bytes were counted too many, or stand before the header
};

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
