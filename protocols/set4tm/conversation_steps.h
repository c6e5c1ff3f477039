// What the parts of the meter's conversation share: steps of a session, and kinds of requests.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>

#include "protocols/conversation.h"
#include "protocols/set4tm/codec.h"

namespace baudgate::protocols::set4tm {

inline const Bytes kAskSerial = {kRead, kSerialNumber};

inline bool IsFloatRead(View pdu) {
  return pdu.size() == 4 && pdu[0] == kRead && pdu[1] == kFloats;
}

inline bool IsJournal(View pdu) { return pdu[0] == kJournal || pdu[0] == kJournalExtended; }

inline bool Is(View pdu, const Bytes& other) { return std::ranges::equal(pdu, other); }

/// A step of the session that is nobody's news.
inline Answer AskAgain() {
  Answer answer;
  answer.then = Then::ask_again;
  return answer;
}

}  // namespace baudgate::protocols::set4tm
