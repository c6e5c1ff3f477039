// SPDX-License-Identifier: Apache-2.0
#include "gateway/diagnosis/damage/changed_bytes.h"

#include <algorithm>
#include <bit>
#include <cstddef>
#include <initializer_list>
#include <iterator>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "gateway/base/decimal.h"
#include "gateway/base/text.h"
#include "protocols/assembler.h"

namespace baudgate::diagnosis {
namespace {

/// True if the byte may come from a character at half the bit rate, where each bit fills two bits
/// of the byte. The pairs of equal bits begin at the second bit, because the first belongs to the
/// start bit; or at the first bit, if the receiver took a missing stop bit for a start bit.
bool HasDoubledBits(std::uint8_t byte) {
  const unsigned differ = byte ^ (byte >> 1U);
  return (differ & 0b00101010U) == 0 || (differ & 0b01010101U) == 0;
}

/// True if the byte may come from two characters (of ten bits) at twice the bit rate. The receiver
/// then reads every second bit, and bit 3 of the byte is the stop bit of the first character, which
/// is 1.
bool HasStopBitInside(std::uint8_t byte) { return (byte & 0b00001000U) != 0; }

Finding Says(const std::string& rate, bool connection) {
  return {.symptom = Symptom::other_setting,
          .cause = "its characters come at " + rate + " the configured bit rate",
          .remedy = connection ? "set the bit rate of the device at the port of the serial server"
                               : "set the same bit rate at the device and in the configuration"};
}

}  // namespace

std::optional<Finding> OtherBitRate(View heard, bool connection) {
  constexpr std::size_t kFewestDoubled = 8;
  constexpr std::size_t kFewestHalved = 7;
  constexpr std::size_t kDifferent = 3;
  std::size_t doubled = 0;
  std::size_t halved = 0;
  std::size_t all = 0;
  std::set<std::uint8_t> values;
  for (const std::uint8_t byte : heard) {
    if (byte % 0xFF == 0) continue;  // 00 or FF stands for a damaged character
    ++all;
    values.insert(byte);
    if (HasDoubledBits(byte)) ++doubled;
    if (HasStopBitInside(byte)) ++halved;
  }
  if (values.size() < kDifferent) return std::nullopt;
  if (doubled == all && all >= kFewestDoubled) return Says("half", connection);
  if (halved == all && all >= kFewestHalved) return Says("twice", connection);
  return std::nullopt;
}

namespace {

/// At most this many characters of a reply are tried as the inserted character.
constexpr std::size_t kMostTried = 16;
constexpr std::initializer_list<std::uint8_t> kFlowControl = {0x11, 0x13};
/// Up to kMostMissing equal bytes are inserted in replies of up to kShort bytes, one byte in
/// replies of up to kLongest bytes.
constexpr std::size_t kMostMissing = 3;
constexpr std::size_t kShort = 24;
constexpr std::size_t kLongest = 100;

/// A byte that some equipment removes, and the remedy.
struct Taker {
  std::uint8_t byte;
  const char* remedy;
};
constexpr const char* kNoFlowControl = "switch XON/XOFF off at the converter or serial server";
constexpr const char* kSetRaw =
    "set the converter or serial server that removes these bytes to raw";
constexpr Taker kTakers[] = {{0x11, kNoFlowControl}, {0x13, kNoFlowControl}, {0x00, kSetRaw},
                             {0x0A, kSetRaw},        {0x0D, kSetRaw},        {0x03, kSetRaw},
                             {0x1A, kSetRaw},        {0x7F, kSetRaw},        {0xFF, kSetRaw}};

Bytes Without(View heard, std::initializer_list<std::uint8_t> bytes) {
  Bytes rest;
  std::ranges::copy_if(heard, std::back_inserter(rest),
                       [&](auto byte) { return std::ranges::find(bytes, byte) == bytes.end(); });
  return rest;
}

/// Replaces each pair of the bytes `first` and `second` by `kept`.
Bytes Shrunk(View heard, std::uint8_t first, std::uint8_t second, std::uint8_t kept) {
  Bytes rest;
  for (std::size_t i = 0; i < heard.size(); ++i) {
    const bool pair = heard[i] == first && i + 1 < heard.size() && heard[i + 1] == second;
    rest.push_back(pair ? kept : heard[i]);
    if (pair) ++i;
  }
  return rest;
}

/// True if the reply is complete when one of the characters `any` is removed; other such characters
/// may belong to the reply. Only the first kMostTried of them are tried.
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

/// Removes in turn what different converters insert. Returns the finding for the removal after
/// which the reply is complete.
std::optional<Finding> Stuffed(const Hearing& hearing, View heard) {
  const struct {
    Bytes clean;
    const char* cause;
    const char* remedy;
  } all[] = {
      {Without(heard, kFlowControl), "XON and XOFF characters (11, 13) are mixed into its replies",
       kNoFlowControl},
      {Shrunk(heard, 0xFF, 0xFF, 0xFF), "each FF of its replies comes twice, as in Telnet",
       "set the serial server to raw TCP, without Telnet"},
      {Shrunk(heard, 0x0D, 0x00, 0x0D), "a 00 is put behind each 0D of its replies, as in Telnet",
       "set the serial server to raw TCP, without Telnet"},
      {Shrunk(heard, 0x0D, 0x0A, 0x0A), "a 0D is put before each 0A of its replies",
       "set the converter or serial server that changes line ends to raw"},
      {Shrunk(heard, 0x0D, 0x0A, 0x0D), "a 0A is put behind each 0D of its replies",
       "set the converter or serial server that changes line ends to raw"},
  };
  for (const auto& one : all) {
    const bool whole = one.clean.size() < heard.size() && IsWhole(hearing, one.clean);
    if (!whole && (&one != all || !IsWholeWithoutOne(hearing, heard, kFlowControl))) continue;
    return Finding{.symptom = Symptom::other_setting, .cause = one.cause, .remedy = one.remedy};
  }
  return std::nullopt;
}

/// True if the reply is complete when `missing` bytes of this value are inserted, at any positions
/// from `from` on.
bool IsWholeWith(const Hearing& hearing, const Bytes& heard, std::uint8_t byte, std::size_t missing,
                 std::size_t from) {
  for (std::size_t at = from; at <= heard.size(); ++at) {
    Bytes longer = heard;
    longer.insert(longer.begin() + static_cast<std::ptrdiff_t>(at), byte);
    if (missing == 1 ? IsWhole(hearing, longer)
                     : IsWholeWith(hearing, longer, byte, missing - 1, at + 1)) {
      return true;
    }
  }
  return false;
}

/// True if the reply is complete when the byte is inserted at every second position, as if it were
/// the high byte of registers with similar values.
bool IsWholeWithEverySecond(const Hearing& hearing, View heard, std::uint8_t byte,
                            std::size_t missing) {
  const std::size_t size = heard.size() + missing;
  for (std::size_t from = 0; from + 2 * missing <= size + 1; ++from) {
    Bytes longer;
    for (std::size_t i = 0; i < size; ++i) {
      const bool put = i >= from && (i - from) % 2 == 0 && (i - from) / 2 < missing;
      const std::size_t taken = i < from ? i : i - std::min((i - from + 1) / 2, missing);
      longer.push_back(put ? byte : heard[taken]);
    }
    if (IsWhole(hearing, longer)) return true;
  }
  return false;
}

/// True if the reply is complete when one XON and one XOFF are inserted. `side_by_side`: only at
/// neighbouring positions, because a long reply has too many other pairs of positions.
bool IsWholeWithBoth(const Hearing& hearing, View heard, bool side_by_side) {
  const std::size_t farthest = side_by_side ? 0 : heard.size();
  for (std::size_t at = 0; at <= heard.size(); ++at) {
    for (std::size_t next = at; next <= std::max(at, farthest); ++next) {
      for (const bool turned : {false, true}) {
        Bytes longer(heard.begin(), heard.end());
        const auto [first, second] = std::pair{turned ? 0x13 : 0x11, turned ? 0x11 : 0x13};
        longer.insert(longer.begin() + static_cast<std::ptrdiff_t>(next),
                      static_cast<std::uint8_t>(second));
        longer.insert(longer.begin() + static_cast<std::ptrdiff_t>(at),
                      static_cast<std::uint8_t>(first));
        if (IsWhole(hearing, longer)) return true;
      }
    }
  }
  return false;
}

/// Finds the byte that is missing in a binary reply. Returns nothing if two different bytes fit,
/// because neither is proven.
std::optional<Finding> Swallowed(const Hearing& hearing, View heard) {
  if (std::ranges::all_of(hearing.request, IsPrintable)) return std::nullopt;
  const Taker* found = nullptr;
  for (const protocols::Shape& shape : hearing.expect->shapes) {
    const bool fixed = shape.min_length == shape.max_length && shape.max_length > heard.size();
    const std::size_t missing = fixed ? shape.max_length - heard.size() : 0;
    const std::size_t most = shape.max_length <= kShort     ? kMostMissing
                             : shape.max_length <= kLongest ? 1
                                                            : 0;
    if (missing == 0 || shape.max_length > kLongest) continue;
    if (missing == 2 && IsWholeWithBoth(hearing, heard, shape.max_length > kShort)) {
      return Finding{.symptom = Symptom::other_setting,
                     .cause = "bytes 11 and 13 are missing inside its replies",
                     .remedy = kNoFlowControl};
    }
    for (const Taker& taker : kTakers) {
      const bool whole =
          missing <= most
              ? IsWholeWith(hearing, Bytes(heard.begin(), heard.end()), taker.byte, missing, 0)
              : IsWholeWithEverySecond(hearing, heard, taker.byte, missing);
      if (!whole) continue;
      if (found != nullptr && found->byte != taker.byte) return std::nullopt;
      found = &taker;
    }
  }
  if (found == nullptr) return std::nullopt;
  return Finding{.symptom = Symptom::other_setting,
                 .cause = "bytes " + HexByte(found->byte) + " are missing inside its replies",
                 .remedy = found->remedy};
}

/// True if the reply is complete when one of its bytes `came`, or all of them, are replaced by
/// `belongs`.
bool IsWholeWithout(const Hearing& hearing, View heard, std::uint8_t came, std::uint8_t belongs) {
  Bytes all(heard.begin(), heard.end());
  for (std::size_t i = 0; i < heard.size(); ++i) {
    if (heard[i] != came) continue;
    Bytes one(heard.begin(), heard.end());
    one[i] = all[i] = belongs;
    if (IsWhole(hearing, one)) return true;
  }
  return IsWhole(hearing, all);
}

std::optional<Finding> Translated(const Hearing& hearing, View heard) {
  if (std::ranges::all_of(hearing.request, IsPrintable)) return std::nullopt;
  for (const auto& [came, belongs] : {std::pair{0x0A, 0x0D}, std::pair{0x0D, 0x0A}}) {
    const auto is = static_cast<std::uint8_t>(came);
    const auto was = static_cast<std::uint8_t>(belongs);
    if (!IsWholeWithout(hearing, heard, is, was)) continue;
    return Finding{.symptom = Symptom::other_setting,
                   .cause = "a " + HexByte(is) + " comes where a " + HexByte(was) + " belongs",
                   .remedy = "set the converter or serial server that changes line ends to raw"};
  }
  return std::nullopt;
}

std::optional<Finding> Inverted(const Hearing& hearing, View heard) {
  Bytes turned(heard.begin(), heard.end());
  for (std::uint8_t& byte : turned) byte = static_cast<std::uint8_t>(~byte);
  if (!IsWhole(hearing, turned)) return std::nullopt;
  return Finding{
      .symptom = Symptom::other_setting,
      .cause = "its replies are right with every bit inverted",
      .remedy = "swap A and B at the device, or switch the inversion of its converter off"};
}

/// Recognises a wrong parity setting: characters with wrong parity arrive as FF (kDamaged in
/// transports/parity.h) or as 00, and all other characters have one parity. A line without bias
/// also gives 00 and FF, but no other characters.
std::optional<Finding> OtherParity(const Hearing& hearing, View heard) {
  constexpr std::ptrdiff_t kFewest = 6;
  constexpr std::ptrdiff_t kMarks = 2;
  const auto is_odd = [](std::uint8_t byte) { return std::popcount(byte) % 2 != 0; };
  const bool text = std::ranges::all_of(hearing.request, IsPrintable);
  const bool words = text && std::ranges::all_of(heard, [](auto byte) {
                       return IsPrintable(byte) || byte % 0xFF == 0;
                     });
  const auto odd = std::ranges::count_if(heard, is_odd);
  const auto rest = std::ranges::count_if(heard, [](auto byte) { return byte % 0xFF != 0; });
  // If all other characters have odd parity, 00 stands for a damaged character too, because its
  // parity is even.
  const auto zeros = words || odd > 0 ? std::ranges::count(heard, 0x00) : 0;
  const auto marks = std::ranges::count(heard, 0xFF) + zeros;
  if (hearing.connection || marks < kMarks || rest < kFewest) return std::nullopt;
  if (odd != 0 && odd != rest) return std::nullopt;
  return Finding{.symptom = Symptom::other_setting,
                 .cause = "only characters with the right parity arrive; the others arrive as " +
                          std::string(zeros > 0 ? "00" : "FF"),
                 .remedy = "set the same parity at the device and in the configuration"};
}

View Core(View bytes) {
  while (!bytes.empty() && IsLineEnd(bytes.front())) bytes = bytes.subspan(1);
  while (!bytes.empty() && IsLineEnd(bytes.back())) bytes = bytes.first(bytes.size() - 1);
  return bytes;
}

/// Returns the length of the longest common subsequence of `one` and `other`.
std::size_t CommonBytes(View one, View other) {
  std::vector<std::size_t> row(other.size() + 1);
  for (const std::uint8_t byte : one) {
    std::size_t diagonal = 0;
    for (std::size_t i = 0; i < other.size(); ++i) {
      const std::size_t above = row[i + 1];
      row[i + 1] = byte == other[i] ? diagonal + 1 : std::max(above, row[i]);
      diagonal = above;
    }
  }
  return row.back();
}

}  // namespace

std::optional<Finding> DecimalComma(const Hearing& hearing, View heard) {
  if (!std::ranges::all_of(hearing.request, IsPrintable)) return std::nullopt;
  // If the text also contains points, its commas separate numbers and are not decimal commas.
  if (std::ranges::find(heard, '.') != heard.end()) return std::nullopt;
  Bytes changed(heard.begin(), heard.end());
  for (std::size_t i = 0; i < heard.size(); ++i) {
    if (heard[i] != ',') continue;
    if (!IsDecimalComma(AsText(heard), i)) return std::nullopt;
    changed[i] = '.';
  }
  if (std::ranges::equal(changed, heard)) return std::nullopt;
  if (!IsWhole(hearing, heard) && !IsWhole(hearing, changed)) return std::nullopt;
  return Finding{.symptom = Symptom::other_setting,
                 .cause = "a comma comes in place of a decimal point (" + Quote(heard) + ")",
                 .remedy = "set the device to a decimal point"};
}

std::optional<Finding> DoubledBytes(const Hearing& hearing, View heard) {
  constexpr std::size_t kFewestPairs = 4;
  constexpr std::size_t kDifferent = 4;
  Bytes single;
  std::size_t pairs = 0;
  std::set<std::uint8_t> values;
  for (std::size_t i = 0; i + 1 < heard.size(); i += 2) {
    single.push_back(heard[i]);
    if (heard[i] != heard[i + 1]) continue;
    ++pairs;
    values.insert(heard[i]);
  }
  if (single.size() < kFewestPairs || 8 * pairs < 7 * single.size()) return std::nullopt;
  if (values.size() < kDifferent && !IsWhole(hearing, single)) return std::nullopt;
  return Finding{.symptom = Symptom::other_setting,
                 .cause = "each byte of its replies comes twice",
                 .remedy =
                     "terminate the bus at both ends, or take out the repeater or converter that "
                     "doubles the bytes"};
}

/// Compares the bytes without line ends. In a text, a quarter of the characters may differ, because
/// the value and its check value may have changed between the two replies. A text that has its line
/// end can lack more than two characters. Binary bytes must not differ: noise changes bytes but
/// removes none.
bool LacksSome(View heard, View reply) {
  constexpr std::size_t kMostLost = 2;
  constexpr std::size_t kFewest = 4;
  constexpr std::size_t kLong = 8;
  const bool ends = !heard.empty() && IsLineEnd(heard.back());
  heard = Core(heard);
  reply = Core(reply);
  if (heard.size() < kFewest || heard.size() >= reply.size()) return false;
  if (heard.front() != reply.front()) return false;
  const std::size_t lost = reply.size() - heard.size();
  const std::size_t common = CommonBytes(heard, reply);
  const bool text = std::ranges::all_of(reply, IsPrintable);
  const bool many = text && ends && heard.size() >= kLong && lost <= heard.size();
  if (lost > kMostLost && !many) return false;
  if (text) return 4 * common >= 3 * heard.size();
  return common == heard.size() && heard.back() == reply.back();
}

bool IsPrintable(std::uint8_t byte) {
  return (byte >= 0x20 && byte < 0x7F) || byte == '\r' || byte == '\n' || byte == '\t';
}

bool IsWhole(const Hearing& hearing, View heard) {
  protocols::Assembler assembler;
  assembler.Begin(hearing.protocol->reply_rule, *hearing.expect);
  assembler.Feed(heard);
  return assembler.Next(true).has_value();
}

std::optional<Finding> ChangedBytes(const Hearing& hearing, View heard) {
  // A Modbus TCP reply has no check value, so no change can be proven.
  if (hearing.protocol->tcp) return std::nullopt;
  for (const auto undo : {Stuffed, Swallowed, Translated, Inverted}) {
    if (auto found = undo(hearing, heard)) return found;
  }
  if (auto rate = OtherBitRate(heard, hearing.connection)) return rate;
  return OtherParity(hearing, heard);
}

}  // namespace baudgate::diagnosis
