// SPDX-License-Identifier: Apache-2.0
#include "gateway/bus/devices/device_states.h"

#include <utility>

namespace baudgate::bus {

namespace {

/// Outages are frequent if a device had at least kFlapping of them in the last kFlappingMinutes.
constexpr std::uint32_t kFlapping = 3;
constexpr std::size_t kFlappingMinutes = 5;

std::string Change(const protocols::DeviceTrouble& was, const protocols::DeviceTrouble& is) {
  if (is || (!was && !is.text.empty())) return is.text;
  if (!was) return "this trouble is over: " + was.text;
  const std::string over = "the configured device answers again";
  return is.text.empty() ? over : over + "; " + is.text;
}

}  // namespace

DeviceStates::DeviceStates(const Roster& roster, PointStore& store, PollerListener& listener)
    : roster_(roster), store_(store), listener_(listener) {
  for (const auto& device : roster.devices()) {
    ShowTimes(*device);
    if (!device->in_use) entries_[*device].shown = DeviceState::disabled;
  }
}

void DeviceStates::OnClosed(Override why) {
  open_ = false;
  closed_as_ = why;
  const std::string reason = WhyClosed();
  for (const auto& device : roster_.devices()) {
    ShowOverride(*device);
    if (!device->in_use) continue;
    // While the port is closed no device is online. The log gets one line for the port and none for
    // each device, so only `shown` changes. The first answer after the port opens is then reported
    // as a change of state.
    DeviceState& shown = entries_[*device].shown;
    if (shown != DeviceState::never_seen) shown = DeviceState::offline;
    store_.UpdateStatus(device->index, [&](DeviceStatus& status) {
      status.state = shown;
      status.last_outcome = Outcome::line_down;
      status.last_reason = reason;
    });
  }
}

std::string DeviceStates::WhyClosed() const {
  return closed_as_ == Quality::bad_out_of_service ? "the port is lent to another program"
                                                   : "the port is closed";
}

void DeviceStates::OnState(const Member& member, const std::string& reason) {
  const DeviceState state = StateOf(member);
  const DeviceState from = std::exchange(entries_[member].shown, state);
  ShowOverride(member);
  if (state == from) return;
  if (member.device != nullptr) {
    store_.UpdateStatus(member.index, [&](DeviceStatus& status) { Show(state, from, status); });
  }
  listener_.OnDeviceState(member.index, from, state, reason, now_);
  if (tap_ != nullptr) tap_->OnDeviceState(member.index, state, reason, now_);
}

/// Publishes the state. Clears the findings of the diagnosis when a device returns after an outage,
/// unless its outages are frequent.
void DeviceStates::Show(DeviceState state, DeviceState from, DeviceStatus& status) const {
  status.state = state;
  const bool back = Answers(state) && !Answers(from);
  if (back && status.hour.Sum(now_.instant, kFlappingMinutes).outages < kFlapping) {
    status.findings = {};
  }
}

DeviceState DeviceStates::StateOf(const Member& member) const {
  if (!member.in_use) return DeviceState::disabled;
  const DeviceState state = member.health.state();
  return open_ || state == DeviceState::never_seen ? state : DeviceState::offline;
}

/// A trouble without a reason is a remark. It goes to the status and the log, but is not reported
/// as news, because the values of the device are good.
bool DeviceStates::OnTrouble(const Device& device) {
  const protocols::DeviceTrouble& is = device.conversation->trouble();
  protocols::DeviceTrouble& known = entries_[device].trouble;
  if (is.reason == known.reason && is.text == known.text) return false;
  const protocols::DeviceTrouble was = std::exchange(known, is);
  ShowOverride(device);
  if (is && was && is.text == was.text) return false;
  store_.UpdateStatus(device.index, [&is](DeviceStatus& status) { status.trouble = is.text; });
  const bool over = was && !is;
  if (is) listener_.OnNews({News::What::wrong_device, false, device.index, is.text}, now_);
  if (over) listener_.OnNews({News::What::wrong_device, true, device.index}, now_);
  listener_.OnWarning(device.index, Change(was, is));
  return over;
}

void DeviceStates::OnReplaced(const Member& member) {
  const std::string text =
      "it reports another name than before: another device answers at this address, and all points "
      "are read again";
  listener_.OnNews({.what = News::What::replaced, .device = member.index, .text = text}, now_);
  listener_.OnWarning(member.index, text);
}

void DeviceStates::OnMemory(Device& device) {
  const std::string& memory = device.conversation->Memory();
  if (memory == device.memory) return;
  device.memory = memory;
  listener_.OnMemory(device.index, memory);
}

void DeviceStates::ShowTimes(const Device& device) {
  store_.UpdateStatus(device.index, [&](DeviceStatus& status) { status.timing = device.timing; });
}

void DeviceStates::ShowOverride(const Member& member) {
  if (member.device != nullptr) store_.SetOverride(member.index, OverrideOf(member));
}

Override DeviceStates::OverrideOf(const Member& member) const {
  if (!member.in_use) return Quality::bad_out_of_service;
  if (!open_) return closed_as_;
  if (member.health.state() == DeviceState::offline) return Quality::bad_communication;
  const Device* const device = member.device;
  if (device == nullptr || !device->conversation->trouble()) return std::nullopt;
  return QualityOfDevice(device->conversation->trouble().reason);
}

}  // namespace baudgate::bus
