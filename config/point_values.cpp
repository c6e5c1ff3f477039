// SPDX-License-Identifier: Apache-2.0
#include "config/point_values.h"

#include <algorithm>

#include "gateway/base/leading_zero.h"
#include "gateway/base/spelling.h"
#include "gateway/base/text.h"

namespace baudgate::config {
namespace {

// DDS carries text as string<128>.
constexpr std::size_t kLongestText = 128;

constexpr std::array<Word<Quality>, 8> kQualities = {
    {{"sensor_failure", Quality::bad_sensor_failure},
     {"device_failure", Quality::bad_device_failure},
     {"configuration", Quality::bad_configuration},
     {"not_connected", Quality::bad_not_connected},
     {"out_of_service", Quality::bad_out_of_service},
     {"last_usable", Quality::uncertain_last_usable},
     {"sub_normal", Quality::uncertain_sub_normal},
     {"uncertain", Quality::uncertain}}};

constexpr std::array<Quality::Code, 8> kByCode = {
    Quality::bad_configuration,     Quality::bad_not_connected,   Quality::bad_device_failure,
    Quality::bad_sensor_failure,    Quality::bad_out_of_service,  Quality::uncertain,
    Quality::uncertain_last_usable, Quality::uncertain_sub_normal};

// A sentinel cannot mean good, nor what the gateway alone may say (waiting, communication).
std::optional<Quality> QualityOfCode(std::string_view text) {
  if (!text.starts_with("0x") && !text.starts_with("0X")) return std::nullopt;
  const auto code = ParseInteger<std::uint8_t>(text.substr(2), 16);
  if (!code) return std::nullopt;
  const auto found = std::find(kByCode.begin(), kByCode.end(), static_cast<Quality::Code>(*code));
  if (found == kByCode.end()) return std::nullopt;
  return *found;
}

std::optional<Quality> ReadQuality(const YamlNode& node, const std::string& what,
                                   Problems& problems) {
  if (node.kind() == YamlNode::Kind::scalar) {
    if (const auto quality = QualityOfCode(node.text())) return quality;
  }
  return ReadWord(node, what, kQualities, problems);
}

std::optional<double> ReadLevel(const YamlNode& node, Problems& problems) {
  if (node.kind() == YamlNode::Kind::scalar && node.text() == "true") return 1;
  if (node.kind() == YamlNode::Kind::scalar && node.text() == "false") return 0;
  const auto level = ReadNumber(node, "simulate", problems);
  return level ? std::optional(level->ToDouble()) : std::nullopt;
}

constexpr std::pair<std::string_view, TypeText> kIecTypes[] = {
    {"BOOL", {Type::boolean}},
    {"SINT", {Type::int8}},
    {"USINT", {Type::uint8}},
    {"BYTE", {Type::uint8}},
    {"INT", {Type::int16}},
    {"UINT", {Type::uint16}},
    {"WORD", {Type::uint16}},
    {"DINT", {Type::int32}},
    {"UDINT", {Type::uint32}},
    {"DWORD", {Type::uint32}},
    {"LINT", {Type::int64}},
    {"ULINT", {Type::uint64}},
    {"LWORD", {Type::uint64}},
    {"REAL", {Type::float32}},
    {"LREAL", {Type::float64}},
    {"TIME", {Type::uint32, 0, TimeType::time}},
    {"DATE", {Type::uint32, 0, TimeType::date}},
    {"TOD", {Type::uint32, 0, TimeType::time_of_day}},
    {"TIME_OF_DAY", {Type::uint32, 0, TimeType::time_of_day}},
    {"DT", {Type::uint32, 0, TimeType::date_time}},
    {"DATE_AND_TIME", {Type::uint32, 0, TimeType::date_time}},
};

}  // namespace

std::string_view UnitOf(TimeType type) {
  if (type == TimeType::none) return "";
  return type == TimeType::time || type == TimeType::time_of_day ? "ms" : "s";
}

Result<TypeText> ParseType(std::string_view text) {
  static constexpr std::array<std::string_view, 12> kShown = {
      "bool",   "int8",  "uint8",  "int16",   "uint16",  "int32",
      "uint32", "int64", "uint64", "float32", "float64", "string(n)"};
  for (int i = 0; i < static_cast<int>(Type::string); ++i) {
    const auto type = static_cast<Type>(i);
    if (text == Name(type)) return TypeText{type, 0};
  }
  for (const auto& [name, type] : kIecTypes) {
    if (text == name) return type;
  }
  if (const Status status = RefuseLeadingZeros(text, "(["); !status) return Error{status.error()};
  const bool iec = text.starts_with("STRING");
  const std::string_view length_text = text.substr(std::min<std::size_t>(6, text.size()));
  const bool round = length_text.starts_with("(") && length_text.ends_with(")");
  const bool square = iec && length_text.starts_with("[") && length_text.ends_with("]");
  if ((iec || text.starts_with("string")) && (round || square)) {
    const auto length = ParseInteger<std::size_t>(length_text.substr(1, length_text.size() - 2));
    if (length && *length >= 1 && *length <= kLongestText) {
      return TypeText{Type::string, *length};
    }
    return Error{Quoted(text) + " has no usable length; allowed: string(1)…string(128)"};
  }
  if (text == "string" || text == "STRING") {
    return Error{Quoted(text) + " needs its length in bytes: string(16)"};
  }
  for (const auto& [name, type] : kIecTypes) {
    if (Lower(name) != Lower(text)) continue;
    return Error{Quoted(text) + " is unknown; did you mean '" + std::string(name) + "'?"};
  }
  return Error{Quoted(text) + " is unknown;" + DidYouMean(text, kShown) +
               " allowed: " + Join(kShown) + ", or a type of IEC 61131-3 such as REAL"};
}

std::vector<Sentinel> ReadSentinels(const YamlNode& node, Problems& problems) {
  std::vector<Sentinel> sentinels;
  for (const Entry& entry : ReadEntries(node, "sentinels", problems)) {
    const Mark mark = entry.value.source()->MarkAt(entry.place);
    if (const std::string why = WhyLeadingZero(entry.key); !why.empty()) {
      problems.Error(mark, "sentinels: " + Quoted(entry.key) + " " + why);
      continue;
    }
    const auto value = Decimal::Parse(entry.key);
    if (!value) {
      problems.Error(
          mark,
          "sentinels: " + Quoted(entry.key) +
              " is not a number; write { 999: sensor_failure } or { 0xFFFF: sensor_failure }");
      continue;
    }
    const auto quality = ReadQuality(entry.value, "sentinels: " + entry.key, problems);
    if (!quality) continue;
    sentinels.push_back({*value, *quality, entry.key, mark});
  }
  return sentinels;
}

std::optional<OnFault> ReadOnFault(const YamlNode& node, Problems& problems) {
  const auto text = ReadText(node, "on_fault", problems);
  if (!text) return std::nullopt;
  if (*text == "nan") return OnFault{OnFault::Kind::nan, {}};
  if (*text == "hold") return OnFault{OnFault::Kind::hold, {}};
  const std::string zero = WhyLeadingZero(*text);
  const auto value = Decimal::Parse(*text);
  if (value && zero.empty()) return OnFault{OnFault::Kind::value, *value};
  problems.Error(node.mark(), !zero.empty() ? "on_fault: " + Quoted(*text) + " " + zero
                                            : "on_fault: " + Quoted(*text) +
                                                  " is unknown; allowed: nan, hold or a number");
  return std::nullopt;
}

std::optional<Simulate> ReadSimulate(const YamlNode& node, Type type, Problems& problems) {
  if (type == Type::string) {
    const auto text = ReadText(node, "simulate", problems);
    if (!text) return std::nullopt;
    return Simulate{0, 0, *text};
  }
  if (node.kind() != YamlNode::Kind::list) {
    const auto value = ReadLevel(node, problems);
    if (!value) return std::nullopt;
    return Simulate{*value, *value, std::nullopt};
  }
  const std::vector<YamlNode> ends = ReadList(node, "simulate", 2, problems);
  if (ends.size() != 2) {
    problems.Error(node.mark(), "simulate: a range has two ends; write [low, high]");
    return std::nullopt;
  }
  const auto low = ReadLevel(ends[0], problems);
  const auto high = ReadLevel(ends[1], problems);
  if (!low || !high) return std::nullopt;
  if (*low > *high) {
    problems.Error(node.mark(), "simulate: the low end is above the high end; write [low, high]");
    return std::nullopt;
  }
  return Simulate{*low, *high, std::nullopt};
}

std::optional<Recheck> ReadRecheck(MapReader& map) {
  constexpr std::array<Word<Recheck>, 3> kWords = {
      {{"off", Recheck::off}, {"jump", Recheck::jump}, {"always", Recheck::always}}};
  return map.OneOf("recheck", kWords);
}

}  // namespace baudgate::config
