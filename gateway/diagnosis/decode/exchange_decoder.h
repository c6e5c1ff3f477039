// What the exchanges of one device mean, by the rules and codecs of the daemon. For `decode`,
// `trace` and the page.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "config/model/line.h"
#include "gateway/base/quality.h"
#include "gateway/base/value.h"
#include "gateway/diagnosis/decode/capture.h"
#include "protocols/protocol.h"

namespace baudgate {

struct DecodedValue {
  std::string name;  ///< of the point; where there is none, how the protocol calls it
  Value value{};
  std::string unit{};
  Quality quality{};
  bool is_point = false;
};

/// "current_l1 0.5 xIn", "current_l2 - xIn (bad: not connected)".
std::string ValueText(const DecodedValue& value);

/// Where a trace tells how an exchange ended, that is its outcome: times decide, too. The reason
/// says what the bytes alone would be where that differs, and there are no values then. Where a
/// trace does not tell it and no whole frame came, the outcome is `none`: more may have come than
/// was recorded. Bytes that a trace shows as ** are unknown, and there are no values that would
/// need them.
struct DecodedExchange {
  Outcome outcome = Outcome::none;
  std::string reason;
  std::vector<DecodedValue> values;
};

/// What a device has said by itself.
struct HeardMessage {
  std::size_t end = 0;  ///< how many of the bytes it ends behind
  DecodedExchange decoded;
};

class ExchangeDecoder {
 public:
  /// `line` has this one device, with every option; the protocol is the device's.
  ExchangeDecoder(config::Line line, const Protocol& protocol);

  DecodedExchange Decode(const Capture& capture);
  /// How many bytes of the reply the first whole frame ends behind; all where there is none.
  std::size_t FirstFrame(const Capture& capture) const;

  /// The device speaks by itself.
  bool Listens() const { return conversation_->Listens() != nullptr; }
  /// The messages in these bytes. What is none of them is said in front of the next one, or at
  /// the end.
  std::vector<HeardMessage> Hear(View bytes);

 private:
  DecodedExchange ToExchange(Answer answer) const;

  std::unique_ptr<config::Line> line_;  // of the one device, which must not move
  const Protocol* protocol_;
  std::unique_ptr<Bus> bus_;
  ParsedOptions options_;
  std::unique_ptr<Conversation> conversation_;
};

}  // namespace baudgate
