// SPDX-License-Identifier: Apache-2.0
#include "protocols/spabus/points.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <tuple>

#include "gateway/base/decimal.h"
#include "gateway/base/text.h"
#include "protocols/spabus/clock.h"
#include "protocols/spabus/settings.h"

namespace baudgate::protocols::spabus {
namespace {

constexpr DecoderSpec kDecoders[] = {
    {"I1", "input data: measurements and digital inputs"},
    {"O1", "output data: starts, trips and relay outputs"},
    {"S1", "setting"},
    {"V1", "variable: recorded values, counters, control parameters"},
    {"M1", "memory data"},
    {"14V1", "item of channel 14; channel 0 need not be written"},
    {"C", "module status: 0 normal, 1 automatic reset, 2 event overflow, 3 both"},
    {"F", "type designation (string)"},
    {"T", "time within the minute, ss.sss"},
    {"T offset", "device's clock minus this machine's clock, in s; read only"},
    {"D", "date and time (string)"},
    {"3A", "alarms of a channel (string)"},
};

/// Returns why an item must not be written through a gateway. Empty: writing it is allowed.
std::string_view Forbidden(const Address& address) {
  if (address.category != 'V') return {};
  switch (address.number.value_or(0)) {
    case 160:
    case 161:
      return "it is the password; set the option `password`, which writes use automatically";
    case 167:
      return "it formats the memory of the device";
    case 200:
      return "it changes the slave number and would make the device unreachable";
    case 201:
      return "it changes the bit rate and would make the device unreachable";
    default:
      return {};
  }
}

Status CheckOffset(const config::Point& point) {
  if (point.access != config::Access::read) {
    return Error{"'" + point.read + "' can only be read; the clock is set with send_seconds"};
  }
  const bool is_float = point.type == config::Type::float32 || point.type == config::Type::float64;
  if (!is_float) return Error{"'" + point.read + "' is a number of seconds; write type: float32"};
  return {};
}

Status CheckRead(const config::Point& point) {
  if (point.read == kOffsetItem) return CheckOffset(point);
  const auto address = ParseAddress(point.read);
  if (!address) return Error{address.error()};
  const char category = address->category;
  if (category == 'L' || category == 'B') {
    return Error{
        "'" + point.read +
        "' reads events, which removes them from the device; events cannot be read by points"};
  }
  const bool text = category == 'F' || category == 'D' || category == 'A';
  if (text && point.type != config::Type::string) {
    return Error{"'" + point.read + "' is text; write type: string(16)"};
  }
  const std::uint32_t number = address->number.value_or(0);
  if (category == 'V' && number >= kPasswordItems.first && number <= kPasswordItems.last) {
    return Error{"'" + point.read + "' is the password and cannot be read"};
  }
  return {};
}

Status CheckWrite(const config::Point& point) {
  const std::string& text = point.write.empty() ? point.read : point.write;
  const auto address = WriteAddress(point);
  if (!address) return Error{address.error()};
  constexpr std::string_view kWritable = "OSVMCTD";
  if (kWritable.find(address->category) == std::string_view::npos) {
    return Error{"'" + text + "' can only be read; the categories to write are O S V M C T D"};
  }
  const std::string_view why = Forbidden(*address);
  if (!why.empty()) {
    return Error{"'" + text + "' cannot be written through the gateway: " + std::string(why)};
  }
  return {};
}

}  // namespace

Result<Address> WriteAddress(const config::Point& point) {
  return ParseAddress(point.write.empty() ? point.read : point.write);
}

std::vector<ReadPoint> ReadablePoints(std::span<const config::Point> points) {
  std::vector<ReadPoint> readable;
  for (std::size_t index = 0; index < points.size(); ++index) {
    const config::Point& point = points[index];
    if (point.access == config::Access::write) continue;
    if (point.read == kOffsetItem) {
      readable.push_back({{0, kSeconds, std::nullopt}, index, &point, true});
    } else if (const auto address = ParseAddress(point.read)) {
      readable.push_back({*address, index, &point});
    }
  }
  return readable;
}

std::vector<ConfigRemark> DoubtsOf(const config::Device& device) {
  std::vector<ConfigRemark> doubts;
  if (const auto slave = ParseSlave(device.address); slave && *slave > kBroadcast) {
    doubts.push_back({kNoPoint, std::to_string(*slave) +
                                    " is above the broadcast number 900, so no known device can "
                                    "have it; write the number that the device shows, 1 to 899"});
  }
  for (std::size_t i = 0; i < device.points.size(); ++i) {
    const config::Point& point = device.points[i];
    if (!point.writing.allowed) continue;
    const auto item = WriteAddress(point);
    if (!item || item->category != 'O') continue;
    doubts.push_back({i, "can be written: " + FormatAddress(*item) +
                             " is an output of a protection relay, so a write may trip a breaker. "
                             "Name only the needed points in `write` of the device, and set "
                             "permit: read at listeners that need not write"});
  }
  return doubts;
}

Status CheckPoint(const config::Point& point) {
  for (const std::string& text : {point.read, point.write}) {
    if (const Status status = RefuseLeadingZeros(text, "^IOSVM"); !status) return status;
  }
  if (point.access != config::Access::write || !point.read.empty()) {
    if (Status read = CheckRead(point); !read) return read;
  }
  if (point.table == config::Table::bits && point.type != config::Type::boolean) {
    return Error{"'" + point.name + "' is in a bit table; write type: bool"};
  }
  if (point.access == config::Access::read) return {};
  return CheckWrite(point);
}

std::span<const DecoderSpec> DecoderTable() { return kDecoders; }

namespace {

using config::Type;

/// A double represents every integer exactly up to this number. No known device uses larger
/// integers.
constexpr double kLargestExact = 9007199254740992.0;
/// The maximum length of a text item. Known masters write no longer texts.
constexpr std::size_t kLongestText = 131;
/// The maximum number of decimals for a point without configured decimals; kScaledDecimals if the
/// point has a scale, because a value that was divided by a scale is inexact in its last digits.
constexpr std::size_t kMostDecimals = 9;
constexpr std::size_t kScaledDecimals = 6;
/// Relative tolerance in the comparison with limits, which may be no binary fractions.
constexpr double kSlack = 1e-9;

bool IsInteger(Type type) { return type >= Type::int8 && type <= Type::uint64; }
bool IsScaled(const config::Point& point) { return point.scale != 1 || point.offset != 0; }

/// Parses a number. A whole number in any form gives an integer, any other a decimal number.
std::optional<Value> ParseNumber(std::string_view text) {
  if (const auto whole = ParseInteger<std::int64_t>(text)) return Value(*whole);
  if (const auto large = ParseInteger<std::uint64_t>(text)) return Value(*large);
  const auto number = ParseDecimal(text);
  if (!number || !std::isfinite(*number)) return std::nullopt;
  if (std::trunc(*number) == *number && std::abs(*number) < kLargestExact) {
    return Value(static_cast<std::int64_t>(*number));
  }
  return Value(*number);
}

struct Limits {
  double low;
  double high;
};

Limits LimitsOf(Type type) {
  switch (type) {
    case Type::boolean:
      return {0, 1};
    case Type::int8:
      return {-128, 127};
    case Type::uint8:
      return {0, 255};
    case Type::int16:
      return {-32768, 32767};
    case Type::uint16:
      return {0, 65535};
    case Type::int32:
      return {-2147483648.0, 2147483647.0};
    case Type::uint32:
      return {0, 4294967295.0};
    case Type::int64:
      return {-kLargestExact, kLargestExact};
    case Type::uint64:
      return {0, kLargestExact};
    default:
      return {-1e12, 1e12};
  }
}

/// Removes zeros at the end of the decimals: "4.10" gives "4.1", "4.00" gives "4". At least `least`
/// decimals stay.
void DropZeros(std::string& text, std::size_t least) {
  const std::size_t point = text.find('.');
  if (point != std::string::npos) {
    while (text.size() > point + 1 + least && text.back() == '0') text.pop_back();
    if (text.back() == '.') text.pop_back();
  }
  if (text == "-0") text = "0";
}

std::string FormatFixed(double number, int least, int most) {
  char buffer[64];
  const auto [end, error] =
      std::to_chars(buffer, buffer + sizeof buffer, number, std::chars_format::fixed, most);
  if (error != std::errc()) return {};
  std::string text(buffer, end);
  DropZeros(text, static_cast<std::size_t>(least));
  return text;
}

/// Adds one to the last digit of a number: "-1.99" gives "-2.00".
void StepUp(std::string& text) {
  for (std::size_t i = text.size(); i-- > 0;) {
    if (text[i] == '.' || text[i] == '-') continue;
    if (text[i] != '9') {
      ++text[i];
      return;
    }
    text[i] = '0';
  }
  text.insert(text.front() == '-' ? 1 : 0, 1, '1');
}

/// Rounds a decimal text, half away from zero. Example: 2.675 becomes 2.68, although its double is
/// lower than 2.675.
std::string RoundTo(std::string text, std::size_t decimals) {
  const std::size_t point = text.find('.');
  const std::size_t next = point + 1 + decimals;
  if (point != std::string::npos && next < text.size()) {
    const bool up = text[next] >= '5';
    text.resize(decimals == 0 ? point : next);
    if (up) StepUp(text);
  }
  DropZeros(text, 0);
  return text;
}

Result<std::string> EncodeText(const std::string& text) {
  if (text.empty()) return Error{"an empty text cannot be written to an SPA device"};
  if (text.size() > kLongestText) return Error{"an SPA text item has at most 131 characters"};
  for (const char c : text) {
    if (IsReserved(c) || !IsPrintable(static_cast<std::uint8_t>(c))) {
      return Error{"'" + Printable(ToBytes(text)) +
                   "' cannot be written; only printable ASCII without < > : / & is possible"};
    }
  }
  return text;
}

/// Returns the shortest text of a number. A float32 register contains 30.3 as 30.299999237, so the
/// shortest text that gives the same float32 is the intended number. A float64 is rounded to 15
/// digits, which hides the error of 0.1 + 0.2.
std::string Shortest(double number, Type type) {
  char buffer[512];
  char* const end = buffer + sizeof buffer;
  if (type == Type::float32) {
    const auto number32 = static_cast<float>(number);
    return {buffer, std::to_chars(buffer, end, number32, std::chars_format::fixed).ptr};
  }
  double meant = number;
  if (type == Type::float64) {
    const char* const last = std::to_chars(buffer, end, number, std::chars_format::general, 15).ptr;
    std::from_chars(buffer, last, meant);
  }
  return {buffer, std::to_chars(buffer, end, meant, std::chars_format::fixed).ptr};
}

std::size_t MostDecimals(const config::Point& point) {
  if (point.writing.decimals) return static_cast<std::size_t>(*point.writing.decimals);
  return IsScaled(point) ? kScaledDecimals : kMostDecimals;
}

bool IsAllowed(const std::string& text, const config::Point& point) {
  const Decimal shown = Decimal::Parse(text).value_or(0) * point.scale + point.offset;
  const auto& [min, max] = std::tie(point.writing.min, point.writing.max);
  const Decimal slack = std::max(Decimal(1), Abs(shown)) * kSlack;
  return !(min && shown < *min - slack) && !(max && shown > *max + slack);
}

/// Returns the text for a number, rounded to the point's decimals. Fails if rounding gives 0, or a
/// number outside the range that may be written.
Result<std::string> EncodeNumber(double number, const config::Point& point) {
  const std::size_t decimals = MostDecimals(point);
  std::string text = RoundTo(Shortest(number, point.type), decimals);
  const auto rounded = [&](const std::string& why) {
    return Error{FormatNumber(number) + ", rounded to the " + std::to_string(decimals) +
                 " decimals of '" + point.name + "', is " + text + ": " + why};
  };
  if (text == "0" && number != 0) return rounded("the number is too small to be written");
  if (!IsAllowed(text, point))
    return rounded("the number is outside the range that may be written");
  return text;
}

}  // namespace

Decoded DecodeValue(std::string_view raw, const config::Point& point) {
  const std::string_view text = Trim(raw);
  if (point.type == Type::string) return {Value(std::string(text)), Quality::good};
  if (text.empty()) return {{}, Quality::bad_sensor_failure};
  const auto number = ParseNumber(text);
  if (!number) return {{}, Quality::bad_configuration};
  if (point.type == Type::boolean) {
    if (*number == Value(std::int64_t{0})) return {Value(false), Quality::good};
    if (*number == Value(std::int64_t{1})) return {Value(true), Quality::good};
    return {{}, Quality::bad_configuration};
  }
  if (IsInteger(point.type)) {
    // A decimal such as 0.52 is valid for an integer point only if the point is scaled.
    const bool whole = !std::holds_alternative<double>(*number);
    if (!whole && !IsScaled(point)) return {{}, Quality::bad_configuration};
    return {*number, Quality::good};
  }
  return {Value(ToDouble(*number)), Quality::good};
}

Value GuessValue(std::string_view raw) {
  const std::string_view text = Trim(raw);
  if (auto number = ParseNumber(text)) return *number;
  return std::string(text);
}

Result<std::string> EncodeValue(const Value& value, const config::Point& point) {
  if (point.type == Type::string) {
    const auto* text = std::get_if<std::string>(&value);
    if (text == nullptr) return Error{"'" + point.name + "' takes a text"};
    return EncodeText(*text);
  }
  if (std::holds_alternative<std::string>(value)) {
    return Error{"'" + point.name + "' takes a number, not a text"};
  }
  const double number = ToDouble(value);
  if (!std::isfinite(number))
    return Error{"'" + point.name + "' cannot be set to a value that is not a number"};
  const Limits limits = LimitsOf(IsScaled(point) ? Type::float64 : point.type);
  if (number < limits.low || number > limits.high) {
    return Error{ToText(value) + " is outside the range of '" + point.name + "' (" +
                 std::string(config::Name(point.type)) + ")"};
  }
  const bool whole = point.type == Type::boolean || (IsInteger(point.type) && !IsScaled(point));
  if (whole && std::trunc(number) != number) {
    return Error{ToText(value) + " is not a whole number, which '" + point.name + "' needs"};
  }
  return EncodeNumber(number, point);
}

std::string PrintValue(const Value& value, const config::Point& point) {
  if (const auto* text = std::get_if<std::string>(&value)) {
    std::string clean = *text;
    std::replace_if(
        clean.begin(), clean.end(),
        [](char c) { return IsReserved(c) || !IsPrintable(static_cast<std::uint8_t>(c)); }, '-');
    return clean;
  }
  const double number = ToDouble(value);
  if (!std::isfinite(number)) return {};
  if (point.type == Type::boolean) return number != 0 ? "1" : "0";
  if (IsInteger(point.type) && !IsScaled(point)) return FormatFixed(std::round(number), 0, 0);
  const int most = point.writing.decimals.value_or(4);
  return FormatFixed(number, std::min(2, most), most);
}

}  // namespace baudgate::protocols::spabus
