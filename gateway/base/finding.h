// What one exchange looked like on the wire, for `baudgate status`: an outcome says how it ended, a
// finding what came in place of a good reply, or beside it. Made by
// gateway/diagnosis/damage/examine.h, kept by gateway/bus/points/findings.h, put into words by
// gateway/diagnosis/causes/diagnose.h.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <iterator>
#include <string>
#include <string_view>

#include "gateway/base/bytes.h"
#include "gateway/base/outcome.h"
#include "gateway/base/time.h"

namespace baudgate {

enum class Symptom : std::uint8_t {
  // A good reply came.
  clean,          ///< nothing else came
  refusal,        ///< in it the device says no, or asks to wait
  doubted,        ///< it was not taken, because it may answer an earlier request
  no_number,      ///< it has no number where one belongs; `cause`: what stands there
  few_beside,     ///< one to three bytes came as well, which may be nothing
  noise_before,   ///< bytes that belong to nothing came before it
  noise_behind,   ///< bytes that belong to nothing came behind it
  text_beside,    ///< words or numbers for people came as well
  master_beside,  ///< a request that this gateway has not sent came as well
  device_beside,  ///< a whole reply of another device came as well
  copies,         ///< it came more than once
  others_beside,  ///< a second one with another content came as well
  // None came, or none that could be taken:
  silence,         ///< not a byte
  echo,            ///< the request itself, and nothing else
  late,            ///< a whole reply after the reply time
  split,           ///< a whole reply with a pause inside that is longer than `gap`
  head_lost,       ///< a whole reply but for its first byte, or a few; `cause`: a few, garbled
  end_lost,        ///< a whole reply but for its last byte; `cause`: garbled
  tail_lost,       ///< the beginning of a reply
  bytes_lost,      ///< beginning and end of a reply, and one or two bytes too few; `cause`: of a
                   ///< text, as other_form
  bytes_added,     ///< the same, with one or two too many
  bad_check,       ///< a reply of the right form and length, whose check value is wrong; `cause`:
                   ///< a text, which may lack a character
  eighth_bit,      ///< a whole reply once the eighth bit of its characters is cleared
  other_setting,   ///< a whole reply, if the device were configured in another way
  other_protocol,  ///< messages of another protocol
  other_device,    ///< a whole reply of another device
  other_master,    ///< a request that this gateway has not sent
  one_behind,  ///< the reply to the request before, in time; `cause`: lags, where it never comes
               ///< without the next request
  same_again,  ///< what came to other requests before, byte for byte; `cause`: a text
  late_echo,   ///< a request of this gateway, long after it was sent; `cause`: a part of it at once
  late_other,  ///< the late reply of another device of the line
  other_reply,  ///< a whole reply to another request
  two_replies,  ///< two different whole replies to one request
  odd,          ///< a whole reply whose content does not fit its request
  other_form,   ///< a whole line of text of another form; `cause` says which
  text,         ///< words for people: a login, a menu, a log
  zeros,        ///< nothing but 00 or FF
  damaged,      ///< begins as a reply does, and is damaged
  endless,      ///< it does not stop
  noise,        ///< bytes in which nothing can be recognised
};
inline constexpr std::size_t kSymptoms = static_cast<std::size_t>(Symptom::noise) + 1;

/// Cause of noise_before and late_echo: a part of the request came back.
inline constexpr std::string_view kOwnRequest = "our own request";

/// Before the first request after the opening of a port.
inline constexpr Duration kLongIdle = Duration::max();

struct Finding {
  Symptom symptom = Symptom::clean;
  /// late: from the end of the request to the reply; split: the pause.
  Duration time{};
  Duration idle{};           ///< silence of the line before the request; kLongIdle: unknown
  std::size_t bytes = 0;     ///< that came
  std::size_t expected = 0;  ///< of the longest good reply, where that is known
  /// Which of kSpecialBytes came, one bit each: converters that are not transparent change them;
  /// and kHighBit, kEvenByte, kOddByte.
  std::uint8_t specials = 0;
  std::uint8_t asked = 0;  ///< which of kSpecialBytes the request had, one bit each
  /// "Modbus RTU frames come", "slave 7 answers"; text: as it came; refusal and odd: the reason;
  /// noise_before, noise_behind, few_beside: "10 02 ... 10 03", what stands around the reply;
  /// eighth_bit: "mark", where it is always 1.
  std::string cause{};
  std::string remedy{};  ///< "set protocol: modbus_rtu at the line"; empty: nothing special
  Outcome outcome = Outcome::none;  ///< of the exchange
  bool ended = false;  ///< silence: the server closed the connection in place of an answer
};

constexpr std::string_view Name(Symptom symptom) {
  constexpr std::string_view kNames[] = {
      "clean",        "refusal",       "doubted",     "no_number",     "few_beside",
      "noise_before", "noise_behind",  "text_beside", "master_beside", "device_beside",
      "copies",       "others_beside", "silence",     "echo",          "late",
      "split",        "head_lost",     "end_lost",    "tail_lost",     "bytes_lost",
      "bytes_added",  "bad_check",     "eighth_bit",  "other_setting", "other_protocol",
      "other_device", "other_master",  "one_behind",  "same_again",    "late_echo",
      "late_other",   "other_reply",   "two_replies", "odd",           "other_form",
      "text",         "zeros",         "damaged",     "endless",       "noise"};
  static_assert(std::size(kNames) == kSymptoms);
  return kNames[static_cast<std::size_t>(symptom)];
}

/// Line ends, flow control and Telnet.
inline constexpr std::uint8_t kSpecialBytes[] = {0x0A, 0x0D, 0x11, 0x13, 0xFF};

inline constexpr std::uint8_t kAllSpecials = (1U << std::size(kSpecialBytes)) - 1;
/// Those of flow control: XON and XOFF.
inline constexpr std::uint8_t kFlowBytes = 0b01100;
static_assert(kSpecialBytes[2] == 0x11 && kSpecialBytes[3] == 0x13);

/// Which of them these bytes have, one bit each.
inline std::uint8_t SpecialsOf(View bytes) {
  unsigned bits = 0;
  for (std::size_t i = 0; i < std::size(kSpecialBytes); ++i) {
    if (std::ranges::find(bytes, kSpecialBytes[i]) != bytes.end()) bits |= 1U << i;
  }
  return static_cast<std::uint8_t>(bits);
}

/// A character with its eighth bit came, or none can: the protocol has seven.
inline constexpr std::uint8_t kHighBit = 0x80;
/// A character came, other than FF, whose number of ones is even, or odd.
inline constexpr std::uint8_t kEvenByte = 0x40;
inline constexpr std::uint8_t kOddByte = 0x20;

/// There was a good reply.
constexpr bool IsAnswered(Symptom symptom) { return symptom <= Symptom::others_beside; }

}  // namespace baudgate
