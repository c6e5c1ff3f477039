// From the bytes of a client to checked requests, and how its replies are framed. Pure.
// ClientFraming cuts Modbus TCP, or RTU or ASCII frames over TCP; inside the server every frame has
// its Modbus TCP form. MbapAssembler cuts Modbus TCP. ModbusRequest is one request in its frame,
// checked byte for byte before anything acts on it. Frames lists the protocols, and OtherFraming
// recognises a client that frames its messages in another way. Bytes come from
// gateway/outputs/modbus/server/client_session.cpp, requests go to
// gateway/outputs/modbus/service/own_units.h. What may stand in a PDU is decided by
// protocols/modbus_pdu/modbus_pdu.h.
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

// Cuts the bytes that a Modbus TCP client sends into frames; no sockets, bounded memory.
// Rule: MODBUS Messaging on TCP/IP 1.0b, 3.1.3.

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

// The protocols whose frames masters of the gateway may send. Null: the module is not loaded.
struct Frames {
  const protocols::Protocol* rtu = nullptr;
  const protocols::Protocol* ascii = nullptr;

  /// Null, too, of Modbus TCP, which needs none.
  const protocols::Protocol* Of(Framing framing) const {
    return framing == Framing::rtu ? rtu : framing == Framing::ascii ? ascii : nullptr;
  }
};

// Recognises a client that frames its messages in another way than its listener expects, by the
// first bytes that it sends. Pure.
//
//   00 01 00 00 00 06 01 03 00 00 00 01     Modbus TCP
//   01 03 00 00 00 01 84 0A                 Modbus RTU: the CRC is right
//   :010300000001FB CR LF                   Modbus ASCII: the LRC is right

/// How many of the first received bytes are examined.
inline constexpr std::size_t kMostLookedAt = 520;

/// What `heard`, which has no request in the framing `expected`, is in another. Empty: that
/// cannot be told.
std::optional<Framing> OtherFraming(View heard, Framing expected, const Frames& frames);

class ClientFraming {
 public:
  using State = MbapAssembler::State;

  virtual ~ClientFraming() = default;

  /// Where the next bytes from the socket go. Not empty after Take or Peek said need_more.
  /// Invalidates the last frame.
  virtual std::span<std::uint8_t> Space() = 0;
  /// `count` bytes, at most Space().size(), were put there.
  virtual void Commit(std::size_t count) = 0;
  /// The client has been silent for a while: half a frame will not be completed any more.
  virtual void Settle() = 0;

  /// What Take would say.
  virtual State Peek() = 0;
  /// Hands out the next whole frame in its Modbus TCP form; valid until Space or the
  /// next Take.
  virtual State Take(View& frame) = 0;
  /// Something has come after the last request that is, or may become, the next one: an answer
  /// that says not what it answers would be taken for the answer to that.
  virtual bool HoldsMore() = 0;
  /// Why Peek or Take says malformed; empty when it does not.
  virtual std::string_view Defect() const = 0;

  /// Puts a reply, given in its Modbus TCP form, behind `out` as the client is to read it.
  virtual void Append(Bytes& out, View frame) const = 0;
  /// Replies carry nothing that tells which request they answer, so a client that asks again has
  /// given up what it asked before; and they do not look like their Modbus TCP form.
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
  /// `protocol` has a carrier.
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
  Bytes next_;  ///< looked at by Peek, not taken yet
  Bytes taken_;
  bool settled_ = false;
};

/// `frames` must have an entry for `framing`.
std::unique_ptr<ClientFraming> MakeFraming(Framing framing, const Frames& frames);

}  // namespace baudgate::modbus
