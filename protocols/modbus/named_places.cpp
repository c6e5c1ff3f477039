// SPDX-License-Identifier: Apache-2.0
#include "protocols/modbus/named_places.h"

#include <algorithm>

#include "gateway/base/text.h"
#include "protocols/modbus/codec.h"

namespace baudgate::protocols::modbus {
namespace {

/// Categories of identification: basic and regular objects, and the maker's own.

/// What has two words in place of a table and an address.
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

Status TakeBits(std::string_view text, std::string_view inside, Place& place) {
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
    return Wrong(text, "names no bits; write [b0] (lowest) to [b15], or several as [b3-b5]");
  }
  if (IsBits(place.table)) return Wrong(text, "is one bit already, and has no [b]");
  place.form = dash == std::string_view::npos ? Form::bit : Form::bits;
  place.count = 1;
  place.bit = *from;
  place.width = *to - *from + 1;
  return {};
}

std::optional<Result<Place>> ParseNamed(std::string_view text,
                                        std::span<const std::string_view> words) {
  if (words.size() < 2) return std::nullopt;
  const auto open = words[1].find('[');
  const std::string_view name = words[1].substr(0, open);
  const std::string_view inside = open == std::string_view::npos ? "" : words[1].substr(open);
  const auto* const row = std::ranges::find_if(
      kNamed, [&](const NamedRow& one) { return one.table == words[0] && one.name == name; });
  Place place;
  if (row != std::end(kNamed)) {
    place.table = row->where;
    place.which = row->which;
    place.address = row->address;
  } else if (const auto object = ParseNumber(name); words[0] == "identification" && object) {
    if (*object < kFirstOwnObject || *object > 0xFF) {
      return Wrong(text, "names no object 0x80...0xFF, nor vendor, product, revision ...");
    }
    place.table = Table::identity;
    place.which = kExtended;
    place.address = *object;
  } else {
    return std::nullopt;
  }
  if (words.size() > 2) return Wrong(text, "has more behind it than it can have");
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
    return Wrong(text, "has no part in brackets");
  }
  place.form = Form::uint16;
  place.address = *byte;
  return place;
}

}  // namespace baudgate::protocols::modbus
