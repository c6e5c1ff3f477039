// The alarms that the gateway raises itself: takes facts about lines, routes and disks from any
// thread, and reports in order what raises and ends alarms. gateway/records/events/own_alarms.h
// decides what is an alarm, and when.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <map>
#include <memory>
#include <set>
#include <span>
#include <string>

#include "config/model/config.h"
#include "gateway/base/guarded.h"
#include "gateway/bus/devices/poller_listener.h"
#include "gateway/outputs/modbus/service/routed_report.h"
#include "gateway/records/disk/disk.h"
#include "gateway/records/events/own_alarms.h"

namespace baudgate {

class AlarmService {
 public:
  using Tell = std::function<void(events::EventRecord record)>;
  /// `tell` returns at once, and does not call this.
  AlarmService(std::shared_ptr<const config::Config> config, Tell tell)
      : tell_(std::move(tell)), alarms_(std::move(config)) {}

  /// `device`: its name; empty: the news is of the line.
  void OnNews(const std::string& line, const std::string& device, const News& news, Now at);
  void OnRouted(const modbus::RoutedReport& end, Now now);
  /// The configuration does not use this device.
  void OnUnused(const std::string& line, const std::string& device, Now now);

  struct DiskState {
    events::Trouble trouble = events::Trouble::events_lost;
    Disk disk = Disk::opening;
    std::string why{};
  };
  /// From time to time: the state of the disks; raises what has lasted long enough.
  void Look(std::span<const DiskState> disks, Now now);

  /// See OwnAlarms.
  void Renew(std::shared_ptr<const config::Config> config, const std::set<std::string>& begun);

 private:
  /// Requests of clients to one unit that got no reply, in a row.
  struct Unanswered {
    int requests = 0;
    Now first{};
    Instant last{};
  };

  void TellAll(events::OwnAlarms::Records records) BAUDGATE_REQUIRES(mutex_);
  void OnAnswered(const events::OwnAlarms::Place& unit, Now now) BAUDGATE_REQUIRES(mutex_);
  void OnUnanswered(const events::OwnAlarms::Place& unit, const std::string& why, Now now)
      BAUDGATE_REQUIRES(mutex_);
  void Forget(Now now) BAUDGATE_REQUIRES(mutex_);

  const Tell tell_;
  Mutex mutex_;
  events::OwnAlarms alarms_ BAUDGATE_GUARDED_BY(mutex_);
  std::map<events::OwnAlarms::Place, Unanswered> unanswered_ BAUDGATE_GUARDED_BY(mutex_);
};

}  // namespace baudgate
