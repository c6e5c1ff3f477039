// SPDX-License-Identifier: Apache-2.0
#include "config/checks/name_checks.h"

#include "gateway/base/spelling.h"

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

}  // namespace

Status CheckName(std::string_view name) {
  if (IsWellFormed(name, "_-")) return CheckLength(name);
  return Error{Quoted(name) +
               " is no name; use letters, digits and single '-' or '_' between them"};
}

Status CheckPointName(std::string_view name) {
  const std::string_view rest = name.substr(name.starts_with('_') ? 1 : 0);
  if (IsWellFormed(rest, "_") && !IsDigit(name.front())) return CheckLength(name);
  return Error{Quoted(name) +
               " is no point name; use letters, digits and single '_' before or between them, no "
               "digit first"};
}

}  // namespace baudgate::config
