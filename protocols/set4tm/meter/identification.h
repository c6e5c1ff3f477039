// Identification stores what a meter has reported about itself: type and constants (08 12), ratios
// (08 02), and the multiplier of its times (08 17). The conversation passes the replies to it, and
// asks its questions before requests that depend on them.
//
//   > 05 08 12 E6 0C   < 05 10 40 10 …        type 1: a SET-4TM.03, the profile is for type 8
//
// FindType returns the properties of a type.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string_view>
#include <utility>

#include "protocols/conversation.h"
#include "protocols/set4tm/meter/constants.h"
#include "protocols/set4tm/meter/plan.h"
#include "protocols/set4tm/meter/settings.h"

namespace baudgate::protocols::set4tm {

/// The table that names the bits of the status word (08 0A). The manufacturer prints the table of
/// .02M and .03M (reference, 9.4) and states that the tables of other types differ.
enum class StatusWord : std::uint8_t { unknown, as_02m_03m };

/// Whether a type supports a feature according to the reference; perhaps: the reference does not
/// define this.
enum class Knows : std::uint8_t { no, yes, perhaps };

struct MeterType {
  std::uint8_t code = 0;
  std::string_view name{};
  StatusWord status_word = StatusWord::unknown;
  Knows floats = Knows::perhaps;  ///< supports float reads, 08 1B (reference, 9.7)
  /// Whether the type supports masked reads, 08 23 (reference, 9.8). `perhaps`: this depends on the
  /// firmware of the meter.
  Knows masked_floats = Knows::perhaps;
};

/// Returns a type. `code`: the upper four bits of the third byte of 08 12. Null: a type that is
/// newer than the reference.
const MeterType* FindType(std::uint8_t code);
/// Parses a type code, 0 to 15 in hex: "8", "0xB", "b".
std::optional<std::uint8_t> ParseType(std::string_view text);

class Identification {
 public:
  Identification(const config::Device& device, const Settings& settings);

  /// Call it if another meter may be connected. A trouble stays until a reply shows that it is
  /// over.
  void OnReconnect();
  /// Call it if a request was not answered: the type is asked again if the option types is set.
  void OnLost();

  /// Forgets refusals, so that refused questions are asked again: a refusal may have been the late
  /// reply to another request.
  void ForgetRefusals();

  /// Returns the question to ask before the request that reads `matches`. Empty: no question is
  /// needed.
  std::optional<Bytes> Question(std::span<const Match> matches) const;
  /// Learns from the data of a reply; `pdu` is its request, which can be any request.
  void Learn(View pdu, View data);
  /// Call it if the meter has refused `pdu` (status 01 or 03). Returns false if `pdu` is not a
  /// question.
  bool OnRefused(View pdu);

  /// Returns the constants. Constants in the options come first; missing constants are taken from
  /// the meter.
  Scale scale() const { return Merge(settings_.scale(), learned_); }
  /// True if the bits of the status word have the meaning that profiles assume, that of .02M and
  /// .03M.
  bool KnowsStatusWord() const;
  std::optional<std::uint8_t> type() const { return type_; }
  Knows masked_floats() const;
  /// Returns whether the meter's type has floats (08 1B); perhaps while the type is unknown.
  Knows floats() const;
  /// Has the type asked with the next question, even if no point needs it. Returns false if it was
  /// asked already.
  bool WantType();
  /// Returns the factor, 1 to 255, that stretches the meter's silence and reply time.
  unsigned multiplier() const { return multiplier_; }
  /// Returns true once after the meter's date has changed.
  bool TakeNewDay() { return std::exchange(new_day_, false); }
  const DeviceTrouble& trouble() const { return trouble_; }
  /// Returns the answer to any request as long as a meter of a wrong type is connected.
  Answer OtherType() const;

 private:
  void Judge();

  const config::Device& device_;
  const Settings& settings_;
  Scale learned_;
  std::optional<std::uint8_t> type_;
  bool wants_type_ = false;
  bool asked_variant_ = false;
  bool asked_ratios_ = false;
  unsigned multiplier_ = 1;
  Bytes day_;  ///< the meter's date: BCD day, month, year
  bool new_day_ = false;
  DeviceTrouble trouble_;
};

}  // namespace baudgate::protocols::set4tm
