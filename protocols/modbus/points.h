// The `read` and `write` grammar of points: "holding 200 uint16 CDAB". Text comes from the
// configuration; places go to planning, values and the twin. ParseNamed reads places that have a
// name.
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
  status,    ///< eight bits (07): place 0
  events,    ///< status word and counter (11): places 0 and 1
  log,       ///< status word, event counter, message counter (12): places 0, 1, 2
  server,    ///< what the device says of itself (17): its bytes
  file,      ///< records of one file (20)
  queue,     ///< a queue (24): place 0 its count, 1 the first entry
  identity,  ///< objects of one category (43/14)
};

/// Where addresses count from 0: a table, and of files and queues each one by itself.
struct Space {
  Table table = Table::holding;
  std::uint16_t which = 0;  ///< number of the file, address of the queue, category of the objects

  auto operator<=>(const Space&) const = default;
};

/// What the registers hold.
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
  object,  ///< the text of a server id or of an object
  string,  ///< two characters a register, the first in the high byte
  text,    ///< a code, and its meaning by the device's option `texts`
};

/// A large gateway has 100,000 of them: the small members stand side by side.
struct Location {
  Table table = Table::holding;
  Form form = Form::uint16;
  DateForm date = DateForm::unix;          ///< of Form::date
  std::optional<config::WordOrder> order;  ///< the point's own
  std::uint16_t which = 0;                 ///< of Space
  std::uint16_t address = 0;               ///< 0-based, as it stands in the PDU
  unsigned bit = 0;                        ///< of Form::bit and bits, 0 = lowest
  unsigned width = 1;                      ///< of Form::bits
  /// The register of the same table that holds n of "times 10 to the n", -10…10.
  std::optional<std::uint16_t> scale;
  std::size_t count = 1;   ///< registers or bits
  std::size_t length = 0;  ///< of Form::string: characters
  std::string texts{};     ///< of Form::text: the table's name

  std::size_t end() const { return std::size_t{address} + count; }
  Space space() const { return {table, which}; }
};

/// What one request has to read for the place: its registers, and that of its scale.
std::size_t BeginOf(const Location& place);
std::size_t EndOf(const Location& place);

/// Where the point is read. An error says what is wrong and what would be right.
Result<Location> ReadLocation(const config::Point& point);
/// Where it is written: `write`, else `read`. Its form is that of `read` where it gives none.
Result<Location> WriteLocation(const config::Point& point);

bool IsBits(Table table);
bool IsWritable(Table table);
/// Whether its places have addresses: coils, discrete inputs, registers and files have.
bool IsAddressed(Table table);
std::string_view Name(Table table);

/// What its registers can hold; of a float whether it is one of 32 bits.
config::RawNumbers NumbersOf(const Location& place);

/// Whether `read`, `write` and access fit together.
Status CheckPoint(const config::Point& point);

std::span<const DecoderSpec> DecoderTable();

// Places of `read` that have a name where others have a table and an address: "event counter",
// "identification product"; and bits in brackets: "[b3-b5]". Parts of the grammar of ReadLocation.

/// Function 43/14: what is read of a device's identification, and where the maker's objects begin.
enum Category : std::uint16_t { kBasic = 1, kRegular = 2, kExtended = 3 };
/// The first objects of an identification.
enum Object : std::size_t { kVendor = 0, kProduct = 1 };
inline constexpr unsigned kFirstOwnObject = 0x80;

/// "'holding 200[b16]' names no bits ...".
Error Wrong(std::string_view text, const std::string& why);

/// "[b3]" or "[b3-b5]".
Status TakeBits(std::string_view text, std::string_view inside, Location& place);

/// "exception status[b3]", "server id[2]", "identification 0x80". Empty: it is none of these.
std::optional<Result<Location>> ParseNamed(std::string_view text,
                                           std::span<const std::string_view> words);

}  // namespace baudgate::protocols::modbus
