// What a meter has said of itself: type and constants (08 12), ratios (08 02), pace (08 17).
// Learned by the conversation from replies, asked before what they decide.
//
//   > 05 08 12 E6 0C   < 05 10 40 10 …        type 1: a SET-4TM.03, the profile is for type 8
//
// FindType gives what a type decides.
// SPDX-License-Identifier: Apache-2.0
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

// The meters of the family by the type code that they tell (08 12, reference 9.3), and what a type
// decides: which flags its status word has, and which requests it knows. Used by the
// identification, by the twin and by `baudgate decode`.

/// Which table names the bits of 08 0A. The manufacturer's description prints one for .02M and .03M
/// (reference, 9.4) and says that those of other types differ.
enum class StatusWord : std::uint8_t { unknown, as_02m_03m };

/// What the reference says of a type: no, yes, or nothing.
enum class Knows : std::uint8_t { no, yes, perhaps };

struct MeterType {
  std::uint8_t code = 0;
  std::string_view name{};
  StatusWord status_word = StatusWord::unknown;
  Knows floats = Knows::perhaps;         ///< 08 1B (reference, 9.7)
  Knows masked_floats = Knows::perhaps;  ///< 08 23 (reference, 9.8): by firmware, where perhaps
};

/// The upper four bits of the third byte of 08 12. Null: a later type, of which nothing is known.
const MeterType* FindType(std::uint8_t code);
/// "8", "0xB", "b": 0 to 15.
std::optional<std::uint8_t> ParseType(std::string_view text);

class Identification {
 public:
  /// Both outlive it.
  Identification(const config::Device& device, const Settings& settings);

  /// Another meter may answer now: all is asked again. What is wrong stays so until it is known to
  /// be right.
  void OnReconnect();
  /// A request was not answered: where it matters, the type is asked again.
  void OnLost();

  /// The refusals may have been meant for other requests.
  void ForgetRefusals();

  /// What to ask before the request whose values are `matches`; empty: it may go out.
  std::optional<Bytes> Question(std::span<const Match> matches) const;
  /// `data` answers `pdu`, whichever that is.
  void Learn(View pdu, View data);
  /// The meter does not tell (status 01 or 03). False: that was no question of this kind.
  bool OnRefused(View pdu);

  /// In place of the meter's constants, options first.
  Scale scale() const { return Merge(settings_.scale(), learned_); }
  /// Whether the bits of its status word are those that profiles name.
  bool KnowsStatusWord() const;
  std::optional<std::uint8_t> type() const { return type_; }
  Knows masked_floats() const;
  /// What its type says of 08 1B; perhaps, while it is not known.
  Knows floats() const;
  /// A float was refused: the type tells whether the meter has any. False: it has been asked.
  bool WantType();
  /// By how much silence and answer are stretched, 1 to 255.
  unsigned multiplier() const { return multiplier_; }
  /// The day by the meter's clock is another one than at the last reading of it. Told once.
  bool TakeNewDay() { return std::exchange(new_day_, false); }
  const DeviceTrouble& trouble() const { return trouble_; }
  /// The answer to whatever a meter of another type was asked: it is asked for its type alone,
  /// until that is right.
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
  Bytes day_;  ///< BCD day, month, year
  bool new_day_ = false;
  DeviceTrouble trouble_;
};

}  // namespace baudgate::protocols::set4tm
