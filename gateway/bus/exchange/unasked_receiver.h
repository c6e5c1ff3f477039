// Receives what a device sends unasked: whole messages out of bytes that come at any time. Sans-I/O
// and pure as the line, which owns it (gateway/bus/exchange/line.h). Bytes of no message are left
// for the exchange under way.
//
//   what is held          what it becomes
//   whole by its rule     a message, at once
//   silent for `idle`     the rule is asked once more: a message, or damaged
//   longer than `whole`   damaged, and so is what follows up to a silence or a marked beginning
//   behind a message      damaged as well, where no beginning is marked and `whole` is not over: it
//   that broke off        may be the rest of that one
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string_view>
#include <vector>

#include "gateway/base/bytes.h"
#include "gateway/base/time.h"
#include "protocols/assembler.h"
#include "protocols/conversation.h"

namespace baudgate {

struct UnaskedMessage {
  Bytes bytes;
  Duration since{};  ///< from its last byte to now; see ExchangeEnd::since_reply
};

/// The effect of one input.
struct UnaskedInput {
  std::vector<UnaskedMessage> messages;
  std::size_t damaged = 0;  ///< messages, as far as they can be told apart
  std::string_view why{};   ///< reason of the last of them; static text
  Bytes rest;               ///< bytes of no message, in their order
};

class UnaskedReceiver {
 public:
  /// `what` outlives it.
  explicit UnaskedReceiver(const Standing& what) : what_(what) {}

  /// Before all else: the port has opened.
  void Begin(Instant now);
  UnaskedInput OnBytes(View bytes, Instant now);
  /// When Deadline() has come. Early calls do nothing.
  UnaskedInput OnTimer(Instant now);

  /// Part of a message has come.
  bool receiving() const { return assembler_.held() > 0; }
  std::optional<Instant> Deadline() const;

 private:
  void Take(UnaskedInput& heard, bool idle, Instant now);
  void Align(Instant now);
  void End(UnaskedInput& heard, Instant now);
  void Damage(UnaskedInput& heard, std::string_view why);
  Instant TooLong() const;

  const Standing& what_;
  Assembler assembler_;
  /// The next byte begins a message, or messages are recognised by their beginning.
  bool aligned_ = true;
  bool damaged_ = false;  // what came last
  Instant torn_until_{};  // what begins before this may be the rest of a message that broke off
  Instant began_{};       // the message that is held
  Instant last_byte_{};   // or when the port opened
};

}  // namespace baudgate
