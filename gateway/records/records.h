// What the gateway keeps on the disk, as far as its configuration wants it: the state folder, the
// memory of conversations, the audit of writes, events, values. Made before the lines, ended after
// them. FileTroubles names files that cannot be written, and WritePath is the way of a recorded
// write.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <functional>
#include <future>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <vector>

#include "config/model/config.h"
#include "gateway/base/guarded.h"
#include "gateway/base/result.h"
#include "gateway/bus/points/point_store.h"
#include "gateway/bus/writes/write_command.h"
#include "gateway/records/audit/audit_log.h"
#include "gateway/records/audit/audited_writes.h"
#include "gateway/records/disk/device_memory.h"
#include "gateway/records/disk/state_folder.h"
#include "gateway/records/event_path.h"
#include "gateway/records/history/history_log.h"

namespace baudgate::records {

// Small files that cannot be written, for the log and the status, as long as it lasts.

/// From any thread.
class FileTroubles {
 public:
  /// For the writer of `file`: call it with what is wrong now, or with an empty text when the file
  /// can be written again. It may outlive this object.
  std::function<void(const std::string& trouble)> Reporter(const std::string& file);
  std::vector<std::string> all() const { return held_->All(); }

 private:
  struct Held {
    std::vector<std::string> All() const;
    /// Returns the trouble that was set before.
    std::string Set(const std::string& file, const std::string& trouble);

    mutable Mutex mutex;
    std::map<std::string, std::string> troubles BAUDGATE_GUARDED_BY(mutex);
  };
  const std::shared_ptr<Held> held_ = std::make_shared<Held>();
};

// The way of a recorded write from an output to its line: the audit log and the sink in front of
// the lines. Made and ended by Records.
class WritePath {
 public:
  /// Called once, from any thread: see AuditLog::Options.
  using Unsettled = std::function<void(const std::set<audit::Target>& devices)>;
  /// All but `place` outlive it.
  WritePath(const config::Config& config, const bus::PointStore& store, bus::CommandSink& lines,
            const EventsPlace& place, Unsettled unsettled);

  /// What outputs submit to.
  bus::CommandSink& entrance() { return audited_; }
  audit::AuditLog& log() { return log_; }

  /// The lines are there: `unsettled` is called from now on.
  void Start();
  /// Nothing is submitted any more: waiting writes are handed to the lines, or denied.
  void Stop() { audited_.Stop(); }

 private:
  void OnUnsettled(const std::set<audit::Target>& devices);

  const Unsettled unsettled_;
  Mutex mutex_;
  bool started_ BAUDGATE_GUARDED_BY(mutex_) = false;
  std::set<audit::Target> early_ BAUDGATE_GUARDED_BY(mutex_);  // before Start
  audit::AuditLog log_;
  audit::AuditedWrites audited_;
};

class Records {
 public:
  struct Links {
    bus::PointStore& store;
    bus::CommandSink& lines;
    EventPath::Kept kept;  ///< see EventPath
    WritePath::Unsettled unsettled;
    FileTroubles& troubles;
    std::set<std::string> consumers{};  ///< of events; see CursorBook
  };
  /// The error: another gateway has the folder. `config` outlives this.
  Status Open(const config::Config& config, const Links& links);
  /// Nothing is kept on the disk: only the gateway's own alarms, in memory.
  void OpenAlarms(const config::Config& config, const Links& links);
  /// Opens only the folder, for parts that need nothing else.
  Status OpenFolder(const config::Config& config);
  /// Something is kept.
  bool open() const { return writes_ != nullptr; }

  /// A reload; see EventPath.
  void OnReload(const std::shared_ptr<const config::Config>& config,
                std::span<const std::shared_ptr<const config::Line>> begun);
  /// Begins a new run of the history; its readers must be given the new one. The old one ends as
  /// soon as the disk allows: nothing waits for a disk that does not answer.
  void RenewHistory(const std::shared_ptr<const config::Config>& config, bus::PointStore& store);

  /// The sink of recorded writes; null: none are recorded.
  bus::CommandSink* entrance() { return writes_ ? &writes_->entrance() : nullptr; }
  WritePath* write_path() const { return writes_.get(); }
  DeviceMemory* memory() const { return memory_.get(); }
  /// Null: it was not opened.
  EventPath* events() const {
    const MutexLock lock(mutex_);
    return events_.get();
  }
  /// Events are kept on the disk.
  bool keeps_events() const { return keeps_events_; }
  /// Null: none is kept.
  std::shared_ptr<const history::HistorySource> history() const {
    const MutexLock lock(mutex_);
    return history_.log ? history_.log->view() : nullptr;
  }
  /// Null: nothing is kept, or it could not be had at the start.
  const StateFolder* state() const { return why_no_state_.empty() ? state_.get() : nullptr; }
  const std::string& why_no_state() const { return why_no_state_; }

  /// From time to time, on any thread, until EndEvents: lasting troubles raise alarms.
  void Look(Now now);

  /// Before the lines end, so that their devices do not look lost.
  void EndHistory();
  /// Saves what is left; the loops of the lines still run.
  void EndEvents();

 private:
  void MakeEvents(const config::Config& config, const Links& links, EventsPlace place);
  Status PlaceEvents(const config::Config& config, EventsPlace& place);
  Status PlaceHistory(const config::Config& config);
  void StartHistory(const std::shared_ptr<const config::Config>& config, bus::PointStore& store);
  std::vector<AlarmService::DiskState> LookAtDisks(Now now) BAUDGATE_REQUIRES(mutex_);

  std::shared_ptr<StateFolder> state_;  // null: there is no place for it
  std::string why_no_state_;            // at the start; empty: it could be had
  std::unique_ptr<DeviceMemory> memory_;
  std::shared_ptr<StateFolder> databases_;       // null: they lie in `state_`
  std::shared_ptr<StateFolder> history_folder_;  // null: there is no place for it
  mutable Mutex mutex_;
  struct RunningHistory {
    std::shared_ptr<const config::Config> config;
    std::unique_ptr<history::HistoryLog> log{};  // null: none is kept
  };
  RunningHistory history_ BAUDGATE_GUARDED_BY(mutex_);
  std::shared_future<void> history_ends_;  // the one before; of the reloader's thread
  std::unique_ptr<WritePath> writes_;
  std::unique_ptr<EventPath> events_ BAUDGATE_GUARDED_BY(mutex_);
  bool keeps_events_ = false;
  std::optional<Instant> disks_at_ BAUDGATE_GUARDED_BY(mutex_);  // they were looked at
};

}  // namespace baudgate::records
