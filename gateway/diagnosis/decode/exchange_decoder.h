// ExchangeDecoder says what the exchanges of one device mean, by the rules and codecs of the
// daemon, for `decode`, `trace` and the web page. Capture is one exchange as it was recorded.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "config/model/line.h"
#include "gateway/base/bytes.h"
#include "gateway/base/outcome.h"
#include "gateway/base/time.h"
#include "gateway/base/value.h"
#include "protocols/protocol.h"

namespace baudgate {

// One exchange as it was recorded: for ExchangeDecoder.
struct Capture {
  bool unasked = false;  ///< there is no request: a device may have sent it by itself
  int line = 0;          ///< of the recording, where it begins
  Bytes request{};
  Bytes reply{};
  bool request_masked = false;
  bool reply_masked = false;
  std::string time{};   ///< of a trace, and so is all below
  Duration heard_at{};  ///< of the day, its newest bytes
  std::string device{};
  std::optional<Outcome> told{};  ///< how it ended when it was recorded
  std::string why{};              ///< and the reason that was recorded with it
  bool ended = false;             ///< what comes now belongs to no exchange
  bool last = false;              ///< nothing follows it in the recording

  /// More may have come than was recorded.
  bool is_open() const { return !time.empty() && !told; }
};

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
