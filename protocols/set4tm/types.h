// The meters of the family by the type code that they tell (08 12, reference 9.3), and what a type
// decides: which flags its status word has, and which requests it knows. Used by the
// identification, by the twin and by `baudgate decode`.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

namespace baudgate::protocols::set4tm {

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
/// "8 (SET-4TM.02M, .03M)", "C".
std::string NameOfType(std::uint8_t code);
/// "8", "0xB", "b": 0 to 15.
std::optional<std::uint8_t> ParseType(std::string_view text);

}  // namespace baudgate::protocols::set4tm
