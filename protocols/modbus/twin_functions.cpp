// What a simulated slave answers to functions that read neither registers nor bits: counters of the
// line, files, queues, and what it says of itself.
// SPDX-License-Identifier: Apache-2.0
#include <algorithm>

#include "protocols/modbus/pdu.h"
#include "protocols/modbus/space.h"
#include "protocols/modbus/twin.h"

namespace baudgate::protocols::modbus {
namespace {

constexpr std::size_t kLongestTitle = 64;

}  // namespace

Bytes ModbusTwin::ReadOne(View pdu, Instant now) const {
  const auto asked = protocols::modbus::BlockOf(pdu);
  if (!asked) return Exception(pdu[0], kIllegalValue);
  const Space& space = asked->key;
  const bool file = space.table == Table::file;
  const bool speaks = space.table == Table::server && !device_.identity.names.empty();
  const std::size_t count = file ? asked->size() : CountOf(space);
  if (count == 0 && !speaks) return Exception(pdu[0], kIllegalFunction);
  if (file && count > kMostOfFile) return Exception(pdu[0], kIllegalValue);
  const Image image = ImageOf(space, file ? asked->begin : 0, count, now);
  const auto byte = [](std::size_t value) { return static_cast<std::uint8_t>(value & 0xFFU); };
  Bytes reply = {pdu[0]};
  switch (space.table) {
    case Table::status:
      reply.push_back(byte(image.words[0]));
      return reply;
    case Table::events:
      Append(reply, BytesOf({image.words[0], count > 1 ? image.words[1] : std::uint16_t{0}}));
      return reply;
    case Table::log:
      reply.push_back(6);
      Append(reply, BytesOf(image.words));
      return reply;
    case Table::server: {
      Bytes says;
      for (const std::uint16_t word : image.words) says.push_back(byte(word));
      says.push_back(0xFF);  // it runs
      Append(says, std::string_view(SaysOf(Table::server, 0, now)));
      reply.push_back(byte(says.size()));
      Append(reply, says);
      return reply;
    }
    case Table::queue: {
      const bool told = points_.Find(
          [&](const Place& place) { return place.space() == space && place.address == 0; });
      const std::size_t queued =
          told ? std::min<std::size_t>(image.words[0], count - 1) : count - 1;
      AppendU16(reply, 2 + 2 * queued);
      AppendU16(reply, queued);
      Append(reply, BytesOf({image.words.begin() + 1,
                             image.words.begin() + 1 + static_cast<std::ptrdiff_t>(queued)}));
      return reply;
    }
    default: {
      if (!Allows(image.there)) return Exception(pdu[0], kIllegalAddress);
      const Bytes data = BytesOf(image.words);
      reply.push_back(byte(data.size() + 2));
      reply.push_back(byte(data.size() + 1));
      reply.push_back(pdu[2]);
      Append(reply, data);
      return reply;
    }
  }
}

std::size_t ModbusTwin::CountOf(const Space& space) const {
  std::size_t count = 0;
  for (const auto& point : points_.all()) {
    if (point.read && point.read->space() == space) count = std::max(count, point.read->end());
  }
  // Words that are always sent, with a point or without.
  if (count > 0 && space.table == Table::log) count = 3;
  return count;
}

/// What the device says in an object or a server id: the point's value, else what the device is;
/// empty: it has no such object.
std::string ModbusTwin::SaysOf(Table table, std::size_t object, Instant now) const {
  const auto* const point = points_.Find([&](const Place& place) {
    return place.table == table && place.form == Form::object && place.address == object;
  });
  if (point != nullptr) return ToText(points_.Get(*point, now)).substr(0, kLongestTitle);
  const auto& names = device_.identity.names;
  const std::string title = !names.empty()          ? names.front()
                            : device_.title.empty() ? device_.name
                                                    : device_.title;
  constexpr std::size_t kProduct = 1;
  if (table == Table::server || object == kProduct) return title.substr(0, kLongestTitle);
  if (object == 0) return "baudgate";
  return object == 2 ? "1.0" : "";
}

/// All objects of a category as a stream, in several replies where one does not hold them, or one
/// by its number.
Bytes ModbusTwin::Identify(View pdu, Instant now) const {
  if (pdu.size() != 4 || pdu[1] != kIdentification) {
    return Exception(pdu[0], kIllegalFunction);
  }
  constexpr std::uint8_t kOne = 4;
  constexpr std::size_t kEnds[] = {0x03, 0x80, 0x100};  // of basic, regular, extended
  if (pdu[2] < 1 || pdu[2] > kOne) return Exception(pdu[0], kIllegalValue);
  const bool one = pdu[2] == kOne;
  std::size_t id = pdu[3];
  if (SaysOf(Table::identity, id, now).empty()) {
    if (one) return Exception(pdu[0], kIllegalAddress);
    id = 0;
  }
  const std::size_t end = one ? id + 1 : kEnds[pdu[2] - 1];
  const auto has = [&](std::size_t from, std::size_t to) {
    while (from < to && SaysOf(Table::identity, from, now).empty()) ++from;
    return from < to;
  };
  const std::uint8_t conformity = has(kEnds[1], kEnds[2])   ? 0x83
                                  : has(kEnds[0], kEnds[1]) ? 0x82
                                                            : 0x81;
  Bytes reply = {pdu[0], pdu[1], pdu[2], conformity, 0, 0, 0};
  for (; id < end; ++id) {
    const std::string text = SaysOf(Table::identity, id, now);
    if (text.empty()) continue;
    if (reply.size() + 2 + text.size() > kMaxPdu) {
      reply[4] = 0xFF;
      reply[5] = static_cast<std::uint8_t>(id);
      break;
    }
    ++reply[6];
    reply.push_back(static_cast<std::uint8_t>(id));
    reply.push_back(static_cast<std::uint8_t>(text.size()));
    Append(reply, text);
  }
  return reply;
}

}  // namespace baudgate::protocols::modbus
