// Matches a pattern from left to right without backtracking: each element decides by itself where
// it ends, so the result does not depend on how the bytes were split into pieces.
#include "protocols/telegram/matching.h"

#include <zlib.h>

#include <algorithm>
#include <array>
#include <numeric>

#include "gateway/base/text.h"
#include "protocols/telegram/field.h"

namespace baudgate::protocols::telegram {
namespace {

std::uint32_t Ccitt(View bytes, std::uint16_t start) {
  std::uint32_t crc = start;
  for (const std::uint8_t byte : bytes) {
    crc ^= static_cast<std::uint32_t>(byte) << 8U;
    for (int bit = 0; bit < 8; ++bit) {
      crc = ((crc & 0x8000U) != 0 ? (crc << 1U) ^ 0x1021U : crc << 1U) & 0xFFFFU;
    }
  }
  return crc;
}

constexpr std::array<ChecksumKind, 8> kKinds = {
    {{"sum8", 1, [](View bytes) -> std::uint32_t { return Sum8(bytes); }},
     {"sum16", 2,
      [](View bytes) {
        return std::accumulate(bytes.begin(), bytes.end(), std::uint32_t{0}) & 0xFFFFU;
      }},
     {"xor8", 1, [](View bytes) -> std::uint32_t { return Xor8(bytes); }},
     {"lrc", 1, [](View bytes) { return (0x100U - Sum8(bytes)) & 0xFFU; }},
     {"crc16_modbus", 2, [](View bytes) -> std::uint32_t { return Crc16(bytes); }},
     {"crc16_ccitt", 2, [](View bytes) { return Ccitt(bytes, 0xFFFF); }},
     {"crc16_xmodem", 2, [](View bytes) { return Ccitt(bytes, 0); }},
     {"crc32", 4, [](View bytes) {
        return static_cast<std::uint32_t>(
            crc32_z(0, bytes.data(), static_cast<z_size_t>(bytes.size())));
      }}}};

}  // namespace

std::span<const ChecksumKind> ChecksumKinds() { return kKinds; }

std::optional<std::uint32_t> Checksum::Of(View front) const {
  if (front.size() <= skip + leave) return std::nullopt;
  return kind->compute(front.subspan(skip, front.size() - skip - leave));
}

namespace {

using Kind = Format::Kind;

constexpr std::size_t kNoSize = 0;

bool IsDigit(std::uint8_t byte) { return byte >= '0' && byte <= '9'; }
bool IsSign(std::uint8_t byte) { return byte == '+' || byte == '-'; }

class Walk {
 public:
  enum class Step : std::uint8_t { taken, need_more, none };

  Walk(const Form& form, View held, bool idle, std::size_t most, std::size_t whole)
      : form_(form), held_(held), idle_(idle), most_(most), whole_(whole) {}

  Step Run(Match& match) {
    const auto& elements = form_.pattern.elements;
    for (std::size_t i = 0; i < elements.size(); ++i) {
      const std::size_t begin = at_;
      const Step step = elements[i].is_field() ? TakeField(i) : TakeLiteral(elements[i].literal);
      if (step != Step::taken) return step;
      if (at_ > most_) return Step::none;
      match.parts.push_back(held_.subspan(begin, at_ - begin));
      if (i == 0) match.began = !elements[i].is_field();
    }
    match.size = at_;
    return whole_ == kNoSize || at_ == whole_ ? Step::taken : Step::none;
  }

 private:
  Step Short() const { return idle_ || held_.size() >= most_ ? Step::none : Step::need_more; }

  Step TakeLiteral(const Bytes& literal) {
    const View rest = held_.subspan(at_);
    const std::size_t count = std::min(rest.size(), literal.size());
    if (!std::equal(literal.begin(), literal.begin() + static_cast<std::ptrdiff_t>(count),
                    rest.begin())) {
      return Step::none;
    }
    if (count < literal.size()) return Short();
    at_ += count;
    return Step::taken;
  }

