// Parses the `read` and `write` texts of points: which commands the gateway may send, the form of
// their replies, and whether a command may be repeated (protocols/dcon/README.md, "Reading" and
// "Writing").
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>

#include "config/model/point.h"
#include "gateway/base/result.h"
#include "gateway/base/value.h"
#include "protocols/protocol.h"

namespace baudgate::protocols::dcon {

/// The forms of replies. One command can have several forms: `#AAN` alone has three.
enum class Form : std::uint8_t {
  numbers,   ///< `>` and joined numbers (`#AA`)
  number,    ///< `>` and one number (`#AAN`, `$AA3`)
  words,     ///< `>` and joined hex numbers of four digits (`$AAA`)
  bits,      ///< `>` and four hex digits of a digital word (`@AA`)
  status,    ///< `!`, four hex digits and 00, without an address (`$AA6`, `$AALS`)
  counter,   ///< `>` or `!AA`, then eight hex digits
  decimal,   ///< `!AA` and five decimal digits; four for `$AAY`, `$AAX1`
  readback,  ///< `!AA` and one number (`$AA8N`)
  hex,       ///< `!AA` and hex digits; the command defines how many (`~AA0`, `$AAB`)
  text,      ///< `!AA` and text (`$AAM`, `$AAF`, `$AA2`)
};

struct ReadAddress {
  enum class Select : std::uint8_t { whole, index, bit, high, low, bits };
  std::string command;  ///< command without address: "#", "#3", "$6"
  Form form = Form::number;
  Select select = Select::whole;
  unsigned index = 0;  ///< number of the selected value or bit; for Select::bits the lowest bit
  unsigned count = 1;  ///< number of bits for Select::bits
  /// True: the point reads the total of a counter (Totals), not its count.
  bool total = false;
};

/// Parses the `read` text of a point: "#[0]", "#3", "#0 counter", "@[b3]", "$M".
Result<ReadAddress> ParseRead(std::string_view text);

/// Returns the form of the reply to `command` if the point names none ("#0", not "#0 counter").
/// Empty: `command` is not a read command, or the form differs between modules.
std::optional<Form> DefaultForm(std::string_view command);

/// Returns the smallest and the largest number of digits in a reply of Form::hex to `command`.
/// Replies with more digits are rejected, because two more digits would be an unexpected checksum.
std::pair<std::size_t, std::size_t> HexDigits(std::string_view command);

/// True if the command is allowed to be sent again after a failure: a read without side effects, or
/// a write of an absolute value.
bool IsRepeatable(std::string_view command);

struct WriteAddress {
  enum class Kind : std::uint8_t { bit, hex, number, decimal, flag, action };
  std::string command;  ///< the characters of the command before the data: "#13", "@", "#2"
  Kind kind = Kind::bit;
  /// True: the command writes a setting, not an output. `!AA` confirms it, and only `@DO` is
  /// repeated after a failure.
  bool setting = false;
  /// Number of digits for hex and decimal; for a number, the digits before the point.
  std::size_t digits = 2;
  std::size_t decimals = 0;
  bool sign = false;  ///< true: the number begins with + or -
  double low = 0;     ///< accepted range of a number: `low` to `high`
  double high = 0;
};

/// Parses the `write` text of a point: "#13{bit}", "@{hex2}", "#2{+00.000 0..10}", "$C{clear}",
/// "$50{flag}", "$X{dec4}".
Result<WriteAddress> ParseWrite(std::string_view text);

/// Returns the command with its data, such as "#2+07.500", or an error if the value does not fit.
Result<std::string> FormatWrite(const WriteAddress& write, const Value& value);

/// Parses a command that FormatWrite has made, for the simulated device. Empty: `command` does not
/// match `write`. An empty Value: the command matches, but a module would refuse its data.
std::optional<Value> ParseWritten(const WriteAddress& write, std::string_view command);

config::RawNumbers NumbersOf(const ReadAddress& read, bool hex_unsigned);

/// True if `command` can change the value that `point` reads. Read commands change nothing. An
/// output command changes only its own outputs (IsOutputOf). Only $ and % commands
/// change counters, decimals and texts. No command changes measured numbers.
bool Changes(std::string_view command, const config::Point& point);

Status CheckPoint(const config::Point& point);

std::span<const DecoderSpec> DecoderTable();

}  // namespace baudgate::protocols::dcon
