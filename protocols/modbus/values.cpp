// SPDX-License-Identifier: Apache-2.0
#include "protocols/modbus/values.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <utility>

#include "gateway/base/text.h"

namespace baudgate::protocols::modbus {
namespace {

using config::WordOrder;

/// Largest exponent in a scale register, positive or negative.
constexpr int kMostExponent = 10;

constexpr std::uint16_t Swapped(std::uint16_t word) {
  return static_cast<std::uint16_t>((word << 8U) | (word >> 8U));
}

/// Returns the word order that applies to the location. A point's own order applies to every
/// register; the device's order applies only to numbers in several registers.
WordOrder OrderOf(const Location& place, const Settings& settings) {
  if (place.order) return *place.order;
  const bool apart = place.form == Form::date && place.date != DateForm::unix;
  const bool single = place.count == 1 || place.form == Form::string || apart;
  return single ? WordOrder::abcd : settings.order;
}

/// Sign-extends the lower `width` bits of `bits`: 24 in two registers, 48 in three.
std::int64_t SignExtended(std::uint64_t bits, unsigned width) {
  const std::uint64_t sign = std::uint64_t{1} << (width - 1);
  const std::uint64_t low = bits & ((sign << 1U) - 1);
  return static_cast<std::int64_t>(low ^ sign) - static_cast<std::int64_t>(sign);
}

/// Returns word `i` of the registers in the order ABCD.
std::uint16_t WordIn(std::span<const std::uint16_t> registers, WordOrder order, std::size_t i) {
  const bool in_pairs = order == WordOrder::cdabghef && registers.size() == 4;
  const bool forward = order == WordOrder::abcd || order == WordOrder::badc;
  const std::size_t from = in_pairs ? i ^ 1U : forward ? i : registers.size() - 1 - i;
  const bool swaps = order == WordOrder::badc || order == WordOrder::dcba;
  return swaps ? Swapped(registers[from]) : registers[from];
}

/// Converts registers from `order` to ABCD (high byte first), or from ABCD to `order`: the
/// conversion is the same in both directions.
Registers Reorder(std::span<const std::uint16_t> registers, WordOrder order) {
  Registers ordered(registers.size());
  for (std::size_t i = 0; i < ordered.size(); ++i) ordered[i] = WordIn(registers, order, i);
  return ordered;
}

std::uint64_t Join(std::span<const std::uint16_t> registers, WordOrder order) {
  std::uint64_t bits = 0;
  for (std::size_t i = 0; i < registers.size(); ++i) {
    bits = (bits << 16U) | WordIn(registers, order, i);
  }
  return bits;
}

Registers Part(std::uint64_t bits, std::size_t count) {
  Registers registers(count);
  for (std::size_t i = 0; i < count; ++i) {
    registers[count - 1 - i] = static_cast<std::uint16_t>(bits >> (16 * i));
  }
  return registers;
}

Decoded Integer(std::int64_t value) { return {Value(value), Quality::good}; }
Decoded Unsigned(std::uint64_t value) { return {Value(value), Quality::good}; }

Decoded Real(double value) {
  if (!std::isfinite(value)) return {{}, {Quality::bad_sensor_failure, Reason::sentinel}};
  return {Value(value), Quality::good};
}

Decoded DecodeBcd(std::uint64_t digits, std::size_t count) {
  std::uint64_t value = 0;
  for (std::size_t i = count; i-- > 0;) {
    const std::uint64_t digit = (digits >> (4 * i)) & 0xFU;
    if (digit > 9) return {{}, Quality::bad_device_failure};
    value = value * 10 + digit;
  }
  return Unsigned(value);
}

std::string DecodeString(const Registers& ordered, std::size_t length) {
  std::string text;
  for (const std::uint16_t word : ordered) {
    text += static_cast<char>(word >> 8U);
    text += static_cast<char>(word & 0xFFU);
  }
  text.resize(std::min(length, text.size()));
  text.resize(std::min(text.find('\0'), text.size()));
  text.resize(text.find_last_not_of(' ') + 1);
  return text;
}

Decoded DecodeText(const Location& place, std::uint16_t code, const Settings& settings) {
  const auto table = settings.texts.find(place.texts);
  if (table != settings.texts.end()) {
    const auto text = table->second.find(code);
    if (text != table->second.end()) return {text->second, Quality::good};
  }
  return {"code " + std::to_string(code), Quality::good};
}

Error NoFit(const Value& value, std::string_view why) {
  return Error{ToText(value) + " " + std::string(why)};
}

/// Tolerance for rounding errors after a division by the scale. Example: 30.3 / 0.1 is
/// 302.99999999999994.
constexpr double kNoise = 1e-6;

/// Returns `value` as a whole number, a negative number in two's complement. Fails if `value` is
/// not whole or out of the range. A value of type int64 or uint64 is not converted to double, so it
/// keeps all digits.
Result<std::uint64_t> Whole(const Value& value, std::int64_t lowest, std::uint64_t highest) {
  const std::string range =
      "is outside " + std::to_string(lowest) + "..." + std::to_string(highest);
  if (const auto* number = std::get_if<std::uint64_t>(&value)) {
    if (*number > highest) return NoFit(value, range);
    return *number;
  }
  if (const auto* number = std::get_if<std::int64_t>(&value)) {
    const bool above = *number > 0 && static_cast<std::uint64_t>(*number) > highest;
    if (*number < lowest || above) return NoFit(value, range);
    return static_cast<std::uint64_t>(*number);
  }
  const double number = std::round(ToDouble(value));
  if (!std::isfinite(number)) return NoFit(value, "is not a number");
  if (std::abs(number - ToDouble(value)) > kNoise * std::max(1.0, std::abs(number))) {
    return NoFit(value, "is not a whole number, but the register holds whole numbers only");
  }
  if (!config::IntegerRange{lowest, highest}.Contains(number)) return NoFit(value, range);
  return number < 0 ? static_cast<std::uint64_t>(static_cast<std::int64_t>(number))
                    : static_cast<std::uint64_t>(number);
}

Result<std::uint64_t> EncodeBcd(const Value& value, std::size_t digits) {
  std::uint64_t most = 1;
  for (std::size_t i = 0; i < digits; ++i) most *= 10;
  const auto whole = Whole(value, 0, most - 1);
  if (!whole) return whole;
  std::uint64_t bits = 0;
  std::uint64_t rest = *whole;
  for (std::size_t i = 0; i < digits; ++i, rest /= 10) bits |= (rest % 10) << (4 * i);
  return bits;
}

Result<std::uint64_t> EncodeReal(const Value& value, bool single) {
  const double number = ToDouble(value);
  if (!std::isfinite(number)) return NoFit(value, "is not a number");
  if (!single) return std::bit_cast<std::uint64_t>(number);
  if (std::abs(number) > std::numeric_limits<float>::max()) {
    return NoFit(value, "is too large for float32");
  }
  return std::bit_cast<std::uint32_t>(static_cast<float>(number));
}

Result<std::uint64_t> EncodeNumber(Form form, const Value& value) {
  constexpr std::int64_t kHalf24 = 1 << 23;
  constexpr std::int64_t kHalf48 = std::int64_t{1} << 47;
  switch (form) {
    case Form::int8: {
      const auto byte = Whole(value, std::numeric_limits<std::int8_t>::min(),
                              std::numeric_limits<std::int8_t>::max());
      return byte ? Result<std::uint64_t>(*byte & 0xFFU) : byte;
    }
    case Form::uint8:
      return Whole(value, 0, std::numeric_limits<std::uint8_t>::max());
    case Form::int24:
      return Whole(value, -kHalf24, kHalf24 - 1);
    case Form::uint24:
      return Whole(value, 0, 2 * kHalf24 - 1);
    case Form::int48:
      return Whole(value, -kHalf48, kHalf48 - 1);
    case Form::uint48:
      return Whole(value, 0, 2 * kHalf48 - 1);
    case Form::bcd48:
      return EncodeBcd(value, 12);
    case Form::bcd64:
      return EncodeBcd(value, 16);
    case Form::int16:
      return Whole(value, std::numeric_limits<std::int16_t>::min(),
                   std::numeric_limits<std::int16_t>::max());
    case Form::int32:
      return Whole(value, std::numeric_limits<std::int32_t>::min(),
                   std::numeric_limits<std::int32_t>::max());
    case Form::int64:
      return Whole(value, std::numeric_limits<std::int64_t>::min(),
                   std::numeric_limits<std::int64_t>::max());
    case Form::uint32:
      return Whole(value, 0, std::numeric_limits<std::uint32_t>::max());
    case Form::uint64:
      return Whole(value, 0, std::numeric_limits<std::uint64_t>::max());
    case Form::float32:
      return EncodeReal(value, true);
    case Form::float64:
      return EncodeReal(value, false);
    case Form::bcd16:
      return EncodeBcd(value, 4);
    case Form::bcd32:
      return EncodeBcd(value, 8);
    default:
      return Whole(value, 0, std::numeric_limits<std::uint16_t>::max());
  }
}

Result<Registers> EncodeString(const Location& place, const Value& value) {
  std::string text = ToText(value);
  if (text.size() > place.length) {
    return Error{"the text is longer than " + std::to_string(place.length) + " characters"};
  }
  text.resize(2 * place.count);
  Registers registers(place.count);
  for (std::size_t i = 0; i < registers.size(); ++i) {
    const auto high = static_cast<std::uint8_t>(text[2 * i]);
    const auto low = static_cast<std::uint8_t>(text[2 * i + 1]);
    registers[i] = static_cast<std::uint16_t>((high << 8U) | low);
  }
  return registers;
}

/// Multiplies the value by 10 to the power of `exponent`, the content of a scale register (SunSpec
/// and others). An exponent outside -10…10 means that the device has no value.
Decoded Scaled(const Decoded& decoded, std::uint16_t exponent) {
  const int n = static_cast<std::int16_t>(exponent);
  if (!HasValue(decoded.value)) return decoded;
  if (n < -kMostExponent || n > kMostExponent) return {{}, Quality::bad_device_failure};
  const auto number = Decimal::Of(decoded.value);
  if (!number) return {decoded.value, decoded.quality};
  return {Value(number->Shifted(n).ToDouble()), decoded.quality};
}

}  // namespace

Decoded DecodeBlock(const Location& place, std::span<const std::uint16_t> block,
                    const Settings& settings, std::span<const config::Sentinel> sentinels) {
  const std::size_t begin = BeginOf(place);
  if (block.size() != EndOf(place) - begin) return {{}, Quality::bad_configuration};
  Decoded decoded = Decode(place, block.subspan(place.address - begin, place.count), settings);
  if (!place.scale || !HasValue(decoded.value)) return decoded;
  // A sentinel means "no measurement", so the scale does not apply to it.
  const bool stands = std::ranges::any_of(sentinels, [&](const config::Sentinel& sentinel) {
    return IsMeant(decoded.value, sentinel.value);
  });
  return stands ? decoded : Scaled(decoded, block[*place.scale - begin]);
}

Decoded Decode(const Location& place, std::span<const std::uint16_t> registers,
               const Settings& settings) {
  if (registers.size() != place.count) return {{}, Quality::bad_configuration};
  const WordOrder order = OrderOf(place, settings);
  const std::uint64_t bits = Join(registers, order);
  switch (place.form) {
    case Form::flag:
    case Form::bit:
      return {((bits >> place.bit) & 1U) != 0, Quality::good};
    case Form::int16:
      return Integer(static_cast<std::int16_t>(bits));
    case Form::int32:
      return Integer(static_cast<std::int32_t>(bits));
    case Form::int64:
      return Integer(static_cast<std::int64_t>(bits));
    case Form::uint16:
    case Form::uint32:
    case Form::uint64:
      return Unsigned(bits);
    case Form::float32:
      return Real(std::bit_cast<float>(static_cast<std::uint32_t>(bits)));
    case Form::float64:
      return Real(std::bit_cast<double>(bits));
    case Form::bcd16:
      return DecodeBcd(bits, 4);
    case Form::bcd32:
      return DecodeBcd(bits, 8);
    case Form::bcd48:
      return DecodeBcd(bits, 12);
    case Form::bcd64:
      return DecodeBcd(bits, 16);
    case Form::bits:
      return Unsigned((bits >> place.bit) & ((1U << place.width) - 1U));
    case Form::int8:
      return Integer(static_cast<std::int8_t>(bits));
    case Form::uint8:
      return Unsigned(bits & 0xFFU);
    case Form::int24:
      return Integer(SignExtended(bits, 24));
    case Form::uint24:
      return Unsigned(bits & 0xFFFFFFU);
    case Form::int48:
      return Integer(SignExtended(bits, 48));
    case Form::uint48:
      return Unsigned(bits);
    case Form::date:
      return DecodeDate(place.date, Reorder(registers, order));
    case Form::object:
      break;
    case Form::string:
      return {DecodeString(Reorder(registers, order), place.length), Quality::good};
    case Form::text:
      return DecodeText(place, static_cast<std::uint16_t>(bits), settings);
  }
  return {{}, Quality::bad_configuration};
}

Result<Registers> Encode(const Location& place, const Value& value, const Settings& settings) {
  if (!HasValue(value)) return Error{"the device sent no value"};
  if (place.form == Form::string) {
    auto registers = EncodeString(place, value);
    return registers ? Result(Reorder(*registers, OrderOf(place, settings))) : registers;
  }
  if (place.form == Form::date) {
    const auto registers = EncodeDate(place.date, ToText(value));
    if (!registers) return NoFit(value, "is not a date such as 2026-11-23 04:45:00");
    return Reorder(*registers, OrderOf(place, settings));
  }
  const auto bits = EncodeNumber(place.form, value);
  if (!bits) return Error{bits.error()};
  return Reorder(Part(*bits, place.count), OrderOf(place, settings));
}

std::optional<std::uint16_t> CodeOf(const Location& place, const Value& value,
                                    const Settings& settings) {
  const auto table = settings.texts.find(place.texts);
  if (table == settings.texts.end()) return std::nullopt;
  const std::string wanted = ToText(value);
  for (const auto& [code, text] : table->second) {
    if (text == wanted) return code;
  }
  return std::nullopt;
}

Registers WordsFrom(View bytes, std::size_t at) {
  Registers words;
  for (; at + 1 < bytes.size(); at += 2) words.push_back(U16At(bytes, at));
  return words;
}

}  // namespace baudgate::protocols::modbus
