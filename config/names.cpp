// SPDX-License-Identifier: Apache-2.0
#include "config/names.h"

#include "gateway/base/spelling.h"
#include "gateway/base/text.h"

namespace baudgate::config {
namespace {

constexpr std::size_t kLongestName = 64;

bool IsDigit(char c) { return c >= '0' && c <= '9'; }
bool IsLetterOrDigit(char c) {
  return IsDigit(c) || (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z');
}

bool IsWellFormed(std::string_view name, std::string_view separators) {
  bool after_word = false;
  for (const char c : name) {
    const bool separator = separators.find(c) != std::string_view::npos;
    if (separator ? !after_word : !IsLetterOrDigit(c)) return false;
    after_word = !separator;
  }
  return after_word;
}

Status CheckLength(std::string_view name) {
  if (name.size() <= kLongestName) return {};
  return Error{Quoted(name) + " is too long; at most 64 characters"};
}

// Without leading zeros, which some readers of YAML take for octal.
std::optional<int> UnitNumber(std::string_view digits) {
  if (digits.size() > 1 && digits.front() == '0') return std::nullopt;
  return ParseInteger<int>(digits);
}

std::string RangeText(std::size_t first, std::size_t last) {
  if (first == last) return std::to_string(first);
  return std::to_string(first) + "-" + std::to_string(last);
}

}  // namespace

Status CheckName(std::string_view name) {
  if (IsWellFormed(name, "_-")) return CheckLength(name);
  return Error{Quoted(name) +
               " is no name; use letters, digits and single '-' or '_' between them"};
}

Status CheckPointName(std::string_view name) {
  if (IsWellFormed(name, "_") && !IsDigit(name.front())) return CheckLength(name);
  return Error{
      Quoted(name) +
      " is no point name; use letters, digits and single '_' between them, no digit first"};
}

std::optional<std::string> ReadName(MapReader& map, std::string_view example) {
  const auto node = map.Need("name", example);
  if (!node) return std::nullopt;
  auto name = ReadText(*node, "name", map.problems());
  if (!name) return std::nullopt;
  if (const Status status = CheckName(*name); !status) {
    map.problems().Error(node->mark(), "name: " + status.error());
    return std::nullopt;
  }
  map.Rename(map.what() + " '" + *name + "'");
  return name;
}

Result<std::pair<std::uint8_t, std::uint8_t>> ParseUnits(std::string_view text) {
  const auto parts = Split(text, '-');
  const auto first = UnitNumber(Trim(parts.front()));
  const auto last = UnitNumber(Trim(parts.back()));
  if (parts.size() > 2 || !first || !last) {
    return Error{Quoted(text) +
                 " is neither a unit id nor a range of them; write for example 20 or \"33-40\""};
  }
  if (*first < 0 || *first > 255 || *last < 0 || *last > 255) {
    return Error{Quoted(text) + " is out of range; allowed: 0…255"};
  }
  if (*first > *last) {
    return Error{Quoted(text) + " is upside down; write \"" + std::to_string(*last) + "-" +
                 std::to_string(*first) + "\""};
  }
  return std::pair(static_cast<std::uint8_t>(*first), static_cast<std::uint8_t>(*last));
}

std::string UnitsText(const UnitSet& units) {
  std::string text;
  for (std::size_t unit = 0; unit < units.size(); ++unit) {
    if (!units[unit]) continue;
    const std::size_t first = unit;
    while (unit + 1 < units.size() && units[unit + 1]) ++unit;
    text += (text.empty() ? "" : ", ") + RangeText(first, unit);
  }
  return text;
}

}  // namespace baudgate::config
