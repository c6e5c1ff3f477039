// SPDX-License-Identifier: Apache-2.0
#include "protocols/dcon/values.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>

#include "gateway/base/text.h"
#include "protocols/dcon/codec.h"

namespace baudgate::protocols::dcon {
namespace {

constexpr std::size_t kHexWidth = 4;
constexpr std::size_t kUsualWidth = 7;
constexpr double kHexSpan = 32768.0;

bool Contains(const std::vector<std::string>& codes, std::string_view token) {
  return std::find(codes.begin(), codes.end(), token) != codes.end();
}

Field Trouble(Reason reason, std::string_view token) {
  return BadField({Quality::bad_sensor_failure, reason},
                  std::string(Name(reason)) + " (" + std::string(token) + ")");
}

Field DisabledField(std::size_t channel = 0) {
  return BadField({Quality::bad_out_of_service, Reason::channel_disabled}, "channel disabled",
                  static_cast<unsigned>(channel));
}

Field Above(std::string_view token) { return Trouble(Reason::over_range, token); }
Field Below(std::string_view token) { return Trouble(Reason::under_range, token); }
Field Open(std::string_view token) { return Trouble(Reason::open_sensor, token); }

bool AllAre(std::string_view text, char digit) {
  return text.find_first_not_of(digit) == std::string_view::npos;
}

std::optional<Field> ListedCode(std::string_view token, const Settings& settings) {
  if (Contains(settings.over, token)) return Above(token);
  if (Contains(settings.under, token)) return Below(token);
  if (Contains(settings.open, token)) return Open(token);
  return std::nullopt;
}

/// True for the full-scale codes of a module with a movable decimal point: "+99999." or "-99.999".
bool IsFullScale(std::string_view token) {
  return std::ranges::count(token, '9') >= 5 &&
         token.find_first_not_of("9.", 1) == std::string_view::npos;
}

/// Classifies a token without a decimal point. It is never a measurement, but can be a fault code.
Field PointlessCode(std::string_view token) {
  const std::string_view digits = token.substr(1);
  const bool minus = token.front() == '-';
  if (digits.size() >= 4 && AllAre(digits, '9')) return minus ? Below(token) : Above(token);
  if (digits.size() == 6 && AllAre(digits, '8')) return Open(token);
  if (minus && AllAre(digits, '0')) return Below(token);
  return BadField(Quality::bad, "not a measurement: the number has no decimal point (" +
                                    std::string(token) + ")");
}

bool IsNumberText(std::string_view token) {
  if (token.size() < 2 || (token[0] != '+' && token[0] != '-')) return false;
  const std::string_view rest = token.substr(1);
  return rest.find_first_not_of("0123456789.") == std::string_view::npos &&
         std::count(rest.begin(), rest.end(), '.') <= 1 &&
         rest.find_first_not_of('.') != std::string_view::npos;
}

Fields Malformed(Outcome outcome, std::string reason, std::string remedy = {}) {
  return {
      .outcome = outcome, .reason = std::move(reason), .remedy = std::move(remedy), .fields = {}};
}

/// True for joined hex words in place of numbers, such as "7FFF8000".
bool AreHexWords(std::string_view text) {
  return text.size() % kHexWidth == 0 && IsHexText(text) &&
         text.find_first_of("+-.") == std::string_view::npos;
}

std::string WidthReason(std::string_view token, const Settings& settings) {
  std::string reason = "number '" + std::string(token) + "' is " + std::to_string(token.size()) +
                       " characters wide, not " + std::to_string(settings.width);
  if (!settings.checksum && token.size() == settings.width + 2) {
    reason += "; it may end in a checksum; set checksum: true if the module's checksum is on";
  }
  return reason;
}

Fields CutNumbers(std::string_view text, const Settings& settings) {
  Fields result;
  while (!text.empty()) {
    if (text.front() == ' ') {
      const std::size_t blank = settings.width == 0 ? kUsualWidth : settings.width;
      if (text.size() < blank || !AllAre(text.substr(0, blank), ' ')) {
        return Malformed(Outcome::unexpected,
                         "a blank field is not " + std::to_string(blank) + " characters wide");
      }
      result.fields.push_back(DisabledField());
      text.remove_prefix(blank);
      continue;
    }
    const std::string_view token = text.substr(0, text.find_first_of("+- ", 1));
    text.remove_prefix(token.size());
    if (!IsNumberText(token)) {
      return Malformed(Outcome::corrupt, "'" + std::string(token) + "' is not a number",
                       AreHexWords(token) ? "the module sends hex words; set format: hex" : "");
    }
    const bool point = token.find('.') != std::string_view::npos;
    const bool wide = settings.width != 0 && token.size() != settings.width;
    if (auto code = ListedCode(token, settings)) {
      result.fields.push_back(std::move(*code));
    } else if (wide && (point || token.size() < 5 || token.size() > kUsualWidth)) {
      return Malformed(Outcome::unexpected, WidthReason(token, settings),
                       "set width: " + std::to_string(token.size()) + " in the configuration");
    } else if (!point) {
      result.fields.push_back(PointlessCode(token));
    } else if ((settings.nines && IsFullScale(token)) ||
               (settings.format == Format::percent && token.substr(1) == "999.99")) {
      result.fields.push_back(token[0] == '-' ? Below(token) : Above(token));
    } else if (const auto number = ParseDecimal(token)) {
      result.fields.push_back({{*number}, 0, {}});
    } else {
      return Malformed(Outcome::corrupt, "'" + std::string(token) + "' is not a number");
    }
  }
  return result;
}

Value HexValue(std::uint16_t raw, const Settings& settings) {
  const auto signed_raw = std::bit_cast<std::int16_t>(raw);
  if (settings.full_scale == 0) {
    return settings.hex_unsigned ? std::int64_t{raw} : std::int64_t{signed_raw};
  }
  if (settings.hex_unsigned) return raw * settings.full_scale / 65535.0;
  if (signed_raw == 0x7FFF) return settings.full_scale;
  return signed_raw * settings.full_scale / kHexSpan;
}

constexpr const char* kSendsNumbers = "the module sends decimal numbers; set format: engineering";

Fields CutWords(std::string_view text, const Settings& settings) {
  Fields result;
  if (text.size() % kHexWidth != 0) {
    const bool numbers = text.find_first_of("+-.") != std::string_view::npos;
    return Malformed(Outcome::unexpected,
                     "the hex words do not have four digits each: " + std::string(text),
                     numbers ? kSendsNumbers : "");
  }
  for (; !text.empty(); text.remove_prefix(kHexWidth)) {
    const std::string_view token = text.substr(0, kHexWidth);
    const auto raw = ParseInteger<std::uint16_t>(token, 16);
    if (AllAre(token, ' ')) {
      result.fields.push_back(DisabledField());
    } else if (!raw) {
      const bool number = token.find_first_of("+-.") != std::string_view::npos;
      return Malformed(Outcome::corrupt, "'" + std::string(token) + "' is not a hex word",
                       number ? kSendsNumbers : "");
    } else if (auto code = ListedCode(token, settings)) {
      result.fields.push_back(std::move(*code));
    } else {
      result.fields.push_back({{HexValue(*raw, settings)}, 0, {}});
    }
  }
  return result;
}

bool Enabled(const Settings& settings, std::size_t channel) {
  return channel >= 32 || ((settings.enabled >> channel) & 1U) != 0;
}

std::string FormatHexField(double value, const Settings& settings) {
  double raw = value;
  if (settings.full_scale != 0) {
    raw = value / settings.full_scale * (settings.hex_unsigned ? 65535.0 : kHexSpan);
  }
  const double low = settings.hex_unsigned ? 0 : -kHexSpan;
  const double high = settings.hex_unsigned ? 65535.0 : kHexSpan - 1;
  const auto whole = static_cast<std::int32_t>(std::lround(std::clamp(raw, low, high)));
  const auto word = static_cast<std::uint16_t>(whole & 0xFFFF);
  return HexByte(static_cast<std::uint8_t>(word >> 8U)) + HexByte(static_cast<std::uint8_t>(word));
}

}  // namespace

Fields CutFields(std::string_view text, const Settings& settings, bool hex) {
  return hex || settings.format == Format::hex ? CutWords(text, settings)
                                               : CutNumbers(text, settings);
}

void AssignChannels(Fields& fields, const Settings& settings, std::size_t expected) {
  const std::size_t count = fields.fields.size();
  if (fields.outcome != Outcome::ok) return;
  if (expected == 0 || count == expected) {
    for (std::size_t i = 0; i < count; ++i) {
      fields.fields[i].channel = static_cast<unsigned>(i);
      if (Enabled(settings, i) || IsBad(fields.fields[i].quality)) continue;
      fields.more_enabled = settings.disabled == Disabled::missing;
      fields.fields[i] = DisabledField(i);
    }
    return;
  }
  std::vector<unsigned> enabled;
  for (std::size_t i = 0; i < expected; ++i) {
    if (Enabled(settings, i)) enabled.push_back(static_cast<unsigned>(i));
  }
  if (settings.disabled != Disabled::missing || count != enabled.size()) {
    fields = Malformed(Outcome::unexpected,
                       std::to_string(count) + " values came, but " + std::to_string(expected) +
                           " channels are configured; if some are disabled in the module, set "
                           "enable_mask",
                       "use the profile of a module with " + std::to_string(count) +
                           " channels, or set enable_mask");
    return;
  }
  for (std::size_t i = 0; i < count; ++i) fields.fields[i].channel = enabled[i];
  for (std::size_t i = 0; i < expected; ++i) {
    if (Enabled(settings, i)) continue;
    fields.fields.push_back(DisabledField(i));
  }
}

std::string FormatField(const Value& value, const Settings& settings, bool hex) {
  if (const auto* text = std::get_if<std::string>(&value)) return *text;
  const double number = ToDouble(value);
  if (hex || settings.format == Format::hex) {
    return FormatHexField(std::isfinite(number) ? number : 0, settings);
  }
  if (!std::isfinite(number) || std::abs(number) >= 9999.85) {
    const auto& codes = number < 0 ? settings.under : settings.over;
    return codes.empty() ? (number < 0 ? "-999999" : "+999999") : codes.front();
  }
  const std::size_t width = settings.width == 0 ? kUsualWidth : settings.width;
  // Most ranges have two digits before the decimal point; larger numbers need more.
  std::size_t before = settings.format == Format::percent ? 3 : 2;
  while (std::pow(10.0, static_cast<double>(before)) <= std::abs(number) + 0.0005) ++before;
  const std::size_t after = width > before + 3 ? width - before - 2 : 1;
  std::array<char, 48> buffer{};
  const auto [end, error] =
      std::to_chars(buffer.data(), buffer.data() + buffer.size(), std::abs(number),
                    std::chars_format::fixed, static_cast<int>(after));
  std::string digits(buffer.data(), error == std::errc() ? end : buffer.data());
  if (digits.size() + 1 < width) digits.insert(0, width - 1 - digits.size(), '0');
  return (std::signbit(number) ? "-" : "+") + digits;
}

}  // namespace baudgate::protocols::dcon
