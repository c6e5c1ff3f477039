// SPDX-License-Identifier: Apache-2.0
#include "protocols/reader/points.h"

#include <algorithm>
#include <array>

#include "gateway/base/decimal.h"
#include "gateway/base/text.h"
#include "protocols/reader/codec.h"
#include "protocols/reader/settings.h"

namespace baudgate::protocols::reader {
namespace {

constexpr DecoderSpec kDecoders[] = {
    {"tag",
     "the last tag, ten hex digits, or the last text; tag@3: the tag three before the last, up to "
     "15"},
    {"high, middle, low",
     "the 48 bits of a tag, 16 each; high@3: of the tag three before the last"},
    {"counter",
     "running number of the tag; each new tag adds one; counter@3: of the tag three before the "
     "last"},
    {"time",
     "time of the tag, in seconds since 1970 UTC; time@3: of the tag three before the last"},
    {"present", "whether a tag is present: a tag came within `present`, and no 'no tag' after it"},
    {"repeats", "how often the same tag came again within `same_tag`"},
    {"message", "the latest message, new or not"},
    {"number", "the only number in the message; number 4-11: the number in characters 4 to 11"},
    {"identity", "the name of the reader; needs commands: ask"}};
// In the order of Item::Kind.
constexpr std::array<std::string_view, 11> kNames = {"tag",     "high",   "middle",  "low",
                                                     "counter", "time",   "present", "repeats",
                                                     "message", "number", "identity"};

}  // namespace

Result<Item> ParseItem(const config::Point& point) {
  const Error error{"read '" + point.read +
                    "' is not known; 'baudgate protocols reader' lists the known ones"};
  const std::string_view read = point.read;
  const std::size_t end = std::min(read.find_first_of("@ "), read.size());
  const auto* const name = std::ranges::find(kNames, read.substr(0, end));
  if (name == kNames.end()) return error;
  Item item{.kind = static_cast<Item::Kind>(name - kNames.begin())};
  if (end == read.size()) return item;
  const std::string_view rest = read.substr(end + 1);
  if (read[end] == '@') {
    const auto back = ParseInteger<std::size_t>(rest);
    if (!back || *back >= kRing || !item.of_tag()) return error;
    item.back = *back;
    return item;
  }
  const auto parts = Split(rest, '-');
  if (item.kind != Item::Kind::number || parts.size() != 2) return error;
  item.first = ParseInteger<std::size_t>(parts[0]).value_or(0);
  item.last = ParseInteger<std::size_t>(parts[1]).value_or(0);
  if (item.first < 1 || item.last < item.first || item.last > 120) return error;
  return item;
}

Status CheckPoint(const config::Point& point) {
  for (const std::string& text : {point.read, point.write}) {
    if (const Status status = RefuseLeadingZeros(text, "@ -"); !status) return status;
  }
  using Kind = Item::Kind;
  const auto item = ParseItem(point);
  if (!item) return Error{item.error()};
  if (point.access != config::Access::read) return Error{"a reader cannot be written"};
  const bool text =
      item->kind == Kind::tag || item->kind == Kind::message || item->kind == Kind::identity;
  const bool flag = item->kind == Kind::present;
  if (text != (point.type == config::Type::string)) {
    return Error{text ? "this value is a text; write type: string(20)"
                      : "this value is not a text; write a number type"};
  }
  if (flag != (point.type == config::Type::boolean)) {
    return Error{flag ? "this value is true or false; write type: bool"
                      : "this value is a number; write a number type"};
  }
  return {};
}

Status CheckDevice(const config::Device& device) {
  if (Status status = CheckOptions(device.options); !status) return status;
  const Settings settings = ReadSettings(device.options);
  for (const config::Point& point : device.points) {
    const auto item = ParseItem(point);
    if (!item) continue;
    const std::string its = "point '" + point.name + "': '" + point.read + "' needs ";
    const bool bits = item->kind >= Item::Kind::high && item->kind <= Item::Kind::low;
    if (bits && settings.form != Form::tag) {
      return Error{its + "form: tag, because a text has no such number"};
    }
    if (item->kind == Item::Kind::identity && !settings.asks) return Error{its + "commands: ask"};
    const bool whole = item->kind == Item::Kind::tag || item->kind == Item::Kind::message;
    const std::size_t length = settings.form == Form::tag ? kTagDigits : settings.length;
    if (whole && length > point.text_length) {
      return Error{its + "type: string(" + std::to_string(length) +
                   "), because a longer text never gives a good value"};
    }
  }
  for (const config::Record& record : device.records) {
    if (!settings.asks)
      return Error{"record '" + record.name +
                   "' needs commands: ask, because the gateway must ask the reader for it"};
    for (const std::uint32_t index : record.points) {
      const auto item = ParseItem(device.points[index]);
      if (!item || item->of_message()) continue;
      return Error{
          "record '" + record.name + "': '" + device.points[index].read +
          "' cannot be read again after an event; use present, repeats, message or number"};
    }
  }
  return {};
}

std::span<const DecoderSpec> DecoderTable() { return kDecoders; }

namespace {

constexpr std::string_view kDigits = "0123456789";

Value Word(std::string_view tag, unsigned shift) {
  const std::uint64_t bits = ParseInteger<std::uint64_t>(tag, 16).value_or(0);
  return static_cast<std::int64_t>((bits >> shift) & 0xFFFFU);
}

bool IsLetter(char c) { return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z'); }

char Lower(char c) { return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c; }

bool IsSameWord(std::string_view one, std::string_view other) {
  return std::ranges::equal(one, other, {}, Lower, Lower);
}

/// Each row has the units of one quantity. The row for mass must be the first.
constexpr std::string_view kQuantities[] = {"mg g kg t ct oz lb lbs",
                                            "um mm cm dm m km in inch ft",
                                            "C F K",
                                            "Pa hPa kPa MPa mbar bar psi",
                                            "mN N kN kgf lbf",
                                            "mV V kV",
                                            "uA mA A",
                                            "mW W kW MW",
                                            "Hz kHz MHz",
                                            "ml cl l"};

bool Has(std::string_view units, std::string_view unit) {
  const auto words = Split(units, ' ');
  return std::ranges::any_of(words, [&](std::string_view one) { return IsSameWord(one, unit); });
}

/// Returns the unit without a degree sign ("C" for "°C"), because readers send ASCII.
std::string_view WithoutDegree(std::string_view unit) {
  constexpr std::string_view kDegree = "\u00B0";
  if (unit.starts_with(kDegree)) unit.remove_prefix(kDegree.size());
  return unit;
}

bool IsPartOfNumber(char c) { return (c >= '0' && c <= '9') || c == '.'; }
bool IsSign(char c) { return c == '-' || c == '+'; }

/// True if the text contains only letters and separators, as names and units do. Other characters
/// beside a number, such as a sign or a bracket, could change the number.
bool IsUnderstood(std::string_view text) {
  constexpr std::string_view kSeparators = " \t\r\n.,;:=%/$";
  return std::ranges::all_of(
      text, [&](char c) { return IsLetter(c) || kSeparators.find(c) != std::string_view::npos; });
}

/// Removes the sign at the end of `before`, the text in front of a number, and returns it. Blanks
/// behind the sign are skipped. 0: there is no sign.
char TakeSign(std::string_view& before) {
  while (before.ends_with(' ')) before.remove_suffix(1);
  if (before.empty() || !IsSign(before.back())) return 0;
  const char sign = before.back();
  before.remove_suffix(1);
  return sign;
}

/// True if `lead`, the text in front of the selected characters, ends in a sign or '(' that belongs
/// to the number.
bool IsSigned(std::string_view lead) {
  lead = Trim(lead);
  return lead.ends_with('(') || (!lead.empty() && IsSign(lead.back()));
}

/// True if the text behind a number begins with a sign that belongs to the number: "-" or "- kg".
/// False for "-5.0", which is another number.
bool HasSignBehind(std::string_view rest) {
  rest = Trim(rest);
  if (rest.empty() || !IsSign(rest.front())) return false;
  rest = Trim(rest.substr(1));
  return rest.empty() || !IsPartOfNumber(rest.front());
}

}  // namespace

Decoded ValueOf(const Item& item, const Tag& tag) {
  using Kind = Item::Kind;
  switch (item.kind) {
    case Kind::high:
      return {Word(tag.text, 32), Quality::good};
    case Kind::middle:
      return {Word(tag.text, 16), Quality::good};
    case Kind::low:
      return {Word(tag.text, 0), Quality::good};
    case Kind::counter:
      return {static_cast<std::int64_t>(tag.counter), Quality::good};
    case Kind::time:
      return {
          std::int64_t{
              std::chrono::floor<std::chrono::seconds>(tag.received.time_since_epoch()).count()},
          Quality::good};
    default:
      return {tag.text, Quality::good};
  }
}

std::optional<std::string_view> UnitBehind(std::string_view text, std::string_view unit) {
  const std::size_t digit = text.find_first_of(kDigits);
  if (digit == std::string_view::npos) return std::nullopt;
  text.remove_prefix(std::min(text.find_first_not_of("0123456789.", digit), text.size()));
  text = Trim(text);
  const auto end = std::ranges::find_if_not(text, IsLetter);
  const std::string_view word = text.substr(0, static_cast<std::size_t>(end - text.begin()));
  const bool alike = std::ranges::any_of(kQuantities, [&](std::string_view units) {
    return Has(units, word) && Has(units, WithoutDegree(unit));
  });
  return alike ? std::optional(word) : std::nullopt;
}

bool IsMass(std::string_view unit) { return Has(kQuantities[0], unit); }

bool IsSameUnit(std::string_view said, std::string_view unit) {
  unit = WithoutDegree(unit);
  if (said == unit) return true;
  const auto is_small = [](char c) { return c >= 'a' && c <= 'z'; };
  const bool capitals = std::ranges::all_of(unit, is_small) && std::ranges::none_of(said, is_small);
  return IsSameWord(said, unit) && (IsMass(unit) || capitals);
}

Decoded NumberIn(const Item& item, std::string_view text, std::string_view unit) {
  const Decoded none{{}, {Quality::bad_sensor_failure}};
  const std::string_view all = text;
  std::string_view lead;
  std::string_view rest;
  if (item.first > 0) {
    if (item.first > text.size()) return none;
    lead = text.substr(0, item.first - 1);
    rest = text.substr(std::min(item.last, text.size()));
    text = text.substr(item.first - 1, item.last - item.first + 1);
  }
  const std::size_t digit = text.find_first_of(kDigits);
  if (digit == std::string_view::npos) return none;
  std::string_view before = text.substr(0, digit);
  while (before.ends_with('.')) before.remove_suffix(1);
  const std::size_t end = std::min(text.find_first_not_of("0123456789.", digit), text.size());
  const std::string_view behind = text.substr(end);
  const std::size_t dots = digit - before.size();
  // The dot in "No.5" may belong to the word or to the number, so no number is returned.
  if (dots > 1 || (dots == 1 && !before.empty() && IsLetter(before.back()))) return none;
  const auto number = ParseDecimal((dots == 1 ? "0" : "") +
                                   std::string(text.substr(before.size(), end - before.size())));
  if (!number) return none;
  const auto its = UnitBehind(all.substr(item.first > 0 ? item.first - 1 : 0), unit);
  // "Err 03" and "TICKET 0042" must not be read as weights: a text with letters must contain a unit
  // of mass.
  const bool words = IsMass(unit) && item.first == 0 && std::ranges::any_of(text, IsLetter);
  if (its ? !IsSameUnit(*its, unit) : words) return none;
  const bool at_begin = before.empty();
  const char sign = TakeSign(before);
  if (!IsUnderstood(before) || !IsUnderstood(behind)) return none;
  const bool goes_on = behind.empty() && !rest.empty() && IsPartOfNumber(rest.front());
  const bool began = sign == 0 && before.empty() &&
                     ((at_begin && !lead.empty() && IsPartOfNumber(lead.back())) || IsSigned(lead));
  if (began || goes_on || (Trim(behind).empty() && HasSignBehind(rest))) return none;
  return {sign == '-' ? -*number : *number, Quality::good};
}

}  // namespace baudgate::protocols::reader
