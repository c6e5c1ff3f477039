// The `write` part of protocols/dcon/points.h: parses forms such as "#2{+00.000 0..10}" and formats
// the commands.
// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <cmath>

#include "gateway/base/text.h"
#include "protocols/dcon/points.h"

namespace baudgate::protocols::dcon {
namespace {

Error WriteError(std::string_view text, std::string_view what) {
  return Error{"write '" + std::string(text) + "' " + std::string(what)};
}

/// True for the commands of outputs: "#", "@", and "#" with a channel, a bit group, or `C` and a
/// channel (ADAM-4024).
bool IsOutputCommand(std::string_view command) {
  if (command == "@" || command == "#") return true;
  if (!command.starts_with('#') || command.size() > 3) return false;
  return std::all_of(command.begin() + 1, command.end(),
                     [](char c) { return (c >= '0' && c <= '9') || (c >= 'A' && c <= 'F'); });
}

/// A command that writes a setting; 'n' is any digit. Source: dcon reference, 8.1, 9.1, 10, 14.
struct SettingRule {
  std::string_view pattern;
  std::string_view data;
};

constexpr SettingRule kSettings[] = {
    {"$C", "clear"},   // clears latches
    {"$Cn", "clear"},  // clears the counter of an input
    {"$6n", "clear"},  // resets a counter to its preset
    {"~1", "clear"},   // clears the tripped host watchdog
    {"$4", "store"},   // stores the present analog output for power-up
    {"$4n", "store"},  // stores the present analog output of channel n for power-up
    {"~5n", "store"},  // stores the present analog output as the safe value
    {"$5n", "flag"},   // starts or stops a counter
    {"$A", "hex1"},    // sets the gate of a counter
    {"$3n", "hex8"},   // sets the maximum of a counter
    {"@Pn", "hex8"},   // sets the preset of a counter
    {"@DO0", "hex1"},  // sets the outputs of a counter module
    {"~3", "hex3"},    // sets the host watchdog: enable flag, then tenths of a second
    {"~5", "hex4"},   // sets digital outputs for two cases: the power-up value, then the safe value
    {"$X", "dec4"},   // sets the watchdog of ADAM modules, in tenths of a second
    {"$X0", "dec4"},  // sets the watchdog of ADAM-4024, in tenths of a second
};

const SettingRule* FindSetting(std::string_view command) {
  const auto fits = [&](const SettingRule& rule) {
    return std::ranges::equal(rule.pattern, command, [](char p, char c) {
      return p == 'n' ? c >= '0' && c <= '9' : p == c;
    });
  };
  const auto* found = std::ranges::find_if(kSettings, fits);
  return found == std::end(kSettings) ? nullptr : found;
}

std::size_t DigitsOf(std::string_view data) {
  return ParseInteger<unsigned>(data.substr(3)).value_or(0);
}

Result<WriteAddress> ParseSetting(const SettingRule& rule, WriteAddress write,
                                  std::string_view text, std::string_view data) {
  if (data != rule.data) {
    return WriteError(
        text, "needs this form of data: \"" + write.command + "{" + std::string(rule.data) + "}\"");
  }
  using Kind = WriteAddress::Kind;
  write.setting = true;
  if (data == "clear" || data == "store") {
    write.kind = Kind::action;
  } else if (data == "flag") {
    write.kind = Kind::flag;
    write.digits = 1;
  } else {
    write.kind = data.starts_with("hex") ? Kind::hex : Kind::decimal;
    write.digits = DigitsOf(data);
  }
  return write;
}

/// Parses the number format "+00.000": an optional sign, zeros, a point, zeros.
bool ParsePicture(std::string_view picture, WriteAddress& write) {
  write.kind = WriteAddress::Kind::number;
  write.sign = picture.starts_with('+');
  if (write.sign) picture.remove_prefix(1);
  const auto point = picture.find('.');
  if (point == std::string_view::npos || point == 0 || picture.size() > 10) return false;
  write.digits = point;
  write.decimals = picture.size() - point - 1;
  const auto zeros = std::count(picture.begin(), picture.end(), '0');
  return static_cast<std::size_t>(zeros) == picture.size() - 1 && write.decimals > 0;
}

double LargestOf(const WriteAddress& write) {
  return std::pow(10.0, static_cast<double>(write.digits)) -
         std::pow(10.0, -static_cast<double>(write.decimals));
}

/// Parses the range "0..10" after the number format. Without a range all numbers that fit the
/// digits are allowed.
bool ParseRange(std::string_view range, WriteAddress& write) {
  const double largest = LargestOf(write);
  write.high = largest;
  write.low = write.sign ? -largest : 0;
  if (range.empty()) return true;
  const auto dots = range.find("..");
  if (dots == std::string_view::npos) return false;
  const auto low = ParseDecimal(range.substr(0, dots));
  const auto high = ParseDecimal(range.substr(dots + 2));
  if (!low || !high || *low >= *high || *low < write.low || *high > largest) return false;
  write.low = *low;
  write.high = *high;
  return true;
}

std::string FixedPoint(double value, const WriteAddress& write) {
  std::array<char, 48> buffer{};
  const auto [end, error] =
      std::to_chars(buffer.data(), buffer.data() + buffer.size(), std::abs(value),
                    std::chars_format::fixed, static_cast<int>(write.decimals));
  std::string digits(buffer.data(), error == std::errc() ? end : buffer.data());
  const std::size_t width = write.digits + 1 + write.decimals;
  if (digits.size() < width) digits.insert(0, width - digits.size(), '0');
  if (!write.sign) return digits;
  return (value < 0 ? "-" : "+") + digits;
}

std::string Padded(std::uint64_t value, std::size_t digits) {
  std::string text = std::to_string(value);
  if (text.size() < digits) text.insert(0, digits - text.size(), '0');
  return text;
}

std::string FixedHex(std::uint64_t value, std::size_t digits) {
  std::string text;
  for (std::size_t i = digits; i-- > 0;)
    text += HexByte(static_cast<std::uint8_t>((value >> (4 * i)) & 15U))[1];
  return text;
}

}  // namespace

Result<WriteAddress> ParseWrite(std::string_view text) {
  constexpr std::string_view kForms =
      "; write a command with the form of its data, as in \"#13{bit}\", \"@{hex2}\", \"#2{+00.000 "
      "0..10}\"";
  const auto open = text.find('{');
  if (open == std::string_view::npos || !text.ends_with('}')) {
    return WriteError(text, "has no data" + std::string(kForms));
  }
  WriteAddress write;
  write.command = text.substr(0, open);
  const std::string_view data = text.substr(open + 1, text.size() - open - 2);
  if (const SettingRule* rule = FindSetting(write.command)) {
    return ParseSetting(*rule, std::move(write), text, data);
  }
  if (!IsOutputCommand(write.command)) {
    return WriteError(text,
                      "is not a write command; use # or @ for outputs, or a command that the "
                      "README lists, as \"$C{clear}\" or \"~1{clear}\"");
  }
  if (data == "bit") {
    if (write.command.size() != 3) {
      return WriteError(text, "needs the group and number of one output, as in \"#13{bit}\"");
    }
    return write;
  }
  if (data.starts_with("hex")) {
    const auto digits = ParseInteger<unsigned>(data.substr(3));
    if (!digits || *digits < 1 || *digits > 4)
      return WriteError(text, "has a wrong number of digits; write hex1 to hex4");
    write.kind = WriteAddress::Kind::hex;
    write.digits = *digits;
    if (write.command != "@" && write.command.size() - 1 + write.digits < 3) {
      return WriteError(text, "would be read by the module as a request for a channel");
    }
    return write;
  }
  const auto blank = data.find(' ');
  const std::string_view range =
      blank == std::string_view::npos ? std::string_view{} : Trim(data.substr(blank));
  if (!ParsePicture(data.substr(0, blank), write) || !ParseRange(range, write)) {
    return WriteError(text, "has an unknown form of data" + std::string(kForms));
  }
  if (write.command == "@")
    return WriteError(text, "takes hex digits, not a number; write {hex1} to {hex4}");
  return write;
}

Result<std::string> FormatWrite(const WriteAddress& write, const Value& value) {
  const double number = ToDouble(value);
  const std::string shown = ToText(value);
  if (!std::isfinite(number)) return Error{"'" + shown + "' is not a number"};
  switch (write.kind) {
    case WriteAddress::Kind::bit:
    case WriteAddress::Kind::flag: {
      if (number != 0 && number != 1) return Error{shown + " is neither 0 nor 1"};
      const std::string zero = write.kind == WriteAddress::Kind::bit ? "0" : "";
      return write.command + zero + (number == 1 ? "1" : "0");
    }
    case WriteAddress::Kind::action:
      if (number != 1) return Error{shown + " has no effect; write 1"};
      return write.command;
    case WriteAddress::Kind::hex:
    case WriteAddress::Kind::decimal: {
      const bool hex = write.kind == WriteAddress::Kind::hex;
      const double limit = std::pow(hex ? 16.0 : 10.0, static_cast<double>(write.digits));
      if (number < 0 || number >= limit || number != std::floor(number)) {
        return Error{shown + " is not a whole number of " + std::to_string(write.digits) +
                     (hex ? " hex digits" : " digits")};
      }
      const auto whole = static_cast<std::uint64_t>(number);
      return write.command + (hex ? FixedHex(whole, write.digits) : Padded(whole, write.digits));
    }
    case WriteAddress::Kind::number:
      // The gateway must not send a value beyond the range: a module refuses it, but still moves
      // the output to the limit.
      if (number < write.low || number > write.high) {
        return Error{shown + " is outside " + FormatNumber(write.low) + "..." +
                     FormatNumber(write.high)};
      }
      return write.command + FixedPoint(number, write);
  }
  return Error{
      "the key write does not describe the form of the data, such as {bit}; correct the key"};
}

std::optional<Value> ParseWritten(const WriteAddress& write, std::string_view command) {
  if (!command.starts_with(write.command)) return std::nullopt;
  if (write.kind == WriteAddress::Kind::action) {
    return command == write.command ? std::optional(Value{true}) : std::nullopt;
  }
  const std::string_view data = command.substr(write.command.size());
  if (write.kind == WriteAddress::Kind::number) {
    const std::size_t width = (write.sign ? 1U : 0U) + write.digits + 1 + write.decimals;
    const auto number = ParseDecimal(data);
    const bool signed_text = data.starts_with('+') || data.starts_with('-');
    if (!number || data.size() != width || signed_text != write.sign) return std::nullopt;
    if (*number < write.low || *number > write.high) return Value{};
    return Value{*number};
  }
  const bool decimal = write.kind == WriteAddress::Kind::decimal;
  const auto is_digit = [decimal](char c) {
    return decimal ? c >= '0' && c <= '9' : HexDigit(c).has_value();
  };
  if (data.size() != write.digits || !std::ranges::all_of(data, is_digit)) return std::nullopt;
  const auto number = ParseInteger<std::uint64_t>(data, decimal ? 10 : 16);
  if (!number) return std::nullopt;
  if (decimal || write.kind == WriteAddress::Kind::hex) return Value{*number};
  if (*number > 1) return Value{};
  return Value{*number == 1};
}

}  // namespace baudgate::protocols::dcon
