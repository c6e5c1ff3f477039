// SPDX-License-Identifier: Apache-2.0
#include "gateway/bus/poller/device_side.h"

#include <utility>

namespace baudgate {

DeviceSide::DeviceSide(Roster& roster, Ledger& ledger, Upkeep& upkeep, UnaskedSide& unasked,
                       EffectApplier& effects)
    : roster_(roster), ledger_(ledger), upkeep_(upkeep), unasked_(unasked), effects_(effects) {}

void DeviceSide::Attach(Tap& tap, std::vector<ForeignRule> foreign) {
  roster_.SetForeign(std::move(foreign));
  ledger_.Attach(tap);
}

void DeviceSide::OnOpened(Instant now) {
  upkeep_.OnOpened(now);
  unasked_.OnOpened();
}

std::string DeviceSide::OnClosing(Override why) {
  ledger_.OnClosed(why);
  return WhyClosed();
}

void DeviceSide::Recall(std::uint32_t index, std::string memory, Now now) {
  Device& device = roster_.DeviceAt(index);
  device.conversation->Recall(memory, now);
  device.memory = std::move(memory);
  upkeep_.OnRecalled(device);
}

void DeviceSide::SetInUse(std::uint32_t index, bool in_use, bool open, Instant now) {
  Device& device = roster_.DeviceAt(index);
  if (in_use) upkeep_.OnEnabled(device, open, now);
  if (device.in_use != in_use) upkeep_.SetInUse(device, in_use, open, now);
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
  ledger_.states.OnMemory(device);
}

void DeviceSide::OnWritingTelegram(std::uint32_t index, View telegram, Instant now) {
  upkeep_.OnTelegram(*roster_.DeviceAt(index).protocol, telegram, now);
}

Speaking DeviceSide::SpeakingAs(std::uint32_t index) const {
  const Device& device = roster_.DeviceAt(index);
  return {device.protocol, device.options, device.serial, device.times};
}

}  // namespace baudgate
