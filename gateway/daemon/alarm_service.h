// The alarms that the gateway raises itself: hears of lines, routes and disks, from any thread, and
// tells what raises and ends alarms, in order. What is an alarm, and when, is decided by
// gateway/events/own_alarms.h.
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
#include "gateway/events/own_alarms.h"
#include "gateway/modbus/service/routed_report.h"
#include "gateway/poll/poller_listener.h"
#include "gateway/state/disk.h"

namespace baudgate {

class AlarmService {
 public:
  using Tell = std::function<void(events::EventRecord record)>;
  /// `tell` returns at once, and asks nothing of this.
  AlarmService(std::shared_ptr<const config::Config> config, Tell tell)
      : tell_(std::move(tell)), alarms_(std::move(config)) {}

  /// `device`: its name; empty: it is of the line.
  void OnNews(const std::string& line, const std::string& device, const News& news, Now at);
  void OnRouted(const modbus::RoutedReport& end, Now now);
  /// A device that the configuration does not use.
  void OnUnused(const std::string& line, const std::string& device, Now now);

  struct DiskState {
    events::Trouble trouble = events::Trouble::events_lost;
    Disk disk = Disk::opening;
    std::string why{};
  };
  /// From time to time: how the disks do, and what has lasted long enough.
  void Look(std::span<const DiskState> disks, Now now);

  /// See OwnAlarms.
  void Renew(std::shared_ptr<const config::Config> config, const std::set<std::string>& begun);

 private:
  /// Requests of clients to one unit that got no reply, one after another.
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
