// What may stand in `read` and `write` of a point: a field of a telegram, "weight.weight",
// "input(channel=3).value", "status.flags[b3]", "weight.state=S"; a telegram that is sent, "tare".
// DecodeReply says what an answer means.
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

// What an answer means, field by field.

struct SaidField {
  Decoded decoded{};
  std::string text{};      ///< as it stands there, without the blanks around it
  bool is_status = false;  ///< no number, and has codes: it says how the others are
};

struct Reply {
  Outcome outcome = Outcome::ok;
  /// Of an ok one: what stands where a known code or a number belongs; empty: nothing does.
  std::string reason{};
  std::string remedy{};  ///< goes with the reason of an ok one
  /// What the status fields say of all others.
  Quality quality = Quality::good;
  std::map<std::string, SaidField, std::less<>> fields{};
};

/// `known`: what the answer has to repeat.
Reply DecodeReply(const Telegram& telegram, View frame, const Bound& known);
/// Each number of the match is one, and as wide as described.
bool HasNumbers(const Form& form, const Match& match);

/// A telegram with its parameters.
struct Call {
  std::string telegram;
  std::vector<std::pair<std::string, std::string>> parameters{};

  bool operator==(const Call&) const = default;
};

/// Tells the calls of a device apart by everything that is sent for them: "CH2" and then "READ" is
/// the question of val(n=2), if telegram `sel`, which goes before `val`, is 'CH{n}'. "READ" alone
/// is the question of neither val(n=1) nor val(n=2).
class Questions {
 public:
  Questions() = default;
  /// `calls`: an empty one is never asked. `bound`: what every telegram of the device is filled
  /// with.
  Questions(const Description& description, const Bound& bound,
            const std::vector<std::optional<Call>>& calls);

  /// Whether `telegram` was sent for calls[call]. `sent`: the fields of this telegram and of those
  /// that were sent before it.
  bool IsAsked(std::size_t call, std::size_t telegram, const Bound& sent) const;
  /// The calls for which `telegram` was sent, in their order.
  std::vector<std::size_t> AskedBy(std::size_t telegram, const Bound& sent) const;

 private:
  struct Question {
    std::size_t telegram = 0;
    Bound fields{};  ///< of those by which calls of the device differ
  };
  std::vector<std::optional<Question>> questions_;  // by call
  std::multimap<std::size_t, std::size_t> calls_;   // by telegram
};

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
