// SPDX-License-Identifier: Apache-2.0
#include "protocols/modbus/points.h"

#include <algorithm>

#include "gateway/base/text.h"
#include "protocols/modbus/codec.h"
#include "protocols/modbus/pdu.h"
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
    {"float32", Form::float32, 2}, {"float64", Form::float64, 4}, {"bcd16", Form::bcd16, 1},
    {"bcd32", Form::bcd32, 2},
};

constexpr DecoderSpec kDecoders[] = {
    {"coil 0", "one coil; 0-based address, decimal or 0x; read and written (01, 05, 15)"},
    {"discrete 5", "one discrete input (02)"},
    {"holding 200", "holding registers as the point's own type (03, written by 06 and 16)"},
    {"input 3", "input registers as the point's own type (04)"},
    {"holding 200 uint16",
     "what the registers hold where it is not the point's type: int16, uint16, int32, uint32, "
     "int64, uint64, float32, float64, bcd16, bcd32"},
    {"holding 200 float32 CDAB",
     "with the order of its bytes: ABCD, CDAB, BADC or DCBA, over the device's `order`"},
    {"holding 8[b3]", "one bit of a register, 0 = lowest; a bool, written by mask (22)"},
    {"holding 300 string(16)", "characters, two a register, the first in the high byte"},
    {"holding 500 text(NAME)", "what the code in a register means, by the option `texts`"},
};

Error Wrong(std::string_view text, const std::string& why) {
  return Error{"'" + std::string(text) + "' " + why};
}

std::optional<Table> TableNamed(std::string_view name) {
  for (const Table table : {Table::coils, Table::discretes, Table::holding, Table::input}) {
    if (name == Name(table)) return table;
  }
  return std::nullopt;
}

/// "(16)" of "string(16)".
std::optional<std::string_view> InParentheses(std::string_view word, std::string_view name) {
  if (!word.starts_with(name) || !word.substr(name.size()).starts_with('(')) return std::nullopt;
  if (!word.ends_with(')')) return std::nullopt;
  return word.substr(name.size() + 1, word.size() - name.size() - 2);
}

/// The registers of the point's own type.
void TakeType(const Point& point, Place& place) {
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

/// True when `word` names a form.
bool TakeForm(std::string_view word, Place& place) {
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
  if (const auto name = InParentheses(word, "text"); name && !name->empty()) {
    place.form = Form::text;
    place.texts = *name;
    place.count = 1;
    return true;
  }
  return false;
}

/// "8" or "8[b3]".
Status TakeAddress(std::string_view text, std::string_view word, Place& place) {
  const auto open = word.find('[');
  const auto address = ParseNumber(word.substr(0, open));
  if (!address) {
    return Wrong(text, "has no address 0...65535, decimal or as 0x1F4, behind its table");
  }
  place.address = *address;
  if (open == std::string_view::npos) return {};
  const std::string_view inside = word.substr(open);
  const bool formed = inside.starts_with("[b") && inside.ends_with(']');
  const auto bit = formed ? ParseInteger<unsigned>(inside.substr(2, inside.size() - 3))
                          : std::optional<unsigned>();
  if (!bit || *bit > 15) return Wrong(text, "names no bit; write [b0] (lowest) to [b15]");
  if (IsBits(place.table)) return Wrong(text, "is one bit already, and has no [b]");
  place.form = Form::bit;
  place.bit = *bit;
  return {};
}

/// What stands behind the address.
Status TakeWords(std::string_view text, std::span<const std::string_view> words, Place& place,
                 bool& formed) {
  for (const std::string_view word : words) {
    if (const auto order = ParseOrder(word); order && !place.order) {
      place.order = order;
      continue;
    }
    if (formed || place.order || IsBits(place.table) || place.form == Form::bit ||
        !TakeForm(word, place)) {
      return Wrong(text, "has '" + std::string(word) +
                             "' where only a form (uint16, float32, bcd16, string(16), "
                             "text(NAME) ...) and then an order (ABCD, CDAB, BADC, DCBA) may "
                             "stand");
    }
    formed = true;
  }
  if (!place.order) return {};
  if (IsBits(place.table) || place.form == Form::bit || place.form == Form::text) {
    return Wrong(text, "is one bit or one code: it has no order of bytes");
  }
  const bool swap_only = place.count == 1 || place.form == Form::string;
  if (swap_only && place.order != WordOrder::abcd && place.order != WordOrder::badc) {
    return Wrong(text, "has bytes in single registers to order: ABCD, or BADC to swap them");
  }
  return {};
}

/// `usual`: the form where `text` gives none.
Result<Place> ParsePlace(std::string_view text, const Point& point, const Place* usual) {
  std::vector<std::string_view> words;
  for (const std::string_view word : Split(Trim(text), ' ')) {
    if (!word.empty()) words.push_back(word);
  }
  const auto table = words.empty() ? std::nullopt : TableNamed(words[0]);
  if (!table) {
    return Wrong(text,
                 "names no table; write coil, discrete, holding or input and a 0-based "
                 "address, as in holding 200");
  }
  Place place;
  if (IsBits(*table)) {
    place.form = Form::flag;
  } else if (usual != nullptr && usual->form != Form::flag && usual->form != Form::bit) {
    place = *usual;
  } else {
    TakeType(point, place);
  }
  place.table = *table;
  const Status address = TakeAddress(text, words.size() > 1 ? words[1] : std::string_view(), place);
  if (!address) return Error{address.error()};
  bool formed = false;
  const auto rest = std::span(words).subspan(std::min<std::size_t>(2, words.size()));
  if (!rest.empty()) place.order.reset();
  if (const Status status = TakeWords(text, rest, place, formed); !status) {
    return Error{status.error()};
  }
  if (place.end() > 0x10000) return Wrong(text, "ends beyond address 65535");
  return place;
}

/// Whether the form gives what the point's type takes.
Status CheckType(std::string_view text, const Point& point, const Place& place) {
  const bool truth = place.form == Form::flag || place.form == Form::bit;
  const bool words = place.form == Form::string || place.form == Form::text;
  if (truth != (point.type == Type::boolean)) {
    return Wrong(text, truth ? "is one bit: its type is bool"
                             : "is no bit; a bool needs one, as in holding 8[b0] or coil 0");
  }
  if (words != (point.type == Type::string)) {
    return Wrong(text, words ? "gives text: its type is string(n)"
                             : "gives a number, and the type is text; write string(n)");
  }
  return {};
}

}  // namespace

