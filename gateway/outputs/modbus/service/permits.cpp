// SPDX-License-Identifier: Apache-2.0
#include "gateway/outputs/modbus/service/permits.h"

#include <algorithm>
#include <optional>
#include <vector>

#include "gateway/outputs/modbus/wire/request.h"
#include "protocols/modbus_pdu/modbus_pdu.h"

namespace baudgate::modbus {

bool Permits(config::Permit permit, std::uint8_t function) {
  switch (permit) {
    case config::Permit::read:
      return IsRead(function);
    case config::Permit::data:
      return IsRead(function) || IsPlainWrite(function);
    case config::Permit::all:
      return true;
  }
  return false;
}

namespace {

using Range = config::RoleRule::Range;

bool IsWithin(const std::vector<Range>& ranges, std::size_t first, std::size_t last) {
  if (ranges.empty()) return true;
  return std::ranges::any_of(
      ranges, [&](const Range& one) { return one.first <= first && last <= one.last; });
}

/// A range of addresses in a request: `count` registers or bits from `start`.
struct Span {
  std::size_t start;
  std::size_t count;
};

/// Returns the registers or bits that a request addresses. Empty: the function is none of 1 to 6,
/// 15, 16 and 22 to 24, or the PDU is too short; a rule with `addresses` then does not permit the
/// request. Source: MODBUS Application Protocol 1.1b3, chapter 6.
std::vector<Span> AddressesOf(View pdu) {
  const ByteReader reader(pdu);
  const auto span = [&](std::size_t at, std::optional<std::size_t> count) -> std::optional<Span> {
    const auto start = reader.U16Be(at);
    if (!start || !count) return std::nullopt;
    return Span{*start, std::max<std::size_t>(*count, 1)};
  };
  std::vector<std::optional<Span>> spans;
  switch (pdu.empty() ? 0 : pdu[0]) {
    case 1:
    case 2:
    case 3:
    case 4:
    case 15:
    case 16:
      spans = {span(1, reader.U16Be(3))};
      break;
    case 5:
    case 6:
    case 22:  // mask write register
    case 24:  // read FIFO queue
      spans = {span(1, 1)};
      break;
    case 23:  // read and write registers
      spans = {span(1, reader.U16Be(3)), span(5, reader.U16Be(7))};
      break;
    default:
      break;
  }
  std::vector<Span> found;
  for (const auto& one : spans) {
    if (!one) return {};
    found.push_back(*one);
  }
  return found;
}

bool Permits(const config::RoleRule& rule, View frame) {
  const std::uint8_t unit = UnitOf(frame);
  if (!IsWithin(rule.units, unit, unit)) return false;
  if (!rule.functions.empty() &&
      std::ranges::find(rule.functions, FunctionOf(frame)) == rule.functions.end()) {
    return false;
  }
  if (rule.addresses.empty()) return true;
  const auto spans = AddressesOf(PduOf(frame));
  return !spans.empty() && std::ranges::all_of(spans, [&](const Span& one) {
    return IsWithin(rule.addresses, one.start, one.start + one.count - 1);
  });
}

}  // namespace

bool HasExactForm(View frame) {
  const View pdu = PduOf(frame);
  const ByteReader reader(pdu);
  constexpr std::uint8_t kMaskWrite = 22;
  constexpr std::uint8_t kReadWrite = 23;
  constexpr std::uint8_t kReadFifo = 24;
  ModbusRequest request;
  switch (const std::uint8_t function = FunctionOf(frame)) {
    case 7:   // read exception status
    case 11:  // get communication event counter
    case 12:  // get communication event log
    case 17:  // report server id
      return pdu.size() == 1;
    case kMaskWrite:
      return pdu.size() == 7;
    case kReadFifo:
      return pdu.size() == 3;
    case kReadWrite: {
      const std::size_t registers = reader.U16Be(7).value_or(0);
      return registers > 0 && reader.U16Be(3).value_or(0) > 0 && pdu.size() == 10 + 2 * registers &&
             pdu[9] == 2 * registers;
    }
    default:
      if (!IsRead(function) && !IsPlainWrite(function)) return true;
      return ParseRequest(frame, request) == kNoException;
  }
}

bool Permits(const config::RoleRights& rights, View frame) {
  if (rights.rules.empty()) return Permits(rights.permit, FunctionOf(frame));
  return std::ranges::any_of(
      rights.rules, [frame](const config::RoleRule& rule) { return Permits(rule, frame); });
}

}  // namespace baudgate::modbus
