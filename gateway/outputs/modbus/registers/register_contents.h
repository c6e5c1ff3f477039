// `FillRegisters` and `FillBits` compute the contents of registers and bits of one device (values,
// qualities, ages, status block) from its DeviceRecord in the point store. `EventBlockOf` computes
// the event block of a unit. The callers write the result to the buffers of Responder
// (gateway/outputs/modbus/registers/responder.h). No I/O, no clock.
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

template <typename T>
T Saturated(std::uint64_t number) {
  constexpr std::uint64_t kMost = std::numeric_limits<T>::max();
  return static_cast<T>(std::min(number, kMost));
}

inline void Put32(std::span<std::uint16_t> block, std::size_t at, std::uint32_t number) {
  block[at] = static_cast<std::uint16_t>(number >> 16);
  block[at + 1] = static_cast<std::uint16_t>(number);
}

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

/// Counts since the Modbus server was started, except `clients`.
struct ModbusCounters {
  std::uint64_t clients = 0;  ///< clients that are connected now
  std::uint64_t accepted = 0;
  std::uint64_t refused = 0;  ///< clients that were not allowed to connect, or were too many
  /// connections closed because the end of a frame could not be found
  std::uint64_t malformed = 0;
  std::uint64_t idle = 0;     ///< connections closed because no request came for the idle timeout
  std::uint64_t stalled = 0;  ///< connections closed because the client did not read its replies
  /// Connections for which no file descriptor or memory was left; accepting is tried again later.
  std::uint64_t accept_errors = 0;
  std::uint64_t requests = 0;
  std::uint64_t exceptions = 0;
};

/// The status block of a device, from register 9000. New fields are only appended.
///
///   +0 state (bus::DeviceState)  +1 last outcome (Outcome)
///   +2 age of the last good reply (u32, ms; 0xFFFFFFFF: there was none, or it is older)
///   +4 exchanges  +6 ok  +8 no reply  +10 corrupt  +12 retries (u32 counts)
///   +14 last round trip  +15 mean round trip (ms; 65535: this time or longer)
///
/// The layout lists the offset of each field; its last entry is the length of the block.
inline constexpr std::array<std::uint16_t, 11> kDeviceBlockLayout = {0,  1,  2,  4,  6, 8,
                                                                     10, 12, 14, 15, 16};
using DeviceBlock = std::array<std::uint16_t, kDeviceBlockLayout.back()>;
DeviceBlock DeviceBlockOf(const bus::DeviceStatus& status, Instant now);

/// The status block of the gateway (units 0 and 255), from register 9000. New fields are only
/// appended.
///
///   +0 version (major * 10000 + minor * 100 + patch)  +1 lines  +2 uptime (u32, s)
///   +4 devices  +5 devices online  +6 connected Modbus clients  +7 lines up
///   +8 requests answered (u32)  +10 requests answered with an exception (u32)
inline constexpr std::array<std::uint16_t, 10> kGatewayBlockLayout = {0, 1, 2, 4,  5,
                                                                      6, 7, 8, 10, 12};
using GatewayBlock = std::array<std::uint16_t, kGatewayBlockLayout.back()>;
GatewayBlock GatewayBlockOf(const GatewayFigures& info, const ModbusCounters& counters);

/// Fills `out` with the pieces that PlanRead has found for a request. Returns kNoTarget if a value
/// must not be shown because of its quality. Pieces of the event block are set to 0.
ExceptionCode FillRegisters(const bus::DeviceRecord& record, std::span<const Piece> pieces,
                            Instant now, std::span<std::uint16_t> out);
/// Fills `out` with one bit. A bit without a value is 0 in a read of several bits, because the
/// quality bit (at the bit's address + 20000) shows that it is not good. If the bit is read alone
/// (`alone`), kNoTarget is returned instead, because the client, e.g. an operator's lamp, perhaps
/// does not read the quality bit.
ExceptionCode FillBit(const bus::DeviceRecord& record, std::uint32_t point, Instant now, bool alone,
                      std::uint8_t& out);
ExceptionCode FillBits(const bus::DeviceRecord& record, std::span<const Piece> pieces, Instant now,
                       std::span<std::uint8_t> out);

/// Copies `piece.count` registers of a status or event block, from index `piece.index`, to `out`,
/// from index `piece.offset`.
void FillFromBlock(std::span<const std::uint16_t> block, const Piece& piece,
                   std::span<std::uint16_t> out);

// `EventBlock` contains events of a unit as registers, from 9016. The events come from
// gateway/records/events/event_feed.h; gateway/outputs/modbus/service/own_units.cpp requests them.
//
//   +0 number of the first event to show, as the client has written it (u32)
//   +2 newest event  +4 oldest stored event  +6 lost events (u32 each)
//   +8 number of events in this block, at most 7  +9 always 0
//   +10 seven events of 10 registers each; in each event:
//       +0 number  +2 seconds since 1970 (u32 each)  +4 milliseconds
//       +5 clock quality  +6 channel  +7 code (u32)  +9 state

inline constexpr std::size_t kShownEvents = 7;
inline constexpr std::size_t kEventHead = 10;
inline constexpr std::size_t kEventRecord = 10;

/// The offset of each field; the last entry is the length of the block.
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

/// `first`: the event number that the client has written. Event numbers of more than 32 bits are
/// shown by their low 32 bits.
EventBlock EventBlockOf(const events::EventFeed::Page& shown, std::uint32_t first);

}  // namespace baudgate::modbus
