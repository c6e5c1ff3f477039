// SPDX-License-Identifier: Apache-2.0
#include "tests/fuzz/under_test.h"

#include <bit>
#include <map>
#include <utility>

#include "config/catalog/option_values.h"
#include "config/loader.h"
#include "gateway/base/text.h"
#include "protocols/all_protocols.h"

namespace baudgate::fuzz {
namespace {

const protocols::Protocol* under_test = nullptr;

void Describe(const protocols::Protocol& protocol, std::uint8_t variant, config::Options& options) {
  const std::string name(protocol.name);
  const config::Catalog catalog = {.protocols = {{name, &protocol}},
                                   .module_dirs = {},
                                   .profile_dirs = {FUZZ_SOURCE_DIR "/config/profiles"}};
  const auto profiles = catalog.Profiles(name);
  if (protocol.describe == nullptr || profiles.empty()) return;
  const std::string& chosen = profiles[variant % profiles.size()].name;
  config::Override(options, config::LoadProfile(chosen, protocol, catalog).profile.options);
}

}  // namespace

const protocols::Protocol& UnderTest() { return *under_test; }

RegisteredFor::RegisteredFor(Protocols which, const std::string& before, const std::string& behind,
                             void (*run)(View input)) {
  for (const protocols::Protocol* protocol : protocols::AllProtocols()) {
    if (which == Protocols::with_conversations && !protocol->profiles_of.empty()) continue;
    Registered(before + std::string(protocol->name) + behind, [protocol, run](View input) {
      under_test = protocol;
      run(input);
    });
  }
}

config::Options OptionsOf(const protocols::Protocol& protocol, std::uint8_t variant) {
  config::Options options = config::DefaultOptions(protocol);
  Describe(protocol, variant, options);
  std::uint8_t bits = variant;
  for (const protocols::OptionSpec& spec : protocol.options) {
    if (spec.scope != protocols::OptionSpec::Scope::device) continue;
    const std::string name(spec.name);
    if (spec.kind == protocols::OptionSpec::Kind::flag) {
      options.Set(name, options.Flag(name) != ((bits & 1U) != 0));
      bits = std::rotr(bits, 1);
    } else if (spec.kind == protocols::OptionSpec::Kind::choice) {
      const auto choices = Split(spec.choices, ',');
      options.Set(name, std::string(choices[bits % choices.size()]));
      bits = std::rotr(bits, 2);
    } else if (spec.kind == protocols::OptionSpec::Kind::integer && spec.maximum > spec.minimum) {
      if ((bits & 1U) != 0) options.Set(name, static_cast<std::int64_t>(spec.minimum) + 1);
      bits = std::rotr(bits, 1);
    }
  }
  return options;
}

const protocols::ParsedOptions& CachedOptions(std::uint8_t variant) {
  static std::map<std::pair<const protocols::Protocol*, std::uint8_t>, protocols::ParsedOptions>
      made;
  const auto found = made.find({&UnderTest(), variant});
  if (found != made.end()) return found->second;
  return made
      .emplace(std::pair(&UnderTest(), variant),
               ParseOptions(UnderTest(), OptionsOf(UnderTest(), variant)))
      .first->second;
}

}  // namespace baudgate::fuzz
