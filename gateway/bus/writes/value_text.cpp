// SPDX-License-Identifier: Apache-2.0
#include "gateway/bus/writes/value_text.h"

#include <cmath>
#include <string>

#include "gateway/base/spelling.h"
#include "gateway/base/text.h"

namespace baudgate {
namespace {

using config::Quoted;
using config::Type;

Result<Value> ParseFlag(const config::Point& point, std::string_view text) {
  for (const std::string_view yes : {"true", "on", "1"}) {
    if (text == yes) return Value(true);
  }
  for (const std::string_view no : {"false", "off", "0"}) {
    if (text == no) return Value(false);
  }
  return Error{Quoted(text) + " is not a value of '" + point.name + "', a bool: write on or off"};
}

}  // namespace

Result<Value> ParseValue(const config::Point& point, std::string_view text) {
  if (point.type == Type::boolean) return ParseFlag(point, text);
  if (point.type == Type::string) {
    if (text.size() <= point.text_length) return Value(std::string(text));
    return Error{Quoted(text) + " is longer than the " + std::to_string(point.text_length) +
                 " bytes of '" + point.name + "'"};
  }
  if (const auto whole = ParseInteger<std::int64_t>(text)) return Value(*whole);
  if (const auto whole = ParseInteger<std::uint64_t>(text)) return Value(*whole);
  const auto number = ParseDecimal(text);
  if (number && std::isfinite(*number)) return Value(*number);
  return Error{Quoted(text) + " is not a value of '" + point.name +
               "', a number: write for example 1.5"};
}

}  // namespace baudgate
