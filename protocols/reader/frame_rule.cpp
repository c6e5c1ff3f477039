// SPDX-License-Identifier: Apache-2.0
#include "protocols/reader/frame_rule.h"

#include <algorithm>

#include "gateway/base/text.h"
#include "protocols/common/frame_cuts.h"
#include "protocols/reader/codec.h"
#include "protocols/reader/expect.h"

namespace baudgate::protocols::reader {
namespace {

constexpr std::string_view kTagForm = "\r\n-##########\r\n>";  // #: a hex digit
static_assert(kTagForm.size() == kTagFrame);
constexpr std::string_view kBetween = "\r\n>";  // what may stand between two messages

/// `noise`: what stands between two tags.
Cut CutTag(View held, bool idle, Outcome noise) {
  const std::size_t size = std::min(held.size(), kTagFrame);
  std::size_t fits = 0;
  for (; fits < size; ++fits) {
    const char c = static_cast<char>(held[fits]);
    if (kTagForm[fits] == '#' ? !HexDigit(c) : c != kTagForm[fits]) break;
  }
  if (fits == kTagFrame) return Cut::Frame(kTagFrame);
  // The prompt alone is missing: the digits are whole.
  if (fits == kTagFrame - 1 && (idle || size > fits)) return Cut::Frame(fits);
  if (fits == size && !idle) return Cut::NeedMore();
  if (fits >= kTagAt) return Cut::Discard(1, Outcome::corrupt, "a damaged tag");
  const bool harmless = cut::IsHarmless(held[0], kBetween);
  return Cut::Discard(1, harmless ? Outcome::none : noise, "noise before a tag");
}

/// To the prompt at the begin of a line; if none comes, to the silence after a whole line.
Cut CutInformation(View held, std::size_t most, bool idle) {
  const auto is_end = [](std::uint8_t byte) { return byte == '\r' || byte == '\n'; };
  const std::size_t size = std::min(held.size(), most);
  bool said = false;
  for (std::size_t at = 0; at < size; ++at) {
    const bool begins = at > 0 && is_end(held[at - 1]);
    if (held[at] == '>' && begins && DecodeInformation(held.first(at))) return Cut::Frame(at + 1);
    if (held[at] == '>' && begins && said) {
      return Cut::Discard(at + 1, Outcome::corrupt, "a damaged answer");
    }
    said = said || !cut::IsHarmless(held[at], "\r\n>i");  // and the echo
  }
  if (held.size() >= most) return cut::TooLong();
  if (!idle) return Cut::NeedMore();
  if (!said) return Cut::Discard(held.size(), Outcome::none, "no answer yet");
  if (is_end(held.back()) && DecodeInformation(held)) return Cut::Frame(held.size());
  return cut::Wait(idle, held.size());
}

/// A whole text, if it is as long as it should be.
Cut Checked(View frame, const Settings& form) {
  const View text = TextIn(frame, form);
  const std::size_t around = frame.size() - text.size();
  const bool fits = frame.size() <= form.most + 2 * kMostAround;
  if (!form.start && text.empty() && fits) {
    return Cut::Discard(frame.size(), Outcome::none, "an empty line");
  }
  const bool right = text.size() <= form.most && around <= kMostAround &&
                     (form.length == 0 || text.size() == form.length);
  return right ? Cut::Frame(frame.size())
               : Cut::Discard(frame.size(), Outcome::corrupt, "not as long as a text should be");
}

/// Its index, from `from` on; held.size(): it has not come yet.
std::size_t Find(View held, std::uint8_t wanted, std::size_t from) {
  const auto begin = held.begin() + static_cast<std::ptrdiff_t>(from);
  return static_cast<std::size_t>(std::find(begin, held.end(), wanted) - held.begin());
}

Cut CutText(View held, const Settings& form, bool idle) {
  if (form.start && held[0] != *form.start) {
    return cut::SkipNoise(held, std::string(1, static_cast<char>(*form.start)), kBetween);
  }
  if (!form.end) {
    const bool counted = form.start && form.length > 0;
    if (counted && held.size() > form.length) return Checked(held.first(form.length + 1), form);
    if (counted) return cut::Wait(idle, held.size());
    return idle ? Checked(held, form) : Cut::NeedMore();
  }
  const std::size_t end = Find(held, *form.end, form.start ? 1 : 0);
  if (form.start) {
    const std::size_t again = Find(held, *form.start, 1);
    if (std::min(again, end) > form.most + 1) return cut::TooLong();
    if (again < end) return Cut::Discard(again, Outcome::partial, "stopped mid-frame");
  }
  if (end < held.size()) return Checked(held.first(end + 1), form);
  if (idle && !form.start && TextIn(held, form).empty()) return Checked(held, form);
  return cut::Wait(idle, held.size());
}

}  // namespace

Cut RequestRule(View held, const Expectation& expect, bool idle) {
  const std::size_t end = Find(held, '\r', 0);
  if (end >= expect.max_bytes) return cut::TooLong();
  return end < held.size() ? Cut::Frame(end + 1) : cut::Wait(idle);
}

Cut MessageRule(View held, const Expectation& expect, bool idle) {
  if (expect.shapes.empty()) return CutTag(held, idle, Outcome::partial);
  const Shape& shape = expect.shapes.front();
  if (shape.tag == kTagsAndAnswers) return CutTag(held, idle, Outcome::none);
  if (shape.tag == kInformation) return CutInformation(held, expect.max_bytes, idle);
  return CutText(held, OfShape(shape), idle);
}

}  // namespace baudgate::protocols::reader
