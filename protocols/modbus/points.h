// The `read` and `write` grammar of points: "holding 200 uint16 CDAB". Text comes from the
// configuration; places go to planning, values and the twin.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>

#include "config/model/device.h"
#include "gateway/base/result.h"
#include "protocols/protocol.h"

namespace baudgate::protocols::modbus {

enum class Table : std::uint8_t { coils, discretes, holding, input };

/// What the registers hold.
enum class Form : std::uint8_t {
  flag,  ///< one coil or discrete input
  bit,   ///< one bit of a register
  int16,
  uint16,
  int32,
  uint32,
  int64,
  uint64,
  float32,
  float64,
  bcd16,
  bcd32,
  string,  ///< two characters a register, the first in the high byte
  text,    ///< a code, and its meaning by the device's option `texts`
};

struct Place {
  Table table = Table::holding;
  std::uint16_t address = 0;  ///< 0-based, as it stands in the PDU
  std::size_t count = 1;      ///< registers or bits
  Form form = Form::uint16;
  unsigned bit = 0;                        ///< of Form::bit, 0 = lowest
  std::size_t length = 0;                  ///< of Form::string: characters
  std::string texts;                       ///< of Form::text: the table's name
  std::optional<config::WordOrder> order;  ///< the point's own

  std::size_t end() const { return std::size_t{address} + count; }
};

/// Where the point is read. An error says what is wrong and what would be right.
Result<Place> ReadPlace(const config::Point& point);
/// Where it is written: `write`, else `read`. Its form is that of `read` where it gives none.
Result<Place> WritePlace(const config::Point& point);

bool IsBits(Table table);
bool IsWritable(Table table);
std::string_view Name(Table table);
/// The function that reads the table.
std::uint8_t ReadFunction(Table table);
/// The table that a reading function reads.
std::optional<Table> TableOf(std::uint8_t function);

/// Whether `read`, `write` and access fit together.
Status CheckPoint(const config::Point& point);

std::span<const DecoderSpec> DecoderTable();

}  // namespace baudgate::protocols::modbus
