// SPDX-License-Identifier: Apache-2.0
#include "tests/fuzz/under_test.h"

#include <array>
#include <bit>
#include <optional>
#include <string>

#include "config/catalog/option_values.h"
#include "gateway/base/text.h"
#include FUZZ_HEADER

namespace baudgate::fuzz {

const Protocol& UnderTest() { return FUZZ_PROTOCOL(); }

config::Options OptionsOf(const Protocol& protocol, std::uint8_t variant) {
  config::Options options = config::DefaultOptions(protocol);
  std::uint8_t bits = variant;
  for (const OptionSpec& spec : protocol.options) {
    if (spec.scope != OptionSpec::Scope::device) continue;
    const std::string name(spec.name);
    if (spec.kind == OptionSpec::Kind::flag) {
      options.Set(name, options.Flag(name) != ((bits & 1U) != 0));
      bits = std::rotr(bits, 1);
    } else if (spec.kind == OptionSpec::Kind::choice) {
      const auto choices = Split(spec.choices, ',');
      options.Set(name, std::string(choices[bits % choices.size()]));
      bits = std::rotr(bits, 2);
    } else if (spec.kind == OptionSpec::Kind::integer && spec.maximum > spec.minimum) {
      if ((bits & 1U) != 0) options.Set(name, static_cast<std::int64_t>(spec.minimum) + 1);
      bits = std::rotr(bits, 1);
    }
  }
  return options;
}

const config::Options& CachedOptions(std::uint8_t variant) {
  static std::array<std::optional<config::Options>, 256> made;
  auto& options = made[variant];
  if (!options) options = OptionsOf(UnderTest(), variant);
  return *options;
}

}  // namespace baudgate::fuzz
