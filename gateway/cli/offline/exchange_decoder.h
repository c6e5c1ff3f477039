// What the exchanges of one device mean, by the rules and codecs of the daemon. For `decode` and
// `trace`.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "config/catalog/catalog.h"
#include "config/model/line.h"
#include "gateway/base/quality.h"
#include "gateway/base/result.h"
#include "gateway/base/value.h"
#include "gateway/cli/offline/captures.h"

namespace baudgate {

struct DecodedValue {
  std::string name;  ///< of the point; where there is none, how the protocol calls it
  Value value{};
  std::string unit{};
  Quality quality{};
  bool is_point = false;
};

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

class ExchangeDecoder {
 public:
  /// The error says what of protocol, profile and options is wrong; the catalog outlives it.
  static Result<ExchangeDecoder> Create(const TracedDevice& traced, const config::Catalog& catalog);

  DecodedExchange Decode(const Capture& capture);
  /// How many bytes of the reply the first whole frame ends behind; all where there is none.
  std::size_t FirstFrame(const Capture& capture) const;

 private:
  ExchangeDecoder(config::Line line, const Protocol& protocol);

  std::unique_ptr<config::Line> line_;  // of the one device, which must not move
  const Protocol* protocol_;
  std::unique_ptr<Bus> bus_;
  std::unique_ptr<Conversation> conversation_;
};

}  // namespace baudgate
