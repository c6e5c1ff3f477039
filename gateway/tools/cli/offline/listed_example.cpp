// SPDX-License-Identifier: Apache-2.0
#include "gateway/tools/cli/offline/listed_example.h"

#include "config/point_values.h"
#include "gateway/base/decimal_comma.h"
#include "gateway/base/since.h"
#include "gateway/base/spelling.h"
#include "gateway/base/text.h"
#include "gateway/base/time.h"
#include "gateway/tools/cli/offline/listed_words.h"

namespace baudgate {
namespace {

/// A float of 64 bits has no more.
constexpr int kMostPlaces = 308;

template <typename Unit>
Decimal CountOf(WallTime time) {
  return Decimal(std::chrono::floor<Unit>(time.time_since_epoch()).count());
}

/// A date or time as a manual prints it.
std::optional<Decimal> TimeNumber(const std::string& text, const std::string& form) {
  if (form == "TIME") {
    const auto span = ParseDuration(text);
    return span ? std::optional(Decimal(*span / 1ms)) : std::nullopt;
  }
  const auto time = ParseWallTime(form == "TOD" ? "1970-01-01T" + text : text);
  if (!time) return std::nullopt;
  return form == "TOD" ? CountOf<std::chrono::milliseconds>(*time)
                       : CountOf<std::chrono::seconds>(*time);
}

/// The range of an integer in these registers; empty: they hold a float.
std::optional<config::IntegerRange> RangeOfForm(const std::string& form) {
  if (form == "bcd16") return config::IntegerRange{0, 9'999};
  if (form == "bcd32") return config::IntegerRange{0, 99'999'999};
  const auto type = config::ParseType(form);
  if (!type || form.starts_with("float")) return std::nullopt;
  return config::RangeOf(type->type);
}

const char* Like(const std::string& form) {
  if (form == "TIME") return "90s, or milliseconds";
  if (form == "TOD") return "14:30:00, or milliseconds since midnight";
  if (form == "DATE") return "2026-11-27, or seconds since 1970";
  if (form == "DT") return "2026-11-27T14:30:00, or seconds since 1970";
  return form == "bool" ? "0 or 1" : "230.4";
}

}  // namespace

std::optional<Decimal> ListedNumber(const std::string& text) {
  const auto e = text.find_first_of("eE");
  const bool exponent = e != std::string::npos && !text.starts_with("0x");
  const std::string digits = text.substr(0, exponent ? e : std::string::npos);
  const std::string with_point = WithDecimalPoint(digits);
  const auto number = Decimal::Parse(with_point.empty() ? digits : with_point);
  if (!number || !exponent) return number;
  const std::size_t from = text.find('+', e) == e + 1 ? e + 2 : e + 1;
  const auto places = ParseInteger<int>(std::string_view(text).substr(from));
  if (!places || *places > kMostPlaces || *places < -kMostPlaces) return std::nullopt;
  return number->Shifted(*places);
}

Result<std::string> ListedExample(const std::string& text, const std::string& form,
                                  const Decimal& scale) {
  if (form.starts_with("string")) {
    if (text.size() > LengthOf(form)) return Error{"is longer than " + form};
    return InQuotes(text);
  }
  auto number = ListedNumber(text);
  if (!number && IsTimeForm(form)) number = TimeNumber(text, form);
  if (!number) {
    return Error{"is none of type " + form + "; write for example " + std::string(Like(form))};
  }
  const Decimal raw = *number / scale;
  const auto range = RangeOfForm(form);
  if (range && !range->Contains(raw)) {
    return Error{"is " + raw.ToText() + " in the device, and " + form + " holds " +
                 Decimal(range->lowest).ToText() + " to " + Decimal(range->highest).ToText()};
  }
  return raw.ToText();
}

}  // namespace baudgate
