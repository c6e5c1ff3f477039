// Parses `read` and `write` of points. `read` is a field of a telegram: "weight.weight",
// "input(channel=3).value", "status.flags[b3]", "weight.state=S"; `write` is a telegram that is
// sent: "tare". `DecodeReply` decodes an answer.
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

struct SaidField {
  Decoded decoded{};
  std::string text{};
  /// True if the field is not a number and has codes: it then decides the quality of the other
  /// fields.
  bool is_status = false;
};

struct Reply {
  Outcome outcome = Outcome::ok;
  /// For `ok`: the text that was in place of a known code or a number. Empty: all fields were
  /// right.
  std::string reason{};
  std::string remedy{};
  /// The quality that the status fields give to all other fields.
  Quality quality = Quality::good;
  std::map<std::string, SaidField, std::less<>> fields{};
};

/// Decodes an answer to `telegram`. `known`: values that the answer must repeat.
Reply DecodeReply(const Telegram& telegram, View frame, const Bound& known);
/// True if each number field of the match contains a number with the width in the description.
bool HasNumbers(const Form& form, const Match& match);

struct Call {
  std::string telegram;
  std::vector<std::pair<std::string, std::string>> parameters{};

  bool operator==(const Call&) const = default;
};

/// Decides for which calls a telegram was sent. A Call is a telegram with parameters, as points
/// name it in `read` and `write`. All telegrams that are sent for a call decide. Example: telegram
/// `sel`, 'CH{n}', goes before `val`. Then "CH2" followed by "READ" is sent for val(n=2); "READ"
/// alone is sent for neither val(n=1) nor val(n=2).
class Questions {
 public:
  Questions() = default;
  /// `calls`: an empty entry stands for a point without a call. `bound`: values that all telegrams
  /// share.
  Questions(const Description& description, const Bound& bound,
            const std::vector<std::optional<Call>>& calls);

  /// True if `telegram` was sent for calls[call]. `sent`: the fields of this telegram and of the
  /// telegrams that were sent before it.
  bool IsAsked(std::size_t call, std::size_t telegram, const Bound& sent) const;
  /// Returns the indices of all calls for which IsAsked(call, telegram, sent) is true, in ascending
  /// order.
  std::vector<std::size_t> AskedBy(std::size_t telegram, const Bound& sent) const;

 private:
  struct Question {
    std::size_t telegram = 0;
    Bound fields{};  ///< values of the fields that tell this call from others of the device
  };
  std::vector<std::optional<Question>> questions_;  // index: call
  std::multimap<std::size_t, std::size_t> calls_;   // key: telegram; value: index in questions_
};

struct ReadPlace {
  Call call;
  std::string field;
  enum class Select : std::uint8_t { whole, bits, equal } select = Select::whole;
  unsigned bit = 0;  ///< for `bits`: number of the first bit
  unsigned bits = 1;
  std::string equal{};  ///< for `equal`: the text of the field that means true

  bool operator==(const ReadPlace&) const = default;
};

Result<ReadPlace> ParseRead(const config::Point& point);
Result<Call> ParseWrite(const config::Point& point);
Status CheckPoint(const config::Point& point);

std::span<const DecoderSpec> DecoderTable();

Decoded ValueAt(const ReadPlace& place, const Reply& reply);

}  // namespace baudgate::protocols::telegram
