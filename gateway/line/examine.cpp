// SPDX-License-Identifier: Apache-2.0
#include "gateway/line/examine.h"

#include <algorithm>
#include <optional>
#include <string>
#include <utility>

#include "gateway/base/text.h"
#include "gateway/line/assembler.h"

namespace baudgate {
namespace {

/// Fewer printable characters are no words.
constexpr std::size_t kShortestText = 6;
constexpr std::size_t kQuoted = 40;
/// A driver that takes or leaves the bus may make so many bytes of nothing.
constexpr std::size_t kHarmless = 3;

/// A whole reply in what came.
struct Found {
  std::size_t begin = 0;
  std::size_t end = 0;
  std::size_t frames = 0;  ///< this one and those behind it that are the same
  bool others = false;     ///< a different one stands behind it
};

std::optional<Found> FindReply(const Hearing& hearing, View heard) {
  Assembler assembler;
  assembler.Begin(hearing.protocol->reply_rule, *hearing.expect);
  assembler.Feed(heard);
  std::optional<Found> found;
  Bytes first;
  while (const auto frame = assembler.Next(true)) {
    const std::size_t end = heard.size() - assembler.held();
    if (!found) {
      first = *frame;
      found = Found{end - frame->size(), end, 1, false};
    } else if (*frame == first) {
      ++found->frames;
      found->end = end;
    } else {
      found->others = true;
    }
  }
  return found;
}

bool IsWhole(const Hearing& hearing, View heard) { return FindReply(hearing, heard).has_value(); }

Duration ArrivalOf(const Hearing& hearing, std::size_t byte) {
  Duration after{};
  for (const Arrival& arrival : hearing.arrivals) {
    if (arrival.at > byte) break;
    after = arrival.after;
  }
  return after;
}

/// The longest between two pieces of heard[begin, end).
Duration LongestPause(const Hearing& hearing, std::size_t begin, std::size_t end) {
  Duration longest{};
  for (std::size_t i = 1; i < hearing.arrivals.size(); ++i) {
    const Arrival& arrival = hearing.arrivals[i];
    if (arrival.at <= begin || arrival.at >= end) continue;
    longest = std::max(longest, arrival.after - hearing.arrivals[i - 1].after);
  }
  return longest;
}

std::string Quote(View text) {
  std::string quoted = Printable(text.first(std::min(text.size(), kQuoted)));
  if (text.size() > kQuoted) quoted += "...";
  return "'" + quoted + "'";
}

bool IsWords(View heard) {
  const auto printable = std::ranges::count_if(heard, [](std::uint8_t byte) {
    return (byte >= 0x20 && byte < 0x7F) || byte == '\r' || byte == '\n' || byte == '\t';
  });
  const auto letters = std::ranges::count_if(heard, [](std::uint8_t byte) {
    return (byte >= 'a' && byte <= 'z') || (byte >= 'A' && byte <= 'Z') || byte == ' ';
  });
  const auto size = static_cast<std::ptrdiff_t>(heard.size());
  return heard.size() >= kShortestText && 20 * printable >= 19 * size && 2 * letters >= size;
}

/// Its first bytes are those of a reply, or nearly.
bool BeginsLikeReply(const Hearing& hearing, View heard) {
  const Expectation& expect = *hearing.expect;
  return std::ranges::any_of(heard.first(std::min<std::size_t>(heard.size(), 3)), [&](auto byte) {
    const bool address = !expect.address.empty() && byte == expect.address[0];
    const bool lead = byte == hearing.request.front();
    return address || lead || std::ranges::any_of(expect.shapes, [byte](const Shape& shape) {
             return shape.tag > 0 && (shape.tag & 0xFF) == byte;
           });
  });
}

/// More was to come, and it is not as long as a reply that has but one length.
bool IsBeginning(const Hearing& hearing, View heard) {
  Assembler assembler;
  assembler.Begin(hearing.protocol->reply_rule, *hearing.expect);
  assembler.Feed(heard);
  if (assembler.Next(false) || assembler.held() == 0 || assembler.blame() != Outcome::none) {
    return false;
  }
  return std::ranges::none_of(hearing.expect->shapes, [&](const Shape& shape) {
    return shape.min_length == shape.max_length && shape.max_length == heard.size();
  });
}

Outcome BlameOf(const Hearing& hearing, View heard) {
  Assembler assembler;
  assembler.Begin(hearing.protocol->reply_rule, *hearing.expect);
  assembler.Feed(heard);
  while (assembler.Next(true)) {
  }
  return assembler.blame();
}

bool IsWholeWithoutEighthBit(const Hearing& hearing, View heard) {
  if (hearing.protocol->data_bits > 7) return false;
  Bytes cleared(heard.begin(), heard.end());
  for (std::uint8_t& byte : cleared) byte &= 0x7F;
  return !std::ranges::equal(cleared, heard) && IsWhole(hearing, cleared);
}

bool IsWholeBehindLostHead(const Hearing& hearing, View heard) {
  Bytes longer(heard.size() + 1);
  std::ranges::copy(heard, longer.begin() + 1);
  for (int first = 0; first < 256; ++first) {
    longer[0] = static_cast<std::uint8_t>(first);
    const auto found = FindReply(hearing, longer);
    if (found && found->begin == 0) return true;
  }
  return false;
}

Symptom SymptomOf(Recognised::What what) {
  switch (what) {
    case Recognised::What::other_device:
      return Symptom::other_device;
    case Recognised::What::other_master:
      return Symptom::other_master;
    case Recognised::What::other_reply:
      return Symptom::other_reply;
    case Recognised::What::other_setting:
      return Symptom::other_setting;
    case Recognised::What::other_protocol:
      break;
  }
  return Symptom::other_protocol;
}

std::optional<Finding> Recognise(const Hearing& hearing, View heard) {
  if (hearing.protocol->recognise == nullptr) return std::nullopt;
  auto recognised = hearing.protocol->recognise(hearing.request, heard, *hearing.options);
  if (!recognised) return std::nullopt;
  return Finding{.symptom = SymptomOf(recognised->what),
                 .cause = std::move(recognised->cause),
                 .remedy = std::move(recognised->remedy)};
}

/// Of an exchange whose reply was taken.
Finding Beside(const Hearing& hearing, View heard, const Found& found) {
  const View before = heard.first(found.begin);
  const View behind = heard.subspan(found.end);
  for (const View part : {before, behind}) {
    if (part.size() <= kHarmless) continue;
    auto recognised = Recognise(hearing, part);
    if (recognised && recognised->symptom == Symptom::other_master) return *recognised;
  }
  if (found.others) return {.symptom = Symptom::other_reply};
  if (found.frames > 1) return {.symptom = Symptom::copies};
  if (before.size() > kHarmless) return {.symptom = Symptom::noise_before, .bytes = before.size()};
  if (behind.size() > kHarmless) return {.symptom = Symptom::noise_behind, .bytes = behind.size()};
  return {};
}

/// A whole reply came, and the exchange has failed all the same.
Finding Untaken(const Hearing& hearing, std::size_t echo, const Found& found) {
  const Duration pause = LongestPause(hearing, echo + found.begin, echo + found.end);
  const Duration after = ArrivalOf(hearing, echo + found.begin);
  if (found.frames == 1 && pause > hearing.gap) return {.symptom = Symptom::split, .time = pause};
  if (after > hearing.reply) return {.symptom = Symptom::late, .time = after};
  if (auto recognised = Recognise(hearing, hearing.heard.subspan(echo))) return *recognised;
  return {.symptom = found.others ? Symptom::other_reply : Symptom::odd};
}

/// No reply is in it.
Finding Unreadable(const Hearing& hearing, View heard) {
  if (auto recognised = Recognise(hearing, heard)) return *recognised;
  if (BlameOf(hearing, heard) == Outcome::unexpected) return {.symptom = Symptom::other_reply};
  if (heard.size() > hearing.expect->max_bytes) return {.symptom = Symptom::endless};
  if (IsWholeWithoutEighthBit(hearing, heard)) return {.symptom = Symptom::eighth_bit};
  if (IsWords(heard) && !BeginsLikeReply(hearing, heard)) {
    return {.symptom = Symptom::text, .cause = Quote(heard)};
  }
  if (IsWholeBehindLostHead(hearing, heard)) return {.symptom = Symptom::head_lost};
  const bool zeros = std::ranges::all_of(heard, [](auto byte) { return byte % 0xFF == 0; });
  if (zeros) return {.symptom = Symptom::zeros};
  if (!BeginsLikeReply(hearing, heard)) return {.symptom = Symptom::noise};
  const Duration pause = LongestPause(hearing, 0, hearing.heard.size());
  if (pause > hearing.gap) return {.symptom = Symptom::split, .time = pause};
  if (IsBeginning(hearing, heard)) return {.symptom = Symptom::tail_lost};
  return {.symptom = Symptom::damaged};
}

}  // namespace

Finding Examine(const Hearing& hearing) {
  const bool answered = ProvesLife(hearing.outcome);
  View heard = hearing.heard;
  if (heard.empty()) return {.symptom = answered ? Symptom::clean : Symptom::silence};
  std::size_t echo = 0;
  if (!hearing.expect->mirrors && heard.size() >= hearing.request.size() &&
      std::ranges::equal(heard.first(hearing.request.size()), hearing.request)) {
    echo = hearing.request.size();
    heard = heard.subspan(echo);
    if (heard.empty()) return {.symptom = answered ? Symptom::clean : Symptom::echo, .bytes = echo};
  }
  const auto found = FindReply(hearing, heard);
  Finding finding;
  if (answered) {
    if (found) finding = Beside(hearing, heard, *found);
  } else {
    finding = found ? Untaken(hearing, echo, *found) : Unreadable(hearing, heard);
  }
  if (finding.bytes == 0) finding.bytes = heard.size();
  return finding;
}

}  // namespace baudgate
