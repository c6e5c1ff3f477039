// What one exchange looked like on the wire, for `baudgate status`: an outcome says how it ended, a
// finding what came in place of a good reply, or beside it. Made by gateway/line/examine.h, kept by
// gateway/store/findings.h, put into words by gateway/status/diagnose.h.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>

#include "gateway/base/time.h"

namespace baudgate {

enum class Symptom : std::uint8_t {
  clean,           ///< a good reply, and nothing else
  noise_before,    ///< a good reply behind bytes that belong to nothing
  noise_behind,    ///< a good reply in front of such bytes
  copies,          ///< a good reply, more than once
  silence,         ///< not a byte
  echo,            ///< the request itself, and nothing else
  late,            ///< a whole reply behind the reply time
  split,           ///< a whole reply with a pause inside that is longer than `gap`
  head_lost,       ///< a whole reply but for its first byte
  tail_lost,       ///< the beginning of a reply
  eighth_bit,      ///< a whole reply once the eighth bit of its characters is cleared
  other_setting,   ///< a whole reply, if the device were configured in another way
  other_protocol,  ///< messages of another protocol
  other_device,    ///< a whole reply of another device
  other_master,    ///< a request that this gateway has not sent
  late_other,      ///< the late reply of another device of the line
  other_reply,     ///< a whole reply to another request
  odd,             ///< a whole reply whose content does not fit its request
  text,            ///< words for people: a login, a menu, a log
  zeros,           ///< nothing but 00 or FF
  damaged,         ///< begins as a reply does, and is damaged
  endless,         ///< it does not stop
  noise,           ///< bytes in which nothing can be recognised
};
inline constexpr std::size_t kSymptoms = 23;

struct Finding {
  Symptom symptom = Symptom::clean;
  /// late: from the end of the request to the reply; split: the pause.
  Duration time{};
  std::size_t bytes = 0;  ///< that came
  /// "Modbus RTU frames come", "slave 7 answers"; text: as it came; odd: "2 values came where 8 …".
  std::string cause{};
  std::string remedy{};  ///< "set protocol: modbus_rtu at the line"; empty: nothing special
};

/// There was a good reply.
constexpr bool IsAnswered(Symptom symptom) { return symptom <= Symptom::copies; }

}  // namespace baudgate
