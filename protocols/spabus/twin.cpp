// SPDX-License-Identifier: Apache-2.0
#include "protocols/spabus/twin.h"

#include <fmt/format.h>

#include <algorithm>

#include "gateway/base/text.h"
#include "protocols/spabus/clock.h"
#include "protocols/spabus/events.h"
#include "protocols/spabus/points.h"
#include "protocols/spabus/reply.h"
#include "protocols/spabus/settings.h"

namespace baudgate::protocols::spabus {
namespace {

constexpr int kDamaged = 0;
constexpr int kMissing = 6;
constexpr int kBadValue = 8;
/// The simulated device refuses requests for more items than this.
constexpr std::size_t kMostItems = 500;

constexpr std::size_t kRegister = 65;
constexpr std::size_t kEventsOfReply = 5;
constexpr int kStatusOverflow = 2;
constexpr Address kModuleStatus{0, 'C', std::nullopt};
constexpr Address kOwnClock{0, 'T', std::nullopt};

/// Returns the one checksum variant that the simulated device uses.
int OwnReading(const Settings& settings) {
  const int bits = ChecksumBits(settings);
  const int chosen = bits & kCoversAny;
  return (chosen == kCoversAny ? kCoversAll : chosen) | (bits & kLineFeedCovered);
}

std::size_t DecimalsOf(std::string_view text) {
  const std::size_t point = text.find('.');
  return point == std::string_view::npos ? 0 : text.size() - point - 1;
}

/// True if `text` has no more decimals than the point allows, and its value `decoded` is good and
/// fits the type of the point.
bool Fits(const std::string& text, const Decoded& decoded, const config::Point& point) {
  const auto& decimals = point.writing.decimals;
  if (decimals && DecimalsOf(text) > static_cast<std::size_t>(*decimals)) return false;
  return decoded.quality == Quality::good && EncodeValue(decoded.value, point).ok();
}

bool HasOffset(const config::Device& device) {
  return std::ranges::any_of(device.points,
                             [](const config::Point& point) { return point.read == kOffsetItem; });
}

/// Returns the seconds of the simulated device's clock. This clock is not set, so its minutes begin
/// at any time.
std::string PrintSeconds(Duration time) {
  const auto millis = time / 1ms % 60'000;
  return fmt::format("{:02}.{:03}", millis / 1000, millis % 1000);
}

bool IsPassword(const Address& item) {
  return item.channel == 0 && item.category == 'V' && *item.number >= kPasswordItems.first &&
         *item.number <= kPasswordItems.last;
}

}  // namespace

SpaTwin::SpaTwin(const config::Device& device, TwinValues& values)
    : device_(device),
      points_(
          device, values, [](const config::Point& point) { return ParseAddress(point.read); },
          [](const config::Point& point) { return WriteAddress(point); }),
      slave_(ParseSlave(device.address).value()),
      reply_as_(slave_) {
  const Settings settings = ReadSettings(device.options);
  reading_ = OwnReading(settings);
  write_items_ = settings.write_items;
  password_ = settings.password;
}

void SpaTwin::ReplyAs(std::string_view address) { reply_as_ = ParseSlave(address).value(); }

Bytes SpaTwin::Answer(View request, Instant now) {
  const ReceivedRequest received = ParseRequest(request);
  if (!received.slave || *received.slave != slave_) return {};
  if (!received.intact) return Nack(kDamaged);
  if (!received.command) return Nack(kSyntax);
  return received.command->write ? Write(*received.command) : Read(*received.command, now);
}

bool SpaTwin::Raise(const DeviceEvent& event, Now now) {
  if (events_.size() > kRegister) return false;
  const bool full = events_.size() == kRegister;
  DeviceEvent stored = event;
  if (full) {
    stored = {0, kOverflow, std::nullopt, {}};
    status_ |= kStatusOverflow;
  }
  stored.time = SaidTime{now.wall.time_since_epoch() % 1min, 1min};
  events_.push_back(PrintEvent(stored));
  return !full;
}

std::string SpaTwin::TakeEvents() {
  std::string text;
  for (std::size_t i = 0; i < kEventsOfReply && !events_.empty(); ++i) {
    text += (i == 0 ? "" : "/") + events_.front();
    events_.pop_front();
  }
  return text;
}

Bytes SpaTwin::Nack(int code) const { return EncodeNack(reply_as_, code, reading_); }

Bytes SpaTwin::Read(const Command& command, Instant now) {
  if (IsEventList(command.category)) {
    if (command.category == 'L') last_events_ = TakeEvents();
    return *EncodeData(reply_as_, last_events_, reading_);
  }
  if (command.ItemCount() > kMostItems) return Nack(kTooComplicated);
  std::string data;
  for (unsigned channel = command.channels.first; channel <= command.channels.last; ++channel) {
    const Range numbers = command.numbers.value_or(Range{});
    for (std::uint32_t number = numbers.first; number <= numbers.last; ++number) {
      Address item{channel, command.category, std::nullopt};
      if (command.numbers) item.number = number;
      const auto text = Text(item, now);
      if (!text) return Nack(kMissing);
      if (channel != command.channels.first || number != numbers.first) data += '/';
      data += *text;
    }
  }
  auto reply = EncodeData(reply_as_, data, reading_);
  return reply ? std::move(*reply) : Nack(kTooComplicated);
}

Result<std::string> SpaTwin::Text(const Address& item, Instant now) const {
  if (item == kModuleStatus && status_ != 0) return std::to_string(status_);
  const auto* known = points_.Find([&item](const Address& address) { return address == item; });
  if (known != nullptr) return PrintValue(points_.Get(*known, now), *known->point);
  if (item == Address{0, 'F', std::nullopt}) {
    config::Point type;
    type.type = config::Type::string;
    return PrintValue(Value(device_.title), type);
  }
  if (item == kModuleStatus) return std::string("0");
  if (item == kOwnClock && HasOffset(device_)) return PrintSeconds(now.time_since_epoch());
  return Error{"the profile does not contain this item"};
}

Bytes SpaTwin::Write(const Command& command) {
  if (command.ItemCount() > write_items_ || command.channels.Count() > 1) {
    return Nack(kTooComplicated);
  }
  Address item{command.channels.first, command.category, std::nullopt};
  if (command.numbers) item.number = command.numbers->first;
  const auto values = Split(command.data, '/');
  if (values.size() != command.ItemCount()) return Nack(kSyntax);
  if (values.size() == 1 && IsPassword(item)) return WritePassword(*item.number, command.data);
  for (const std::string_view value : values) {
    if (const auto refused = WriteItem(item, std::string(value))) return Nack(*refused);
    if (item.number) ++*item.number;
  }
  return EncodeAck(reply_as_, reading_);
}

std::optional<int> SpaTwin::WriteItem(const Address& item, const std::string& data) {
  const auto is_item = [&item](const Address& address) { return address == item; };
  const auto* known = points_.FindWritable(is_item);
  if (item == kModuleStatus && data == "0") {
    status_ = 0;
    if (known == nullptr) return std::nullopt;
  }
  if (known == nullptr) return points_.Find(is_item) != nullptr ? kNotNow : kMissing;
  if (password_ != 0 && !open_) return kNotNow;
  const Decoded decoded = DecodeValue(data, *known->point);
  if (!Fits(data, decoded, *known->point)) return kBadValue;
  points_.Set(*known, decoded.value);
  return std::nullopt;
}

Bytes SpaTwin::WritePassword(std::uint32_t item, const std::string& data) {
  const auto number = ParseInteger<std::int64_t>(data);
  if (!number || *number < 0 || *number > 999) return Nack(kBadValue);
  const bool opening = item == kPasswordItems.first;
  if (password_ == 0) return EncodeAck(reply_as_, reading_);
  if (opening) {
    if (*number != password_) return Nack(kNotNow);
    open_ = true;
  } else {
    if (!open_) return Nack(kNotNow);
    if (*number == password_) {
      open_ = false;
    } else {
      password_ = *number;  // while the password is open, another value becomes the new password
    }
  }
  return EncodeAck(reply_as_, reading_);
}

}  // namespace baudgate::protocols::spabus
