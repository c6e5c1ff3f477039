// Which Modbus unit and address stands for which point, built once from the configuration; and how
// a value looks in 16-bit registers or in a bit, and what stands there when it cannot be trusted.
// Asked by gateway/outputs/modbus/service/own_units.cpp (ConvertWrites: what a client's registers
// mean) and register_contents.cpp before anything is written or read. The addresses are a public
// contract: config/model/modbus.h.
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

/// Where alarms are acknowledged (u32): behind the events. It cannot be read.
inline constexpr std::uint16_t kAckRegister = kEventBlock + 80;

/// The addresses of one point.
struct Span {
  std::uint16_t start = 0;
  std::uint16_t count = 0;
  std::uint32_t point = 0;  ///< index in the device's points
  bool readable = true;

  std::uint32_t end() const { return static_cast<std::uint32_t>(start) + count; }
};

enum class Area : std::uint8_t { value, quality, age, status, events, hole };

/// What a run of requested addresses is: a whole value, or any part of a mirror or block.
struct Piece {
  Area area = Area::value;
  std::uint32_t index = 0;   ///< the point; in a block its first register; of a hole 0
  std::uint16_t offset = 0;  ///< from the start of the request
  std::uint16_t count = 0;
};

struct UnitMap {
  enum class Kind : std::uint8_t { unmapped, device, gateway } kind = Kind::unmapped;
  std::uint32_t device = 0;     ///< index in the point store
  std::vector<Span> registers;  ///< sorted, without overlap
  std::vector<Span> bits;
  std::map<std::uint16_t, std::uint32_t> selects;  ///< points with `select: yes`, by address
  /// Where the values of the status block start (relative), closed by its length.
  std::vector<std::uint16_t> status_layout;

  const std::vector<Span>& spans(config::Table table) const {
    return table == config::Table::bits ? bits : registers;
  }
};

class RegisterMap {
 public:
  /// Devices are numbered as in PointStore: in the order of the file, disabled ones included.
  explicit RegisterMap(const config::Config& config);

  const UnitMap& unit(std::uint8_t id) const { return units_[unit_index_[id]]; }

 private:
  std::array<std::uint16_t, 256> unit_index_{};  ///< 0 = the unmapped unit
  std::vector<UnitMap> units_;
};

using Holes = config::Listener::Holes;

/// Divides a read into pieces, in order (`pieces` is cleared first). Any unmapped or write-only
/// address gives kIllegalAddress, else a value that the range cuts gives kIllegalValue. With
/// Holes::zero such addresses are pieces of their own, if there is another piece.
ExceptionCode PlanRead(const UnitMap& unit, config::Table table, std::uint16_t start,
                       std::uint16_t count, std::vector<Piece>& pieces, Holes holes = Holes::off);

/// The same for a write, which must cover whole points. Which of them may be written is
/// gateway/bus/writes/write_gate.h's affair.
ExceptionCode PlanWrite(const UnitMap& unit, config::Table table, std::uint16_t start,
                        std::uint16_t count, std::vector<Piece>& pieces);

/// What a client is shown in place of a value.
enum class Shown : std::uint8_t {
  held,        ///< the last good value
  no_value,    ///< EncodeNoValue
  substitute,  ///< the point's on_fault VALUE
  exception,   ///< 0x0B for the whole request
};

/// The rules of `on_bad` and `on_fault`. `held`: there is a last good value, and it fits the
/// registers.
///  * Good and uncertain values are shown.
///  * Faults of one channel (0x04, 0x0C, 0x10) never raise an exception: on_fault counts, by
///    default nan for floats and hold for all others.
///  * Everything else that is bad follows on_bad. `hold` before the first value is an exception: a
///    made-up 0 must not pass for a reading. `nan` is for floats and texts; an integer or a bit has
///    no such number, so it is an exception unless on_fault names a VALUE.
Shown Show(const config::Point& point, config::OnBad on_bad, Quality quality, bool held);

/// Fills `out` (RegisterCount(point) registers). False, with nothing written, when the value does
/// not fit the type: too large, not a number, or missing. Texts are cut at the point's length.
bool EncodeRegisters(const config::Point& point, config::WordOrder order, const Value& value,
                     std::span<std::uint16_t> out);

/// NaN for floats, an empty text, and for integers the most unlikely number of the type (as SunSpec
/// has it): the smallest of a signed one, all bits set of an unsigned one; 0 for a bool.
void EncodeNoValue(const config::Point& point, config::WordOrder order,
                   std::span<std::uint16_t> out);

/// Nothing when the value is neither a number nor a boolean.
std::optional<bool> EncodeBit(const Value& value);

/// A client's registers as a value of the point's type. Nothing for a float that is no number, a
/// bool other than 0 and 1, or a wrong register count.
std::optional<Value> DecodeRegisters(const config::Point& point, config::WordOrder order,
                                     std::span<const std::uint16_t> registers);

// What a client's registers mean: values of points, as users see them, or the
// selection of one. gateway/outputs/modbus/service/own_units.cpp takes them to
// gateway/bus/writes/write_gate.h. Pure.
struct ConvertedWrite {
  ExceptionCode exception = kNoException;
  std::vector<bus::WriteAsk::Part> parts{};  ///< empty where there is an exception
};

/// The point that the request selects; empty: it is no selection. Whether it has the key is
/// IsSelectKey.
std::optional<std::uint32_t> SelectedPoint(const UnitMap& unit, const ModbusRequest& request);
bool IsSelectKey(const ModbusRequest& request);

/// The request is for where a unit shows its events from (config::kEventBlock), and nothing else.
bool IsFirstEvent(const ModbusRequest& request);
/// Empty: it is half of it.
std::optional<std::uint32_t> FirstEvent(const ModbusRequest& request);

/// kIllegalAddress: not mapped. kIllegalValue: part of a value, or a number that the
/// type cannot hold.
ConvertedWrite ConvertWrites(const UnitMap& unit, const config::Device& device,
                             const ModbusRequest& request);

}  // namespace baudgate::modbus
