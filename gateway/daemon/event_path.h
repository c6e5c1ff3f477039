// The way of an event from its line to the file, and the way back, by which its device may be asked
// for more. The gateway's own events enter here, too, and its own alarms. Made and ended by
// daemon.cpp.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <map>
#include <memory>
#include <set>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "config/model/config.h"
#include "gateway/base/guarded.h"
#include "gateway/base/version.h"
#include "gateway/bus/points/point_store.h"
#include "gateway/bus/points/steady_vector.h"
#include "gateway/daemon/alarm_service.h"
#include "gateway/daemon/events_place.h"
#include "gateway/lines/event_sink.h"
#include "gateway/records/events/event_feed.h"
#include "gateway/records/events/event_log.h"
#include "gateway/records/events/lasting_facts.h"
#include "gateway/records/events/point_watch.h"
#include "gateway/records/events/record_service.h"

namespace baudgate {

class EventPath final : public EventSink {
 public:
  /// `said` of the device's last events that are on the disk (see Conversation::OnEventsKept):
  /// `reported`: by OnReported; else from before the start. On the writing thread, or from Start.
  using Kept = std::function<void(std::uint32_t device, std::string said, bool reported)>;
  /// All references outlive it. `commands`: for reads of the records that events owe.
  EventPath(const config::Config& config, const PointStore& store, const EventsPlace& place,
            CommandSink& commands, Kept kept);

  /// From now on lines are told what is kept from before, as soon as the file is open.
  void Start();
  /// A reload: `config` has the lines of the store; `begun`, the last of them, outlive this. Before
  /// these start; then Begun.
  void Renumber(const std::shared_ptr<const config::Config>& config,
                std::span<const std::shared_ptr<const config::Line>> begun);
  /// The lines of these devices have started: they are told what is kept from before, and asked for
  /// the records that their events owe.
  void Begun(std::uint32_t first_device, std::size_t devices);
  /// A configuration was applied, or taken back.
  void OnReload(bool taken_back, const std::string& text);
  /// The gateway has corrected the clock of a device, or could not.
  void OnClock(std::uint32_t device, bool corrected, const std::string& text, Now at);
  /// The lines are about to start.
  void Started() { queue().Started(kVersion); }
  /// The lines have ended; from now on outputs are told that the gateway ends.
  void End();

  void OnReported(ReportedEvents reported) override;
  void OnNews(const config::Line& line, const News& news, Now at) override;
  void OnRead(std::uint32_t device, std::span<const std::uint32_t> points, Now at) override;
  void OnDrained(std::uint32_t device, Instant asked) override {
    records_.OnDrained(device, asked);
  }
  /// A request of a client to a route has ended.
  void OnRouted(const modbus::RoutedReport& end, Now now) { alarms_.OnRouted(end, now); }
  /// See AlarmService.
  void Look(std::span<const AlarmService::DiskState> disks, Now now) { alarms_.Look(disks, now); }
  events::EventLog& log() { return log_; }
  /// What is on the disk, for outputs, which may keep it longer than this lives.
  std::shared_ptr<events::EventFeed> feed() const { return feed_; }
  std::shared_ptr<events::CursorBook> cursors() const { return cursors_; }

 private:
  struct Place {
    const config::Line* line = nullptr;
    const config::Device* device = nullptr;
    Mutex mutex{};  // a line that a reload has abandoned may still read its points
    std::unique_ptr<events::DeviceWatch> watch{};  // null: of no point; what it knows: by the mutex
  };

  events::EventQueue& queue() { return log_.queue(); }
  bool IsNews(const events::Fact& fact, bool first);
  std::vector<events::Fact> EndedBy(const config::Config& config,
                                    const std::set<std::string>& begun);
  void AddPlaces(const config::Line& line);
  void Tell(std::uint32_t first_device, std::size_t devices);

  const PointStore& store_;
  const bool tells_own_;
  const bool in_memory_;
  const Kept kept_;
  SteadyVector<Place> places_;                           // by device
  std::map<events::SourceName, std::uint32_t> present_;  // places of devices that are configured
  Mutex facts_mutex_;
  events::LastingFacts facts_ BAUDGATE_GUARDED_BY(facts_mutex_);
  const std::shared_ptr<events::EventFeed> feed_;
  const std::shared_ptr<events::CursorBook> cursors_;
  RecordService records_;
  events::EventLog log_;  // its thread tells the service
  AlarmService alarms_;
};

}  // namespace baudgate
