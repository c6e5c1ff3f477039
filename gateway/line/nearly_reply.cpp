// SPDX-License-Identifier: Apache-2.0
#include "gateway/line/nearly_reply.h"

#include <algorithm>
#include <initializer_list>
#include <iterator>

#include "gateway/line/assembler.h"

namespace baudgate {
namespace {

/// Characters that may have been put in.
constexpr std::size_t kMostTried = 16;
constexpr std::initializer_list<std::uint8_t> kFlowControl = {0x11, 0x13};

bool IsWhole(const Hearing& hearing, View heard) {
  Assembler assembler;
  assembler.Begin(hearing.protocol->reply_rule, *hearing.expect);
  assembler.Feed(heard);
  return assembler.Next(true).has_value();
}

/// A whole reply stands at the front. One look of the rule, however much there is.
bool StartsWithReply(const Hearing& hearing, View heard) {
  return hearing.protocol->reply_rule(heard, *hearing.expect, true).kind == Cut::Kind::frame;
}

/// Its last byte is missing, whatever that was.
bool IsWholeWithEnd(const Hearing& hearing, View heard) {
  while (!heard.empty() && (heard.front() == '\r' || heard.front() == '\n'))
    heard = heard.subspan(1);
  if (heard.empty()) return false;
  // Where nothing is checked, every beginning of a text is whole with an end.
  Bytes shorter(heard.begin(), heard.end());
  shorter.back() = '\r';
  if (StartsWithReply(hearing, shorter)) return false;
  Bytes longer(heard.begin(), heard.end());
  longer.push_back(0);
  for (int last = 0; last < 256; ++last) {
    longer.back() = static_cast<std::uint8_t>(last);
    if (StartsWithReply(hearing, longer)) return true;
  }
  return false;
}

/// A line feed in place of the carriage return.
bool IsWholeWithOtherEnd(const Hearing& hearing, View heard) {
  if (heard.back() != '\n') return false;
  Bytes changed(heard.begin(), heard.end());
  changed.back() = '\r';
  return IsWhole(hearing, changed);
}

Bytes Without(View heard, std::initializer_list<std::uint8_t> bytes) {
  Bytes rest;
  std::ranges::copy_if(heard, std::back_inserter(rest),
                       [&](auto byte) { return std::ranges::find(bytes, byte) == bytes.end(); });
  return rest;
}

/// `first` alone in place of each pair of `first` and `second`.
Bytes Shrunk(View heard, std::uint8_t first, std::uint8_t second, std::uint8_t kept) {
  Bytes rest;
  for (std::size_t i = 0; i < heard.size(); ++i) {
    const bool pair = heard[i] == first && i + 1 < heard.size() && heard[i + 1] == second;
    rest.push_back(pair ? kept : heard[i]);
    if (pair) ++i;
  }
  return rest;
}

/// It is whole without one of these characters; others like it may be its own.
bool IsWholeWithoutOne(const Hearing& hearing, View heard,
                       std::initializer_list<std::uint8_t> any) {
  std::size_t tried = 0;
  for (std::size_t i = 0; i < heard.size() && tried < kMostTried; ++i) {
    if (std::ranges::find(any, heard[i]) == any.end()) continue;
    ++tried;
    Bytes rest(heard.begin(), heard.end());
    rest.erase(rest.begin() + static_cast<std::ptrdiff_t>(i));
    if (IsWhole(hearing, rest)) return true;
  }
  return false;
}

/// What converters and serial servers put in, taken out again: then it is whole.
std::optional<Finding> Stuffed(const Hearing& hearing, View heard) {
  const struct {
    Bytes clean;
    const char* cause;
    const char* remedy;
  } all[] = {
      {Without(heard, kFlowControl), "XON and XOFF characters (11, 13) are mixed into its replies",
       "switch software flow control off at the converter or serial server"},
      {Shrunk(heard, 0xFF, 0xFF, 0xFF), "each FF of its replies comes twice, as in Telnet",
       "set the serial server to raw TCP, without Telnet"},
      {Shrunk(heard, 0x0D, 0x00, 0x0D), "a 00 is put behind each 0D of its replies, as in Telnet",
       "set the serial server to raw TCP, without Telnet"},
      {Shrunk(heard, 0x0D, 0x0A, 0x0A), "a 0D is put before each 0A of its replies",
       "a converter or serial server changes line ends: set it to raw"},
      {Shrunk(heard, 0x0D, 0x0A, 0x0D), "a 0A is put behind each 0D of its replies",
       "a converter or serial server changes line ends: set it to raw"},
  };
  for (const auto& one : all) {
    const bool whole = one.clean.size() < heard.size() && IsWhole(hearing, one.clean);
    if (!whole && (&one != all || !IsWholeWithoutOne(hearing, heard, kFlowControl))) continue;
    return Finding{.symptom = Symptom::other_setting, .cause = one.cause, .remedy = one.remedy};
  }
  return std::nullopt;
}

bool IsWholeWithoutEighthBit(const Hearing& hearing, View heard) {
  if (hearing.protocol->data_bits > 7) return false;
  Bytes cleared(heard.begin(), heard.end());
  for (std::uint8_t& byte : cleared) byte &= 0x7F;
  return !std::ranges::equal(cleared, heard) && IsWhole(hearing, cleared);
}

/// Its first byte is missing, whatever that was; or its first two or three, of which two are those
/// of the request.
bool IsWholeBehindLostHead(const Hearing& hearing, View heard) {
  Bytes longer(heard.size() + 1);
  std::ranges::copy(heard, longer.begin() + 1);
  for (int first = 0; first < 256; ++first) {
    longer[0] = static_cast<std::uint8_t>(first);
    if (StartsWithReply(hearing, longer)) return true;
  }
  if (hearing.request.size() < 2) return false;
  Bytes head(hearing.request.begin(), hearing.request.begin() + 2);
  const std::size_t two = head.size();
  Append(head, heard);
  if (StartsWithReply(hearing, head)) return true;
  head.insert(head.begin() + static_cast<std::ptrdiff_t>(two), 0);
  for (int third = 0; third < 256; ++third) {
    head[two] = static_cast<std::uint8_t>(third);
    if (StartsWithReply(hearing, head)) return true;
  }
  return false;
}

}  // namespace

std::optional<Finding> NearlyReply(const Hearing& hearing, View heard) {
  if (IsWholeWithoutEighthBit(hearing, heard)) return Finding{.symptom = Symptom::eighth_bit};
  if (IsWholeWithOtherEnd(hearing, heard)) {
    return Finding{.symptom = Symptom::other_setting,
                   .cause = "its replies end in a line feed, not in a carriage return",
                   .remedy = "a converter or serial server changes line ends: set it to raw"};
  }
  if (auto stuffed = Stuffed(hearing, heard)) return stuffed;
  if (IsWholeBehindLostHead(hearing, heard)) return Finding{.symptom = Symptom::head_lost};
  if (IsWholeWithEnd(hearing, heard)) return Finding{.symptom = Symptom::end_lost};
  return std::nullopt;
}

}  // namespace baudgate
