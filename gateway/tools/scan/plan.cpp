// SPDX-License-Identifier: Apache-2.0
#include "gateway/tools/scan/plan.h"

#include <algorithm>

#include "config/catalog/option_values.h"
#include "gateway/base/text.h"

namespace baudgate::scan {
namespace {

/// The last address that LikelySweeps tries: devices are usually numbered from 1 on, and few buses
/// have more devices.
constexpr unsigned kLastLikely = 32;
/// Additional timeout for the way through the network and a serial server.
constexpr Duration kNetwork = 150ms;
/// How much of kQuickLimit a quick scan plans for listening and sweeps. The rest is needed for
/// devices that answer.
constexpr Duration kQuickPlan = 46s;
constexpr unsigned kHighestAddress = 999;

unsigned First(const protocols::ScanRule& rule) { return std::max(rule.first_address, 1U); }

std::optional<Addresses> Within(const Addresses& wanted, unsigned first, unsigned last) {
  const Addresses both{std::max(wanted.first, first), std::min(wanted.last, last)};
  if (both.first > both.last) return std::nullopt;
  return both;
}

/// Returns the addresses that the user has given, as far as the rule permits them; else all
/// addresses of the rule.
std::optional<Addresses> AllOf(const protocols::ScanRule& rule, const Wish& wish) {
  if (wish.addresses) return Within(*wish.addresses, rule.first_address, rule.last_address);
  return Addresses{rule.first_address, rule.last_address};
}

std::optional<Addresses> LikelyOf(const protocols::ScanRule& rule, const Wish& wish) {
  if (wish.addresses) return AllOf(rule, wish);
  return Within({First(rule), kLastLikely}, rule.first_address, rule.last_address);
}

std::size_t SettingsOf(const Tongue& tongue, const Wish& wish) {
  return wish.network ? 1 : tongue.rule().serials.size();
}

Sweep Quick(const Wish& wish, std::size_t tongue, std::size_t setting, const Addresses& range) {
  const protocols::ScanRule& rule = wish.tongues[tongue].rule();
  return {.tongue = tongue,
          .serial = rule.serials[setting],
          .addresses = range,
          .modes = rule.quick_modes,
          .finds = rule.quick_finds,
          .patience = rule.usual + (wish.network ? kNetwork : Duration())};
}

/// Returns the part of the sweep that fits into the time `left`; empty: no address fits.
std::optional<Sweep> Cut(Sweep sweep, Duration left, const Wish& wish) {
  const unsigned count = sweep.addresses.last - sweep.addresses.first + 1;
  const Duration each = TimeOf(sweep, wish) / count;
  const auto fitting = static_cast<unsigned>(std::min<std::int64_t>(left / each, count));
  if (left <= Duration::zero() || fitting == 0) return std::nullopt;
  sweep.addresses.last = sweep.addresses.first + fitting - 1;
  return sweep;
}

std::vector<Sweep> CutAll(const std::vector<Sweep>& sweeps, Duration limit, const Wish& wish) {
  std::vector<Sweep> kept;
  Duration used{};
  for (const Sweep& sweep : sweeps) {
    auto part = Cut(sweep, limit - used, wish);
    if (!part) break;
    used += TimeOf(*part, wish);
    kept.push_back(*part);
  }
  return kept;
}

/// Adds sweeps over the addresses after kLastLikely, if the user has given no range.
void AddRest(const Wish& wish, std::vector<Sweep>& sweeps) {
  if (wish.addresses) return;
  for (std::size_t i = 0; i < wish.tongues.size(); ++i) {
    const protocols::ScanRule& rule = wish.tongues[i].rule();
    if (rule.last_address <= kLastLikely) continue;
    sweeps.push_back(Quick(wish, i, 0, {kLastLikely + 1, rule.last_address}));
  }
}

}  // namespace

Tongue TongueOf(const protocols::Protocol& protocol) {
  Tongue tongue{&protocol, {}};
  for (const protocols::ScanMode& mode : protocol.scan->modes) {
    config::Options options = config::DefaultOptions(protocol);
    for (const protocols::OptionSpec& spec : protocol.options) {
      if (spec.name != mode.key) continue;
      if (auto value = config::ParseOption(spec, mode.value)) {
        options.Set(std::string(mode.key), std::move(*value));
      }
    }
    tongue.options.push_back(ParseOptions(protocol, options));
  }
  return tongue;
}

Result<Addresses> ParseAddresses(std::string_view text) {
  const auto dash = text.find('-');
  const auto first = ParseInteger<unsigned>(text.substr(0, dash));
  const auto last =
      dash == std::string_view::npos ? first : ParseInteger<unsigned>(text.substr(dash + 1));
  if (!first || !last || *first > *last || *last > kHighestAddress) {
    return Error{"'" + std::string(text) + "' is no address range; write for example 1-32"};
  }
  return Addresses{*first, *last};
}

Duration TimeOf(const Sweep& sweep, const Wish& wish) {
  const protocols::ScanRule& rule = wish.tongues[sweep.tongue].rule();
  Duration each{};
  for (std::size_t question = 0; question < rule.questions; ++question) {
    if ((sweep.finds >> question & 1U) == 0) continue;
    const auto characters = rule.ask(sweep.addresses.last, 0, question).size();
    each += sweep.patience;
    if (!wish.network) {
      each += static_cast<Duration::rep>(characters) * sweep.serial.CharacterTime();
    }
  }
  const unsigned count = sweep.addresses.last - sweep.addresses.first + 1;
  return each * static_cast<Duration::rep>(count * sweep.modes);
}

Duration TimeOf(std::span<const Sweep> sweeps, const Wish& wish) {
  Duration time{};
  for (const Sweep& sweep : sweeps) time += TimeOf(sweep, wish);
  return time;
}

std::vector<Sweep> LikelySweeps(const Wish& wish) {
  std::size_t rounds = 0;
  for (const Tongue& tongue : wish.tongues) rounds = std::max(rounds, SettingsOf(tongue, wish));
  std::vector<Sweep> sweeps;
  for (std::size_t round = 0; round < rounds; ++round) {
    for (std::size_t i = 0; i < wish.tongues.size(); ++i) {
      if (round >= SettingsOf(wish.tongues[i], wish)) continue;
      const auto range = LikelyOf(wish.tongues[i].rule(), wish);
      if (range) sweeps.push_back(Quick(wish, i, round, *range));
    }
  }
  if (!wish.quick) return sweeps;
  AddRest(wish, sweeps);
  Duration listening{};
  for (const Listening& listen : ListenFirst(wish)) listening += listen.time;
  return CutAll(sweeps, kQuickPlan - listening, wish);
}

std::vector<Sweep> ThoroughSweeps(const Wish& wish,
                                  std::span<const config::SerialSettings> answered) {
  std::vector<Sweep> sweeps;
  if (wish.quick) return sweeps;
  const auto has_answered = [&](const config::SerialSettings& serial) {
    return std::ranges::any_of(answered, [&](const auto& one) { return SameWire(one, serial); });
  };
  // Sweeps at settings at which devices have answered come before each protocol's first setting.
  for (const bool first : {true, false}) {
    for (std::size_t i = 0; i < wish.tongues.size(); ++i) {
      const protocols::ScanRule& rule = wish.tongues[i].rule();
      const auto range = AllOf(rule, wish);
      for (std::size_t k = 0; range && k < SettingsOf(wish.tongues[i], wish); ++k) {
        const bool here = has_answered(rule.serials[k]);
        if (first != here || (!here && k > 0)) continue;
        Sweep sweep = Quick(wish, i, k, *range);
        sweep.modes = rule.modes.size();
        sweep.finds = rule.finds;
        sweep.patience += rule.usual;
        sweeps.push_back(sweep);
      }
    }
  }
  return sweeps;
}

std::vector<Listening> ListenFirst(const Wish& wish) {
  const Duration time = wish.quick ? 1s : 1500ms;
  if (wish.network) return {{{}, 2 * time}};
  std::vector<Listening> list;
  const std::size_t most = wish.quick ? 2 : 4;
  for (const int baud : {9600, 19200, 115200, 4800}) {
    const bool spoken = std::ranges::any_of(wish.tongues, [&](const Tongue& tongue) {
      return std::ranges::any_of(tongue.rule().serials,
                                 [&](const auto& serial) { return serial.baud == baud; });
    });
    if (spoken && list.size() < most) list.push_back({{.baud = baud}, time});
  }
  return list;
}

bool SameWire(const config::SerialSettings& a, const config::SerialSettings& b) {
  return a.ToString() == b.ToString();
}

std::vector<config::SerialSettings> OtherFormats(const config::SerialSettings& serial,
                                                 const protocols::Protocol& protocol) {
  const auto is_listed = [&](const config::SerialSettings& other) {
    return std::ranges::any_of(protocol.scan->serials, [&](const auto& listed) {
      return listed.data_bits == other.data_bits && listed.parity == other.parity;
    });
  };
  std::vector<config::SerialSettings> others;
  for (const int bits : {7, 8}) {
    for (const auto parity : {config::Parity::even, config::Parity::odd, config::Parity::none}) {
      const bool seven_bare = bits == 7 && parity == config::Parity::none;
      const config::SerialSettings other{.baud = serial.baud, .data_bits = bits, .parity = parity};
      if (seven_bare || bits < protocol.data_bits || SameWire(other, serial)) continue;
      others.push_back(other);
    }
  }
  // A pty ignores data bits, so 7E1 and 8E1 both work there. The scan takes the first format that
  // works, so the protocol's usual formats come first.
  std::stable_partition(others.begin(), others.end(), is_listed);
  return others;
}

}  // namespace baudgate::scan
