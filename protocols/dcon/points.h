// Parses the `read` and `write` texts of points: which commands the gateway may send, the form of
// their replies, and whether a command may be repeated (README.md, "Reading" and "Writing").
// Planning, decoding, the twin and Expect use the results.
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

/// The forms of replies. One command may have several: `#AAN` alone has three.
enum class Form : std::uint8_t {
  numbers,   ///< `>` and joined numbers (`#AA`)
  number,    ///< `>` and one number (`#AAN`, `$AA3`)
  words,     ///< `>` and joined hex numbers of four digits (`$AAA`)
  bits,      ///< `>` and four hex digits (`@AA`)
  status,    ///< `!`, four hex digits and 00, without address (`$AA6`, `$AALS`)
  counter,   ///< `>` or `!AA`, and eight hex digits
  decimal,   ///< `!AA` and five decimal digits; four for `$AAY`, `$AAX1`
  readback,  ///< `!AA` and one number (`$AA8N`)
  hex,       ///< `!AA` and hex digits, their number depends on the command (`~AA0`, `$AAB`)
  text,      ///< `!AA` and text (`$AAM`, `$AAF`, `$AA2`)
};

struct ReadAddress {
  enum class Select : std::uint8_t { whole, index, bit, high, low, bits };
  std::string command;  ///< "#", "#3", "$6"
  Form form = Form::number;
  Select select = Select::whole;
  unsigned index = 0;  ///< number of the value or bit; the lowest bit of `bits`
  unsigned count = 1;  ///< number of bits in `bits`
  bool total = false;  ///< for a counter: its total (totals.h) in place of its count
};

/// Accepts "#[0]", "#3", "#0 counter", "@[b3]", "$M".
Result<ReadAddress> ParseRead(std::string_view text);

/// Returns the form of the reply if no decoder word selects another. Empty: `command` is no read
/// command, or its reply form differs between modules.
std::optional<Form> DefaultForm(std::string_view command);

/// Returns the smallest and the largest number of digits in a Form::hex reply to `command`. The
/// range is exact, because two more digits would be an unexpected checksum.
std::pair<std::size_t, std::size_t> HexDigits(std::string_view command);

/// True if the command may be sent again after a failure: a read without side effects, or an
/// absolute write.
bool IsRepeatable(std::string_view command);

struct WriteAddress {
  enum class Kind : std::uint8_t { bit, hex, number, decimal, flag, action };
  std::string command;  ///< the characters before the data: "#13", "@", "#2"
  Kind kind = Kind::bit;
  /// The command writes a setting: `!AA` confirms it, and only `@DO` is repeated after a failure.
  bool setting = false;
  std::size_t digits = 2;  ///< digits of hex and decimal; for a number, digits before the point
  std::size_t decimals = 0;
  bool sign = false;  ///< the number begins with + or -
  double low = 0;     ///< accepted range of a number, low…high
  double high = 0;
};

/// Accepts "#13{bit}", "@{hex2}", "#2{+00.000 0..10}", "$C{clear}", "$50{flag}", "$X{dec4}".
Result<WriteAddress> ParseWrite(std::string_view text);

/// Returns the command with its data: "#2+07.500". Returns an error if the value does not fit.
Result<std::string> FormatWrite(const WriteAddress& write, const Value& value);

/// Reverses FormatWrite, for the twin. Nothing: `command` does not match `write`. An empty Value:
/// the command matches, but a module would refuse its data.
std::optional<Value> ParseWritten(const WriteAddress& write, std::string_view command);

config::RawNumbers NumbersOf(const ReadAddress& read, bool hex_unsigned);

/// True if `command` may change the value that `point` reads. Every write may change bits, states,
/// hex values and outputs that are read back; only $ and % commands may change counters, decimals
/// and texts.
bool Changes(std::string_view command, const config::Point& point);

Status CheckPoint(const config::Point& point);

std::span<const DecoderSpec> DecoderTable();

}  // namespace baudgate::protocols::dcon
