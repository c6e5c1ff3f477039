// Tries the forms that are awaited at the first byte, in the order of the description; what begins
// none is dropped one byte at a time, so that a good telegram behind a damaged one is found.
//
//   receive: 'S {state:char} {weight:10decimal} {unit:word}\r\n'
//   < 53 20 53 20 20 20 20 20 31 30 30 2E 30 30 20 67 0D 0A    "S S     100.00 g": whole
//   < 53 20 53 20 20 20 FF 20                                  a field of text has no such byte
// SPDX-License-Identifier: Apache-2.0
#include "protocols/telegram/frame_rule.h"

#include "protocols/common/frame_cuts.h"
#include "protocols/telegram/expect.h"

namespace baudgate::protocols::telegram {

Cut CutTelegram(View held, const Expectation& expect, bool idle) {
  const auto* awaited = static_cast<const Awaited*>(expect.forms.get());
  bool began = false;
  bool bad_checksum = false;
  std::size_t other = 0;
  if (awaited != nullptr) {
    for (const Form* form : awaited->forms) {
      const Match match = MatchFront(*form, held, idle, expect.max_bytes, awaited->known);
      if (match.kind == Match::Kind::need_more) return Cut::NeedMore();
      if (match.kind == Match::Kind::whole) {
        if (!match.other) return Cut::Frame(match.size);
        if (other == 0) other = match.size;
      }
      began = began || match.began;
      bad_checksum = bad_checksum || match.bad_checksum;
    }
  }
  if (other != 0) return cut::OfAnother(other);
  if (bad_checksum) return cut::BadChecksum();
  if (began && !idle) return Cut::Discard(1, Outcome::corrupt, "not as described");
  return cut::Slide(held, began ? "stopped mid-frame" : "not the begin of a telegram");
}

}  // namespace baudgate::protocols::telegram
