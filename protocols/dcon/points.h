// What may stand in a point's `read` and `write`: the commands that a gateway may send, the form of
// their replies, and whether they may be repeated (README.md, "Reading" and "Writing"). Text comes
// from the configuration; the results go to planning, decoding, the twin and Expect.
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

/// The reply grammars. One command may have several: `#AAN` alone has three.
enum class Form : std::uint8_t {
  numbers,   ///< `>` and joined numbers (`#AA`)
  number,    ///< `>` and one number (`#AAN`, `$AA3`)
  words,     ///< `>` and joined hex numbers of four digits (`$AAA`)
  bits,      ///< `>` and four hex digits (`@AA`)
  status,    ///< `!` and four hex digits and 00, without address (`$AA6`, `$AALS`)
  counter,   ///< `>` or `!AA`, and eight hex digits
  decimal,   ///< `!AA` and five decimal digits
  readback,  ///< `!AA` and one number (`$AA8N`)
  hex,       ///< `!AA` and as many hex digits as the command gives (`~AA0`, `$AAB`)
  text,      ///< `!AA` and text (`$AAM`, `$AAF`, `$AA2`)
};

struct ReadAddress {
  enum class Select : std::uint8_t { whole, index, bit, high, low, bits };
  std::string command;  ///< "#", "#3", "$6"
  Form form = Form::number;
  Select select = Select::whole;
  unsigned index = 0;  ///< of a number or a bit, the lowest one of `bits`
  unsigned count = 1;  ///< of `bits`
  bool total = false;  ///< of a counter: all that it has counted (totals.h)
};

/// "#[0]", "#3", "#0 counter", "@[b3]", "$M".
Result<ReadAddress> ParseRead(std::string_view text);

/// The form of a read command's reply unless a decoder word says otherwise; empty: no read
/// command.
std::optional<Form> DefaultForm(std::string_view command);

/// Least and most digits of a Form::hex reply to `command`. Exact, because two digits more would be
/// a checksum that nobody expects.
std::pair<std::size_t, std::size_t> HexDigits(std::string_view command);

/// Whether the same request may go out again after a failure: reads without side effects, and
/// writes of absolute values.
bool IsRepeatable(std::string_view command);

struct WriteAddress {
  enum class Kind : std::uint8_t { bit, hex, number, decimal, flag, action };
  std::string command;  ///< what stands before the data: "#13", "@", "#2"
  Kind kind = Kind::bit;
  /// No output: the module says `!AA` to it, and the same request is not sent twice.
  bool setting = false;
  std::size_t digits = 2;  ///< of hex and decimal; of a number those before the point
  std::size_t decimals = 0;
  bool sign = false;  ///< the number begins with + or -
  double low = 0;     ///< accepted values of a number
  double high = 0;
};

/// "#13{bit}", "@{hex2}", "#2{+00.000 0..10}", "$C{clear}", "$50{flag}", "$X{dec4}".
Result<WriteAddress> ParseWrite(std::string_view text);

/// The command with its data: "#2+07.500". An error when the value does not fit.
Result<std::string> FormatWrite(const WriteAddress& write, const Value& value);

/// The reverse, for the twin: nothing when `command` is another one. A known command with data that
/// the module would refuse gives an empty Value.
std::optional<Value> ParseWritten(const WriteAddress& write, std::string_view command);

/// What the reply can say there.
config::RawNumbers NumbersOf(const ReadAddress& read, bool hex_unsigned);

/// Whether `command` may change what the module shows at `point`. Points of bits, states, hex and
/// outputs read back may change with every write; counters, decimals and texts only with commands
/// that begin with $ or %.
bool Changes(std::string_view command, const config::Point& point);

/// Whether `read`, `write` and type fit together.
Status CheckPoint(const config::Point& point);

std::span<const DecoderSpec> DecoderTable();

}  // namespace baudgate::protocols::dcon
