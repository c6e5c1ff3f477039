// SPDX-License-Identifier: Apache-2.0
#include "protocols/dcon/points.h"

#include <algorithm>

#include "gateway/base/decimal.h"
#include "gateway/base/text.h"

namespace baudgate::protocols::dcon {
namespace {

/// A command that is allowed in polls. In `pattern`, 'n' is any hex digit. `forms` lists the words
/// that a point can write after the command to name the form of the reply ("#0 counter"); the first
/// word is the default.
struct ReadRule {
  std::string_view pattern;
  std::string_view forms;
  bool repeatable = true;
  bool plain = true;  ///< true: the reply has the default form on every module
};

constexpr ReadRule kReads[] = {
    {"#", "value"},
    {"#n", "value counter decimal"},
    {"#nn", "value"},
    {"^", "value"},
    {"^n", "value counter decimal"},
    {"@", "bits"},
    {"@DI", "hex"},
    {"@Gn", "counter"},
    {"$2", "text"},
    {"$3", "value"},
    {"$3n", "counter"},
    // `$4` is not repeatable, because a sample is fetched once, and an analog output module stores
    // its output for power-up at this command.
    {"$4", "value status", false, false},
    {"$5n", "hex"},
    {"$6", "status mask commanded"},
    {"$6n", "commanded", false},  // not repeatable: resets a counter on counter modules
    // Not repeatable: clears the overflow flag on some modules.
    {"$7n", "power_on overflow", false, false},
    {"$8", "commanded"},
    {"$8n", "commanded"},
    {"$A", "words gate"},
    {"$B", "hex"},
    {"$F", "text"},
    {"$I", "hex"},
    {"$L0", "status"},
    {"$L1", "status"},
    {"$M", "text"},
    {"$X1", "decimal", true, false},
    {"$Y", "decimal", true, false},
    {"~0", "hex"},
    {"~2", "hex"},
    {"~4", "hex", true, false},
    {"~4n", "safe", true, false},
    {"~4P", "hex", true, false},
    {"~4S", "hex", true, false},
};

/// Commands that points must not use, because they look like reads but are not, or because only a
/// person at the module should send them.
struct Forbidden {
  std::string_view prefix;
  std::string_view why;
};

constexpr Forbidden kForbidden[] = {
    {"%", "sets address, type, baud rate or format"},
    {"#**", "is a broadcast, which no module answers"},
    {"~**", "is a broadcast, which no module answers"},
    {"~", "is a setting; only ~0, ~2 and ~4 can be read"},
    {"$0", "is a calibration command"},
    {"$1", "is a calibration command"},
    {"$9", "is a calibration or output setting"},
    {"$4", "stores an output for power-up"},
    {"$5", "clears the reset flag that it reads"},
    {"$7", "sets a type, or clears the overflow flag that it reads"},
    {"$C", "clears counters or latches"},
};

bool Matches(std::string_view pattern, std::string_view command) {
  return pattern.size() == command.size() &&
         std::equal(pattern.begin(), pattern.end(), command.begin(), [](char p, char c) {
           const bool upper_hex = HexDigit(c) && !(c >= 'a' && c <= 'f');
           return p == 'n' ? upper_hex : p == c;
         });
}

const ReadRule* FindRead(std::string_view command) {
  const auto* rule = std::find_if(std::begin(kReads), std::end(kReads),
                                  [&](const ReadRule& r) { return Matches(r.pattern, command); });
  return rule == std::end(kReads) ? nullptr : rule;
}

std::optional<Form> FormOf(std::string_view word, std::string_view command) {
  if (word == "value") return command == "#" || command == "^" ? Form::numbers : Form::number;
  if (word == "counter") return Form::counter;
  if (word == "decimal") return Form::decimal;
  if (word == "bits") return Form::bits;
  if (word == "status") return Form::status;
  if (word == "commanded" || word == "power_on" || word == "safe") return Form::readback;
  if (word == "words") return Form::words;
  if (word == "mask" || word == "hex" || word == "overflow" || word == "gate") return Form::hex;
  if (word == "text") return Form::text;
  return std::nullopt;
}

Error ReadError(std::string_view text, std::string_view what) {
  return Error{"read '" + std::string(text) + "' " + std::string(what)};
}

Error UnknownCommand(std::string_view text, std::string_view command) {
  for (const Forbidden& forbidden : kForbidden) {
    if (command.starts_with(forbidden.prefix)) {
      return ReadError(text, std::string(forbidden.why) + "; it cannot be polled");
    }
  }
  return ReadError(text,
                   "is not a command that can be polled; write a command that begins with # $ @ ~ "
                   "or ^, without address and checksum, as in \"#[0]\" or \"$6[b8]\"");
}

/// Parses the selector "b8-b9": several bits of a hex reply.
bool ParseBits(std::string_view text, ReadAddress& address) {
  const auto dash = text.find("-b");
  const auto first = ParseInteger<unsigned>(text.substr(1, dash - 1));
  const auto last = ParseInteger<unsigned>(text.substr(dash + 2));
  if (!first || !last || *first >= *last || *last > 31) return false;
  address.select = ReadAddress::Select::bits;
  address.index = *first;
  address.count = *last - *first + 1;
  return true;
}

/// Parses a selector, the text between the brackets of "[3]", "[b3]", "[b8-b9]", "[high]" or
/// "[low]".
bool ParseSelector(std::string_view text, ReadAddress& address) {
  using Select = ReadAddress::Select;
  if (text.starts_with('b') && text.find("-b") != std::string_view::npos) {
    return ParseBits(text, address);
  }
  if (text == "high" || text == "low") {
    address.select = text == "high" ? Select::high : Select::low;
    return true;
  }
  const bool bit = text.starts_with('b');
  const auto number = ParseInteger<unsigned>(text.substr(bit ? 1 : 0));
  if (!number || *number > 31) return false;
  address.select = bit ? Select::bit : Select::index;
  address.index = *number;
  return true;
}

/// Returns the error for a command that is dangerous unless a word of ReadRule::forms follows it:
/// the danger, and the word to add.
std::string NeedsWord(std::string_view command) {
  const std::string own(command);
  if (command.starts_with("$4")) {
    return "would make the module store its outputs for power-up; for the synchronised sample "
           "write "
           "\"$4 value\" or \"$4[b0] status\"";
  }
  if (command.starts_with("$7")) {
    return "clears the overflow flag of a counter module; for the flag, or for an analog output, "
           "write \"" +
           own + "[b0] overflow\", \"" + own + " power_on\"";
  }
  return "resets the counter of a counter module; for an analog output write \"" + own +
         " commanded\"";
}

bool SelectorFits(const ReadAddress& address) {
  using Select = ReadAddress::Select;
  switch (address.form) {
    case Form::numbers:
    case Form::words:
      return address.select == Select::index;
    case Form::bits:
    case Form::status:
      return address.select != Select::index && address.index + address.count <= 16;
    case Form::hex:
      return address.select == Select::whole || address.select == Select::bit ||
             address.select == Select::bits;
    case Form::text:  // a bit selects from a text only in "$2[b2]": a bit of the format byte
      return address.select == Select::whole ||
             (address.select == Select::bit && address.command == "$2" && address.index < 8);
    default:
      return address.select == Select::whole;
  }
}

constexpr DecoderSpec kDecoders[] = {
    {"#[0]", "First number of the joined reply to #AA; all points of # share one request."},
    {"#3",
     "The number in the reply to #AA3. Modules with more than 16 channels take two digits: #0A."},
    {"#0 counter",
     "Eight hex digits of a counter or frequency module; the checksum may be at either end."},
    {"#0 decimal", "Input counter of a digital module: five decimal digits after !AA."},
    {"$A[2]",
     "Third hex number in the reply to $AAA: four digits, in two's complement unless "
     "hex_unsigned."},
    {"@",
     "Digital word in the reply to @AA, four hex digits; @[b3] is one bit, @[high] and @[low] a "
     "byte."},
    {"$6",
     "Digital word in the reply to $AA6 (!, four digits and 00, no address); $6[b8] is one bit."},
    {"$L1", "Latched digital word in the reply to $AAL1 or $AAL0; $L1[b0] is one bit."},
    {"$4 value",
     "Synchronised sample: #** makes all modules take a sample, $AA4 reads that of one module."},
    {"$4[b0] status", "One bit of the synchronised sample of a digital module."},
    {"$6 mask",
     "Mask of the enabled channels of an analog module: hex after !AA; $6[b0] mask is one bit."},
    {"$80", "Present output of an analog output channel: a number after !AA."},
    {"$60 commanded", "Last commanded output. On a counter module $60 would reset the counter."},
    {"#0 total", "Total of a counter, continued over roll-overs and restarts; 64 bits."},
    {"#0 decimal total", "Total of an input counter of a digital module; 64 bits."},
    {"$70 power_on", "Output at power-up. On a counter module $70 is the overflow flag."},
    {"$50[b0]", "1: the counter is running. $70[b0] overflow: the counter has overflowed."},
    {"@DI[b8-b9]",
     "Bits 8 and 9 of the five hex digits in the reply to @AADI, as a number: the outputs."},
    {"$Y", "Watchdog time of ADAM modules in tenths of a second; ADAM-4024 has $X1 in its place."},
    {"~40",
     "Safe value of an analog output channel; ~4, ~4P, ~4S: power-up and safe values of digital "
     "outputs, in hex."},
    {"$3", "Cold junction temperature of thermocouple modules."},
    {"$B", "Sensor diagnosis as hex; $B[b0] is one bit."},
    {"~0", "Host watchdog status as hex: 4 = tripped."},
    {"$A gate", "Gate of a counter: 0 low, 1 high, 2 disabled (ADAM-4080)."},
    {"$2[b2]", "Bit 2 of the format byte: gate time of ADAM-4080, 0 = 0.1 s, 1 = 1 s."},
    {"$M", "Module name (string); $F firmware, $2 type, baud rate and format."},
};

Status CheckReadType(const config::Point& point, const ReadAddress& read) {
  const bool bit = read.select == ReadAddress::Select::bit;
  if (bit != (point.type == config::Type::boolean)) {
    return Error{bit ? "read '" + point.read + "' is one bit; write type: bool"
                     : "read '" + point.read +
                           "' is not a bit; a bool point needs a bit, as in \"$6[b0]\""};
  }
  const bool text = read.form == Form::text && !bit;
  if (text != (point.type == config::Type::string)) {
    return Error{"read '" + point.read +
                 (text ? "' gives text; write type: string(n)"
                       : "' gives a number, so the type cannot be a string")};
  }
  const bool wide = point.type == config::Type::int64 || point.type == config::Type::uint64 ||
                    point.type == config::Type::float64;
  if (read.total && !wide) {
    return Error{"read '" + point.read + "' needs more than 32 bits; write type: uint64"};
  }
  return {};
}

Status CheckWriteType(const config::Point& point, const WriteAddress& write) {
  if (point.type == config::Type::string)
    return Error{"text cannot be written to a DCON output; write a number type or bool"};
  using Kind = WriteAddress::Kind;
  const bool action = write.kind == Kind::action;
  if (action && point.access != config::Access::write) {
    return Error{"write '" + point.write +
                 "' triggers an action and has no value to read; write access: w, and read the "
                 "value with another point"};
  }
  const bool bit = write.kind == Kind::bit || write.kind == Kind::flag || action;
  if (bit != (point.type == config::Type::boolean)) {
    return Error{bit ? "write '" + point.write + "' takes a bit; write type: bool"
                     : "write '" + point.write + "' takes a number; a bool point needs {bit}"};
  }
  return {};
}

}  // namespace

Result<ReadAddress> ParseRead(std::string_view text) {
  std::string_view rest = Trim(text);
  if (rest.empty()) {
    return Error{
        "read is empty; a bare # begins a comment in YAML, so put the address in quotes: "
        "read: \"#[0]\""};
  }
  std::string_view word;
  if (const auto blank = rest.find(' '); blank != std::string_view::npos) {
    word = Trim(rest.substr(blank));
    rest = rest.substr(0, blank);
  }
  ReadAddress address;
  if (word == "total" || word.ends_with(" total")) {
    address.total = true;
    word = word == "total" ? "counter" : Trim(word.substr(0, word.size() - 6));
  }
  if (const auto open = rest.find('['); open != std::string_view::npos) {
    if (!rest.ends_with(']') ||
        !ParseSelector(rest.substr(open + 1, rest.size() - open - 2), address)) {
      return ReadError(text,
                       "does not end in a valid field: [0]...[31], [b0]...[b31], [high] or [low]");
    }
    rest = rest.substr(0, open);
  }
  const ReadRule* rule = FindRead(rest);
  if (rule == nullptr) return UnknownCommand(text, rest);
  const auto words = Split(rule->forms, ' ');
  if (word.empty()) {
    if (!rule->repeatable) {
      return ReadError(text, NeedsWord(rest));
    }
    word = words.front();
  } else if (std::find(words.begin(), words.end(), word) == words.end()) {
    return ReadError(
        text, "has no decoder '" + std::string(word) + "'; possible: " + std::string(rule->forms));
  }
  address.command = rest;
  address.form = FormOf(word, rest).value_or(Form::number);
  if (address.form == Form::numbers && address.select == ReadAddress::Select::whole) {
    return ReadError(text,
                     "needs a field; for the first number write \"" + std::string(rest) + "[0]\"");
  }
  const bool counts = address.form == Form::counter || address.form == Form::decimal;
  if (address.total && !(counts && rest.starts_with('#'))) {
    return ReadError(text, "has no total; only counter inputs have one, as in \"#0 total\"");
  }
  if (!SelectorFits(address))
    return ReadError(text,
                     "has a field that the reply does not contain; correct the number in brackets");
  return address;
}

std::optional<Form> DefaultForm(std::string_view command) {
  const ReadRule* rule = FindRead(command);
  if (rule == nullptr || !rule->plain) return std::nullopt;
  return FormOf(Split(rule->forms, ' ').front(), command);
}

std::pair<std::size_t, std::size_t> HexDigits(std::string_view command) {
  // `$AAB` returns one digit (a flag of one channel) or two (a mask of several channels).
  if (command == "$B") return {1, 2};
  if (command == "~0" || command == "$6") return {2, 2};
  if (command == "~2") return {3, 3};
  if (command == "~4") return {4, 4};
  if (command.starts_with("~4")) return {2, 4};
  if (command == "@DI") return {5, 5};
  return {1, 1};
}

namespace {

bool IsHexText(std::string_view text) {
  return !text.empty() &&
         std::all_of(text.begin(), text.end(), [](char c) { return HexDigit(c).has_value(); });
}

/// True for commands that write an absolute value, so that sending the same command again changes
/// nothing.
bool IsAbsoluteWrite(std::string_view command) {
  const std::string_view tail = command.substr(1);
  if (command.front() == '@')
    return tail.starts_with("DO") || (tail.size() <= 4 && IsHexText(tail));
  if (command.front() != '#') return false;
  if (tail.size() == 4 && IsHexText(tail)) return true;  // #AABBDD, or hex outputs #AANddd
  const auto number = tail.find_first_of("+-");
  if (number != std::string_view::npos) {
    const std::string_view channel = tail.substr(0, number);
    return channel.empty() || (channel.size() <= 2 && IsHexText(channel));
  }
  return ParseDecimal(tail).has_value() || (tail.size() == 3 && IsHexText(tail));
}

}  // namespace

bool IsRepeatable(std::string_view command) {
  if (command.empty()) return false;
  if (const ReadRule* rule = FindRead(command)) return rule->repeatable;
  return IsAbsoluteWrite(command);
}

namespace {

/// True if the output command can change what `read` shows. "#0+04.500" sets analog output 0,
/// "#000A" sets digital outputs. Neither changes another analog output ("$81"), nor values for
/// power-up ("$7N") or the watchdog ("~…").
bool IsOutputOf(std::string_view read, std::string_view command) {
  if (read.starts_with('~') || read.starts_with("$7")) return false;
  const bool analog = command.size() > 2 && (command[2] == '+' || command[2] == '-');
  const bool numbered = read.size() == 3 && (read.starts_with("$6") || read.starts_with("$8"));
  return !analog || !numbered || read[2] == command[1];
}

}  // namespace

bool Changes(std::string_view command, const config::Point& point) {
  const auto read = ParseRead(point.read);
  if (!read || FindRead(command) != nullptr) return false;
  if (command.starts_with('#') && !IsOutputOf(read->command, command)) return false;
  switch (read->form) {
    case Form::bits:
    case Form::status:
    case Form::readback:
    case Form::hex:
      return true;
    case Form::counter:
    case Form::decimal:
    case Form::text:
      return command.starts_with('$') || command.starts_with('%');
    default:
      return false;
  }
}

config::RawNumbers NumbersOf(const ReadAddress& read, bool hex_unsigned) {
  using config::RawNumbers;
  using Select = ReadAddress::Select;
  if (read.total) return RawNumbers::Bits(64);
  if (read.select == Select::bit || read.select == Select::bits)
    return RawNumbers::Bits(read.count);
  if (read.select == Select::high || read.select == Select::low) return RawNumbers::Bits(8);
  switch (read.form) {
    case Form::words:
      return RawNumbers::Bits(16, !hex_unsigned);
    case Form::bits:
    case Form::status:
      return RawNumbers::Bits(16);
    case Form::counter:
      return RawNumbers::Bits(32);
    case Form::decimal:
      return RawNumbers::Whole(0, 99'999);
    case Form::hex:
      return RawNumbers::Bits(4 * static_cast<unsigned>(HexDigits(read.command).second));
    default:
      return {};
  }
}

std::span<const DecoderSpec> DecoderTable() { return kDecoders; }

Status CheckPoint(const config::Point& point) {
  for (const std::string& text : {point.read, point.write}) {
    if (const Status status = RefuseLeadingZeros(text, "["); !status) return status;
  }
  if (point.access != config::Access::write) {
    const auto read = ParseRead(point.read);
    if (!read) return Error{read.error()};
    if (const Status status = CheckReadType(point, *read); !status) return status;
  }
  if (point.access == config::Access::read) return {};
  if (point.write.empty()) {
    return Error{
        "a writable point needs the key write, as in write: \"#13{bit}\" or \"#2{+00.000 0..10}\""};
  }
  const auto write = ParseWrite(point.write);
  if (!write) return Error{write.error()};
  return CheckWriteType(point, *write);
}

}  // namespace baudgate::protocols::dcon
