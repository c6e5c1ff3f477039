// Explain returns the meaning of a one-byte status of a SET-4TM for the exchange, the points and
// the next request. The inline functions serve all files of protocols/set4tm.
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

/// The codes of a status: the low four bits of the status byte (reference, chapter 6).
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
  std::string reason;  ///< why the request has failed; empty if the outcome is ok
  /// Quality that the requested points get; empty: the quality does not change.
  std::optional<Quality> quality;
  /// How long no request is sent: as long as the meter asks for (high four bits of the status, in
  /// s), or longer for some codes.
  Duration wait{};
  std::string_view remedy{};
};

/// Returns the meaning of a status. `opening`: true if the request was to open the channel; code 3
/// then means a wrong password.
StatusMeaning Explain(std::uint8_t status, bool opening);

inline const Bytes kAskSerial = {kRead, kSerialNumber};

inline bool IsFloatRead(View pdu) {
  return pdu.size() == 4 && pdu[0] == kRead && pdu[1] == kFloats;
}

inline bool IsJournal(View pdu) {
  return !pdu.empty() && (pdu[0] == kJournal || pdu[0] == kJournalExtended);
}

inline bool Is(View pdu, const Bytes& other) { return std::ranges::equal(pdu, other); }

inline Answer AskAgain() {
  Answer answer;
  answer.then = Then::ask_again;
  return answer;
}

/// Returns the answer to any request as long as a wrong meter is connected.
inline Answer NotThisMeter(Duration wait, const std::string& reason) {
  Answer answer;
  answer.outcome = Outcome::refused;
  answer.wait = wait;
  answer.reason = reason;
  return answer;
}

/// Joins the texts that are not empty by commas: "load_1 read to …, no load_2: it refuses it".
inline std::string Listed(const std::vector<std::string>& texts) {
  std::string list;
  for (const std::string& text : texts) {
    if (text.empty()) continue;
    list += (list.empty() ? "" : ", ") + text;
  }
  return list;
}

}  // namespace baudgate::protocols::set4tm
