// SPDX-License-Identifier: Apache-2.0
#include "gateway/bus/poller/device_side.h"

#include <cstddef>
#include <string>
#include <utility>

namespace baudgate {

namespace {

/// A device that goes on for longer is not listened to.
constexpr std::size_t kMostReply = 8192;

}  // namespace

TelegramExchange::TelegramExchange(const Speaking& as, config::Echo echo, View telegram,
                                   Instant now)
    : echo_(echo), as_(as) {
  request_.bytes.assign(telegram.begin(), telegram.end());
  request_.expect = as.protocol->expect(telegram, as.options);
  line_.OnOpened(now);
}

bool TelegramExchange::Begin(Instant now) {
  Exchange exchange;
  exchange.request = request_;
  exchange.reply_rule = as_.protocol->reply_rule;
  exchange.times = as_.times;
  return Take(line_.Start(std::move(exchange), now));
}

bool TelegramExchange::Receive(View bytes, Instant now) {
  const EchoResult heard = echo_.Filter(bytes);
  if (heard.bytes.empty()) return false;
  if (reply_.size() < kMostReply) Append(reply_, View(heard.bytes));
  return Take(line_.Feed(heard.bytes, now));
}

bool TelegramExchange::OnTimer(Instant now) { return Take(line_.OnTimer(now)); }

bool TelegramExchange::Take(LineNews news) {
  if (news.send) echo_.OnSent(request_.bytes);
  if (news.end) end_ = std::move(news.end);
  return news.send;
}

void UnaskedSide::OnOpened() {
  first_ = true;
  if (const Device* const device = speaker_.device()) {
    accounts_.states.OnState(*device, "the port is open");
  }
}

void UnaskedSide::OnKept(const Device& device) {
  if (&device == speaker_.device()) speaker_.OnKept();
}

void UnaskedSide::OnSettled(Instant now) {
  if (speaker_.drained()) intake_.OnDrained(*speaker_.device(), now);
}

void UnaskedSide::Overhear(View bytes, Instant now) {
  // Where a device is asked as well, its answer shows what the connection began with.
  const bool begins = std::exchange(first_, false) && speaker_.in_use();
  if (begins && is_network_ && observer_.IsNegotiation(bytes)) {
    accounts_.line.OnNegotiation();
    tracker_.ShowLine(now);
  }
  if (const auto before = speaker_.Hear(bytes, now)) {
    accounts_.devices.OnMore(*speaker_.device(), *before);
  }
}

void UnaskedSide::OnInput(const UnaskedInput& heard, Now now) {
  if (!speaker_.in_use()) return;
  Device& device = *speaker_.device();
  for (std::size_t i = 0; i < heard.damaged; ++i) {
    tracker_.OnUnasked(device, Outcome::corrupt, std::string(heard.why), speaker_.OnDamaged(),
                       now.instant);
  }
  for (const UnaskedMessage& message : heard.messages) {
    Speaker::Said said = speaker_.OnMessage(message, now);
    tracker_.OnUnasked(device, said.outcome, said.reason, speaker_.Look(said), now.instant);
    Take(std::move(said), now.instant);
  }
}

void UnaskedSide::OnTimer(Now now) {
  if (auto said = speaker_.OnTimer(now)) Take(std::move(*said), now.instant);
}

void UnaskedSide::Take(Speaker::Said said, Instant now) {
  Device& device = *speaker_.device();
  tracker_.OnHeard(device, now);
  if (said.lost > 0) accounts_.devices.OnLostEvents(device, said.lost);
  intake_.TakeUnasked(device, std::move(said));
}

DeviceSide::DeviceSide(Roster& roster, Accounts& accounts, DeviceTracker& tracker,
                       UnaskedSide& unasked, EffectApplier& effects)
    : roster_(roster),
      accounts_(accounts),
      tracker_(tracker),
      unasked_(unasked),
      effects_(effects) {}

void DeviceSide::Attach(Tap& tap, std::vector<ForeignRule> foreign) {
  roster_.SetForeign(std::move(foreign));
  accounts_.Attach(tap);
}

void DeviceSide::OnOpened(Instant now) {
  tracker_.OnOpened(now);
  unasked_.OnOpened();
}

std::string DeviceSide::OnClosing(Override why) {
  accounts_.OnClosed(why);
  return WhyClosed();
}

void DeviceSide::Recall(std::uint32_t index, std::string memory, Now now) {
  Device& device = roster_.DeviceAt(index);
  device.conversation->Recall(memory, now);
  device.memory = std::move(memory);
  tracker_.OnRecalled(device);
}

void DeviceSide::SetInUse(std::uint32_t index, bool in_use, bool open, Instant now) {
  Device& device = roster_.DeviceAt(index);
  if (in_use) tracker_.OnEnabled(device, open, now);
  if (device.in_use != in_use) tracker_.SetInUse(device, in_use, open, now);
}

void DeviceSide::OnEventsKept(std::uint32_t index, const std::string& said, Instant now) {
  Device& device = roster_.DeviceAt(index);
  device.conversation->OnEventsKept(said);
  unasked_.OnKept(device);
  effects_.OnEventsKept(device, said, now);
}

void DeviceSide::OnHostClock(bool right) {
  for (const auto& device : roster_.devices()) device->conversation->OnHostClock(right);
}

void DeviceSide::OnUnsettledWrite(std::uint32_t index) {
  Device& device = roster_.DeviceAt(index);
  device.conversation->OnUnsettledWrite();
  accounts_.states.OnMemory(device);
}

void DeviceSide::OnWritingTelegram(std::uint32_t index, View telegram, Instant now) {
  tracker_.OnTelegram(*roster_.DeviceAt(index).protocol, telegram, now);
}

Speaking DeviceSide::SpeakingAs(std::uint32_t index) const {
  const Device& device = roster_.DeviceAt(index);
  return {device.protocol, device.options, device.serial, device.times};
}

}  // namespace baudgate
