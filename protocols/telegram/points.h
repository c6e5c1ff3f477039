// Parses `read` and `write` of points. `read` is a field of a telegram: "weight.weight",
// "input(channel=3).value", "status.flags[b3]", "weight.state=S"; `write` is a telegram that is
// sent: "tare". `DecodeReply` decodes an answer.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <map>
#include <span>
#include <string>
#include <vector>

#include "gateway/base/outcome.h"
#include "protocols/common/decoded.h"
#include "protocols/protocol.h"
#include "protocols/telegram/description.h"

namespace baudgate::protocols::telegram {

// The content of an answer, field by field.

struct SaidField {
  Decoded decoded{};
  std::string text{};  ///< the text of the field, without the blanks around it
  /// True if the field is no number and has codes: it decides the quality of the other fields.
  bool is_status = false;
};

struct Reply {
  Outcome outcome = Outcome::ok;
  /// With `ok`: the text in place of a known code or a number; empty: there is none.
  std::string reason{};
  std::string remedy{};  ///< with `ok`: what to do about `reason`
  /// The quality of all other fields, as the status fields give it.
  Quality quality = Quality::good;
  std::map<std::string, SaidField, std::less<>> fields{};
};

/// Decodes an answer. `known`: values that the answer must repeat.
Reply DecodeReply(const Telegram& telegram, View frame, const Bound& known);
/// True if each number field of the match is a number with the described width.
bool HasNumbers(const Form& form, const Match& match);

struct Call {
  std::string telegram;
  std::vector<std::pair<std::string, std::string>> parameters{};

  bool operator==(const Call&) const = default;
};

/// Distinguishes the calls of a device by all bytes that are sent for them. If telegram `sel`,
/// 'CH{n}', goes before `val`, then "CH2" followed by "READ" is the question of val(n=2). "READ"
/// alone is the question of neither val(n=1) nor val(n=2).
class Questions {
 public:
  Questions() = default;
  /// `calls`: an empty call is never asked. `bound`: values for the fields of every telegram.
  Questions(const Description& description, const Bound& bound,
            const std::vector<std::optional<Call>>& calls);

  /// True if `telegram` was sent for calls[call]. `sent`: the fields of this telegram and of the
  /// telegrams before it.
  bool IsAsked(std::size_t call, std::size_t telegram, const Bound& sent) const;
  /// Returns the calls for which `telegram` was sent, in their order.
  std::vector<std::size_t> AskedBy(std::size_t telegram, const Bound& sent) const;

 private:
  struct Question {
    std::size_t telegram = 0;
    Bound fields{};  ///< the fields by which calls of the device differ
  };
  std::vector<std::optional<Question>> questions_;  // by call
  std::multimap<std::size_t, std::size_t> calls_;   // by telegram
};

struct ReadPlace {
  Call call;
  std::string field;
  enum class Select : std::uint8_t { whole, bits, equal } select = Select::whole;
  unsigned bit = 0;  ///< with `bits`: number of the first bit
  unsigned bits = 1;
  std::string equal{};  ///< with `equal`: the text of the field for true

  bool operator==(const ReadPlace&) const = default;
};

Result<ReadPlace> ParseRead(const config::Point& point);
Result<Call> ParseWrite(const config::Point& point);
Status CheckPoint(const config::Point& point);

std::span<const DecoderSpec> DecoderTable();

Decoded ValueAt(const ReadPlace& place, const Reply& reply);

}  // namespace baudgate::protocols::telegram
