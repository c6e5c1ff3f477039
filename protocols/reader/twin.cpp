// SPDX-License-Identifier: Apache-2.0
#include "protocols/reader/twin.h"

#include <fmt/format.h>

#include "gateway/base/text.h"

namespace baudgate::protocols::reader {
namespace {

constexpr std::size_t kMostWaiting = 100;
constexpr std::uint64_t kFirstTag = 0x06001259E3;

}  // namespace

ReaderTwin::ReaderTwin(const config::Device& device, TwinValues& values)
    : settings_(ReadSettings(device.options)), points_(device, values, ParseItem, ParseItem) {}

/// Lets the reader send a tag: the text of the event if it is a number, else 06001259E3 plus the
/// number of earlier events. A scale, a text reader with a point `number`, sends the value of this
/// point instead.
bool ReaderTwin::Raise(const DeviceEvent& event, Now now) {
  if (queue_.size() >= kMostWaiting) return false;
  const auto said = ParseInteger<std::uint64_t>(event.text);
  const std::uint64_t tag = said.value_or(kFirstTag + raised_);
  ++raised_;
  if (settings_.form == Form::tag) {
    queue_.push_back(EncodeTag(fmt::format("{:010X}", tag & 0xFF'FFFF'FFFFU)));
    return true;
  }
  std::string text = fmt::format("{:013}", tag);
  const auto is_number = [](const Item& item) { return item.kind == Item::Kind::number; };
  if (const auto* point = points_.Find(is_number)) {
    text = fmt::format("ST,GS,{:+9.2f}kg", ToDouble(points_.Get(*point, now.instant)));
  }
  if (settings_.length > 0) text.resize(settings_.length, ' ');
  queue_.push_back(EncodeText(text, settings_));
  return true;
}

Bytes ReaderTwin::Answer(View request, Instant) {
  if (!settings_.asks) return {};
  const auto is = [request](Command command) {
    return AsText(request) == AsText(EncodeCommand(command));
  };
  if (is(Command::read)) return there_;
  return is(Command::information) ? ToBytes("\r\nMOD-RFID125-BOX\r\n>") : Bytes();
}

Bytes ReaderTwin::Say(Instant) {
  if (queue_.empty()) return {};
  Bytes message = std::move(queue_.front());
  there_ = message;
  queue_.pop_front();
  return message;
}

}  // namespace baudgate::protocols::reader
