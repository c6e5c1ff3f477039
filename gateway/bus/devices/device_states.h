// `DeviceStates` contains the state of each device as users see it, and the quality that the state
// gives to all points of the device. Example: a device that has stopped answering is offline, so
// all its points are bad_communication. `DeviceStates` writes state and quality to the point store,
// and reports changes of the state to the listener and the tap.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "gateway/base/time.h"
#include "gateway/bus/devices/poller_listener.h"
#include "gateway/bus/devices/roster.h"
#include "gateway/bus/exchange/line.h"
#include "gateway/bus/points/device_status.h"
#include "gateway/bus/points/point_store.h"

namespace baudgate::bus {

class DeviceStates {
 public:
  /// All references must stay valid for the lifetime of this object.
  DeviceStates(const Roster& roster, PointStore& store, PollerListener& listener);

  void Attach(Tap& tap) { tap_ = &tap; }
  void OnTime(Now now) { now_ = now; }
  void OnOpened() { open_ = true; }
  /// The port has closed. `why`: the quality of all points until it opens.
  void OnClosed(Override why);
  std::string WhyClosed() const;

  /// Publishes the state of the member if it has changed. `reason`: the text for the log.
  void OnState(const Member& member, const std::string& reason);
  /// Publishes the trouble that the conversation has found, such as a device of the wrong type, if
  /// it has changed. Returns true if the trouble has ended.
  bool OnTrouble(const Device& device);
  void OnReplaced(const Member& member);
  /// Reports the memory of the conversation (text to be saved over a restart) if it has changed.
  void OnMemory(Device& device);
  void ShowOverride(const Member& member);
  void ShowTimes(const Device& device);

 private:
  struct Entry {
    DeviceState shown = DeviceState::never_seen;
    // The trouble that was published last.
    protocols::DeviceTrouble trouble;
  };

  void Show(DeviceState state, DeviceState from, DeviceStatus& status) const;
  DeviceState StateOf(const Member& member) const;
  Override OverrideOf(const Member& member) const;

  const Roster& roster_;
  PointStore& store_;
  PollerListener& listener_;
  Tap* tap_ = nullptr;
  ByMember<Entry> entries_;
  Now now_{};
  bool open_ = false;
  Override closed_as_ = Quality::bad_not_connected;
};

}  // namespace baudgate::bus
