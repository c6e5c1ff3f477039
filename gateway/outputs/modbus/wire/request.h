// `ModbusRequest` is a request in its frame, checked byte for byte before it has any effect.
// `ClientFraming` cuts the bytes of a client (Modbus TCP, or RTU or ASCII over TCP) into frames,
// and frames the replies; inside the server every frame has its Modbus TCP form. `MbapAssembler`
// cuts Modbus TCP. `OtherFraming` recognises a client that uses another framing. No I/O, no clock.
// Bytes come from gateway/outputs/modbus/server/client_session.cpp; requests are passed to
// gateway/outputs/modbus/service/own_units.h. protocols/modbus_pdu/modbus_pdu.h decides which PDUs
// are valid.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string_view>
#include <utility>

#include "config/model/modbus.h"
#include "config/model/point.h"
#include "gateway/base/bytes.h"
#include "protocols/assembler.h"
#include "protocols/modbus_pdu/modbus_pdu.h"
#include "protocols/protocol.h"

namespace baudgate::modbus {

// `MbapAssembler` cuts the bytes of a Modbus TCP client into frames. No sockets, bounded memory.
// Source: MODBUS Messaging on TCP/IP 1.0b, 3.1.3.

/// Size of the header in bytes: transaction, protocol, length and unit.
inline constexpr std::size_t kMbapHeader = 7;
/// Bytes before the part of a frame that the length field counts. That part is the unit and the
/// PDU.
inline constexpr std::size_t kMbapPrefix = 6;
inline constexpr std::size_t kMaxAdu = 260;

Bytes AduOf(std::uint16_t transaction, std::uint8_t unit, View pdu);

class MbapAssembler {
 public:
  enum class State : std::uint8_t {
    need_more,
    frame,
    /// The end of the frame is unknown, so the caller must close the connection.
    malformed,
  };

  /// Returns the real length of a PDU in bytes, at most `told`. `head` begins with the frame's
  /// header, which announces a PDU of `told` bytes.
  using Length = std::function<std::size_t(View head, std::size_t told)>;

  /// `length` is needed for servers whose header can announce more bytes than the frame has: the
  /// next header is then searched for among the announced bytes that are not part of the frame.
  explicit MbapAssembler(Length length = {}) : length_(std::move(length)) {}

  /// Returns the free space for the next bytes from the socket; it is not empty after Take or Peek
  /// returned need_more. The frame of the last Take becomes invalid.
  std::span<std::uint8_t> Space();
  void Commit(std::size_t count);

  /// True if the buffer contains no byte of the next frame. Bytes that can still belong to the
  /// previous frame do not count.
  bool empty() const { return begin_ + surplus_ >= end_; }
  /// Returns the transaction number of the next frame, if two bytes of the frame have been
  /// received.
  std::optional<std::uint16_t> transaction() const { return ByteReader(Held()).U16Be(0); }
  State Peek() const;
  /// Returns the next whole frame, including its header, in `frame`; valid until Space is called.
  State Take(View& frame);
  /// Returns the reason if Peek or Take returns malformed, else an empty text.
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
  /// Bytes between the last frame and the next header: the last header announced them, but they are
  /// not part of its frame.
  std::size_t surplus_ = 0;
};

/// A checked request of function 1-6, 15 or 16 and the frame that contains it.
struct ModbusRequest : PlainRequest {
  View frame;  ///< the frame including its header: a view of the caller's bytes
  std::uint8_t unit = 0;

  config::Table table() const {
    return IsAboutBits(function) ? config::Table::bits : config::Table::registers;
  }
};

inline std::uint8_t UnitOf(View frame) { return frame[kMbapHeader - 1]; }
inline std::uint8_t FunctionOf(View frame) { return frame[kMbapHeader]; }
inline std::uint16_t TransactionOf(View frame) {
  return static_cast<std::uint16_t>(frame[0] << 8U | frame[1]);
}
inline Bytes CopyOf(View bytes) { return Bytes(bytes.begin(), bytes.end()); }
inline View PduOf(View frame) { return frame.subspan(kMbapHeader); }

/// Fills `request` from a whole frame (MbapAssembler::Take). If the request is invalid, returns the
/// exception for the reply.
ExceptionCode ParseRequest(View frame, ModbusRequest& request);

std::size_t ReplySize(const ModbusRequest& request);

std::array<std::uint8_t, 9> ExceptionReply(View frame, ExceptionCode code);

// The protocols of the serial framings that clients can use. Null: the module is not loaded.
struct Frames {
  const protocols::Protocol* rtu = nullptr;
  const protocols::Protocol* ascii = nullptr;

