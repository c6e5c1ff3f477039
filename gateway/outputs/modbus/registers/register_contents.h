// What the registers and bits of a request contain: values, their quality and age, status blocks.
// Pure. Reads one consistent DeviceRecord of the point store; fills the private copy in
// responder.h. EventBlockOf gives the block of events of a unit.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>

#include "gateway/base/time.h"
#include "gateway/bus/points/point_store.h"
#include "gateway/outputs/modbus/registers/register_map.h"
#include "gateway/outputs/modbus/wire/request.h"
#include "gateway/records/events/event_feed.h"

namespace baudgate::modbus {

// How numbers stand in the registers of status and event blocks: ABCD, and no larger than they fit.
template <typename T>
T Saturated(std::uint64_t number) {
  constexpr std::uint64_t kMost = std::numeric_limits<T>::max();
  return static_cast<T>(std::min(number, kMost));
}

inline void Put32(std::span<std::uint16_t> block, std::size_t at, std::uint32_t number) {
  block[at] = static_cast<std::uint16_t>(number >> 16);
  block[at + 1] = static_cast<std::uint16_t>(number);
}

/// Figures of the gateway itself, as the composition root knows them.
struct GatewayFigures {
  unsigned version_major = 0;
  unsigned version_minor = 0;
  unsigned version_patch = 0;
  Duration uptime{};
  std::size_t lines = 0;
  std::size_t lines_up = 0;
  std::size_t devices = 0;
  std::size_t devices_online = 0;
};

/// Counters of the Modbus server: totals since it was started.
struct ModbusCounters {
  std::uint64_t clients = 0;  ///< connected now
  std::uint64_t accepted = 0;
  std::uint64_t refused = 0;    ///< not allowed, or too many
  std::uint64_t malformed = 0;  ///< closed because no frame boundary could be trusted
  std::uint64_t idle = 0;       ///< closed because nothing came
  std::uint64_t stalled = 0;    ///< closed because it did not read its answers
  std::uint64_t accept_errors =
      0;  ///< no file descriptor or memory for a client; tried again later
  std::uint64_t requests = 0;
  std::uint64_t exceptions = 0;
};

/// Status block of a device, from 9000, append only: +0 state, +1 last outcome, +2 age of the last
/// good reply (u32, ms; all bits set = never or more), +4 exchanges, +6 ok, +8 no reply,
/// +10 corrupt, +12 retries (u32 each), +14 last and +15 mean round trip (ms, 65535 = more).
/// Where its values start, closed by its length.
inline constexpr std::array<std::uint16_t, 11> kDeviceBlockLayout = {0,  1,  2,  4,  6, 8,
                                                                     10, 12, 14, 15, 16};
using DeviceBlock = std::array<std::uint16_t, kDeviceBlockLayout.back()>;
DeviceBlock DeviceBlockOf(const bus::DeviceStatus& status, Instant now);

/// Block of the gateway itself (units 0 and 255), from 9000, append only: +0 version (major * 10000
/// + minor * 100 + patch), +1 lines, +2 uptime (u32, s), +4 devices, +5 devices online, +6 Modbus
/// clients, +7 lines up, +8 requests answered, +10 of these with an exception (u32 each).
inline constexpr std::array<std::uint16_t, 10> kGatewayBlockLayout = {0, 1, 2, 4,  5,
                                                                      6, 7, 8, 10, 12};
using GatewayBlock = std::array<std::uint16_t, kGatewayBlockLayout.back()>;
GatewayBlock GatewayBlockOf(const GatewayFigures& info, const ModbusCounters& counters);

/// Fill `out` with the pieces of a request (PlanRead); kNoTarget when a value may not be shown.
ExceptionCode FillRegisters(const bus::DeviceRecord& record, std::span<const Piece> pieces,
                            Instant now, std::span<std::uint16_t> out);
/// A bit that has no value is 0 in a block, where N + 20000 says that it is not good; asked for
/// alone it is an exception, as an operator's lamp may have no such register beside it.
ExceptionCode FillBit(const bus::DeviceRecord& record, std::uint32_t point, Instant now, bool alone,
                      std::uint8_t& out);
ExceptionCode FillBits(const bus::DeviceRecord& record, std::span<const Piece> pieces, Instant now,
                       std::span<std::uint8_t> out);

/// The piece of a status block; `piece.count` registers from `piece.index`.
void FillFromBlock(std::span<const std::uint16_t> block, const Piece& piece,
                   std::span<std::uint16_t> out);

// The events of a unit as registers, from 9016. Pure; what is shown comes from
// gateway/records/events/event_feed.h, asked by gateway/outputs/modbus/service/own_units.cpp.
//
//   +0 first to show  +2 newest  +4 oldest kept  +6 lost (u32 each)  +8 how many follow  +9 0
//   +10 … seven times: +0 number  +2 seconds since 1970 (u32 each)  +4 milliseconds
//                      +5 clock quality  +6 channel  +7 code (u32)  +9 state

inline constexpr std::size_t kShownEvents = 7;
inline constexpr std::size_t kEventHead = 10;
inline constexpr std::size_t kEventRecord = 10;

/// Where its values start, closed by its length.
inline constexpr std::array<std::uint16_t, 56> kEventBlockLayout = [] {
  std::array<std::uint16_t, 56> layout{0, 2, 4, 6, 8, 9};
  std::size_t at = 6;
  for (std::size_t event = 0; event < kShownEvents; ++event) {
    for (const std::size_t place : {0U, 2U, 4U, 5U, 6U, 7U, 9U}) {
      layout[at++] = static_cast<std::uint16_t>(kEventHead + event * kEventRecord + place);
    }
  }
  layout[at] = static_cast<std::uint16_t>(kEventHead + kShownEvents * kEventRecord);
  return layout;
}();
static_assert(kEventBlockLayout.back() == 80);
using EventBlock = std::array<std::uint16_t, kEventBlockLayout.back()>;

/// `first`: as the client has written it. Numbers of more than 32 bits show their low ones.
EventBlock EventBlockOf(const events::EventFeed::Page& shown, std::uint32_t first);

}  // namespace baudgate::modbus
