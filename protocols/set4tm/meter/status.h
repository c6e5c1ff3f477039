// Explain says what the one-byte status of a SET-4TM means for the exchange, the points and the
// next request. The functions behind it are small steps that the parts of the conversation share.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "gateway/base/outcome.h"
#include "gateway/base/time.h"
#include "gateway/base/value.h"
#include "protocols/conversation.h"
#include "protocols/set4tm/meter/codec.h"

namespace baudgate::protocols::set4tm {

/// Low nibbles of the status byte (reference, chapter 6).
enum StatusCode : std::uint8_t {
  kOk = 0x0,
  kNotAllowed = 0x1,
  kInternalError = 0x2,
  kLevelTooLow = 0x3,
  kClockAlreadyCorrected = 0x4,
  kChannelClosed = 0x5,
  kRepeat = 0x6,
  kNotReady = 0x7,
  kBusy = 0x8,
  kMeterSilent = 0xF,
};

constexpr std::uint8_t CodeOf(std::uint8_t status) { return status & 0x0FU; }

struct StatusMeaning {
  Outcome outcome = Outcome::ok;
  std::string reason;              ///< empty when ok
  std::optional<Quality> quality;  ///< of the points that were asked for
  Duration wait{};                 ///< seconds of the high nibble, or our own patience
  std::string_view remedy{};       ///< for `baudgate status`
};

/// `opening`: the status answers a request to open the channel, where 3 means the password.
StatusMeaning Explain(std::uint8_t status, bool opening);

// Small words that the parts of the meter's conversation share.

inline const Bytes kAskSerial = {kRead, kSerialNumber};

inline bool IsFloatRead(View pdu) {
  return pdu.size() == 4 && pdu[0] == kRead && pdu[1] == kFloats;
}

inline bool IsJournal(View pdu) {
  return !pdu.empty() && (pdu[0] == kJournal || pdu[0] == kJournalExtended);
}

inline bool Is(View pdu, const Bytes& other) { return std::ranges::equal(pdu, other); }

/// The task goes on, and this exchange brought nothing that anybody else need know.
inline Answer AskAgain() {
  Answer answer;
  answer.then = Then::ask_again;
  return answer;
}

/// Whatever this meter was asked: its values are not those of the configured one.
inline Answer NotThisMeter(Duration wait, const std::string& reason) {
  Answer answer;
  answer.outcome = Outcome::refused;
  answer.wait = wait;
  answer.reason = reason;
  return answer;
}

/// "load_1 read to …, no load_2: it refuses it". Empty texts are left out.
inline std::string Listed(const std::vector<std::string>& texts) {
  std::string list;
  for (const std::string& text : texts) {
    if (text.empty()) continue;
    list += (list.empty() ? "" : ", ") + text;
  }
  return list;
}

}  // namespace baudgate::protocols::set4tm
