// `RegisterMap` maps a Modbus unit and address to a point. It is built from the configuration. The
// functions below encode values in 16-bit registers or bits, choose the replacement of a bad value,
// and decode written registers (ConvertWrites). gateway/outputs/modbus/service/own_units.cpp and
// register_contents.cpp use them. The addresses are a public contract: config/model/modbus.h.
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

/// The register to which a client writes to acknowledge alarms (u32), behind the event block. It
/// cannot be read.
inline constexpr std::uint16_t kAckRegister = kEventBlock + 80;

struct Span {
  std::uint16_t start = 0;
  std::uint16_t count = 0;
  std::uint32_t point = 0;
  bool readable = true;

  std::uint32_t end() const { return static_cast<std::uint32_t>(start) + count; }
};

enum class Area : std::uint8_t { value, quality, age, status, events, hole };

/// A range of requested addresses: a whole value, or any part of a quality or age mirror or of a
/// block.
struct Piece {
  Area area = Area::value;
  std::uint32_t index = 0;   ///< index of the point; in a block, its first register; in a hole, 0
  std::uint16_t offset = 0;  ///< distance from the first address of the request
  std::uint16_t count = 0;
};

struct UnitMap {
  enum class Kind : std::uint8_t { unmapped, device, gateway } kind = Kind::unmapped;
  std::uint32_t device = 0;     ///< index in the point store
  std::vector<Span> registers;  ///< mapped registers, sorted, without overlap
  std::vector<Span> bits;
  /// Points with `select: yes`, by the address of their selection.
  std::map<std::uint16_t, std::uint32_t> selects;
  /// The offset of each field of the status block; the last entry is the block's length.
  std::vector<std::uint16_t> status_layout;

  const std::vector<Span>& spans(config::Table table) const {
    return table == config::Table::bits ? bits : registers;
  }
};

class RegisterMap {
 public:
  /// The indices of devices are those of PointStore: in the order of the file, including disabled
  /// devices.
  explicit RegisterMap(const config::Config& config);

  const UnitMap& unit(std::uint8_t id) const { return units_[unit_index_[id]]; }

 private:
  /// Index in units_ of each unit; 0: the unit is not mapped.
  std::array<std::uint16_t, 256> unit_index_{};
  std::vector<UnitMap> units_;
};

using Holes = config::Listener::Holes;

/// Divides a read into pieces in ascending order; `pieces` is cleared first. Returns
/// kIllegalAddress if an address is unmapped or write-only, else kIllegalValue if the range
/// contains only a part of a value. With Holes::zero, unmapped and write-only addresses become
/// pieces of area `hole`, unless the range contains nothing else.
ExceptionCode PlanRead(const UnitMap& unit, config::Table table, std::uint16_t start,
                       std::uint16_t count, std::vector<Piece>& pieces, Holes holes = Holes::off);

/// Divides a write into pieces as PlanRead does; a write must cover whole points.
/// gateway/bus/writes/write_gate.h decides which points clients are allowed to write.
ExceptionCode PlanWrite(const UnitMap& unit, config::Table table, std::uint16_t start,
                        std::uint16_t count, std::vector<Piece>& pieces);

/// The registers or the exception that a client gets in place of a value.
enum class Shown : std::uint8_t {
  held,  ///< the present value while it is good or uncertain, else the last good value
  no_value,
  substitute,  ///< the VALUE of the point's on_fault
  exception,   ///< the whole request is answered with exception 0x0B
};

/// Applies `on_bad` and `on_fault`. `held`: there is a last good value, and it fits the registers.
///  * Good and uncertain values are shown.
///  * Faults of one channel (0x04, 0x0C, 0x10) never cause an exception: on_fault decides, by
///    default nan for floats and hold for all other types.
///  * on_bad decides about all other bad values. `hold` before the first value causes an exception,
///    because an invented 0 must not be taken for a reading. `nan` is for floats and texts; an
///    integer or a bit has no such value, so the result is an exception unless on_fault is a VALUE.
Shown Show(const config::Point& point, config::OnBad on_bad, Quality quality, bool held);

/// Fills `out` (RegisterCount(point) registers). False, and `out` is unchanged, if the value does
/// not fit the type: it is too large, not a number, or missing. Texts are cut at the point's
/// length.
bool EncodeRegisters(const config::Point& point, config::WordOrder order, const Value& value,
                     std::span<std::uint16_t> out);

/// Fills `out` with the value that stands for "no value": NaN for floats, an empty text, 0 for a
/// bool, and for integers the number that SunSpec defines: the smallest number if signed, all bits
/// set if unsigned.
void EncodeNoValue(const config::Point& point, config::WordOrder order,
                   std::span<std::uint16_t> out);

std::optional<bool> EncodeBit(const Value& value);

/// Decodes a client's registers to a value of the point's type. Returns nothing for a float that is
/// not finite, a bool other than 0 and 1, or a wrong register count.
std::optional<Value> DecodeRegisters(const config::Point& point, config::WordOrder order,
                                     std::span<const std::uint16_t> registers);

// ConvertedWrite is a decoded write: values of points, in the units that users see.
// gateway/outputs/modbus/service/own_units.cpp passes them to gateway/bus/writes/write_gate.h.
struct ConvertedWrite {
  ExceptionCode exception = kNoException;
  std::vector<bus::WriteAsk::Part> parts{};  ///< empty if there is an exception
};

/// Returns the point that the request selects (`select: yes`); nothing: the request is not a
/// selection. IsSelectKey then checks the value that is written.
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
