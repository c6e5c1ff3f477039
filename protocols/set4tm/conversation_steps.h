// Small words that the parts of the meter's conversation share.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <string>
#include <vector>

#include "protocols/conversation.h"
#include "protocols/set4tm/codec.h"

namespace baudgate::protocols::set4tm {

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
