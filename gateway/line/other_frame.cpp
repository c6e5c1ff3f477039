// SPDX-License-Identifier: Apache-2.0
#include "gateway/line/other_frame.h"

#include <algorithm>
#include <string>

#include "gateway/base/checksum.h"
#include "gateway/line/changed_bytes.h"

namespace baudgate {
namespace {

constexpr std::uint8_t kLastSlave = 247;
/// Slave, function, place, count, check value: a request that reads, or that writes one value.
constexpr std::size_t kRequest = 8;
constexpr std::uint8_t kLastOfThese = 6;
constexpr std::uint8_t kLastRead = 4;
/// Slave, function, count of bytes, check value.
constexpr std::size_t kAroundReply = 5;

/// A Modbus RTU request, or the reply to a read, stands at the front.
bool IsModbus(View held) {
  if (held.size() < kRequest || held[0] == 0 || held[0] > kLastSlave) return false;
  const std::uint8_t function = held[1];
  if (function == 0 || function > kLastOfThese) return false;
  if (EndsInCrc16(held.first(kRequest))) return true;
  const std::size_t reply = kAroundReply + held[2];
  return function <= kLastRead && held.size() >= reply && EndsInCrc16(held.first(reply));
}

}  // namespace

std::optional<Finding> OtherFrame(const Hearing& hearing, View heard) {
  if (!std::ranges::all_of(hearing.request, IsPrintable)) return std::nullopt;
  for (std::size_t at = 0; at + kRequest <= heard.size(); ++at) {
    if (!IsModbus(heard.subspan(at))) continue;
    return Finding{.symptom = Symptom::other_master,
                   .bytes = heard.size(),
                   .cause = "messages of Modbus RTU come (slave " + std::to_string(heard[at]) + ")",
                   .remedy =
                       "another master and its devices are on this line: give each protocol "
                       "a line of its own"};
  }
  return std::nullopt;
}

}  // namespace baudgate
