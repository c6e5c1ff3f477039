// SPDX-License-Identifier: Apache-2.0
#include "protocols/modbus/points.h"

#include <algorithm>
#include <utility>

#include "gateway/base/decimal.h"
#include "gateway/base/text.h"
#include "protocols/modbus/codec.h"
#include "protocols/modbus/settings.h"

namespace baudgate::protocols::modbus {
namespace {

using config::Point;
using config::Type;
using config::WordOrder;

struct FormRow {
  std::string_view name;
  Form form;
  std::size_t registers;
};

constexpr FormRow kForms[] = {
    {"int16", Form::int16, 1},     {"uint16", Form::uint16, 1},   {"int32", Form::int32, 2},
    {"uint32", Form::uint32, 2},   {"int64", Form::int64, 4},     {"uint64", Form::uint64, 4},
    {"float32", Form::float32, 2}, {"float64", Form::float64, 4}, {"int24", Form::int24, 2},
    {"uint24", Form::uint24, 2},   {"int48", Form::int48, 3},     {"uint48", Form::uint48, 3},
    {"bcd16", Form::bcd16, 1},     {"bcd32", Form::bcd32, 2},     {"bcd48", Form::bcd48, 3},
    {"bcd64", Form::bcd64, 4},     {"int8", Form::int8, 1},       {"uint8", Form::uint8, 1},
};

constexpr DecoderSpec kDecoders[] = {
    {"coil 0", "one coil; 0-based address, decimal or 0x; functions 01, 05 and 15"},
    {"discrete 5", "one discrete input (function 02)"},
    {"holding 200",
     "holding registers as the point's own type (function 03; written by 06 and 16)"},
    {"input 3", "input registers as the point's own type (function 04)"},
    {"holding 200 uint16",
     "the form of the registers, if it is not the point's type: int8, uint8, int16, uint16, int24, "
     "uint24, int32, uint32, int48, uint48, int64, uint64, float32, float64, bcd16, bcd32, bcd48, "
     "bcd64"},
    {"holding 200 float32 CDAB",
     "with the order of its bytes: ABCD, CDAB, BADC, DCBA or CDABGHEF, instead of the device's "
     "`order`"},
    {"holding 8[b3]",
     "one bit of a register, 0 = lowest; a bool, written by function 22 (mask write)"},
    {"holding 8[b3-b5]",
     "several bits of a register as a number, written by function 22 (mask write)"},
    {"holding 200 int16 scale(203)",
     "a number times 10 to the n, with n from register 203 of the same table"},
    {"holding 90 date(ti081)",
     "date and time as text: unix, ti081, registers, bytes or bcd (README.md)"},
    {"holding 300 string(16)", "characters, two a register, the first in the high byte"},
    {"holding 500 text(NAME)", "text for the code in a register, from the option `texts`"},
    {"file 4:1 uint16", "a record of a file: numbers of the file and the record (function 20)"},
    {"queue 1246[0]",
     "an entry of a queue, 0 = the oldest; queue 1246 count: number of entries (function 24)"},
    {"exception status", "the eight bits of function 07; exception status[b3]: one of these bits"},
    {"event counter",
     "number of completed requests (function 11); event status: FFFF while a request is being "
     "processed"},
    {"message counter", "number of messages on the line (function 12)"},
    {"server id",
     "the text in the device's reply to function 17; server id[0]: the first byte of the reply"},
    {"identification product",
     "vendor, product, revision, url, name, model, application, or an object 0x80...0xFF (function "
     "43/14)"},
};

std::optional<Table> TableNamed(std::string_view name) {
  for (const Table table :
       {Table::coils, Table::discretes, Table::holding, Table::input, Table::file, Table::queue}) {
    if (name == Name(table)) return table;
  }
  return std::nullopt;
}

/// Returns the text in the parentheses after `name`: "16" for "string(16)". Empty: `word` has
/// another form.
std::optional<std::string_view> InParentheses(std::string_view word, std::string_view name) {
  if (!word.starts_with(name) || !word.substr(name.size()).starts_with('(')) return std::nullopt;
  if (!word.ends_with(')')) return std::nullopt;
  return word.substr(name.size() + 1, word.size() - name.size() - 2);
}

void TakeType(const Point& point, Location& place) {
  if (point.type == Type::string) {
    place.form = Form::string;
    place.length = point.text_length;
    place.count = (point.text_length + 1) / 2;
    return;
  }
  for (const FormRow& row : kForms) {
    if (row.name != config::Name(point.type)) continue;
    place.form = row.form;
    place.count = row.registers;
  }
}

bool TakeForm(std::string_view word, Location& place) {
  for (const FormRow& row : kForms) {
    if (row.name != word) continue;
    place.form = row.form;
    place.count = row.registers;
    return true;
  }
  if (const auto length = InParentheses(word, "string")) {
    const auto characters = ParseInteger<std::size_t>(*length);
    if (!characters || *characters < 1 || *characters > 2 * kMostRegisters) return false;
    place.form = Form::string;
    place.length = *characters;
    place.count = (*characters + 1) / 2;
    return true;
  }
  if (const auto name = InParentheses(word, "date")) {
    const auto date = DateFormNamed(*name);
    if (!date) return false;
    place.form = Form::date;
    place.date = *date;
    place.count = RegistersOf(*date);
    return true;
  }
  if (const auto name = InParentheses(word, "text"); name && !name->empty()) {
    place.form = Form::text;
    place.texts = *name;
    place.count = 1;
    return true;
  }
  return false;
}

/// Parses the address of a location: "8" or "8[b3]"; for a file "4:8"; for a queue "1246" or
/// "1246[0]".
Status TakeAddress(std::string_view text, std::string_view word, Location& place) {
  const auto open = word.find('[');
  std::string_view number = word.substr(0, open);
  if (place.table == Table::file) {
    const auto colon = number.find(':');
    const auto file = ParseNumber(number.substr(0, colon));
    if (colon == std::string_view::npos || !file) {
      return Wrong(text, "needs the numbers of a file and of a record, as 4:1");
    }
    place.which = *file;
    number = number.substr(colon + 1);
  }
  const auto address = ParseNumber(number);
  if (!address) {
    return Wrong(text, "needs an address 0...65535 after the table, decimal or as 0x1F4");
  }
  place.address = *address;
  if (place.table == Table::queue) {
    place.which = std::exchange(place.address, std::uint16_t{0});
    if (open == std::string_view::npos) return {};
    const auto entry = ParseInteger<unsigned>(word.substr(open + 1, word.size() - open - 2));
    if (!word.ends_with(']') || !entry || *entry >= kMostQueued) {
      return Wrong(text, "needs an entry of the queue: [0] (the oldest) to [30]");
    }
    place.address = static_cast<std::uint16_t>(*entry + 1);
    return {};
  }
  if (open == std::string_view::npos) return {};
  return TakeBits(text, word.substr(open), place);
}

Status TakeScale(std::string_view text, std::string_view word, Location& place) {
  const auto address = ParseNumber(*InParentheses(word, "scale"));
  if (!address || place.scale) return Wrong(text, "needs a register address in scale(...)");
  constexpr Form kWhole[] = {Form::int8,   Form::uint8,  Form::int16,  Form::uint16, Form::int24,
                             Form::uint24, Form::int32,  Form::uint32, Form::int48,  Form::uint48,
                             Form::int64,  Form::uint64, Form::bits};
  if (IsBits(place.table) || !IsAddressed(place.table) ||
      std::ranges::find(kWhole, place.form) == std::end(kWhole)) {
    return Wrong(text,
                 "has a scale register, which only whole numbers can have: int16, uint32 ...");
  }
  place.scale = *address;
  if (EndOf(place) - BeginOf(place) > kMostRegisters) {
    return Wrong(text, "is too far from its scale register; one request must read both registers");
  }
  return {};
}

/// Parses the words after the address: form, word order and scale.
Status TakeWords(std::string_view text, std::span<const std::string_view> words, Location& place,
                 bool& formed) {
  for (const std::string_view word : words) {
    if (const auto order = ParseOrder(word); order && !place.order) {
      place.order = order;
      continue;
    }
    if (InParentheses(word, "scale")) {
      if (const Status status = TakeScale(text, word, place); !status) return status;
      continue;
    }
    const bool bits = place.form == Form::bit || place.form == Form::bits;
    if (formed || place.order || place.scale || IsBits(place.table) || bits ||
        !TakeForm(word, place)) {
      return Wrong(text,
                   "has '" + std::string(word) +
                       "' in the wrong place; write a form (uint16, float32, bcd16, string(16), "
                       "text(NAME) ...) and then an order (ABCD, CDAB, BADC, DCBA)");
    }
    formed = true;
  }
  if (!place.order) return {};
  if (IsBits(place.table) || place.form == Form::bit || place.form == Form::bits ||
      place.form == Form::text) {
    return Wrong(text, "reads bits or a code, so it cannot have a byte order; remove the order");
  }
  if (place.form == Form::date && place.date != DateForm::unix) {
    return Wrong(text,
                 "is a date in single registers, so it cannot have a byte order; remove the order");
  }
  const bool swap_only = place.count == 1 || place.form == Form::string;
  if (swap_only && place.order != WordOrder::abcd && place.order != WordOrder::badc) {
    return Wrong(text, "can have only the order ABCD, or BADC to swap the bytes of each register");
  }
  if (place.order == WordOrder::cdabghef && place.count != 4) {
    return Wrong(
        text, "does not have the four registers that CDABGHEF needs; for two registers write CDAB");
  }
  return {};
}

/// Parses a location. `usual`: the location that gives the form if `text` names no form; can be
/// null.
Result<Location> ParseLocation(std::string_view text, const Point& point, const Location* usual) {
  std::vector<std::string_view> words;
  for (const std::string_view word : Split(Trim(text), ' ')) {
    if (!word.empty()) words.push_back(word);
  }
  if (auto named = ParseNamed(text, words)) return *named;
  const auto table = words.empty() ? std::nullopt : TableNamed(words[0]);
  if (!table) {
    return Wrong(text,
                 "does not begin with a table; write coil, discrete, holding or input and a "
                 "0-based address, as in holding 200 (`baudgate protocols` lists more)");
  }
  Location place;
  if (IsBits(*table)) {
    place.form = Form::flag;
  } else if (usual != nullptr && usual->form != Form::flag && usual->form != Form::bit &&
             usual->form != Form::bits) {
    place = *usual;
    place.scale.reset();
  } else {
    TakeType(point, place);
  }
  place.table = *table;
  const Status address = TakeAddress(text, words.size() > 1 ? words[1] : std::string_view(), place);
  if (!address) return Error{address.error()};
  bool formed = false;
  auto rest = std::span(words).subspan(std::min<std::size_t>(2, words.size()));
  if (place.table == Table::queue && place.address == 0) {
    if (rest.size() != 1 || rest[0] != "count") {
      return Wrong(text, "needs an entry of the queue: [0] (the oldest) to [30], or count");
    }
    place.form = Form::uint16;
    place.count = 1;
    return place;
  }
  if (!rest.empty()) place.order.reset();
  if (const Status status = TakeWords(text, rest, place, formed); !status) {
    return Error{status.error()};
  }
  if (EndOf(place) > 0x10000) return Wrong(text, "ends beyond address 65535");
  return place;
}

Status CheckType(std::string_view text, const Point& point, const Location& place) {
  const bool truth = place.form == Form::flag || place.form == Form::bit;
  const bool words = place.form == Form::string || place.form == Form::text ||
                     place.form == Form::date || place.form == Form::object;
  if (truth != (point.type == Type::boolean)) {
    return Wrong(text,
                 truth ? "is one bit; write type: bool"
                       : "is not a bit; a bool point needs a bit, as in holding 8[b0] or coil 0");
  }
  if (words != (point.type == Type::string)) {
    return Wrong(
        text, words
                  ? "gives text; write type: string(n)"
                  : "gives a number, but the type is a string; write string(n) after the address");
  }
  if (place.form == Form::string && place.length > point.text_length) {
    return Wrong(text, "reads texts of " + std::to_string(place.length) +
                           " characters, which are too long for the point's type; write string(" +
                           std::to_string(place.length) + ")");
  }
  if (place.scale && point.type != Type::float32 && point.type != Type::float64) {
    return Wrong(text,
                 "has a scale register, which gives decimals; write type: float32 or float64");
  }
  const bool speaks = place.table == Table::server || place.table == Table::identity;
  if (speaks && point.group != config::Group::once) {
    return Wrong(text, "identifies the device and need not be polled; write group: once");
  }
  return {};
}

}  // namespace

std::size_t BeginOf(const Location& place) {
  return std::min<std::size_t>(place.address, place.scale.value_or(place.address));
}

std::size_t EndOf(const Location& place) {
  return std::max<std::size_t>(place.end(), place.scale ? *place.scale + std::size_t{1} : 0);
}

bool IsBits(Table table) { return table == Table::coils || table == Table::discretes; }
bool IsWritable(Table table) { return table == Table::coils || table == Table::holding; }
bool IsAddressed(Table table) { return table <= Table::input || table == Table::file; }

std::string_view Name(Table table) {
  constexpr std::string_view kNames[] = {
      "coil",    "discrete",  "holding", "input", "exception status", "event",
      "message", "server id", "file",    "queue", "identification"};
  return kNames[static_cast<std::size_t>(table)];
}

Result<Location> ReadLocation(const Point& point) {
  auto place = ParseLocation(point.read, point, nullptr);
  if (!place) return Error{"read " + place.error()};
  if (const Status status = CheckType(point.read, point, *place); !status) {
    return Error{"read " + status.error()};
  }
  return place;
}

Result<Location> WriteLocation(const Point& point) {
  const bool own = !point.write.empty();
  const auto read = point.read.empty() ? Result<Location>(Error{}) : ReadLocation(point);
  if (!own && !read) return read;
  auto place = own ? ParseLocation(point.write, point, read ? &*read : nullptr) : read;
  const std::string& text = own ? point.write : point.read;
  if (!place) return Error{"write " + place.error()};
  if (!IsWritable(place->table)) {
    return Error{"write " +
                 Wrong(text,
                       "is read-only in every device, because only coil and holding can be "
                       "written; if the point has another address for writing, add the key write")
                     .message};
  }
  if (const Status status = CheckType(text, point, *place); !status) {
    return Error{"write " + status.error()};
  }
  if (place->form == Form::text)
    return Error{"a text that stands for a code cannot be written; write access: r"};
  if (place->form == Form::date) return Error{"a date cannot be written; write access: r"};
  if (place->scale) {
    return Error{
        "a number with a scale register cannot be written, because the device sets the scale; add "
        "a second point without scale(...)"};
  }
  if (place->form == Form::int8 || place->form == Form::uint8) {
    return Error{
        "one byte of a register cannot be written alone; use a point for the whole register"};
  }
  if (place->form == Form::int24 || place->form == Form::uint24) {
    return Error{
        "three bytes of two registers cannot be written alone; use a point for both registers"};
  }
  if (place->count > kMostWrittenRegisters) {
    return Error{
        "write " +
        Wrong(text, "is longer than one request can write; use several shorter points").message};
  }
  return place;
}

config::RawNumbers NumbersOf(const Location& place) {
  using config::RawNumbers;
  switch (place.form) {
    case Form::flag:
    case Form::bit:
      return RawNumbers::Bits(1);
    case Form::bits:
      return RawNumbers::Bits(place.width);
    case Form::float32:
      return {RawNumbers::Kind::single, {}};
    case Form::float64:
      return {RawNumbers::Kind::real, {}};
    case Form::bcd16:
      return RawNumbers::Whole(0, 9'999);
    case Form::bcd32:
      return RawNumbers::Whole(0, 99'999'999);
    case Form::bcd48:
      return RawNumbers::Whole(0, 999'999'999'999);
    case Form::bcd64:
      return RawNumbers::Whole(0, 9'999'999'999'999'999);
    default:
      break;
  }
  for (const FormRow& row : kForms) {
    if (row.form != place.form) continue;
    const bool is_signed = row.name.starts_with("int");
    const auto bits = ParseInteger<unsigned>(row.name.substr(is_signed ? 3 : 4));
    if (bits) return RawNumbers::Bits(*bits, is_signed);
  }
  return {};
}

std::span<const DecoderSpec> DecoderTable() { return kDecoders; }

Status CheckPoint(const config::Point& point) {
  for (const std::string& text : {point.read, point.write}) {
    if (const Status status = RefuseLeadingZeros(text, " [(:-"); !status) return status;
  }
  if (point.access != config::Access::write) {
    const auto read = ReadLocation(point);
    if (!read) return Error{read.error()};
  }
  if (point.access == config::Access::read) return {};
  const auto write = WriteLocation(point);
  return write ? Status() : Status(Error{write.error()});
}

namespace {

/// A location that has two words as its name, such as "event counter", instead of a table and an
/// address.
struct NamedRow {
  std::string_view table;
  std::string_view name;
  Table where;
  std::uint16_t which;
  std::uint16_t address;
};

constexpr NamedRow kNamed[] = {
    {"exception", "status", Table::status, 0, 0},
    {"event", "status", Table::events, 0, 0},
    {"event", "counter", Table::events, 0, 1},
    {"message", "counter", Table::log, 0, 2},
    {"server", "id", Table::server, 0, 0},
    {"identification", "vendor", Table::identity, kBasic, 0},
    {"identification", "product", Table::identity, kBasic, 1},
    {"identification", "revision", Table::identity, kBasic, 2},
    {"identification", "url", Table::identity, kRegular, 3},
    {"identification", "name", Table::identity, kRegular, 4},
    {"identification", "model", Table::identity, kRegular, 5},
    {"identification", "application", Table::identity, kRegular, 6},
};

}  // namespace

Error Wrong(std::string_view text, const std::string& why) {
  return Error{"'" + std::string(text) + "' " + why};
}

Status TakeBits(std::string_view text, std::string_view inside, Location& place) {
  const bool formed = inside.starts_with("[b") && inside.ends_with(']');
  std::string_view first = formed ? inside.substr(2, inside.size() - 3) : std::string_view();
  std::string_view last = first;
  const auto dash = first.find("-b");
  if (dash != std::string_view::npos) {
    last = first.substr(dash + 2);
    first = first.substr(0, dash);
  }
  const auto from = ParseInteger<unsigned>(first);
  const auto to = ParseInteger<unsigned>(last);
  if (!from || !to || *to > 15 || *from > *to) {
    return Wrong(text, "has no valid bits; write [b0] (lowest) to [b15], or several as [b3-b5]");
  }
  if (IsBits(place.table)) return Wrong(text, "is already one bit; remove the brackets");
  place.form = dash == std::string_view::npos ? Form::bit : Form::bits;
  place.count = 1;
  place.bit = *from;
  place.width = *to - *from + 1;
  return {};
}

std::optional<Result<Location>> ParseNamed(std::string_view text,
                                           std::span<const std::string_view> words) {
  if (words.size() < 2) return std::nullopt;
  const auto open = words[1].find('[');
  const std::string_view name = words[1].substr(0, open);
  const std::string_view inside = open == std::string_view::npos ? "" : words[1].substr(open);
  const auto* const row = std::ranges::find_if(
      kNamed, [&](const NamedRow& one) { return one.table == words[0] && one.name == name; });
  Location place;
  if (row != std::end(kNamed)) {
    place.table = row->where;
    place.which = row->which;
    place.address = row->address;
  } else if (const auto object = ParseNumber(name); words[0] == "identification" && object) {
    if (*object < kFirstOwnObject || *object > 0xFF) {
      return Wrong(text, "needs an object: 0x80...0xFF, or vendor, product, revision ...");
    }
    place.table = Table::identity;
    place.which = kExtended;
    place.address = *object;
  } else {
    return std::nullopt;
  }
  if (words.size() > 2) return Wrong(text, "has too many words");
  const bool speaks = place.table == Table::server || place.table == Table::identity;
  if (speaks) place.form = Form::object;
  if (inside.empty()) return place;
  if (place.table == Table::status) {
    if (const Status status = TakeBits(text, inside, place); !status) return Error{status.error()};
    if (place.bit + place.width > 8) return Wrong(text, "has eight bits, [b0] to [b7]");
    return place;
  }
  const auto byte = ParseInteger<std::uint8_t>(inside.substr(1, inside.size() - 2));
  if (place.table != Table::server || !inside.ends_with(']') || !byte) {
    return Wrong(text, "has no valid part in brackets");
  }
  place.form = Form::uint16;
  place.address = *byte;
  return place;
}

}  // namespace baudgate::protocols::modbus
