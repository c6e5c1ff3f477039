// The way of an event from its line to the file, and the way back, by which its device may be asked
// for more. The gateway's own events enter here, too, and its own alarms. Made and ended by
// Records. EventsPlace says where events.db is, NewsKind how news is recorded, and AlarmService
// raises the gateway's own alarms.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "config/model/config.h"
#include "gateway/base/guarded.h"
#include "gateway/base/version.h"
#include "gateway/bus/devices/poller_listener.h"
#include "gateway/bus/points/point_store.h"
#include "gateway/bus/writes/route_queue.h"
#include "gateway/records/disk/disk.h"
#include "gateway/records/disk/events_file.h"
#include "gateway/records/events/event_feed.h"
#include "gateway/records/events/event_log.h"
#include "gateway/records/events/own_alarms.h"
#include "gateway/records/events/own_records.h"
#include "gateway/records/events/point_watch.h"
#include "gateway/records/events/record_service.h"

namespace baudgate::records {

// Where events.db is, for the parts that write to it.
struct EventsPlace {
  std::filesystem::path file;  ///< empty: there is no place for it
  std::string why_no_file{};
  bool in_memory = false;             ///< only the gateway's own alarms, until it ends
  std::set<std::string> consumers{};  ///< see CursorBook
  std::shared_ptr<EventsWriter> writer = std::make_shared<EventsWriter>();
};

// How news of lines and devices is recorded: the one table from what a line tells to the code of
// the event and the trouble of the alarm. The words of an event are in
// gateway/records/events/own_records.cpp, the name of an alarm in
// gateway/records/events/own_alarms.cpp.
struct NewsKind {
  events::OwnCode code;
  std::optional<events::Trouble> trouble{};  ///< empty: it is no alarm
};

/// The compiler refuses news without a row.
constexpr NewsKind KindOf(bus::News::What what) {
  using events::OwnCode;
  using events::Trouble;
  switch (what) {
    case bus::News::What::no_answer:
      break;
    case bus::News::What::not_in_use:
      return {OwnCode::not_in_use};
    case bus::News::What::wrong_device:
      return {OwnCode::wrong_device, Trouble::wrong_device};
    case bus::News::What::replaced:
      return {OwnCode::replaced, Trouble::replaced};
    case bus::News::What::port_down:
      return {OwnCode::port_down, Trouble::port_down};
    case bus::News::What::port_lent:
      return {OwnCode::port_lent};
    case bus::News::What::collisions:
      return {OwnCode::collisions};
    case bus::News::What::ring_open:
      return {OwnCode::ring_open, Trouble::ring_open};
    case bus::News::What::port_served:
      return {OwnCode::port_served};
  }
  return {OwnCode::no_answer, Trouble::no_answer};
}

/// The end of a client's request that was passed on to a slave.
struct RoutedEnd {
  enum class Slave : std::uint8_t {
    answered,  ///< with an exception as well
    silent,
    unknown,  ///< it was not asked, or nobody waited for its reply
  };
  const config::Route& route;
  std::uint8_t unit = 0;  ///< as the client asked for it
  Slave slave = Slave::unknown;
  const bus::RoutedReply& reply;
};

// The alarms that the gateway raises itself: takes facts about lines, routes and disks from any
// thread, and reports in order what raises and ends alarms. gateway/records/events/own_alarms.h
// decides what is an alarm, and when.
class AlarmService {
 public:
  using Tell = std::function<void(events::EventRecord record)>;
  /// `tell` returns at once, and does not call this.
  AlarmService(std::shared_ptr<const config::Config> config, Tell tell)
      : tell_(std::move(tell)), alarms_(std::move(config)) {}

  /// `device`: its name; empty: the news is of the line.
  void OnNews(const std::string& line, const std::string& device, const bus::News& news, Now at);
  void OnRouted(const RoutedEnd& end, Now now);
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
  void OnAnswered(const events::OwnAlarms::Subject& unit, Now now) BAUDGATE_REQUIRES(mutex_);
  void OnUnanswered(const events::OwnAlarms::Subject& unit, const std::string& why, Now now)
      BAUDGATE_REQUIRES(mutex_);
  void Forget(Now now) BAUDGATE_REQUIRES(mutex_);

