// `Finding` describes what came on the wire in one exchange, for `baudgate status`. `Outcome` is
// how the exchange ended; `Symptom` is what came in place of a good reply, or together with it.
// gateway/diagnosis/damage/examine.h makes findings, gateway/bus/points/findings.h stores them, and
// gateway/diagnosis/causes/diagnose.h puts them into words.
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
  // From `clean` to `others_beside`: a good reply came.
  clean,
  refusal,  ///< the good reply refuses the request, or asks to wait
  doubted,  ///< the reply was not used, because it may answer an earlier request
  /// The reply has no number where a number belongs; `cause`: what came in place of the number.
  no_number,
  few_beside,     ///< with the good reply, one to three stray bytes came; they may be harmless
  noise_before,   ///< stray bytes came before the good reply
  noise_behind,   ///< stray bytes came behind the good reply
  text_beside,    ///< with the good reply, a text for people came
  master_beside,  ///< with the good reply, a request came that this gateway has not sent
  device_beside,  ///< with the good reply, a whole reply of another device came
  copies,         ///< the good reply came more than once
  others_beside,  ///< with the good reply, a second reply of another content came
  // From `silence` on: no good reply came, or none that could be used.
  silence,
  echo,   ///< only the request itself came back
  late,   ///< a whole reply came after the reply time
  split,  ///< a whole reply came, with a pause inside that is longer than LineTimes::gap
  /// A reply without its beginning; `cause`: empty (one byte is missing), "a few" (several are
  /// missing), "garbled" (the first byte is wrong).
  head_lost,
  /// A reply without its last byte; `cause`: "garbled" if the last byte came, but its last bits are
  /// wrong.
  end_lost,
  tail_lost,  ///< only the beginning of a reply
  /// The beginning and the end of a reply, with one or two bytes missing between them. `cause`: if
  /// the reply is a text, what is wrong with its form.
  bytes_lost,
  bytes_added,  ///< a reply with one or two bytes too many
  /// A reply of the right form and length with a wrong check value; `cause`: "a text" for a text,
  /// in which a character may be missing.
  bad_check,
  eighth_bit,     ///< a whole reply, if the eighth bit of each character is cleared
  other_setting,  ///< a reply that would be whole if the device were configured in another way
  other_protocol,
  other_device,  ///< a whole reply of another device
  other_master,  ///< a request that this gateway has not sent
  /// The reply to the previous request came soon after the present request. `cause`: "lags" if each
  /// reply of the device waits for the next request.
  one_behind,
  /// The same bytes that came to other requests; `cause`: the bytes, if they are a text.
  same_again,
  /// A request of this gateway came back long after it was sent. `cause`: kOwnRequest if a part of
  /// the current request came back.
  late_echo,
  late_other,   ///< the late reply of another device of the line
  other_reply,  ///< a whole reply to another request
  two_replies,  ///< two different whole replies to one request
  odd,          ///< a whole reply whose content does not fit its request
  other_form,   ///< a whole line of text in another form than the reply; `cause`: the form
  text,         ///< text for people: a login, a menu, a log
  zeros,        ///< only bytes 00 or FF
  damaged,      ///< begins like a reply, but is damaged
  endless,
  noise,  ///< bytes in which nothing can be recognised
};
inline constexpr std::size_t kSymptoms = static_cast<std::size_t>(Symptom::noise) + 1;

/// The `cause` of a Finding with noise_before or late_echo if a part of the request came back.
inline constexpr std::string_view kOwnRequest = "our own request";

/// Finding::idle of the first request after a port was opened.
inline constexpr Duration kLongIdle = Duration::max();

struct Finding {
  Symptom symptom = Symptom::clean;
  /// For late: time from the end of the request to the reply. For split: length of the pause.
  Duration time{};
  Duration idle{};  ///< how long the line was silent before the request; kLongIdle: unknown
  std::size_t bytes = 0;
  std::size_t expected = 0;  ///< length of the longest good reply; 0: unknown
  /// The kSpecialBytes that came (bytes that some converters change), one bit each, and the bits
  /// kHighBit, kEvenByte and kOddByte.
  std::uint8_t specials = 0;
  std::uint8_t asked = 0;  ///< the kSpecialBytes that the request contained, one bit each
  /// A detail whose meaning depends on the symptom: "Modbus RTU frames come", "slave 7 answers".
  /// text: the text itself; refusal and odd: the reason; noise_before, noise_behind, few_beside:
  /// the bytes around the reply, "10 02 ... 10 03"; eighth_bit: "mark" if the bit is always 1.
  std::string cause{};
  std::string remedy{};  ///< what to do: "set protocol: modbus_rtu at the line"; may be empty
  Outcome outcome = Outcome::none;
  bool ended = false;  ///< for silence: the server closed the connection instead of answering
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

/// Bytes that converters change: line ends, flow control (XON, XOFF) and Telnet.
inline constexpr std::uint8_t kSpecialBytes[] = {0x0A, 0x0D, 0x11, 0x13, 0xFF};

inline constexpr std::uint8_t kAllSpecials = (1U << std::size(kSpecialBytes)) - 1;
/// The bits of kAllSpecials that stand for XON and XOFF.
inline constexpr std::uint8_t kFlowBytes = 0b01100;
static_assert(kSpecialBytes[2] == 0x11 && kSpecialBytes[3] == 0x13);

/// Returns which of kSpecialBytes `bytes` contains: bit i stands for kSpecialBytes[i].
inline std::uint8_t SpecialsOf(View bytes) {
  unsigned bits = 0;
  for (std::size_t i = 0; i < std::size(kSpecialBytes); ++i) {
    if (std::ranges::find(bytes, kSpecialBytes[i]) != bytes.end()) bits |= 1U << i;
  }
  return static_cast<std::uint8_t>(bits);
}

/// A bit of Finding::specials: a byte above 0x7F came, or the protocol has only seven-bit bytes.
inline constexpr std::uint8_t kHighBit = 0x80;
/// Bits of Finding::specials: a byte with an even (odd) number of ones came. Bytes 00 and FF do not
/// count.
inline constexpr std::uint8_t kEvenByte = 0x40;
inline constexpr std::uint8_t kOddByte = 0x20;

constexpr bool IsAnswered(Symptom symptom) { return symptom <= Symptom::others_beside; }

}  // namespace baudgate
