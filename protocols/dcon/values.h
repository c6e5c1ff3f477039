// Reads and writes the numbers inside DCON replies. It cuts joined fields apart, recognises the
// codes for sensor faults, and formats values for the simulated device. DecodeReply uses the
// fields.
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

/// The value of one channel. It is empty unless the quality is good: a fault code gives no number.
struct Field : Decoded {
  unsigned channel = 0;
  std::string note;  ///< the reason for a bad quality: "over range (+99999)"
};

inline Field BadField(Quality quality, std::string note, unsigned channel = 0) {
  return {{{}, quality}, channel, std::move(note)};
}

struct Fields {
  Outcome outcome = Outcome::ok;
  std::string reason;  ///< why the outcome is not ok; `fields` must not be used then
  std::string remedy{};
  std::vector<Field> fields;
  /// True: the reply contains channels that are disabled in the settings.
  bool more_enabled = false;
};

/// Cuts joined numbers at every sign and checks their width, in the format of the settings. `hex`:
/// true if the numbers are hex words in any format, as in the reply to `$AAA`. The channels are set
/// later, by AssignChannels.
Fields CutFields(std::string_view text, const Settings& settings, bool hex);

/// Sets the channels of the fields, beginning with 0, and checks their number. `expected`: how many
/// channels the module has; 0: any number. If the number is wrong, the whole reply is rejected.
void AssignChannels(Fields& fields, const Settings& settings, std::size_t expected);

/// Converts the 16 bits of a digital reply to the word that points read. DigitalWire is the
/// inverse.
inline std::uint64_t DigitalWord(std::uint64_t wire, const Settings& settings) {
  if (settings.swap_bytes) wire = (wire & 0xFFU) << 8U | (wire >> 8U & 0xFFU);
  return wire ^ settings.invert;
}
inline std::uint64_t DigitalWire(std::uint64_t word, const Settings& settings) {
  word = (word ^ settings.invert) & 0xFFFFU;
  return settings.swap_bytes ? (word & 0xFFU) << 8U | word >> 8U : word;
}

/// Formats a number as a module with these settings sends it. A text is returned unchanged
/// ("+99999"), so that a simulated value can be a fault code.
std::string FormatField(const Value& value, const Settings& settings, bool hex);

}  // namespace baudgate::protocols::dcon
