// What may stand in `read` and `write` of a point: a field of a telegram, "weight.weight",
// "input(channel=3).value", "status.flags[b3]", "weight.state=S"; a telegram that is sent, "tare".
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "protocols/protocol.h"
#include "protocols/telegram/description.h"
#include "protocols/telegram/reply.h"

namespace baudgate::protocols::telegram {

/// A telegram with its parameters.
struct Call {
  std::string telegram;
  std::vector<std::pair<std::string, std::string>> parameters{};

  bool operator==(const Call&) const = default;
};

/// Whether `telegram`, sent with these values, is what the call means.
bool IsCallOf(const Call& call, const Telegram& telegram, const Bound& sent);

struct ReadPlace {
  Call call;
  std::string field;
  enum class Select : std::uint8_t { whole, bits, equal } select = Select::whole;
  unsigned bit = 0;  ///< of bits: the first
  unsigned bits = 1;
  std::string equal{};  ///< true where the field says this

  bool operator==(const ReadPlace&) const = default;
};

Result<ReadPlace> ParseRead(const config::Point& point);
Result<Call> ParseWrite(const config::Point& point);
Status CheckPoint(const config::Point& point);

std::span<const DecoderSpec> DecoderTable();

/// What the answer says of the point.
Decoded ValueAt(const ReadPlace& place, const Reply& reply);

}  // namespace baudgate::protocols::telegram