  Step TakeField(std::size_t index) {
    const Format& format = form_.pattern.elements[index].format;
    if (format.is_fixed()) return TakeFixed(format, format.width);
    if (format.kind == Kind::bytes) return TakeKnownRest(index, format);
    if (format.is_signed_token()) return TakeSigned(index, format);
    const bool last = index + 1 == form_.pattern.elements.size();
    if (last && whole_ != kNoSize) return TakeKnownRest(index, format);
    if (last) return TakeUntilSilence();
    if (const auto anchor = form_.pattern.AnchorOf(index)) return TakeUntil(format, *anchor);
    return TakeRun(format);
  }

  Step TakeFixed(const Format& format, std::size_t width) {
    const std::size_t there = std::min(width, held_.size() - at_);
    if (format.is_text() && !std::ranges::all_of(held_.subspan(at_, there), IsPrintable)) {
      return Step::none;
    }
    if (there < width) return Short();
    at_ += width;
    return Step::taken;
  }

  /// Takes a field without a width: it ends where the elements behind it begin. This is possible if
  /// the size of the telegram is known and the elements behind the field have fixed sizes.
  Step TakeKnownRest(std::size_t index, const Format& format) {
    if (whole_ == kNoSize) return Step::none;
    std::size_t behind = 0;
    const auto& elements = form_.pattern.elements;
    for (std::size_t i = index + 1; i < elements.size(); ++i) {
      if (!elements[i].is_fixed()) return Step::none;
      behind += elements[i].fixed_size();
    }
    if (at_ + behind > whole_) return Step::none;
    return TakeFixed(format, whole_ - at_ - behind);
  }

  /// Takes a number that begins with a sign: "+025.12" of "+025.12-020.45". In place of the number,
  /// blanks in the width of the field are taken.
  Step TakeSigned(std::size_t index, const Format& format) {
    if (at_ >= held_.size()) return Short();
    if (held_[at_] == ' ' && format.width > 0) return TakeBlanks(format.width);
    if (!IsSign(held_[at_])) return Step::none;
    std::size_t end = at_ + 1;
    while (end < held_.size() && IsOfNumber(format, held_[end], end)) ++end;
    if (end - at_ > kMostOfRun) return Step::none;
    // The characters behind the number can look like a part of it, so its end is found by the
    // anchor, the next fixed characters.
    if (const auto anchor = form_.pattern.AnchorOf(index)) {
      const std::size_t begin = at_;
      const Step step = TakeUntil(format, *anchor);
      return step == Step::taken && (at_ > end || at_ == begin) ? Step::none : step;
    }
    if (end == held_.size() && end != whole_) {
      const Step step = Short();
      if (step == Step::need_more || held_.size() >= most_) return step;
    }
    at_ = end;
    return Step::taken;
  }

  Step TakeBlanks(std::size_t width) {
    const std::size_t there = std::min(width, held_.size() - at_);
    const View blanks = held_.subspan(at_, there);
    if (!std::ranges::all_of(blanks, [](std::uint8_t byte) { return byte == ' '; })) {
      return Step::none;
    }
    if (there < width) return Short();
    at_ += width;
    return Step::taken;
  }

  bool IsOfNumber(const Format& format, std::uint8_t byte, std::size_t at) const {
    if (format.kind == Kind::hex) return HexDigit(static_cast<char>(byte)).has_value();
    if (IsDigit(byte)) return true;
    if (format.kind == Kind::integer) return false;
    if (byte == '.') return true;
    if (format.kind != Kind::scientific) return false;
    const auto is_e = [](std::uint8_t one) { return one == 'e' || one == 'E'; };
    return is_e(byte) || (IsSign(byte) && is_e(held_[at - 1]));
  }

  /// Takes a number that another field follows directly: all characters that can belong to the
  /// number.
  Step TakeRun(const Format& format) {
    std::size_t end = at_;
    while (end < held_.size() && held_[end] == ' ') ++end;
    if (end < held_.size() && IsSign(held_[end]) && format.kind != Kind::hex) ++end;
    while (end < held_.size() && IsOfNumber(format, held_[end], end)) ++end;
    if (end - at_ > kMostOfRun) return Step::none;
    if (end == held_.size()) return Short();
    if (end == at_) return Step::none;
    at_ = end;
    return Step::taken;
  }

