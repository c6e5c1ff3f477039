// SPDX-License-Identifier: Apache-2.0
#include "protocols/set4tm/meter/values.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>

#include "gateway/base/text.h"
#include "protocols/set4tm/meter/clock.h"

namespace baudgate::protocols::set4tm {

// FromCp1251 and ToCp1251 need a table for the bytes 80 to BF. From C0 on, Windows-1251 has the
// Cyrillic alphabet in one run.

namespace {

/// The Unicode code points of the bytes 80 to BF.
constexpr std::array<char16_t, 64> kUpper = {
    0x0402, 0x0403, 0x201A, 0x0453, 0x201E, 0x2026, 0x2020, 0x2021, 0x20AC, 0x2030, 0x0409,
    0x2039, 0x040A, 0x040C, 0x040B, 0x040F, 0x0452, 0x2018, 0x2019, 0x201C, 0x201D, 0x2022,
    0x2013, 0x2014, 0x003F, 0x2122, 0x0459, 0x203A, 0x045A, 0x045C, 0x045B, 0x045F, 0x00A0,
    0x040E, 0x045E, 0x0408, 0x00A4, 0x0490, 0x00A6, 0x00A7, 0x0401, 0x00A9, 0x0404, 0x00AB,
    0x00AC, 0x00AD, 0x00AE, 0x0407, 0x00B0, 0x00B1, 0x0406, 0x0456, 0x0491, 0x00B5, 0x00B6,
    0x00B7, 0x0451, 0x2116, 0x0454, 0x00BB, 0x0458, 0x0405, 0x0455, 0x0457,
};
constexpr char16_t kAlphabet = 0x0410;  // code point of the byte C0

char16_t ToCodePoint(std::uint8_t byte) {
  if (byte < 0x20 || byte == 0x7F) return u'?';
  if (byte < 0x80) return byte;
  if (byte < 0xC0) return kUpper[byte - 0x80U];
  return static_cast<char16_t>(kAlphabet + (byte - 0xC0));
}

std::uint8_t ToByte(char32_t code) {
  if (code >= 0x20 && code < 0x7F) return static_cast<std::uint8_t>(code);
  if (code >= kAlphabet && code < kAlphabet + 0x40U) {
    return static_cast<std::uint8_t>(0xC0U + (code - kAlphabet));
  }
  const auto* at = std::ranges::find(kUpper, code);
  return at == kUpper.end() ? std::uint8_t{'?'}
                            : static_cast<std::uint8_t>(0x80 + std::distance(kUpper.begin(), at));
}

void AppendUtf8(char16_t code, std::string& text) {
  if (code < 0x80) {
    text += static_cast<char>(code);
    return;
  }
  if (code < 0x800) {
    text += static_cast<char>(0xC0U | (code >> 6U));
  } else {
    text += static_cast<char>(0xE0U | (code >> 12U));
    text += static_cast<char>(0x80U | ((code >> 6U) & 0x3FU));
  }
  text += static_cast<char>(0x80U | (code & 0x3FU));
}

}  // namespace

std::string FromCp1251(View bytes) {
  std::string text;
  for (const std::uint8_t byte : bytes) {
    if (byte == 0) break;
    AppendUtf8(ToCodePoint(byte), text);
  }
  const auto last = text.find_last_not_of(' ');
  text.resize(last == std::string::npos ? 0 : last + 1);
  return text;
}

Bytes ToCp1251(std::string_view utf8) {
  Bytes bytes;
  for (std::size_t i = 0; i < utf8.size();) {
    const auto lead = static_cast<std::uint8_t>(utf8[i++]);
    unsigned more = 0;
    char32_t code = lead;
    if (lead >= 0xF0) {
      more = 3;
      code = lead & 0x07U;
    } else if (lead >= 0xE0) {
      more = 2;
      code = lead & 0x0FU;
    } else if (lead >= 0xC0) {
      more = 1;
      code = lead & 0x1FU;
    }
    for (; more > 0 && i < utf8.size(); --more, ++i) {
      code = (code << 6U) | (static_cast<std::uint8_t>(utf8[i]) & 0x3FU);
    }
    bytes.push_back(ToByte(code));
  }
  return bytes;
}

namespace {

constexpr std::uint32_t kNoCounts = 0xFFFFFFFF;
constexpr std::uint32_t kActiveReverse = 0x800000;
constexpr std::uint32_t kReactiveReverse = 0x400000;
constexpr std::uint32_t kMagnitude = 0x3FFFFF;

Decoded Bad(Quality quality) { return {{}, quality}; }
Decoded Number(std::uint64_t value) { return {Value(value), Quality::good}; }

Decoded Scaled(double count, Measure measure, const Scale& scale) {
  const auto factor = FactorOf(measure, scale);
  if (!factor) return Bad(Quality::bad_configuration);
  return {count * factor->multiply / factor->divide, Quality::good};
}

/// Decodes a float. A missing value is a NaN whose first byte is a status code (reference, 9.8).
Decoded DecodeFloat(const Field& field, View data, const Scale& scale) {
  const std::size_t at = field.offset;
  const auto value = ByteReader(data).F32Le(at);
  if (!value) return Bad(Quality::bad_device_failure);
  if (std::isfinite(*value)) return Scaled(*value, MeasureOf(field), scale);
  if (data[at + 2] == 0x80 && data[at + 3] == 0x7F) {
    if ((data[at] & 0x0FU) == 7) return Bad({Quality::uncertain_last_usable, Reason::not_ready});
    if ((data[at] & 0x0FU) == 1) return Bad({Quality::bad_configuration, Reason::not_fitted});
  }
  return Bad(Quality::bad_sensor_failure);
}

std::optional<unsigned> Bcd(std::uint8_t byte) {
  if ((byte & 0x0FU) > 9 || byte >> 4U > 9) return std::nullopt;
  return (byte >> 4U) * 10U + (byte & 0x0FU);
}

Decoded DecodeBcd(View digits) {
  std::uint64_t value = 0;
  for (const std::uint8_t byte : digits) {
    const auto two = Bcd(byte);
    if (!two) return Bad(Quality::bad_device_failure);
    value = value * 100 + *two;
  }
  return Number(value);
}

std::string TwoDigits(unsigned value) { return {char('0' + value / 10), char('0' + value % 10)}; }

Decoded DecodeVersion(View digits) {
  std::string text;
  for (const std::uint8_t byte : digits) {
    const auto two = Bcd(byte);
    if (!two) return Bad(Quality::bad_device_failure);
    text += (text.empty() ? "" : ".") + TwoDigits(*two);
  }
  return {text, Quality::good};
}

/// Decodes a time of BCD bytes: seconds (if `seconds`), minute, hour, weekday and date; only the
/// date if `clock` is false. All zeros mean that there is no time (an open journal record), which
/// gives an empty text.
Decoded DecodeTime(View bytes, bool seconds, bool clock) {
  if (std::ranges::all_of(bytes, [](std::uint8_t byte) { return byte == 0; })) {
    return {std::string(), Quality::good};
  }
  std::vector<unsigned> parts;
  for (const std::uint8_t byte : bytes) {
    const auto two = Bcd(byte);
    if (!two) return Bad(Quality::bad_device_failure);
    parts.push_back(*two);
  }
  const std::size_t date = parts.size() - 3;
  const unsigned day = parts[date];
  const unsigned month = parts[date + 1];
  if (day < 1 || day > 31 || month < 1 || month > 12) return Bad(Quality::bad_device_failure);
  std::string text =
      "20" + TwoDigits(parts[date + 2]) + "-" + TwoDigits(month) + "-" + TwoDigits(day);
  if (!clock) return {text, Quality::good};
  const std::size_t minute = seconds ? 1 : 0;
  if (parts[minute + 1] > 23 || parts[minute] > 59 || parts[0] > 59) {
    return Bad(Quality::bad_device_failure);
  }
  text += "T" + TwoDigits(parts[minute + 1]) + ":" + TwoDigits(parts[minute]);
  if (seconds) text += ":" + TwoDigits(parts[0]);
  return {text, Quality::good};
}

std::optional<std::uint32_t> U24Be(View data, std::size_t at) {
  const auto bytes = ByteReader(data).Slice(at, 3);
  if (!bytes) return std::nullopt;
  return (std::uint32_t{(*bytes)[0]} << 16U) | (std::uint32_t{(*bytes)[1]} << 8U) | (*bytes)[2];
}

/// Returns the direction flag that makes an integer value of this decoder negative (reference,
/// 9.6).
std::uint32_t SignOf(Decoder decoder) {
  if (decoder == Decoder::power_be || decoder == Decoder::factor_be) return kActiveReverse;
  return decoder == Decoder::reactive_be ? kReactiveReverse : 0;
}

Decoded DecodeCounts(const Field& field, View data, const Scale& scale) {
  const auto raw = ByteReader(data).U32Be(field.offset);
  // All ones mean "no data". This is known from practice; the manual does not mention it
  // (reference, 8.5).
  if (!raw || *raw == kNoCounts) return Bad(Quality::bad_device_failure);
  if (field.decoder == Decoder::counts) return Number(*raw);
  return Scaled(*raw, Measure::energy, scale);
}

Decoded DecodeInteger(const Field& field, View data, const Scale& scale) {
  const auto raw = U24Be(data, field.offset);
  if (!raw) return Bad(Quality::bad_device_failure);
  const double magnitude = *raw & kMagnitude;
  const bool negative = (*raw & SignOf(field.decoder)) != 0 && magnitude != 0;
  return Scaled(negative ? -magnitude : magnitude, MeasureOf(field), scale);
}

/// Decodes a time to seconds since 1970. The byte after the time is 0 in summer, which decides
/// which of two equal hours in autumn it is (reference, 8.1).
Decoded DecodeClock(const Field& field, View data, const Scale& scale) {
  if (!scale.zone) return Bad({Quality::bad_configuration, Reason::not_fitted});
  const auto time = ByteReader(data).Slice(field.offset, kCivilSize);
  const auto season = ByteReader(data).U8(field.offset + kCivilSize);
  const auto civil = time && season ? CivilOf(*time) : std::nullopt;
  if (!civil) return Bad(Quality::bad_device_failure);
  const CivilZone::Moment moment = scale.zone->ToUtc(*civil);
  const bool first = moment.fit == CivilZone::Fit::twice && *season == 0;
  const auto utc = moment.utc - std::chrono::hours(first ? 1 : 0);
  return Number(static_cast<std::uint64_t>(utc.time_since_epoch().count()));
}

Bytes EncodeClock(double value, const Scale& scale) {
  const CivilZone zone = scale.zone.value_or(CivilZone());
  const CivilZone::Utc utc(std::chrono::seconds(static_cast<std::int64_t>(value)));
  Bytes bytes = BytesOf(zone.ToCivil(utc));
  bytes.push_back(zone.IsDaylight(utc) ? 0 : 1);
  return bytes;
}

template <typename T>
Decoded Plain(const std::optional<T>& value) {
  return value ? Number(*value) : Bad(Quality::bad_device_failure);
}

std::size_t RunLength(const Field& field) {
  switch (field.decoder) {
    case Decoder::version:
    case Decoder::date:
      return 3;
    case Decoder::time:
      return 7;
    case Decoder::time_min:
      return 6;
    case Decoder::alarm:
      return 5;
    default:
      return field.count;
  }
}

Decoded DecodeRun(const Field& field, View data) {
  const auto run = ByteReader(data).Slice(field.offset, RunLength(field));
  if (!run) return Bad(Quality::bad_device_failure);
  switch (field.decoder) {
    case Decoder::bcd:
      return DecodeBcd(*run);
    case Decoder::text_cp1251:
      return {FromCp1251(*run), Quality::good};
    case Decoder::version:
      return DecodeVersion(*run);
    case Decoder::date:
      return DecodeTime(*run, false, false);
    case Decoder::time:
      return DecodeTime(*run, true, true);
    case Decoder::time_min:
      return DecodeTime(*run, false, true);
    default: {
      // These flags are not faults: E-38 broadcast received, E-39 on reserve supply, E-40 write
      // protection on.
      const bool fault =
          std::any_of(run->begin(), run->end() - 1, [](std::uint8_t b) { return b != 0; });
      return {fault || ((*run)[4] & 0x1FU) != 0, Quality::good};
    }
  }
}

bool Put(Bytes& data, std::size_t at, View bytes) {
  if (at > data.size() || bytes.size() > data.size() - at) return false;
  std::ranges::copy(bytes, data.begin() + static_cast<std::ptrdiff_t>(at));
  return true;
}

Bytes BigEndian(std::uint64_t value, std::size_t size) {
  Bytes bytes(size);
  for (std::size_t i = 0; i < size; ++i)
    bytes[size - 1 - i] = static_cast<std::uint8_t>(value >> (8 * i));
  return bytes;
}

std::uint8_t ToBcd(std::uint64_t value) {
  return static_cast<std::uint8_t>((value / 10 % 10) << 4U | value % 10);
}

/// Returns two digits of a time such as "2002-09-02T15:30:31", from offset `at`, as a BCD byte; 0
/// if the text is shorter.
std::uint8_t BcdOf(std::string_view text, std::size_t at) {
  if (at + 2 > text.size()) return 0;
  return ToBcd(ParseInteger<std::uint64_t>(text.substr(at, 2)).value_or(0));
}

/// Returns the weekday of an ISO date, 1 for Monday; 0 if the text is not a date.
std::uint8_t Weekday(std::string_view text) {
  if (text.size() < 10) return 0;
  const auto year = ParseInteger<int>(text.substr(0, 4));
  const auto month = ParseInteger<unsigned>(text.substr(5, 2));
  const auto day = ParseInteger<unsigned>(text.substr(8, 2));
  if (!year || !month || !day) return 0;
  const std::chrono::year_month_day date{std::chrono::year(*year), std::chrono::month(*month),
                                         std::chrono::day(*day)};
  if (!date.ok()) return 0;
  return static_cast<std::uint8_t>(std::chrono::weekday(date).iso_encoding());
}

Bytes EncodeText(const Field& field, std::string_view text) {
  const Bytes date = {BcdOf(text, 8), BcdOf(text, 5), BcdOf(text, 2)};
  Bytes bytes;
  switch (field.decoder) {
    case Decoder::text_cp1251:
      bytes = ToCp1251(text);
      bytes.resize(field.count);
      break;
    case Decoder::version:
      bytes = {BcdOf(text, 0), BcdOf(text, 3), BcdOf(text, 6)};
      break;
    case Decoder::date:
      bytes = date;
      break;
    default:
      if (field.decoder == Decoder::time) bytes.push_back(BcdOf(text, 17));
      Append(bytes, Bytes{BcdOf(text, 14), BcdOf(text, 11), Weekday(text)});
      Append(bytes, date);
      break;
  }
  return bytes;
}

Bytes EncodeNumber(const Field& field, double value, const Scale& scale) {
  const auto whole = static_cast<std::int64_t>(std::clamp(std::round(value), -2e9, 5e9));
  const auto positive = static_cast<std::uint64_t>(std::max<std::int64_t>(whole, 0));
  switch (field.decoder) {
    case Decoder::float_le: {
      Bytes bytes = BigEndian(std::bit_cast<std::uint32_t>(static_cast<float>(value)), 4);
      std::ranges::reverse(bytes);
      return bytes;
    }
    case Decoder::u8:
    case Decoder::i8:
      return {static_cast<std::uint8_t>(whole)};
    case Decoder::u16_be:
      return BigEndian(positive, 2);
    case Decoder::u32_be:
    case Decoder::counts:
      return BigEndian(positive, 4);
    case Decoder::bcd: {
      Bytes bytes(field.count);
      std::uint64_t rest = positive;
      for (auto byte = bytes.rbegin(); byte != bytes.rend(); ++byte, rest /= 100)
        *byte = ToBcd(rest);
      return bytes;
    }
    default:
      break;
  }
  const auto factor = FactorOf(MeasureOf(field), scale);
  if (!factor) return {};
  const double count = std::round(std::abs(value) * factor->divide / factor->multiply);
  if (field.decoder == Decoder::energy) {
    return BigEndian(static_cast<std::uint64_t>(std::min(count, 4294967294.0)), 4);
  }
  std::uint32_t raw = static_cast<std::uint32_t>(std::min(count, static_cast<double>(kMagnitude)));
  if (value < 0) raw |= SignOf(field.decoder);
  return BigEndian(raw, 3);
}

}  // namespace

Decoded DecodeField(const Field& field, View data, const Scale& scale) {
  const ByteReader reader(data);
  switch (field.decoder) {
    case Decoder::float_le:
      return DecodeFloat(field, data, scale);
    case Decoder::u8:
      return Plain(reader.U8(field.offset));
    case Decoder::i8: {
      const auto byte = reader.U8(field.offset);
      if (!byte) return Bad(Quality::bad_device_failure);
      return {std::int64_t{static_cast<std::int8_t>(*byte)}, Quality::good};
    }
    case Decoder::u16_be:
      return Plain(reader.U16Be(field.offset));
    case Decoder::u32_be:
      return Plain(reader.U32Be(field.offset));
    case Decoder::counts:
    case Decoder::energy:
      return DecodeCounts(field, data, scale);
    case Decoder::voltage_be:
    case Decoder::current_be:
    case Decoder::power_be:
    case Decoder::reactive_be:
    case Decoder::apparent_be:
    case Decoder::factor_be:
    case Decoder::hundredths_be:
      return DecodeInteger(field, data, scale);
    case Decoder::clock:
      return DecodeClock(field, data, scale);
    case Decoder::drift:
    case Decoder::latched:
      // LatchedReads and ClockDrift set these values later.
      return Bad(Quality::bad_waiting);
    case Decoder::flag: {
      const auto byte = reader.U8((field.offset - 1) / 8);
      if (!byte) return Bad(Quality::bad_device_failure);
      return {((*byte >> ((field.offset - 1) % 8)) & 1U) != 0, Quality::good};
    }
    default:
      return DecodeRun(field, data);
  }
}

bool EncodeField(const Field& field, const Value& value, const Scale& scale, Bytes& data) {
  if (const auto* text = std::get_if<std::string>(&value)) {
    const bool holds_text =
        field.decoder == Decoder::text_cp1251 ||
        (field.decoder >= Decoder::version && field.decoder <= Decoder::time_min);
    return holds_text && Put(data, field.offset, EncodeText(field, *text));
  }
  const double number = ToDouble(value);
  if (!std::isfinite(number)) return false;
  if (field.decoder == Decoder::flag) {
    const std::size_t at = (field.offset - 1) / 8;
    if (at >= data.size()) return false;
    const auto bit = static_cast<std::uint8_t>(1U << ((field.offset - 1) % 8));
    data[at] = static_cast<std::uint8_t>(number != 0 ? data[at] | bit : data[at] & ~bit);
    return true;
  }
  if (field.decoder == Decoder::clock) return Put(data, field.offset, EncodeClock(number, scale));
  // `alarm` is not encoded, because it has no bytes of its own: it follows from the flags.
  const Bytes bytes =
      field.decoder <= Decoder::hundredths_be ? EncodeNumber(field, number, scale) : Bytes();
  return !bytes.empty() && Put(data, field.offset, bytes);
}

}  // namespace baudgate::protocols::set4tm