  const Tell tell_;
  Mutex mutex_;
  events::OwnAlarms alarms_ BAUDGATE_GUARDED_BY(mutex_);
  std::map<events::OwnAlarms::Subject, Unanswered> unanswered_ BAUDGATE_GUARDED_BY(mutex_);
};

class EventPath final : public bus::EventSink {
 public:
  /// `said` of the device's last events that are on the disk (see Conversation::OnEventsKept):
  /// `reported`: by OnReported; else from before the start. On the writing thread, or from Start.
  using Kept = std::function<void(std::uint32_t device, std::string said, bool reported)>;
  /// All references outlive it. `commands`: for reads of the records that events owe.
  EventPath(const config::Config& config, const bus::PointStore& store, const EventsPlace& place,
            bus::CommandSink& commands, Kept kept);

  /// From now on lines are told what is kept from before, as soon as the file is open.
  void Start();
  /// A reload: `config` has the lines of the store; `begun` are the last of them. Before these
  /// start; then Begun.
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

  void OnReported(bus::ReportedEvents reported) override;
  void OnNews(const config::Line& line, const bus::News& news, Now at) override;
  void OnRead(std::uint32_t device, std::span<const std::uint32_t> points, Now at) override;
  void OnDrained(std::uint32_t device, Instant asked) override {
    records_.OnDrained(device, asked);
  }
  /// A request of a client to a route has ended.
  void OnRouted(const RoutedEnd& end, Now now) { alarms_.OnRouted(end, now); }
  /// See AlarmService.
  void Look(std::span<const AlarmService::DiskState> disks, Now now) { alarms_.Look(disks, now); }
  events::EventLog& log() { return log_; }
  /// What is on the disk, for outputs, which may keep it longer than this lives.
  std::shared_ptr<events::EventFeed> feed() const { return feed_; }
  std::shared_ptr<events::CursorBook> cursors() const { return cursors_; }

 private:
  struct DeviceEntry {
    DeviceEntry(std::weak_ptr<const config::Line> its_line, std::size_t its_place)
        : line(std::move(its_line)), place(its_place) {}
    /// As the line began; there while the line may tell of the device. An abandoned line may do so
    /// after a reload, under the numbers that it had.
    const std::weak_ptr<const config::Line> line;
    const std::size_t place;  // in its line
    Mutex mutex{};
    std::unique_ptr<events::DeviceWatch> watch BAUDGATE_GUARDED_BY(mutex){};  // null: of no point
  };
  /// A device of the line, as it began. Null: the line has ended.
  struct Named {
    std::shared_ptr<const config::Line> line;
    const config::Device* device = nullptr;
  };

  events::EventQueue& queue() { return log_.queue(); }
  bool IsNews(const events::Fact& fact, bool first);
  std::vector<events::Fact> EndedBy(const config::Config& config,
                                    const std::set<std::string>& begun);
  void AddEntries(const std::shared_ptr<const config::Line>& line);
  Named Find(std::uint32_t device) const;
  void Tell(std::uint32_t first_device, std::size_t devices);

  const bus::PointStore& store_;
  const bool tells_own_;
  const bool in_memory_;
  const Kept kept_;
  SteadyVector<DeviceEntry> entries_;                    // by device
  std::map<events::SourceName, std::uint32_t> present_;  // places of devices that are configured
  Mutex facts_mutex_;
  events::LastingFacts facts_ BAUDGATE_GUARDED_BY(facts_mutex_);
  const std::shared_ptr<events::EventFeed> feed_;
  const std::shared_ptr<events::CursorBook> cursors_;
  events::RecordService records_;
  events::EventLog log_;  // its thread tells the service
  AlarmService alarms_;
};

}  // namespace baudgate::records
