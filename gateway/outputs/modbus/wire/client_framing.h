// How a client's bytes are cut into requests and how its replies are framed: Modbus TCP, or RTU
// or ASCII frames over TCP. No sockets, bounded memory. Bytes come from
// gateway/outputs/modbus/server/client_session.cpp; inside the server every frame has its Modbus
// TCP form. Frames lists the protocols, and OtherFraming recognises a client that frames its
// messages in another way.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string_view>

#include "config/model/modbus.h"
#include "gateway/base/bytes.h"
#include "gateway/outputs/modbus/wire/request.h"
#include "protocols/assembler.h"
#include "protocols/protocol.h"

namespace baudgate::modbus {

// The protocols whose frames masters of the gateway may send. Null: the module is not loaded.
struct Frames {
  const Protocol* rtu = nullptr;
  const Protocol* ascii = nullptr;

  /// Null, too, of Modbus TCP, which needs none.
  const Protocol* Of(Framing framing) const {
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
  explicit SerialFraming(const Protocol& protocol);

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

  const PduCarrier& carrier_;
  Assembler assembler_;
  std::array<std::uint8_t, kCapacity> buffer_;
  Bytes next_;  ///< looked at by Peek, not taken yet
  Bytes taken_;
  bool settled_ = false;
};

/// `frames` must have an entry for `framing`.
std::unique_ptr<ClientFraming> MakeFraming(Framing framing, const Frames& frames);

}  // namespace baudgate::modbus
