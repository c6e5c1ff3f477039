// Parses the `read` and `write` texts of points, such as "holding 200 uint16 CDAB", into locations.
// ParseNamed parses the places that have a name.
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
  status,    ///< eight bits (07) at address 0
  events,    ///< status word and counter (11) at addresses 0 and 1
  log,       ///< status word, event counter, message counter (12) at addresses 0, 1, 2
  server,    ///< server id (17), its bytes
  file,      ///< records of one file (20)
  queue,     ///< a queue (24): the count at address 0, the first entry at 1
  identity,  ///< objects of one category (43/14)
};

/// An area in which addresses count from 0: a table, or one file or queue.
struct Space {
  Table table = Table::holding;
  std::uint16_t which = 0;  ///< number of the file, address of the queue, category of the objects

  auto operator<=>(const Space&) const = default;
};

enum class Form : std::uint8_t {
  flag,  ///< one coil or discrete input
  bit,   ///< one bit of a register
  bits,  ///< several bits of a register, as a number
  int16,
  uint16,
  int32,
  uint32,
  int64,
  uint64,
  float32,
  float64,
  int8,  ///< the lower byte of a register
  uint8,
  int24,  ///< the lower three bytes of two registers
  uint24,
  int48,
  uint48,
  bcd16,
  bcd32,
  bcd48,
  bcd64,
  date,
  object,  ///< the text of a server id or of an identification object
  string,  ///< two characters per register, the first in the high byte
  text,    ///< a code, shown as its text in the option `texts`
};

/// The place of a point. A large gateway has 100,000 places, so small members are grouped.
struct Location {
  Table table = Table::holding;
  Form form = Form::uint16;
  DateForm date = DateForm::unix;          ///< used with Form::date
  std::optional<config::WordOrder> order;  ///< set if the point has its own order
  std::uint16_t which = 0;                 ///< see Space
  std::uint16_t address = 0;               ///< 0-based, as in the PDU
  unsigned bit = 0;                        ///< lowest bit of Form::bit and bits, 0…15
  unsigned width = 1;                      ///< number of bits of Form::bits
  /// Address of the scale register in the same table: its n multiplies the value by 10 to the n
  /// (-10…10).
  std::optional<std::uint16_t> scale;
  std::size_t count = 1;   ///< number of registers or bits
  std::size_t length = 0;  ///< number of characters of Form::string
  std::string texts{};     ///< name of the text table of Form::text

  std::size_t end() const { return std::size_t{address} + count; }
  Space space() const { return {table, which}; }
};

/// The range that one request must read for the place: its registers and the scale register.
std::size_t BeginOf(const Location& place);
std::size_t EndOf(const Location& place);

/// Returns where the point is read. The error says what is wrong and what would be correct.
Result<Location> ReadLocation(const config::Point& point);
/// Returns where the point is written: by `write`, else `read`. A missing form is that of `read`.
Result<Location> WriteLocation(const config::Point& point);

bool IsBits(Table table);
bool IsWritable(Table table);
/// True if places in the table have addresses: coils, discrete inputs, registers and files.
bool IsAddressed(Table table);
std::string_view Name(Table table);

config::RawNumbers NumbersOf(const Location& place);

Status CheckPoint(const config::Point& point);

std::span<const DecoderSpec> DecoderTable();

// Places of `read` with a name in place of a table and an address ("event counter", "identification
// product"), and bits in brackets ("[b3-b5]").

/// Function 43/14: categories of identification objects. The maker's objects begin at 0x80.
enum Category : std::uint16_t { kBasic = 1, kRegular = 2, kExtended = 3 };
/// The first two objects of an identification.
enum Object : std::size_t { kVendor = 0, kProduct = 1 };
inline constexpr unsigned kFirstOwnObject = 0x80;

Error Wrong(std::string_view text, const std::string& why);

/// Parses "[b3]" or "[b3-b5]".
Status TakeBits(std::string_view text, std::string_view inside, Location& place);

/// Parses "exception status[b3]", "server id[2]", "identification 0x80". Empty: none of these.
std::optional<Result<Location>> ParseNamed(std::string_view text,
                                           std::span<const std::string_view> words);

}  // namespace baudgate::protocols::modbus
