// What a reply means for the points of a device.
// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <utility>

#include "protocols/modbus/conversation.h"
#include "protocols/modbus/pdu.h"

namespace baudgate::protocols::modbus {
namespace {

/// The quality that an exception gives to the points that were asked for.
std::optional<Quality> QualityOf(std::uint8_t exception) {
  switch (exception) {
    case kIllegalFunction:
    case kIllegalAddress:
    case kIllegalValue:
      return Quality(Quality::bad_configuration, Reason::not_fitted);
    case kDeviceFailure:
    case kParityError:
      return Quality(Quality::bad_device_failure, Reason::device_fault);
    default:
      return std::nullopt;
  }
}

}  // namespace

/// Every point that stands wholly in the reply.
void ModbusConversation::AddReadings(Exchanged& exchanged) const {
  if (!exchanged.data) return;
  const Data& data = *exchanged.data;
  for (std::size_t point = 0; point < places_.size(); ++point) {
    const auto& place = places_[point];
    if (!place || place->space() != data.space) continue;
    const bool there = place->form == Form::object ? data.texts.contains(place->address)
                                                   : data.block().Covers(BlockOf(*place));
    // Objects before the first one that was asked for came in earlier replies.
    const bool earlier = place->form == Form::object && place->address < data.address;
    if (there || (data.whole && !earlier))
      exchanged.answer.readings.push_back(ReadingOf(point, data));
  }
}

/// Without data the device has nothing there: an empty queue, an object that it does not know.
Reading ModbusConversation::ReadingOf(std::size_t point, const Data& data) const {
  const Place& place = *places_[point];
  const Quality absent = place.table == Table::queue
                             ? Quality(Quality::bad, Reason::not_ready)
                             : Quality(Quality::bad_configuration, Reason::not_fitted);
  if (place.form == Form::object) {
    const auto text = data.texts.find(place.address);
    if (text == data.texts.end()) return {point, {}, absent, {}};
    return {point, text->second, Quality::good, {}};
  }
  const Block<Space> block = BlockOf(place);
  if (!data.block().Covers(block)) return {point, {}, absent, {}};
  const auto words = std::span(data.words).subspan(block.begin - data.address, block.size());
  auto [value, quality] = DecodeBlock(place, words, settings_, device_.points[point].sentinels);
  return {point, std::move(value), quality, {}};
}

/// What the reply holds and no point asks for.
void ModbusConversation::AddLabels(Exchanged& exchanged) const {
  if (exchanged.answer.outcome != Outcome::ok || !exchanged.data) return;
  const Data& data = *exchanged.data;
  std::vector<bool> used(data.words.size(), false);
  std::vector<std::size_t> spoken;
  for (const auto& place : places_) {
    if (!place || place->space() != data.space) continue;
    if (place->form == Form::object) spoken.push_back(place->address);
    if (place->form == Form::object || !data.block().Covers(BlockOf(*place))) continue;
    const auto mark = [&](std::size_t address, std::size_t count) {
      std::fill_n(used.begin() + static_cast<std::ptrdiff_t>(address - data.address), count, true);
    };
    mark(place->address, place->count);
    if (place->scale) mark(*place->scale, 1);
  }
  const auto add = [&](std::size_t address, Value value) {
    exchanged.answer.readings.push_back(
        {kNoPoint, std::move(value), Quality::good, LabelOf(data.space, address)});
  };
  for (const auto& [object, text] : data.texts) {
    if (std::ranges::find(spoken, object) == spoken.end()) add(object, text);
  }
  for (std::size_t i = 0; i < used.size() && data.space.table != Table::server; ++i) {
    if (used[i]) continue;
    const bool bits = IsBits(data.space.table);
    add(data.address + i, bits ? Value(data.words[i] != 0) : Value(std::uint64_t{data.words[i]}));
  }
}

/// The points that a refused read was for.
void ModbusConversation::AddFaults(Exchanged& exchanged) const {
  const auto quality = QualityOf(exchanged.exception);
  const auto block = protocols::modbus::BlockOf(exchanged.request);
  if (!quality || !block) return;
  for (std::size_t point = 0; point < places_.size(); ++point) {
    const auto& place = places_[point];
    if (!place || !block->Covers(BlockOf(*place))) continue;
    exchanged.answer.readings.push_back({point, {}, *quality, {}});
  }
}

}  // namespace baudgate::protocols::modbus
