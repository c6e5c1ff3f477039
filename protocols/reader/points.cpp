// SPDX-License-Identifier: Apache-2.0
#include "protocols/reader/points.h"

#include <algorithm>
#include <array>
#include <string>

#include "gateway/base/leading_zero.h"
#include "gateway/base/text.h"
#include "protocols/reader/codec.h"
#include "protocols/reader/settings.h"

namespace baudgate::protocols::reader {
namespace {

constexpr DecoderSpec kDecoders[] = {
    {"tag",
     "the last tag, ten hex digits, or the last text; tag@3: the one three before it, up to 15"},
    {"high, middle, low", "the 48 bits of a tag, 16 each; high@3"},
    {"counter", "number of the tag; each new one has one more; counter@3"},
    {"time", "when it came, in seconds since 1970 UTC; time@3"},
    {"present", "whether a tag is there: one came within `present`, and no 'no tag' since"},
    {"repeats", "how often the same tag came again within `same_tag`"},
    {"message", "the latest message, new or not"},
    {"number", "the one number in it; number 4-11: the one in its characters 4 to 11"},
    {"identity", "the name that the reader tells; commands: ask"}};
// In the order of Item::Kind.
constexpr std::array<std::string_view, 11> kNames = {"tag",     "high",   "middle",  "low",
                                                     "counter", "time",   "present", "repeats",
                                                     "message", "number", "identity"};

}  // namespace

Result<Item> ParseItem(const config::Point& point) {
  const Error error{"read '" + point.read +
                    "' is not known: 'baudgate protocols reader' lists what is"};
  const std::string_view read = point.read;
  const std::size_t end = std::min(read.find_first_of("@ "), read.size());
  const auto* const name = std::ranges::find(kNames, read.substr(0, end));
  if (name == kNames.end()) return error;
  Item item{.kind = static_cast<Item::Kind>(name - kNames.begin())};
  if (end == read.size()) return item;
  const std::string_view rest = read.substr(end + 1);
  if (read[end] == '@') {
    const auto back = ParseInteger<std::size_t>(rest);
    if (!back || *back >= kRing || !item.of_tag()) return error;
    item.back = *back;
    return item;
  }
  const auto parts = Split(rest, '-');
  if (item.kind != Item::Kind::number || parts.size() != 2) return error;
  item.first = ParseInteger<std::size_t>(parts[0]).value_or(0);
  item.last = ParseInteger<std::size_t>(parts[1]).value_or(0);
  if (item.first < 1 || item.last < item.first || item.last > 120) return error;
  return item;
}

Status CheckPoint(const config::Point& point) {
  for (const std::string& text : {point.read, point.write}) {
    if (const Status status = RefuseLeadingZeros(text, "@ -"); !status) return status;
  }
  using Kind = Item::Kind;
  const auto item = ParseItem(point);
  if (!item) return Error{item.error()};
  if (point.access != config::Access::read) return Error{"a reader takes no writes"};
  const bool text =
      item->kind == Kind::tag || item->kind == Kind::message || item->kind == Kind::identity;
  const bool flag = item->kind == Kind::present;
  if (text != (point.type == config::Type::string)) {
    return Error{text ? "it is a text: give it type: string(20)"
                      : "it is no text: give it a number type"};
  }
  if (flag != (point.type == config::Type::boolean)) {
    return Error{flag ? "it is true or false: give it type: bool"
                      : "it is a number, not type bool"};
  }
  return {};
}

Status CheckDevice(const config::Device& device) {
  if (Status status = CheckOptions(device.options); !status) return status;
  const Settings settings = ReadSettings(device.options);
  for (const config::Point& point : device.points) {
    const auto item = ParseItem(point);
    if (!item) continue;
    const std::string its = "point '" + point.name + "': '" + point.read + "' needs ";
    const bool bits = item->kind >= Item::Kind::high && item->kind <= Item::Kind::low;
    if (bits && settings.form != Form::tag) {
      return Error{its + "form: tag; a text has no such number"};
    }
    if (item->kind == Item::Kind::identity && !settings.asks) return Error{its + "commands: ask"};
    const bool whole = item->kind == Item::Kind::tag || item->kind == Item::Kind::message;
    const std::size_t length = settings.form == Form::tag ? kTagDigits : settings.length;
    if (whole && length > point.text_length) {
      return Error{its + "type: string(" + std::to_string(length) +
                   "): a text that is longer than its point is not good"};
    }
  }
  for (const config::Record& record : device.records) {
    if (!settings.asks)
      return Error{"record '" + record.name + "' is read, which needs commands: ask"};
    for (const std::uint32_t index : record.points) {
      const auto item = ParseItem(device.points[index]);
      if (!item || item->of_message()) continue;
      return Error{"record '" + record.name + "': '" + device.points[index].read +
                   "' is not renewed by reading; present, repeats, message and number are"};
    }
  }
  return {};
}

std::span<const DecoderSpec> DecoderTable() { return kDecoders; }

}  // namespace baudgate::protocols::reader