  /// Returns the protocol of a framing. Also null for Modbus TCP, which needs no module.
  const protocols::Protocol* Of(Framing framing) const {
    return framing == Framing::rtu ? rtu : framing == Framing::ascii ? ascii : nullptr;
  }
};

// `OtherFraming` recognises a client that uses another framing than its listener expects, by the
// first bytes that the client sends:
//
//   00 01 00 00 00 06 01 03 00 00 00 01     Modbus TCP
//   01 03 00 00 00 01 84 0A                 Modbus RTU: the CRC is right
//   :010300000001FB CR LF                   Modbus ASCII: the LRC is right

/// The number of first bytes of a client that are examined.
inline constexpr std::size_t kMostLookedAt = 520;

/// Returns the framing, other than `expected`, in which `heard` contains a request; nothing: no
/// framing fits.
std::optional<Framing> OtherFraming(View heard, Framing expected, const Frames& frames);

class ClientFraming {
 public:
  using State = MbapAssembler::State;

  virtual ~ClientFraming() = default;

  virtual std::span<std::uint8_t> Space() = 0;
  virtual void Commit(std::size_t count) = 0;
  /// Must be called when the client has been silent for so long that the rest of an incomplete
  /// frame will not come. The next Peek drops the incomplete frame.
  virtual void Settle() = 0;

  /// Returns what Take would return, without taking the frame.
  virtual State Peek() = 0;
  /// Returns the next whole frame in `frame`, in its Modbus TCP form; valid until the next call of
  /// Space or Take.
  virtual State Take(View& frame) = 0;
  /// True if bytes after the last request are, or can become, the next request. A reply without a
  /// transaction number, sent now, would be taken for the reply to this next request.
  virtual bool HoldsMore() = 0;
  virtual std::string_view Defect() const = 0;

  /// Appends a reply to `out` in the client's framing. `frame` is the reply in its Modbus TCP form.
  virtual void Append(Bytes& out, View frame) const = 0;
  /// True if replies contain no transaction number (RTU, ASCII). A client that sends the next
  /// request has then given up the previous request, and replies differ on the wire from their
  /// Modbus TCP form.
  virtual bool one_at_a_time() const = 0;
};

class MbapFraming final : public ClientFraming {
 public:
  std::span<std::uint8_t> Space() override { return assembler_.Space(); }
  void Commit(std::size_t count) override { assembler_.Commit(count); }
  void Settle() override {}
  State Peek() override { return assembler_.Peek(); }
  State Take(View& frame) override { return assembler_.Take(frame); }
  bool HoldsMore() override { return false; }
  std::string_view Defect() const override { return assembler_.Defect(); }
  void Append(Bytes& out, View frame) const override { baudgate::Append(out, frame); }
  bool one_at_a_time() const override { return false; }

 private:
  MbapAssembler assembler_;
};

class SerialFraming final : public ClientFraming {
 public:
  /// `protocol` must support framing (have a carrier) and outlive this object.
  explicit SerialFraming(const protocols::Protocol& protocol);

  std::span<std::uint8_t> Space() override;
  void Commit(std::size_t count) override;
  void Settle() override { settled_ = true; }
  State Peek() override;
  State Take(View& frame) override;
  bool HoldsMore() override { return Peek() == State::frame || assembler_.held() > 0; }
  std::string_view Defect() const override { return {}; }
  void Append(Bytes& out, View frame) const override;
  bool one_at_a_time() const override { return true; }

 private:
  static constexpr std::size_t kCapacity = 1024;

  const protocols::PduCarrier& carrier_;
  protocols::Assembler assembler_;
  std::array<std::uint8_t, kCapacity> buffer_;
  /// A request in its Modbus TCP form that Peek has found and Take has not returned yet.
  Bytes next_;
  Bytes taken_;
  bool settled_ = false;
};

/// `frames` must contain the protocol of `framing`, unless `framing` is Modbus TCP.
std::unique_ptr<ClientFraming> MakeFraming(Framing framing, const Frames& frames);

}  // namespace baudgate::modbus
