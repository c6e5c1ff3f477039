// Identification stores what a meter has reported about itself: type and constants (08 12), ratios
// (08 02), and the multiplier of its times (08 17). The conversation passes it the replies, and
// asks its questions before requests that depend on them.
//
//   > 05 08 12 E6 0C   < 05 10 40 10 …        type 1: a SET-4TM.03, the profile is for type 8
//
// FindType returns what a type decides.
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

// The meters of the family by type code (08 12, reference 9.3), and what the type decides: the
// flags of the status word and the supported requests.

/// Which table names the bits of 08 0A. The manufacturer prints the table of .02M and .03M
/// (reference, 9.4) and states that the tables of other types differ.
enum class StatusWord : std::uint8_t { unknown, as_02m_03m };

/// Whether a type supports a feature by the reference; perhaps: the reference does not define it.
enum class Knows : std::uint8_t { no, yes, perhaps };

struct MeterType {
  std::uint8_t code = 0;
  std::string_view name{};
  StatusWord status_word = StatusWord::unknown;
  Knows floats = Knows::perhaps;         ///< 08 1B (reference, 9.7)
  Knows masked_floats = Knows::perhaps;  ///< 08 23 (reference, 9.8); perhaps: by firmware
};

/// `code`: the upper four bits of the third byte of 08 12. Null: an unknown, later type.
const MeterType* FindType(std::uint8_t code);
/// Accepts "8", "0xB", "b": 0 to 15, in hex.
std::optional<std::uint8_t> ParseType(std::string_view text);

class Identification {
 public:
  /// The references must outlive this object.
  Identification(const config::Device& device, const Settings& settings);

  /// Call if another meter may be connected. A trouble stays until a reply disproves it.
  void OnReconnect();
  /// Call if a request was not answered: the type is asked again if the option types is set.
  void OnLost();

  /// Lets refused questions be asked again: a refusal may have answered another request.
  void ForgetRefusals();

  /// Returns the question to ask before the request that reads `matches`. Empty: none.
  std::optional<Bytes> Question(std::span<const Match> matches) const;
  /// Learns from any request and its data.
  void Learn(View pdu, View data);
  /// Call if the meter has refused `pdu` (status 01 or 03). Returns false if `pdu` is no question.
  bool OnRefused(View pdu);

  /// Returns the constants: those of the options, else those of the meter.
  Scale scale() const { return Merge(settings_.scale(), learned_); }
  /// True if the bits of the status word have the meaning that profiles assume.
  bool KnowsStatusWord() const;
  std::optional<std::uint8_t> type() const { return type_; }
  Knows masked_floats() const;
  /// Returns whether the type has floats (08 1B); perhaps while the type is unknown.
  Knows floats() const;
  /// Call if a float was refused: the type must be asked. Returns false if it was asked already.
  bool WantType();
  /// Factor that stretches the silence and the reply time, 1 to 255.
  unsigned multiplier() const { return multiplier_; }
  /// Returns true once after the meter's date has changed.
  bool TakeNewDay() { return std::exchange(new_day_, false); }
  const DeviceTrouble& trouble() const { return trouble_; }
  /// Returns the answer to any request to a meter of a wrong type.
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
