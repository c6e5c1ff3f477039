// SPDX-License-Identifier: Apache-2.0
#include "gateway/tools/simulate/fault_text.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "gateway/base/spelling.h"
#include "gateway/base/text.h"

namespace baudgate {
namespace {

using Kind = Fault::Kind;

constexpr std::size_t kMostCount = 1024;
constexpr std::size_t kMostExchanges = 16;
constexpr Duration kLongestPause = 10min;

/// What one kind may be given beside the common keys, and what it takes when it is not.
struct KindKeys {
  Kind kind;
  std::string_view count;  ///< name of the key that fills Fault::count; empty: none
  std::size_t count_default;
  std::string_view pause;  ///< of the key that fills Fault::pause
  Duration pause_default;
};

constexpr std::array<KindKeys, kFaultKinds> kKinds = {{
    {Kind::loss, "", 1, "", {}},
    {Kind::bits, "count", 1, "", {}},
    {Kind::echo, "", 1, "", {}},
    {Kind::stall, "", 1, "pause", 200ms},
    {Kind::dribble, "", 1, "pause", 20ms},
    {Kind::garbage_before, "bytes", 8, "", {}},
    {Kind::garbage_after, "bytes", 8, "", {}},
    {Kind::late, "", 1, "delay", 1s},
    {Kind::wrong_address, "", 1, "", {}},
    {Kind::doubled, "", 1, "pause", {}},
    {Kind::death, "", 1, "", {}},
}};

std::vector<std::string_view> KindNames() {
  std::vector<std::string_view> names;
  for (const KindKeys& keys : kKinds) names.push_back(Name(keys.kind));
  return names;
}

std::vector<std::string_view> KeysOf(const KindKeys& keys) {
  std::vector<std::string_view> names;
  if (!keys.count.empty()) names.push_back(keys.count);
  if (!keys.pause.empty()) names.push_back(keys.pause);
  if (keys.kind == Kind::late) names.push_back("exchanges");
  if (keys.kind != Kind::death) {  // which its schedule alone decides about
    names.push_back("rate");
    names.push_back("seed");
  }
  for (const std::string_view name : {"after", "for", "every"}) names.push_back(name);
  return names;
}

template <typename T>
Status ReadWhole(std::string_view value, T least, T most, T& target) {
  const auto number = ParseInteger<T>(value);
  if (!number || *number < least || *number > most) {
    return Error{"write a whole number from " + std::to_string(least) + " to " +
                 std::to_string(most)};
  }
  target = *number;
  return {};
}

/// Also "1e-9", which ParseDecimal takes for a typing error: what is rare is written so.
std::optional<double> ParseShare(std::string_view value) {
  const auto mark = value.find_first_of("eE");
  const auto number = ParseDecimal(value.substr(0, mark));
  if (!number || mark == std::string_view::npos) return number;
  const auto exponent = ParseInteger<int>(value.substr(mark + 1));
  if (!exponent) return std::nullopt;
  return *number * std::pow(10.0, *exponent);
}

Status ReadRate(std::string_view value, double& target) {
  const auto number = ParseShare(value);
  if (!number || !(*number >= 0 && *number <= 1)) {  // 0e999 is not a number
    return Error{"write a number from 0 (never) to 1 (always)"};
  }
  target = *number;
  return {};
}

Status ReadTime(std::string_view value, Duration least, Duration most, Duration& target) {
  const auto duration = ParseDuration(value);
  if (!duration) return Error{duration.error()};
  if (*duration < least || *duration > most) {
    return Error{"write a duration from " + FormatDuration(least) + " to " + FormatDuration(most)};
  }
  target = *duration;
  return {};
}

/// `key` is one of KeysOf(keys).
Status SetKey(Fault& fault, const KindKeys& keys, std::string_view key, std::string_view value) {
  constexpr Duration kLongest = 24h * 365;
  if (key == keys.count) return ReadWhole<std::size_t>(value, 1, kMostCount, fault.count);
  if (key == keys.pause) {
    const Duration least = keys.pause_default == Duration::zero() ? 0ms : 1ms;
    return ReadTime(value, least, kLongestPause, fault.pause);
  }
  if (key == "exchanges") return ReadWhole<std::size_t>(value, 1, kMostExchanges, fault.exchanges);
  if (key == "rate") return ReadRate(value, fault.rate);
  if (key == "seed") return ReadWhole<std::uint64_t>(value, 0, UINT64_MAX, fault.seed);
  if (key == "after") return ReadTime(value, 0ms, kLongest, fault.after);
  return ReadTime(value, 1ms, kLongest, key == "for" ? fault.lasts : fault.every);
}

/// "rate=0.1". `given`: the keys so far.
Status TakeSetting(Fault& fault, const KindKeys& keys, std::string_view setting,
                   std::set<std::string_view>& given) {
  const auto equals = setting.find('=');
  const std::string_view key = setting.substr(0, equals);
  const auto allowed = KeysOf(keys);
  if (std::find(allowed.begin(), allowed.end(), key) == allowed.end()) {
    return Error{"there is no key " + config::Quoted(key) + ";" + config::DidYouMean(key, allowed) +
                 " there are: " + config::Join(allowed)};
  }
  if (equals == std::string_view::npos) {
    return Error{"key " + std::string(key) + " has no value; write " + std::string(key) + "=…"};
  }
  if (!given.insert(key).second) return Error{std::string(key) + "= stands there twice"};
  const std::string_view value = setting.substr(equals + 1);
  if (const Status status = SetKey(fault, keys, key, value); !status) {
    return Error{std::string(key) + "=" + std::string(value) + ": " + status.error()};
  }
  return {};
}

/// What only all keys together show.
Status CheckWhole(const Fault& fault, const std::set<std::string_view>& given) {
  if (given.contains("every") && !given.contains("for")) {
    return Error{"every= needs for=: how long it goes on each time"};
  }
  if (given.contains("every") && fault.every <= fault.lasts) {
    return Error{"every= has to be longer than for="};
  }
  if (given.contains("delay") && given.contains("exchanges")) {
    return Error{"give delay= or exchanges=, not both"};
  }
  return {};
}

}  // namespace

Result<Fault> ParseFault(std::string_view text) {
  const auto colon = text.find(':');
  const std::string_view name = text.substr(0, colon);
  const auto known = KindNames();
  const auto keys = std::find_if(kKinds.begin(), kKinds.end(),
                                 [&](const KindKeys& one) { return Name(one.kind) == name; });
  if (keys == kKinds.end()) {
    return Error{"there is no fault " + config::Quoted(name) + ";" +
                 config::DidYouMean(name, known) + " there are: " + config::Join(known)};
  }
  Fault fault;
  fault.kind = keys->kind;
  fault.count = keys->count_default;
  fault.pause = keys->pause_default;
  fault.text = text;
  const std::string about = "fault " + std::string(name) + ": ";
  std::set<std::string_view> given;
  const auto settings = colon == std::string_view::npos ? std::vector<std::string_view>()
                                                        : Split(text.substr(colon + 1), ',');
  for (const std::string_view setting : settings) {
    if (const Status status = TakeSetting(fault, *keys, setting, given); !status) {
      return Error{about + status.error()};
    }
  }
  if (const Status status = CheckWhole(fault, given); !status) {
    return Error{about + status.error()};
  }
  if (fault.exchanges > 0) fault.pause = {};
  return fault;
}

}  // namespace baudgate
