// Tries the forms that are awaited at the first byte, in the order of the description. What begins
// none is dropped one byte at a time, so that a good telegram behind a damaged one is found.
//
//   receive: 'S {state:char} {weight:10decimal} {unit:word}\r\n'
//   < 53 20 53 20 20 20 20 20 31 30 30 2E 30 30 20 67 0D 0A    "S S     100.00 g": whole
//   < 53 20 53 20 20 20 FF 20                                  a field of text has no such byte
//
// A telegram that begins with a field and has no check value could be found inside a damaged one,
// as "-03" in "1.25E-03" whose sign was lost. Where such a one is awaited the whole line is
// dropped, or all up to the next silence if no fixed characters end it. The same holds for an
// answer of one or two fixed bytes, as an ACK: all up to the next silence is dropped.
// One that a field ends is whole when the line is silent: if more follows without a pause, its
// bytes are shifted.
// SPDX-License-Identifier: Apache-2.0
#include "protocols/telegram/frame_rule.h"

#include <algorithm>

#include "protocols/common/frame_cuts.h"
#include "protocols/telegram/expect.h"

namespace baudgate::protocols::telegram {
namespace {

bool AllHarmless(View bytes) {
  return std::ranges::all_of(bytes,
                             [](std::uint8_t byte) { return cut::IsHarmless(byte, "\r\n"); });
}

/// After the first characters that end one of the unmarked forms; empty: they have not come.
std::optional<std::size_t> EndOfLine(View held, const Awaited& awaited) {
  std::optional<std::size_t> first;
  for (const Form* form : awaited.forms) {
    if (!form->is_unmarked()) continue;
    const Bytes& end = form->pattern.elements.back().literal;
    const auto found = std::search(held.begin(), held.end(), end.begin(), end.end());
    if (found == held.end()) continue;
    const auto behind = static_cast<std::size_t>(found - held.begin()) + end.size();
    first = std::min(first.value_or(behind), behind);
  }
  return first;
}

/// No telegram begins at the front, and none is looked for behind it.
Cut DropLine(View held, const Awaited& awaited, std::size_t most, bool idle) {
  const bool has_lines = std::ranges::none_of(awaited.forms, [](const Form* form) {
    return form->is_scant() || (form->is_unmarked() && form->pattern.elements.back().is_field());
  });
  // However much has come already, no more is looked at than when it comes byte by byte.
  const View near = held.first(std::min(held.size(), most));
  const auto end = has_lines ? EndOfLine(near, awaited) : std::nullopt;
  const auto drop = [&](std::size_t size, Outcome blame, std::string_view why) {
    return Cut::Discard(size, AllHarmless(held.first(size)) ? Outcome::none : blame, why);
  };
  if (end) return drop(*end, Outcome::corrupt, "not as described");
  // What is kept is longer than any telegram, so that the end of the line is taken for none.
  if (held.size() >= most) return drop(has_lines ? 1 : most, Outcome::corrupt, "too long");
  if (idle) return drop(held.size(), Outcome::partial, "stopped mid-frame");
  return Cut::NeedMore();
}

}  // namespace

Cut CutTelegram(View held, const Expectation& expect, bool idle) {
  const auto* awaited = static_cast<const Awaited*>(expect.forms.get());
  bool began = false;
  bool bad_checksum = false;
  bool unmarked = false;
  bool begins_fixed = true;
  std::size_t other = 0;
  if (awaited != nullptr) {
    for (const Form* form : awaited->forms) {
      const bool is_unmarked = form->is_unmarked();
      unmarked = unmarked || is_unmarked;
      begins_fixed = begins_fixed && !(is_unmarked && form->pattern.elements.front().is_field());
      const std::size_t most = is_unmarked ? expect.max_bytes / 2 : expect.max_bytes;
      const Match match = MatchFront(*form, held, idle, most, awaited->known);
      if (match.kind == Match::Kind::need_more) return Cut::NeedMore();
      if (match.kind == Match::Kind::whole) {
        if (form->ends_with_silence()) {
          if (held.size() > match.size) continue;
          if (!idle) return Cut::NeedMore();
        }
        if (!match.other) return Cut::Frame(match.size);
        if (other == 0) other = match.size;
      }
      began = began || match.began;
      bad_checksum = bad_checksum || match.bad_checksum;
    }
  }
  if (other != 0) return cut::OfAnother(other);
  if (unmarked) {
    // In front of a fixed byte the noise of a driver that is switched on hides nothing.
    if (begins_fixed && cut::IsHarmless(held[0], "\r\n"))
      return Cut::Discard(1, Outcome::none, "noise of a driver");
    return DropLine(held, *awaited, expect.max_bytes, idle);
  }
  if (bad_checksum) return cut::BadChecksum();
  if (began && !idle) return Cut::Discard(1, Outcome::corrupt, "not as described");
  return cut::Slide(held, began ? "stopped mid-frame" : "it begins as none of the awaited answers");
}

}  // namespace baudgate::protocols::telegram
