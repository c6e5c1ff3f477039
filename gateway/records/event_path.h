// `EventPath` carries events from the lines to the file, reports to the lines which events are
// stored, and requests the reads of the records that events announce. The gateway's own events and
// alarms enter here as well. `EventsPlace` contains the path of events.db.
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

struct EventsPlace {
  std::filesystem::path file;  ///< empty: there is no folder for the file
  std::string why_no_file{};
  /// True: there is no events.db; the gateway's own alarms exist in memory until the gateway ends.
  bool in_memory = false;
  std::set<std::string> consumers{};
  std::shared_ptr<EventsWriter> writer = std::make_shared<EventsWriter>();
};

// NewsKind tells how a line's news is recorded: the code of the event, and the kind of the alarm.
// gateway/records/events/own_records.cpp contains the texts of events, and
// gateway/records/events/own_alarms.cpp the names of alarms.
struct NewsKind {
  events::OwnCode code;
  std::optional<events::Trouble> trouble{};  ///< empty: the news is not an alarm
};

/// Returns how a line's news is recorded. The compiler reports a News::What without a case.
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

/// The end of a client's request that was routed to a slave.
struct RoutedEnd {
  enum class Slave : std::uint8_t {
    answered,  ///< the slave replied, possibly with an exception
    silent,
    unknown,  ///< the slave was not asked, or nothing waited for its reply
  };
  const config::Route& route;
  std::uint8_t unit = 0;
  Slave slave = Slave::unknown;
  const bus::RoutedReply& reply;
};

// `AlarmService` raises the gateway's own alarms: any thread reports facts about lines, routes and
// disks to it, and it reports in order which alarms begin and end.
// gateway/records/events/own_alarms.h decides what is an alarm, and when.
class AlarmService {
 public:
  using Tell = std::function<void(events::EventRecord record)>;
  /// `tell` receives each event that begins or ends an alarm. It must return at once, and must not
  /// call this object.
  AlarmService(std::shared_ptr<const config::Config> config, Tell tell)
      : tell_(std::move(tell)), alarms_(std::move(config)) {}

  /// `device`: the device's name; empty: the news is about the line.
  void OnNews(const std::string& line, const std::string& device, const bus::News& news, Now at);
  void OnRouted(const RoutedEnd& end, Now now);
  void OnUnused(const std::string& line, const std::string& device, Now now);

  /// `outlet`: the name of the output that forwards values. `away`: why values wait for its
  /// receiver, `refused`: why the receiver has refused values; empty: no trouble.
  void OnOutlet(const std::string& outlet, const std::string& away, const std::string& refused,
                Now now);

  struct DiskState {
    events::Trouble trouble = events::Trouble::events_lost;
    Disk disk = Disk::opening;
    std::string why{};
  };
  /// `why`: why a certificate must be renewed soon; empty: none must.
  void OnCertificates(const std::string& why, Now now);
  /// To be called periodically with the state of the disks. Raises alarms whose cause has lasted
  /// long enough.
  void Look(std::span<const DiskState> disks, Now now);

  void Renew(std::shared_ptr<const config::Config> config, const std::set<std::string>& begun);

 private:
  /// Counts the consecutive requests of clients to one unit that got no reply.
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
  /// Called with EventBatch::said of a device's last batch on the disk (see
  /// Conversation::OnEventsKept); empty: there is no batch. `reported`: true for a batch of
  /// OnReported, false for a batch that was stored before the start. Called on the writing thread,
  /// or within Start or Begun.
  using Kept = std::function<void(std::uint32_t device, std::string said, bool reported)>;
  /// All references must outlive this object. `commands` receives the read requests for records
  /// that events announce.
  EventPath(const config::Config& config, const bus::PointStore& store, const EventsPlace& place,
            bus::CommandSink& commands, Kept kept);

  /// Starts the reads of records. As soon as the file is open, calls `kept` for each device that
  /// reports events.
  void Start();
  /// The first step of a reload, before new lines start; Begun is the second. `config` contains all
  /// lines of the point store; `begun` are the new lines, which are the last lines in the store.
  void Renumber(const std::shared_ptr<const config::Config>& config,
                std::span<const std::shared_ptr<const config::Line>> begun);
  /// The second step of a reload, when the lines of these devices have started: calls `kept` for
  /// each of the devices that reports events, and requests the records that their events announce.
  void Begun(std::uint32_t first_device, std::size_t devices);
  void OnReload(bool taken_back, const std::string& text);
  void OnClock(std::uint32_t device, bool corrected, const std::string& text, Now at);
  /// Records the start of the gateway; to be called before the lines start.
  void Started() { queue().Started(kVersion); }
  /// Records the end of the gateway, and waits 300 ms at most until outputs can see this event. To
  /// be called when the lines have ended.
  void End();

  void OnReported(bus::ReportedEvents reported) override;
  void OnNews(const config::Line& line, const bus::News& news, Now at) override;
  void OnRead(std::uint32_t device, std::span<const std::uint32_t> points, Now at) override;
  void OnDrained(std::uint32_t device, Instant asked) override {
    records_.OnDrained(device, asked);
  }
  void OnRouted(const RoutedEnd& end, Now now) { alarms_.OnRouted(end, now); }
  void OnCertificates(const std::string& why, Now now) { alarms_.OnCertificates(why, now); }
  /// See AlarmService. Thread-safe; returns at once.
  void OnOutlet(const std::string& outlet, const std::string& away, const std::string& refused,
                Now now) {
    alarms_.OnOutlet(outlet, away, refused, now);
  }
  void Look(std::span<const AlarmService::DiskState> disks, Now now) { alarms_.Look(disks, now); }
  events::EventLog& log() { return log_; }
  /// Returns the events on the disk, for outputs. An output may hold the feed longer than this
  /// object exists.
  std::shared_ptr<events::EventFeed> feed() const { return feed_; }
  std::shared_ptr<events::CursorBook> cursors() const { return cursors_; }

 private:
  struct DeviceEntry {
    DeviceEntry(std::weak_ptr<const config::Line> its_line, std::size_t its_place)
        : line(std::move(its_line)), place(its_place) {}
    /// The line as it began; expired if the line has ended. After a reload, a removed line can
    /// still report for a moment under its old device numbers.
    const std::weak_ptr<const config::Line> line;
    const std::size_t place;
    Mutex mutex{};
    // Null: no point of the device is watched for events.
    std::unique_ptr<events::DeviceWatch> watch BAUDGATE_GUARDED_BY(mutex){};
  };
  /// A device and its line. `line` is null if the line has ended.
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
  SteadyVector<DeviceEntry> entries_;  // index: number of the device
  std::map<events::SourceName, std::uint32_t> present_;
  Mutex facts_mutex_;
  events::LastingFacts facts_ BAUDGATE_GUARDED_BY(facts_mutex_);
  const std::shared_ptr<events::EventFeed> feed_;
  const std::shared_ptr<events::CursorBook> cursors_;
  events::RecordService records_;
  events::EventLog log_;  // the thread of log_ calls records_
  AlarmService alarms_;
};

}  // namespace baudgate::records
