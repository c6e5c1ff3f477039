// `RegisterMap` tells which point is at an address of a Modbus unit. It is built from the
// configuration. The functions below divide requests into pieces, encode values in registers or
// bits, choose what is shown instead of a bad value, and decode writes.
// gateway/outputs/modbus/service/own_units.cpp and register_contents.cpp in this folder use them.
// The addresses are a public contract: config/model/modbus.h.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <optional>
#include <span>
#include <vector>

#include "config/model/config.h"
#include "config/model/device.h"
#include "config/model/modbus.h"
#include "gateway/base/value.h"
#include "gateway/bus/writes/write_gate.h"
#include "gateway/outputs/modbus/wire/request.h"

namespace baudgate::modbus {

using config::kAgeOffset;
using config::kEventBlock;
using config::kQualityOffset;
using config::kStatusBlock;
using config::kValuesAfterStatus;
using config::kValuesEnd;

/// Clients acknowledge alarms by writing to this register and the next: the number of an alarm, or
/// a number that stands for all (u32). They are behind the event block and cannot be read.
inline constexpr std::uint16_t kAckRegister = kEventBlock + 80;

struct Span {
  std::uint16_t start = 0;
  std::uint16_t count = 0;
  std::uint32_t point = 0;
  bool readable = true;

  std::uint32_t end() const { return static_cast<std::uint32_t>(start) + count; }
};

enum class Area : std::uint8_t { value, quality, age, status, events, hole };

/// A part of a request's addresses that belongs to one point (its value, quality or age), to one
/// block, or to a hole (addresses without a readable point).
struct Piece {
  Area area = Area::value;
  /// The index of the point; in a block, the index of the first requested register; in a hole, 0.
  std::uint32_t index = 0;
  std::uint16_t offset = 0;  ///< distance from the first address of the request
  std::uint16_t count = 0;
};

struct UnitMap {
  enum class Kind : std::uint8_t { unmapped, device, gateway } kind = Kind::unmapped;
  std::uint32_t device = 0;     ///< index in the point store
  std::vector<Span> registers;  ///< mapped registers, sorted, without overlap
  std::vector<Span> bits;
  /// Points with `select: yes`; key: the address of the point. A client selects the point by a
  /// write to this address + config::kSelectOffset.
  std::map<std::uint16_t, std::uint32_t> selects;
  /// The offset of each field of the status block; the last entry is the block's length.
  std::vector<std::uint16_t> status_layout;

  const std::vector<Span>& spans(config::Table table) const {
    return table == config::Table::bits ? bits : registers;
  }
};

class RegisterMap {
 public:
  /// Devices are numbered as in PointStore: in the order of the file, including disabled devices.
  explicit RegisterMap(const config::Config& config);

  const UnitMap& unit(std::uint8_t id) const { return units_[unit_index_[id]]; }

 private:
  /// The index of each unit in units_; 0: the unit is not mapped.
  std::array<std::uint16_t, 256> unit_index_{};
  std::vector<UnitMap> units_;
};

using Holes = config::Listener::Holes;

/// Divides a read into pieces in ascending order; `pieces` is cleared first. Returns
/// kIllegalAddress if an address is unmapped or write-only, else kIllegalValue if the range
/// contains only a part of a value or of a field of a block. With Holes::zero, unmapped and
/// write-only addresses become pieces of area `hole`, unless the range contains nothing else.
ExceptionCode PlanRead(const UnitMap& unit, config::Table table, std::uint16_t start,
                       std::uint16_t count, std::vector<Piece>& pieces, Holes holes = Holes::off);

/// Divides a write into pieces of area `value`. Returns kIllegalAddress if an address is unmapped,
/// else kIllegalValue if only a part of a point is written. gateway/bus/writes/write_gate.h decides
/// which points clients are allowed to write.
ExceptionCode PlanWrite(const UnitMap& unit, config::Table table, std::uint16_t start,
                        std::uint16_t count, std::vector<Piece>& pieces);

/// Selects what a client gets when it reads a value.
enum class Shown : std::uint8_t {
  held,  ///< the stored value: the present value, or the last good value if the quality is bad
  no_value,
  substitute,  ///< the number that the point's option on_fault contains
  exception,   ///< the whole request is answered with exception 0x0B
};

/// Applies the options `on_bad` of the device and `on_fault` of the point. `held`: there is a
/// stored value, and the registers or the bit can hold it.
///  * A good or uncertain value is shown; without a value, the result is an exception.
///  * Faults of one channel (qualities 0x04, 0x0C and 0x10, and a disabled channel; see
///    ConcernsDevice for exceptions) never cause an exception: on_fault decides, by default `nan`
///    for floats and `hold` for all other types.
///  * on_bad decides about all other bad values. `hold` before the first value causes an exception,
///    because an invented 0 must not be taken for a reading. `nan` is for floats and texts; an
///    integer or a bit has no such value, so the result is an exception unless on_fault contains a
///    number.
Shown Show(const config::Point& point, config::OnBad on_bad, Quality quality, bool held);

/// Fills `out` (RegisterCount(point) registers). Returns false, and leaves `out` unchanged, if the
/// value does not fit the type: it is too large, not a number, or missing. Texts are cut at the
/// point's length.
bool EncodeRegisters(const config::Point& point, config::WordOrder order, const Value& value,
                     std::span<std::uint16_t> out);

/// Fills `out` with the value that stands for "no value": NaN for floats, an empty text, 0 for a
/// bool, and for integers the number that SunSpec defines: the smallest number if signed, all bits
/// set if unsigned.
void EncodeNoValue(const config::Point& point, config::WordOrder order,
                   std::span<std::uint16_t> out);

std::optional<bool> EncodeBit(const Value& value);

/// Decodes a client's registers to a value of the point's type. Returns nothing for a float that is
/// not finite, a bool other than 0 and 1, a number outside the type's range, or a wrong register
/// count.
std::optional<Value> DecodeRegisters(const config::Point& point, config::WordOrder order,
                                     std::span<const std::uint16_t> registers);

// `ConvertedWrite` is a decoded write: the new value of each point, in the unit that clients read.
// gateway/outputs/modbus/service/own_units.cpp passes them to gateway/bus/writes/write_gate.h.
struct ConvertedWrite {
  ExceptionCode exception = kNoException;
  std::vector<bus::WriteAsk::Part> parts{};  ///< empty if there is an exception
};

/// Returns the point (with `select: yes`) that the request selects for its next write. Nothing: the
/// request is not a selection. The caller must then check the written key with IsSelectKey.
std::optional<std::uint32_t> SelectedPoint(const UnitMap& unit, const ModbusRequest& request);
bool IsSelectKey(const ModbusRequest& request);

/// True if the request writes only to the two registers that contain the number of the first event
/// to show (config::kEventBlock).
bool IsFirstEvent(const ModbusRequest& request);
/// Returns the written event number; nothing: the request writes only one of the two registers.
std::optional<std::uint32_t> FirstEvent(const ModbusRequest& request);

/// Decodes a write. kIllegalAddress: an address is not mapped. kIllegalValue: only a part of a
/// value is written, or the type cannot represent the number.
ConvertedWrite ConvertWrites(const UnitMap& unit, const config::Device& device,
                             const ModbusRequest& request);

}  // namespace baudgate::modbus
