// Cuts lines from a start character to CR; with checksum only those whose sum is right.
//
//   > 23 30 31 38 34 0D                      #01 84 CR
//   < 3E 2B 31 30 30 2E 32 33 2B 33 34 2E 30 35 30 45 32 0D
//                                            > +100.23 +34.050 E2 CR
//   > 23 30 31 30 42 34 0D                   #010 B4 CR to a counter module, which answers with the
//   < 3E 44 34 30 30 30 30 30 30 31 45 0D    > D4 0000001E CR checksum in front (I-7080)
//
// A number never holds a start character, so a second one means that the first line was cut off.
// With checksum the sum decides which start is right: the last one that verifies, because both
// verify only when the bytes between them happen to sum to zero.
// SPDX-License-Identifier: Apache-2.0
#include "protocols/dcon/frame_rule.h"

#include <algorithm>

#include "protocols/common/frame_cuts.h"
#include "protocols/dcon/codec.h"

namespace baudgate::protocols::dcon {
namespace {

constexpr std::string_view kRequestStarts = "$#%@~^";
constexpr std::string_view kReplyStarts = ">!?";

bool IsText(std::uint8_t byte) { return byte >= 0x20 && byte < 0x7F; }

Cut CutLine(View held, const Expectation& expect, std::string_view starts) {
  const std::string_view text = AsText(held);
  if (starts.find(text.front()) == std::string_view::npos)
    return cut::SkipNoise(held, starts, "\n");

  const auto stop = std::find_if_not(held.begin(), held.end(), IsText);
  const auto length = static_cast<std::size_t>(stop - held.begin());
  const std::string_view line = text.substr(0, length);
  if (expect.checksum == kNoChecksum) {
    const auto later = line.substr(0, expect.max_bytes).find_first_of(starts, 1);
    if (later != std::string_view::npos) {
      return Cut::Discard(later, Outcome::partial, "another frame begins");
    }
  }
  if (length + 1 > expect.max_bytes) {
    return cut::TooLong();
  }
  if (stop == held.end()) return Cut::NeedMore();
  if (*stop != '\r') return Cut::Discard(length + 1, Outcome::corrupt, "not a text character");
  if (expect.checksum == kNoChecksum) return Cut::Frame(length + 1);

  for (auto at = line.find_last_of(starts); at != std::string_view::npos;
       at = at == 0 ? std::string_view::npos : line.find_last_of(starts, at - 1)) {
    if (!ChecksumFits(line.substr(at), expect.checksum)) continue;
    if (at == 0) return Cut::Frame(length + 1);
    return Cut::Discard(at, Outcome::corrupt, "another frame begins");
  }
  return cut::BadChecksum(length + 1);
}

}  // namespace

Cut RequestRule(View held, const Expectation& expect, bool) {
  return CutLine(held, expect, kRequestStarts);
}

// < 21 30 32 37 30 31 37 45 42 0D          !02 7017 EB CR while module 01 is asked for its name:
//                                          passed over
Cut ReplyRule(View held, const Expectation& expect, bool) {
  const Cut line = CutLine(held, expect, kReplyStarts);
  const bool names_module = line.kind == Cut::Kind::frame && held[0] != '>';
  if (!names_module || expect.address.empty()) return line;
  if (AsText(held).substr(1).starts_with(AsText(expect.address))) return line;
  return cut::OfAnother(line.size);
}

}  // namespace baudgate::protocols::dcon
