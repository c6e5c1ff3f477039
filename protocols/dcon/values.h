// The numbers inside a DCON reply: cuts joined fields, knows the codes that stand for sensor
// trouble, and writes the same for the twin. Text comes from codec.h, fields go to decode.h.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "gateway/base/outcome.h"
#include "protocols/common/decoded.h"
#include "protocols/dcon/settings.h"

namespace baudgate::protocols::dcon {

/// One channel. Without a good quality there is no value: a code is never a number.
struct Field : Decoded {
  unsigned channel = 0;
  std::string note;  ///< what a bad field means: "over range (+99999)"
};

inline Field BadField(Quality quality, std::string note, unsigned channel = 0) {
  return {{{}, quality}, channel, std::move(note)};
}

struct Fields {
  Outcome outcome = Outcome::ok;
  std::string reason;    ///< when not ok: then no field is believed
  std::string remedy{};  ///< for `baudgate status`
  std::vector<Field> fields;
  bool more_enabled = false;  ///< values came for channels that the settings call disabled
};

/// Joined numbers as the settings' format says, cut at every sign and checked for width; `hex`
/// forces hex words, as `$AAA` does. Channels count from 0.
Fields CutFields(std::string_view text, const Settings& settings, bool hex);

/// Gives fields their channels and checks their count. `expected`: how many channels the module
/// has, 0 = any. A reply of another count is not believed at all.
void AssignChannels(Fields& fields, const Settings& settings, std::size_t expected);

/// A digital word as points see it, of the 16 bits on the wire; and back.
inline std::uint64_t DigitalWord(std::uint64_t wire, const Settings& settings) {
  if (settings.swap_bytes) wire = (wire & 0xFFU) << 8U | (wire >> 8U & 0xFFU);
  return wire ^ settings.invert;
}
inline std::uint64_t DigitalWire(std::uint64_t word, const Settings& settings) {
  word = (word ^ settings.invert) & 0xFFFFU;
  return settings.swap_bytes ? (word & 0xFFU) << 8U | word >> 8U : word;
}

/// A number as a module of these settings writes it; text passes as it is ("+99999"), so that a
/// simulated value can be a code.
std::string FormatField(const Value& value, const Settings& settings, bool hex);

}  // namespace baudgate::protocols::dcon
