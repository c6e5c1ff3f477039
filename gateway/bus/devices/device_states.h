// DeviceStates: the public state of each device, and the quality that it gives to all its points.
// Example: a device that does not answer any more is offline, so all its points are
// bad_communication. Published in the point store, and reported to the listener and the tap when it
// changes. Driven by gateway/bus/poller/poller.cpp and gateway/bus/jobs/device_tracker.cpp.
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
  /// All references outlive it.
  DeviceStates(const Roster& roster, PointStore& store, PollerListener& listener);

  void Attach(Tap& tap) { tap_ = &tap; }
  void OnTime(Now now) { now_ = now; }
  void OnOpened() { open_ = true; }
  /// `why`: the quality of all points while the port is closed.
  void OnClosed(Override why);
  /// "the port is closed", or why.
  std::string WhyClosed() const;

  /// Its state may have changed; `reason`: why.
  void OnState(const Member& member, const std::string& reason);
  /// Its trouble as a whole (wrong type, no identification) may have changed. True: it is over.
  bool OnTrouble(const Device& device);
  /// Another device answers in its place.
  void OnReplaced(const Member& member);
  /// Saves what the conversation has learned and needs after a restart, if that has changed.
  void OnMemory(Device& device);
  void ShowOverride(const Member& member);
  void ShowTimes(const Device& device);

 private:
  struct Entry {
    DeviceState shown = DeviceState::never_seen;
    protocols::DeviceTrouble trouble;  // or a remark
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
