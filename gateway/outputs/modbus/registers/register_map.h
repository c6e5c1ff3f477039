// Which Modbus unit and address stands for which point: built once from the configuration.
// Asked by gateway/outputs/modbus/service/own_units.cpp and value_registers.cpp before anything
// is read or written. The addresses are a public contract: config/model/modbus.h.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <vector>

#include "config/model/config.h"
#include "config/model/modbus.h"
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

}  // namespace baudgate::modbus
