// Parses the `read` and `write` texts of points, such as "holding 200 uint16 CDAB", into locations.
// ParseNamed parses the locations that have a name.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <compare>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>

#include "config/model/device.h"
#include "gateway/base/result.h"
#include "protocols/modbus/dates.h"
#include "protocols/protocol.h"

namespace baudgate::protocols::modbus {

enum class Table : std::uint8_t {
  coils,
  discretes,
  holding,
  input,
  status,  ///< the exception status (function 07): eight bits at address 0
  events,  ///< the event counter (function 11): status word and counter at addresses 0 and 1
  /// The event log (function 12): status word, event counter, message counter at addresses 0, 1, 2.
  log,
  server,  ///< the server id (function 17), one byte at each address
  file,
  queue,     ///< a queue (function 24): the count at address 0, the first entry at 1
  identity,  ///< texts (objects) of the device identification (function 43/14), of one category
};

/// An area of a slave with its own addresses from 0 on: a table, one file, or one queue.
struct Space {
  Table table = Table::holding;
  /// Number of the file, address of the queue, or category of the objects; 0 for other tables.
  std::uint16_t which = 0;

  auto operator<=>(const Space&) const = default;
};

enum class Form : std::uint8_t {
  flag,  ///< one coil or discrete input
  bit,
  bits,  ///< several bits of a register, read as one number
  int16,
  uint16,
  int32,
  uint32,
  int64,
  uint64,
  float32,
  float64,
  int8,  ///< as uint8 the lower byte of a register
  uint8,
  int24,  ///< as uint24 the lower three bytes of two registers
  uint24,
  int48,
  uint48,
  bcd16,
  bcd32,
  bcd48,
  bcd64,
  date,
  object,  ///< a text: the server id, or an identification object
  string,  ///< two characters per register, the first in the high byte
  text,    ///< the code in a register, shown as its text in the option `texts`
};

/// The location of a point. A large gateway has 100,000 locations, so small members are together,
/// which saves padding.
struct Location {
  Table table = Table::holding;
  Form form = Form::uint16;
  DateForm date = DateForm::unix;
  /// Word order of this point; empty: the order of the device.
  std::optional<config::WordOrder> order;
  std::uint16_t which = 0;
  std::uint16_t address = 0;  ///< 0-based, as in the PDU
  unsigned bit = 0;           ///< the lowest bit, 0…15, for Form::bit and Form::bits
  unsigned width = 1;         ///< number of bits in Form::bits
  /// Address of the scale register in the same table. The value is multiplied by 10 to the power n,
  /// where n is the content of the scale register (-10…10). Empty: there is no scale register.
  std::optional<std::uint16_t> scale;
  std::size_t count = 1;   ///< number of registers or bits
  std::size_t length = 0;  ///< number of characters in Form::string
  std::string texts{};

  std::size_t end() const { return std::size_t{address} + count; }
  Space space() const { return {table, which}; }
};

/// BeginOf and EndOf (exclusive) give the range that one request must read for the location: its
/// registers and its scale register.
std::size_t BeginOf(const Location& place);
std::size_t EndOf(const Location& place);

/// Returns the location in `read`. The error names the fault and a correct form.
Result<Location> ReadLocation(const config::Point& point);
/// Returns where the point is written: the location in `write`, or the location in `read` if
/// `write` is empty. If `write` names no form, the form of `read` applies.
Result<Location> WriteLocation(const config::Point& point);

bool IsBits(Table table);
bool IsWritable(Table table);
/// True if locations in the table have addresses, as coils, discrete inputs, registers and files
/// do.
bool IsAddressed(Table table);
std::string_view Name(Table table);

config::RawNumbers NumbersOf(const Location& place);

Status CheckPoint(const config::Point& point);

std::span<const DecoderSpec> DecoderTable();

/// Categories of the texts (objects) that function 43/14 reads. The objects that makers define
/// begin at 0x80 (kFirstOwnObject).
enum Category : std::uint16_t { kBasic = 1, kRegular = 2, kExtended = 3 };
enum Object : std::size_t { kVendor = 0, kProduct = 1 };
inline constexpr unsigned kFirstOwnObject = 0x80;

Error Wrong(std::string_view text, const std::string& why);

/// Parses a selector of bits: "[b3]" or "[b3-b5]".
Status TakeBits(std::string_view text, std::string_view inside, Location& place);

/// Parses a location with a name: "exception status[b3]", "server id[2]", "identification 0x80".
/// Empty: the words are not such a name.
std::optional<Result<Location>> ParseNamed(std::string_view text,
                                           std::span<const std::string_view> words);

}  // namespace baudgate::protocols::modbus