bool IsBits(Table table) { return table == Table::coils || table == Table::discretes; }
bool IsWritable(Table table) { return table == Table::coils || table == Table::holding; }

std::string_view Name(Table table) {
  constexpr std::string_view kNames[] = {"coil", "discrete", "holding", "input"};
  return kNames[static_cast<std::size_t>(table)];
}

std::uint8_t ReadFunction(Table table) {
  constexpr std::uint8_t kFunctions[] = {kReadCoils, kReadDiscretes, kReadHolding, kReadInput};
  return kFunctions[static_cast<std::size_t>(table)];
}

std::optional<Table> TableOf(std::uint8_t function) {
  if (function < kReadCoils || function > kReadInput) return std::nullopt;
  return static_cast<Table>(function - kReadCoils);
}

Result<Place> ReadPlace(const Point& point) {
  auto place = ParsePlace(point.read, point, nullptr);
  if (!place) return Error{"read " + place.error()};
  if (const Status status = CheckType(point.read, point, *place); !status) {
    return Error{"read " + status.error()};
  }
  return place;
}

Result<Place> WritePlace(const Point& point) {
  const bool own = !point.write.empty();
  const auto read = point.read.empty() ? Result<Place>(Error{}) : ReadPlace(point);
  if (!own && !read) return read;
  auto place = own ? ParsePlace(point.write, point, read ? &*read : nullptr) : read;
  const std::string& text = own ? point.write : point.read;
  if (!place) return Error{"write " + place.error()};
  if (!IsWritable(place->table)) {
    return Error{"write " + Wrong(text,
                                  "is read-only in every device; only coil and holding can "
                                  "be written; give write: where it differs from read:")
                                .message};
  }
  if (const Status status = CheckType(text, point, *place); !status) {
    return Error{"write " + status.error()};
  }
  if (place->form == Form::text) return Error{"the meaning of a code can not be written"};
  if (place->count > kMostWrittenRegisters) {
    return Error{"write " + Wrong(text, "is longer than one request can write").message};
  }
  return place;
}

std::span<const DecoderSpec> DecoderTable() { return kDecoders; }

Status CheckPoint(const config::Point& point) {
  if (point.access != config::Access::write) {
    const auto read = ReadPlace(point);
    if (!read) return Error{read.error()};
  }
  if (point.access == config::Access::read) return {};
  const auto write = WritePlace(point);
  return write ? Status() : Status(Error{write.error()});
}

}  // namespace baudgate::protocols::modbus
