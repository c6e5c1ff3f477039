// SPDX-License-Identifier: Apache-2.0
#include "gateway/tools/simulate/twin_faults.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <iterator>
#include <optional>
#include <set>
#include <utility>

#include "gateway/base/text.h"

namespace baudgate::tools {
namespace {

constexpr std::size_t kFaultKinds = 11;
/// The byte that a transport delivers in place of a damaged character (kDamaged in
/// transports/parity.h).
constexpr std::uint8_t kParityError = 0xFF;

// These functions replace the distributions of the standard library, because their results differ
// between implementations.

std::size_t Below(std::mt19937_64& random, std::size_t limit) {
  return static_cast<std::size_t>(random() % limit);
}

double Share(std::mt19937_64& random) { return static_cast<double>(random() >> 11U) * 0x1.0p-53; }

/// Returns the seed of a fault. It depends on the kind, so that two faults with the same `seed` do
/// not strike the same replies.
std::uint64_t SeedOf(const Fault& fault) {
  constexpr std::uint64_t kSpread = 0x9E37'79B9'7F4A'7C15;
  return fault.seed + kSpread * (static_cast<std::uint64_t>(fault.kind) + 1);
}

}  // namespace

std::string_view Name(Fault::Kind kind) {
  constexpr std::array<std::string_view, kFaultKinds> kNames = {
      "death",  "wrong_address",  "loss",          "bits", "stall", "dribble",
      "double", "garbage_before", "garbage_after", "late", "echo"};
  return kNames[static_cast<std::size_t>(kind)];
}

bool Fault::IsDue(Duration since_start) const {
  if (since_start < after) return false;
  if (lasts == Duration::zero()) return true;
  const Duration since = since_start - after;
  return (every == Duration::zero() ? since : since % every) < lasts;
}

TwinFaults::TwinFaults(std::vector<Fault> faults, const TwinWire& wire, Instant start,
                       Stranger stranger)
    : wire_(wire), start_(start), stranger_(std::move(stranger)) {
  for (Fault& fault : faults) {
    std::mt19937_64 random(SeedOf(fault));
    const std::string text = fault.text;
    faults_.push_back({std::move(fault), random, {text, 0, 0}});
  }
}

bool TwinFaults::IsDead(Instant now) const {
  return std::any_of(faults_.begin(), faults_.end(), [&](const Active& active) {
    return active.fault.kind == Fault::Kind::death && active.fault.IsDue(now - start_);
  });
}

bool TwinFaults::IsChosen(Active& active, Instant now) {
  ++active.count.exchanges;
  return active.fault.IsDue(now - start_) && Share(active.random) < active.fault.rate;
}

std::vector<TimedPiece> TwinFaults::Deliver(View request, Bytes reply, Instant end_of_request) {
  const bool dead = IsDead(end_of_request);
  const bool asked = !reply.empty();
  const bool answers = asked && !dead;
  Speech speech;
  if (dead) held_.clear();
  if (answers) speech = TakeHeld();
  Utterance said{request, {}, {}, {}, {}};
  if (answers) said.speech.push_back({{}, std::move(reply)});
  if (answers && stranger_) said.foreign = stranger_(request, end_of_request);
  for (std::size_t kind = 0; kind < kFaultKinds; ++kind) {
    for (Active& active : faults_) {
      if (static_cast<std::size_t>(active.fault.kind) != kind) continue;
      const bool on_the_line = active.fault.kind == Fault::Kind::echo;
      const bool concerned =
          active.fault.kind == Fault::Kind::death ? asked || dead : answers || on_the_line;
      if (!concerned || !IsChosen(active, end_of_request)) continue;
      if (Apply(active, said)) ++active.count.struck;
    }
  }
  std::move(said.speech.begin(), said.speech.end(), std::back_inserter(speech));

  std::vector<TimedPiece> pieces;
  if (!said.echo.empty()) pieces.push_back({Duration::zero(), std::move(said.echo)});
  Instant at = std::max(end_of_request + wire_.think + said.delay, said_until_);
  for (Part& part : speech) {
    at += part.pause + wire_.TimeOf(part.bytes.size());
    pieces.push_back({at - end_of_request, std::move(part.bytes)});
    said_until_ = at;
  }
  return pieces;
}

bool TwinFaults::Apply(Active& active, Utterance& said) {
  const Fault& fault = active.fault;
  Speech& speech = said.speech;
  switch (fault.kind) {
    case Fault::Kind::death:
      return true;
    case Fault::Kind::wrong_address:
      if (said.foreign.empty()) return false;
      speech.assign(1, {{}, said.foreign});
      return true;
    case Fault::Kind::loss:
      return !std::exchange(speech, {}).empty();
    case Fault::Kind::bits:
      return FlipBits(active, speech);
    case Fault::Kind::stall:
      return Stall(active, speech);
    case Fault::Kind::dribble:
      return Dribble(active, speech);
    case Fault::Kind::doubled: {
      Speech copy = speech;
      if (copy.empty()) return false;
      copy.front().pause += fault.pause;
      std::move(copy.begin(), copy.end(), std::back_inserter(speech));
      return true;
    }
    case Fault::Kind::garbage_before:
      speech.insert(speech.begin(), {{}, Garbage(active)});
      return true;
    case Fault::Kind::garbage_after:
      speech.push_back({{}, Garbage(active)});
      return true;
    case Fault::Kind::late:
      if (speech.empty()) return false;
      said.delay += fault.pause;
      if (fault.exchanges > 0) held_.push_back({fault.exchanges, std::exchange(speech, {})});
      return true;
    case Fault::Kind::echo:
      said.echo.assign(said.request.begin(), said.request.end());
      return true;
  }
  return false;
}

/// Inserts a silence behind a random character, except the last character.
bool TwinFaults::Stall(Active& active, Speech& speech) {
  if (speech.empty() || speech.back().bytes.size() < 2) return false;
  Bytes& whole = speech.back().bytes;
  const std::size_t kept = 1 + Below(active.random, whole.size() - 1);
  Bytes rest(whole.begin() + static_cast<std::ptrdiff_t>(kept), whole.end());
  whole.resize(kept);
  speech.push_back({active.fault.pause, std::move(rest)});
  return true;
}

bool TwinFaults::Dribble(Active& active, Speech& speech) {
  Speech drops;
  for (const Part& part : speech) {
    Duration pause = drops.empty() ? part.pause : std::max(part.pause, active.fault.pause);
    for (const std::uint8_t byte : part.bytes) {
      drops.push_back({std::exchange(pause, active.fault.pause), {byte}});
    }
  }
  speech = std::move(drops);
  return !speech.empty();
}

/// Flips random bits of the characters on the wire, including parity bits. A character with an odd
/// number of flipped bits arrives as kParityError if there is a parity.
bool TwinFaults::FlipBits(Active& active, Speech& speech) const {
  if (speech.empty() || speech.front().bytes.empty()) return false;
  Bytes& bytes = speech.front().bytes;
  const bool parity = wire_.serial.parity != config::Parity::none;
  const auto data_bits = static_cast<std::size_t>(wire_.serial.data_bits);
  const std::size_t width = data_bits + (parity ? 1 : 0);
  const std::size_t all = bytes.size() * width;
  std::vector<unsigned> flips(bytes.size());
  for (std::size_t flipped = 0; flipped < std::min(active.fault.count, all);) {
    const std::size_t bit = Below(active.random, all);
    unsigned& character = flips[bit / width];
    const unsigned mask = 1U << (bit % width);
    if ((character & mask) != 0) continue;
    character |= mask;
    ++flipped;
  }
  const unsigned data = (1U << data_bits) - 1;
  for (std::size_t i = 0; i < bytes.size(); ++i) {
    const bool damaged = parity && std::popcount(flips[i]) % 2 != 0;
    bytes[i] = damaged ? kParityError : static_cast<std::uint8_t>(bytes[i] ^ (flips[i] & data));
  }
  return true;
}

Bytes TwinFaults::Garbage(Active& active) const {
  const std::size_t values = std::size_t{1} << static_cast<unsigned>(wire_.serial.data_bits);
  Bytes bytes(active.fault.count);
  for (std::uint8_t& byte : bytes) byte = static_cast<std::uint8_t>(Below(active.random, values));
  return bytes;
}

/// Returns the late replies that waited for this request, see Fault::exchanges.
TwinFaults::Speech TwinFaults::TakeHeld() {
  Speech due;
  for (Held& held : held_) {
    if (--held.exchanges > 0) continue;
    std::move(held.speech.begin(), held.speech.end(), std::back_inserter(due));
  }
  std::erase_if(held_, [](const Held& held) { return held.exchanges == 0; });
  return due;
}

std::vector<FaultCount> TwinFaults::Counts() const {
  std::vector<FaultCount> counts;
  for (const Active& active : faults_) counts.push_back(active.count);
  return counts;
}

namespace {

using Kind = Fault::Kind;

constexpr std::size_t kMostCount = 1024;
constexpr std::size_t kMostExchanges = 16;
constexpr Duration kLongestPause = 10min;

/// The keys that a kind of fault has beyond rate, seed, after, for and every, with their defaults.
struct KindKeys {
  Kind kind;
  std::string_view count;  ///< name of the key for Fault::count; empty: the kind has none
  std::size_t count_default;
  std::string_view pause;  ///< name of the key for Fault::pause; empty: the kind has none
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
  if (keys.kind != Kind::death) {  // `death` depends only on its schedule
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

/// Parses the share of replies. Also accepts "1e-9" for rare faults, which ParseDecimal rejects.
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
  if (!number || !(*number >= 0 && *number <= 1)) {  // "0e999" gives NaN, which must fail too
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

/// Reads one setting such as "rate=0.1". `given`: the keys that were read so far.
Status TakeSetting(Fault& fault, const KindKeys& keys, std::string_view setting,
                   std::set<std::string_view>& given) {
  const auto equals = setting.find('=');
  const std::string_view key = setting.substr(0, equals);
  const auto allowed = KeysOf(keys);
  if (std::find(allowed.begin(), allowed.end(), key) == allowed.end()) {
    return Error{"unknown key " + Quoted(key) + ";" + DidYouMean(key, allowed) +
                 " allowed: " + Join(allowed)};
  }
  if (equals == std::string_view::npos) {
    return Error{"key " + std::string(key) + " has no value; write " + std::string(key) + "=…"};
  }
  if (!given.insert(key).second) return Error{std::string(key) + "= is given twice"};
  const std::string_view value = setting.substr(equals + 1);
  if (const Status status = SetKey(fault, keys, key, value); !status) {
    return Error{std::string(key) + "=" + std::string(value) + ": " + status.error()};
  }
  return {};
}

Status CheckWhole(const Fault& fault, const std::set<std::string_view>& given) {
  if (given.contains("every") && !given.contains("for")) {
    return Error{"every= needs for=: how long the fault lasts each time"};
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
    return Error{"unknown fault " + Quoted(name) + ";" + DidYouMean(name, known) +
                 " allowed: " + Join(known)};
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

}  // namespace baudgate::tools
