// Rows of a protocol's option table, one function a kind. A help text is one sentence.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string_view>

#include "protocols/protocol.h"

namespace baudgate::option {

constexpr OptionSpec Flag(std::string_view name, std::string_view fallback, std::string_view help) {
  OptionSpec spec;
  spec.name = name;
  spec.kind = OptionSpec::Kind::flag;
  spec.fallback = fallback;
  spec.help = help;
  return spec;
}

/// Numbers without a range: `low` and `high` 0.
constexpr OptionSpec Integer(std::string_view name, std::string_view fallback, double low,
                             double high, std::string_view help) {
  OptionSpec spec = Flag(name, fallback, help);
  spec.kind = OptionSpec::Kind::integer;
  spec.minimum = low;
  spec.maximum = high;
  return spec;
}

constexpr OptionSpec Real(std::string_view name, std::string_view fallback, double low, double high,
                          std::string_view help) {
  OptionSpec spec = Integer(name, fallback, low, high, help);
  spec.kind = OptionSpec::Kind::real;
  return spec;
}

constexpr OptionSpec Text(std::string_view name, std::string_view fallback, std::string_view help) {
  OptionSpec spec = Flag(name, fallback, help);
  spec.kind = OptionSpec::Kind::text;
  return spec;
}

/// A list; `fallback` separated by commas.
constexpr OptionSpec Texts(std::string_view name, std::string_view fallback,
                           std::string_view help) {
  OptionSpec spec = Flag(name, fallback, help);
  spec.kind = OptionSpec::Kind::texts;
  return spec;
}

/// `choices` separated by commas.
constexpr OptionSpec Choice(std::string_view name, std::string_view fallback,
                            std::string_view choices, std::string_view help) {
  OptionSpec spec = Flag(name, fallback, help);
  spec.kind = OptionSpec::Kind::choice;
  spec.choices = choices;
  return spec;
}

/// Never shown in logs, `check` or `map`.
constexpr OptionSpec Secret(OptionSpec spec) {
  spec.secret = true;
  return spec;
}

}  // namespace baudgate::option
