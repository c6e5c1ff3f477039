// SPDX-License-Identifier: Apache-2.0
#include "protocols/telegram/codes.h"

#include <array>
#include <cmath>
#include <limits>

#include "gateway/base/decimal.h"
#include "gateway/base/text.h"
#include "protocols/telegram/field.h"

namespace baudgate::protocols::telegram {
namespace {

constexpr std::array<Meaning, 10> kMeanings = {
    {{"good", Quality::good},
     {"uncertain", Quality::uncertain},
     {"busy", {Quality::bad, Reason::not_ready}, true},
     {"over", {Quality::bad_sensor_failure, Reason::over_range}},
     {"under", {Quality::bad_sensor_failure, Reason::under_range}},
     {"open", {Quality::bad_sensor_failure, Reason::open_sensor}},
     {"disabled", {Quality::bad_out_of_service, Reason::channel_disabled}},
     {"not_ready", {Quality::bad, Reason::not_ready}},
     {"fault", {Quality::bad_device_failure, Reason::device_fault}},
     {"bad", Quality::bad}}};

constexpr std::string_view kDots = "..";

/// 9.9E37 may be written in several ways, and bytes are no text.
bool IsByNumber(const Format& format) {
  return format.is_binary() || format.kind == Format::Kind::scientific;
}

struct Range {
  std::optional<Decimal> low;
  std::optional<Decimal> high;
};

/// Nothing: it is no range. Dots without a number beside them are a text.
std::optional<Range> ParseRange(std::string_view code) {
  const std::size_t dots = code.find(kDots);
  if (dots == std::string_view::npos) return std::nullopt;
  const std::string_view low = Trim(code.substr(0, dots));
  const std::string_view high = Trim(code.substr(dots + kDots.size()));
  const Range range{Decimal::Parse(low), Decimal::Parse(high)};
  const bool whole = (range.low || low.empty()) && (range.high || high.empty());
  return whole && (range.low || range.high) ? std::optional(range) : std::nullopt;
}

/// As the field holds it: a float32 has no 999.9, only its nearest neighbour.
Decimal Held(const Format& format, const Decimal& number) {
  const bool single = format.kind == Format::Kind::real && format.width == 4;
  const double nearest = number.ToDouble();
  const bool fits = std::abs(nearest) <= std::numeric_limits<float>::max();
  return single && fits ? Decimal(double{static_cast<float>(nearest)}) : number;
}

const Meaning* FindNumber(const Codes& codes, const Value& value) {
  for (const auto& [code, meaning] : codes) {
    const auto own = Decimal::Parse(code);
    if (own && IsMeant(value, *own)) return meaning;
  }
  return nullptr;
}

const Meaning* FindRange(const Codes& codes, const Format& format, const Decimal& number) {
  for (const auto& [code, meaning] : codes) {
    const auto range = ParseRange(code);
    if (!range || (range->low && number < Held(format, *range->low))) continue;
    if (!range->high || number <= Held(format, *range->high)) return meaning;
  }
  return nullptr;
}

}  // namespace

std::span<const Meaning> Meanings() { return kMeanings; }

Status CheckCode(const Format& format, std::string_view code) {
  if (!format.is_number()) return {};
  if (const auto range = ParseRange(code)) {
    if (!range->low || !range->high || *range->low <= *range->high) return {};
    return Error{"its first number is larger than its second"};
  }
  const std::size_t dots = code.find(kDots);
  if (dots != std::string_view::npos &&
      (Decimal::Parse(Trim(code.substr(0, dots))) || Decimal::Parse(Trim(code.substr(dots + 2))))) {
    return Error{"is no range: write '9.9E37..', '..-9.9E37' or '900..999'"};
  }
  if (!format.is_binary()) return {};
  const auto number = Decimal::Parse(code);
  if (!number) return Error{"is no number, and the field has nothing else"};
  if (NumbersOf(format).Contain(*number)) return {};
  return Error{"never stands there: write a number that its bytes can hold"};
}

Value NumberOf(const Format& format, std::string_view code) {
  const auto range = format.is_number() ? ParseRange(code) : std::nullopt;
  if (range) return (range->low ? range->low : range->high)->ToValue();
  const auto number = IsByNumber(format) ? Decimal::Parse(code) : std::nullopt;
  return number ? number->ToValue() : Value{};
}

const Meaning* FindCode(const Codes& codes, const Format& format, View bytes, const Value& value) {
  if (codes.empty()) return nullptr;
  const auto number = format.is_number() ? Decimal::Of(value) : std::nullopt;
  if (number && IsByNumber(format)) {
    if (const Meaning* meaning = FindNumber(codes, value)) return meaning;
  }
  if (format.kind == Format::Kind::byte) {
    const auto found = codes.find(ByteText(bytes));
    return found == codes.end() ? nullptr : found->second;
  }
  const std::string_view text = AsText(bytes);
  const auto found = codes.find(format.kind == Format::Kind::character ? text : Trim(text));
  if (found != codes.end() && !format.is_binary()) return found->second;
  return number ? FindRange(codes, format, *number) : nullptr;
}

}  // namespace baudgate::protocols::telegram