  Step TakeUntil(const Format& format, const Pattern::Anchor& anchor) {
    const Bytes& literal = *anchor.literal;
    std::size_t end = at_;
    // The blanks in front of a number belong to its field, as in "S S     100.00 g".
    if (format.kind != Kind::text) {
      while (end < held_.size() && held_[end] == ' ') ++end;
    }
    for (; end < held_.size(); ++end) {
      const View rest = held_.subspan(end);
      const std::size_t count = std::min(rest.size(), literal.size());
      if (std::equal(rest.begin(), rest.begin() + static_cast<std::ptrdiff_t>(count),
                     literal.begin())) {
        if (count < literal.size()) return Short();
        if (end - at_ < anchor.between) return Step::none;
        at_ = end - anchor.between;
        return Step::taken;
      }
      if (!IsPrintable(rest[0]) || end - at_ > kMostOfRun) return Step::none;
      if (format.kind == Kind::word && anchor.between == 0 && rest[0] == ' ') return Step::none;
    }
    return Short();
  }

  Step TakeUntilSilence() {
    const View rest = held_.subspan(at_);
    if (!std::ranges::all_of(rest, IsPrintable)) return Step::none;
    if (!idle_) return Short();
    if (rest.empty()) return Step::none;
    at_ = held_.size();
    return Step::taken;
  }

  static constexpr std::size_t kMostOfRun = 255;

