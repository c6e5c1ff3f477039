// SPDX-License-Identifier: Apache-2.0
#include "gateway/diagnosis/damage/other_bit_rate.h"

#include <cstddef>
#include <set>
#include <string>

namespace baudgate {
namespace {

/// A character that is read twice as fast as it was sent: each bit fills two. The pairs begin
/// behind the first bit, which the start bit fills; or with it, if the receiver has taken a missing
/// stop bit for a start bit.
bool HasDoubledBits(std::uint8_t byte) {
  const unsigned differ = byte ^ (byte >> 1U);
  return (differ & 0b00101010U) == 0 || (differ & 0b01010101U) == 0;
}

/// Two characters of ten bits that follow each other, read half as fast as they were sent: every
/// second bit, of which the fourth is the stop bit of the first.
bool HasStopBitInside(std::uint8_t byte) { return (byte & 0b00001000U) != 0; }

Finding Says(const std::string& rate, bool connection) {
  return {.symptom = Symptom::other_setting,
          .cause = "its characters come at " + rate + " the bit rate that is set here",
          .remedy = connection ? "set that of the device at the port of the serial server"
                               : "set both alike"};
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
    if (byte % 0xFF == 0) continue;  // the driver gives them for what it could not read
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

}  // namespace baudgate