  const Form& form_;
  View held_;
  const bool idle_;
  const std::size_t most_;
  // Size of the whole telegram; kNoSize: only the pattern decides where it ends.
  const std::size_t whole_;
  std::size_t at_ = 0;
};

/// Returns the size of a telegram according to its size field. Empty: there are too few bytes. An
/// invalid size gives a huge number, which the caller must refuse.
std::optional<std::size_t> SaidSize(const SizeField& field, View held) {
  if (held.size() < field.at + field.format.width) return std::nullopt;
  const Value value = DecodeField(field.format, held.subspan(field.at, field.format.width));
  const auto* number = std::get_if<std::int64_t>(&value);
  constexpr std::int64_t kBeyond = 1'000'000;
  if (number == nullptr || *number < 0 || *number > kBeyond) return kBeyond;
  return static_cast<std::size_t>(*number) + field.plus;
}

bool ChecksumFits(const Form& form, const Match& match) {
  const auto& elements = form.pattern.elements;
  std::size_t at = 0;
  for (std::size_t i = 0; i < elements.size(); at += match.parts[i].size(), ++i) {
    if (!elements[i].is_field() || elements[i].name != kChecksum) continue;
    const View front(match.parts[0].data(), at);
    const auto sum = form.checksum.kind != nullptr ? form.checksum.Of(front) : std::nullopt;
    if (!sum) return false;
    return SameValue(DecodeField(elements[i].format, match.parts[i]),
                     static_cast<std::int64_t>(*sum));
  }
  return true;
}

/// True if all fields that occur twice have the same bytes in both places.
bool RepeatsAgree(const Form& form, const Match& match) {
  if (!form.pattern.has_repeats) return true;
  const auto& elements = form.pattern.elements;
  for (std::size_t i = 0; i < elements.size(); ++i) {
    if (!elements[i].is_field() || elements[i].name.empty()) continue;
    if (!std::ranges::equal(match.Of(form.pattern, elements[i].name), match.parts[i])) return false;
  }
  return true;
}

bool IsOther(const Form& form, const Match& match, const Bound& known) {
  const auto& elements = form.pattern.elements;
  for (std::size_t i = 0; i < elements.size(); ++i) {
    if (!elements[i].is_field()) continue;
    const auto bound = known.find(elements[i].name);
    if (bound == known.end()) continue;
    if (!SameValue(DecodeField(elements[i].format, match.parts[i]), bound->second)) return true;
  }
  return false;
}

/// Returns the result for a telegram with an invalid size: need_more until the fixed bytes at the
/// beginning have come, then no match. So `began` does not depend on how the bytes were split.
Match BadSize(const Form& form, View held, bool idle) {
  Match match;
  const Bytes& front = form.pattern.elements.front().literal;
  const std::size_t there = std::min(front.size(), held.size());
  if (!std::equal(held.begin(), held.begin() + static_cast<std::ptrdiff_t>(there), front.begin())) {
    return match;
  }
  if (there < front.size() && !idle) match.kind = Match::Kind::need_more;
  match.began = !front.empty() && there == front.size();
  return match;
}

}  // namespace

View Match::Of(const Pattern& pattern, std::string_view name) const {
  for (std::size_t i = 0; i < parts.size(); ++i) {
    const Element& element = pattern.elements[i];
    if (element.is_field() && element.name == name) return parts[i];
  }
  return {};
}

Match MatchFront(const Form& form, View held, bool idle, std::size_t most, const Bound& known) {
  Match match;
  std::size_t whole = kNoSize;
  if (form.size_at) {
    if (const auto said = SaidSize(*form.size_at, held)) {
      if (*said > most || *said < form.pattern.least_size()) return BadSize(form, held, idle);
      whole = *said;
      if (held.size() > whole) held = held.first(whole);
    }
  }
  Walk walk(form, held, idle || (whole != kNoSize && held.size() == whole), most, whole);
  const Walk::Step step = walk.Run(match);
  if (form.size_at && whole == kNoSize && step == Walk::Step::taken) return {};
  if (step == Walk::Step::need_more) {
    match.kind = Match::Kind::need_more;
  } else if (step == Walk::Step::taken) {
    match.bad_checksum = !ChecksumFits(form, match);
    if (match.bad_checksum || !RepeatsAgree(form, match)) return match;
    match.kind = Match::Kind::whole;
    match.other = IsOther(form, match, known);
  }
  return match;
}

Match MatchAll(const Form& form, View bytes, const Bound& known) {
  Match match = MatchFront(form, bytes, true, std::max<std::size_t>(bytes.size(), 1), known);
  if (match.kind == Match::Kind::whole && match.size != bytes.size())
    match.kind = Match::Kind::none;
  return match;
}

Bound ValuesOf(const Form& form, const Match& match) {
  Bound values;
  for (std::size_t i = 0; i < match.parts.size(); ++i) {
    const Element& element = form.pattern.elements[i];
    if (!element.is_field() || element.name.empty() || element.name == kChecksum) continue;
    values.insert_or_assign(element.name, DecodeField(element.format, match.parts[i]));
  }
  return values;
}

namespace {

void Put(const Bytes& field, std::size_t at, Bytes& bytes) {
  if (at + field.size() > bytes.size()) return;
  std::ranges::copy(field, bytes.begin() + static_cast<std::ptrdiff_t>(at));
}

}  // namespace

Result<Bytes> Build(const Form& form, const Bound& values, const Match* rest) {
  Bytes bytes;
  std::optional<std::size_t> sum_at;
  for (std::size_t i = 0; i < form.pattern.elements.size(); ++i) {
    const Element& element = form.pattern.elements[i];
    if (!element.is_field()) {
      Append(bytes, element.literal);
      continue;
    }
    const bool is_sum = element.name == kChecksum;
    if (is_sum) sum_at = bytes.size();
    const auto value = values.find(element.name);
    if (is_sum || value == values.end() || !HasValue(value->second)) {
      if (rest != nullptr && !is_sum) {
        Append(bytes, rest->parts[i]);
      } else {
        Append(bytes, BlankField(element.format));
      }
      continue;
    }
    const auto field = EncodeField(element.format, value->second);
    if (!field) return Error{"field '" + element.name + "': " + field.error()};
    Append(bytes, *field);
  }
  if (form.size_at && bytes.size() >= form.size_at->plus) {
    const auto said = static_cast<std::int64_t>(bytes.size() - form.size_at->plus);
    const auto size = EncodeField(form.size_at->format, said);
    if (!size) return Error{"its size: " + size.error()};
    Put(*size, form.size_at->at, bytes);
  }
  if (sum_at) {
    const auto sum =
        form.checksum.kind != nullptr ? form.checksum.Of(View(bytes).first(*sum_at)) : std::nullopt;
    if (!sum)
      return Error{
          "the telegram has no bytes before its check value, so the check value cannot be "
          "computed"};
    const auto field =
        EncodeField(form.pattern.Find(kChecksum)->format, static_cast<std::int64_t>(*sum));
    if (!field) return Error{"the check value: " + field.error()};
    Put(*field, *sum_at, bytes);
  }
  return bytes;
}

}  // namespace baudgate::protocols::telegram
