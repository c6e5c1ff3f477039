// `Records` owns what the gateway stores on the disk: the state folder, the memory of
// conversations, the audit of writes, events, and the history of values, each if the configuration
// asks for it. It is made before the lines and ends after them.
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

/// Lists small files that cannot be written, for the log and the status, as long as the trouble
/// lasts. Can be used on any thread.
class FileTroubles {
 public:
  /// Returns the function by which the writer of `file` reports the current trouble; an empty text
  /// means that the file can be written again. The function can be called after this object is
  /// destroyed.
  std::function<void(const std::string& trouble)> Reporter(const std::string& file);
  std::vector<std::string> all() const { return held_->All(); }

 private:
  struct Held {
    std::vector<std::string> All() const;
    std::string Set(const std::string& file, const std::string& trouble);

    mutable Mutex mutex;
    std::map<std::string, std::string> troubles BAUDGATE_GUARDED_BY(mutex);
  };
  const std::shared_ptr<Held> held_ = std::make_shared<Held>();
};

// `WritePath` carries a recorded write from an output to its line: it contains the AuditLog, and
// the AuditedWrites in front of the lines.
class WritePath {
 public:
  /// Called once, on any thread, with the devices that have writes of unknown result: see
  /// AuditLog::Options.
  using Unsettled = std::function<void(const std::set<audit::Target>& devices)>;
  /// All references but `place` must outlive this object.
  WritePath(const config::Config& config, const bus::PointStore& store, bus::CommandSink& lines,
            const EventsPlace& place, Unsettled unsettled);

  bus::CommandSink& entrance() { return audited_; }
  audit::AuditLog& log() { return log_; }

  /// To be called when the lines exist. From now on `unsettled` can be called.
  void Start();
  /// To be called when nothing submits writes any more. Writes that still wait go to the lines, or
  /// are denied.
  void Stop() { audited_.Stop(); }

 private:
  void OnUnsettled(const std::set<audit::Target>& devices);

  const Unsettled unsettled_;
  Mutex mutex_;
  bool started_ BAUDGATE_GUARDED_BY(mutex_) = false;
  std::set<audit::Target> early_ BAUDGATE_GUARDED_BY(mutex_);
  audit::AuditLog log_;
  audit::AuditedWrites audited_;
};

class Records {
 public:
  struct Links {
    bus::PointStore& store;
    bus::CommandSink& lines;
    EventPath::Kept kept;
    WritePath::Unsettled unsettled;
    FileTroubles& troubles;
    std::set<std::string> consumers{};
  };
  /// Opens all stores that the configuration asks for. Fails if another gateway uses a folder, or a
  /// newer baudgate has written its files. `config` must outlive this object.
  Status Open(const config::Config& config, const Links& links);
  /// To be called in place of Open if nothing is stored on the disk: provides the gateway's own
  /// alarms, in memory.
  void OpenAlarms(const config::Config& config, const Links& links);
  Status OpenFolder(const config::Config& config);
  bool open() const { return writes_ != nullptr; }

  void OnReload(const std::shared_ptr<const config::Config>& config,
                std::span<const std::shared_ptr<const config::Line>> begun);
  /// Begins a new run of the history; readers of the history must be given the new history(). The
  /// old run ends in the background, so that a disk that does not answer delays the reload by two
  /// seconds at most.
  void RenewHistory(const std::shared_ptr<const config::Config>& config, bus::PointStore& store);

  /// The sink to which outputs submit writes; null: writes are not recorded.
  bus::CommandSink* entrance() { return writes_ ? &writes_->entrance() : nullptr; }
  WritePath* write_path() const { return writes_.get(); }
  DeviceMemory* memory() const { return memory_.get(); }
  EventPath* events() const {
    const MutexLock lock(mutex_);
    return events_.get();
  }
  bool keeps_events() const { return keeps_events_; }
  std::shared_ptr<const history::HistorySource> history() const {
    const MutexLock lock(mutex_);
    return history_.log ? history_.log->view() : nullptr;
  }
  /// The state folder; null: there is no state folder, or it could not be opened at the start.
  const StateFolder* state() const { return why_no_state_.empty() ? state_.get() : nullptr; }
  const std::string& why_no_state() const { return why_no_state_; }

  /// To be called periodically, on any thread, until EndEvents: checks the disks and raises alarms
  /// for lasting troubles. `certificates`: as in EventPath::OnCertificates; nothing: not known yet.
  void Look(Now now, const std::optional<std::string>& certificates = std::nullopt);

  /// Ends the history. To be called before the lines end, so that the history does not record their
  /// devices as lost.
  void EndHistory();
  /// Saves the events that wait, and ends the event path. The event loops of the lines must still
  /// run.
  void EndEvents();

 private:
  void MakeEvents(const config::Config& config, const Links& links, EventsPlace place);
  Status PlaceEvents(const config::Config& config, EventsPlace& place);
  Status PlaceHistory(const config::Config& config);
  void StartHistory(const std::shared_ptr<const config::Config>& config, bus::PointStore& store);
  std::vector<AlarmService::DiskState> LookAtDisks(Now now) BAUDGATE_REQUIRES(mutex_);

  std::shared_ptr<StateFolder> state_;
  // Why the state folder was not opened at the start; empty: the folder was opened.
  std::string why_no_state_;
  std::unique_ptr<DeviceMemory> memory_;
  std::shared_ptr<StateFolder> databases_;  // null: the databases are in `state_`
  std::shared_ptr<StateFolder> history_folder_;
  mutable Mutex mutex_;
  struct RunningHistory {
    std::shared_ptr<const config::Config> config;
    std::unique_ptr<history::HistoryLog> log{};
  };
  RunningHistory history_ BAUDGATE_GUARDED_BY(mutex_);
  // End of the previous run of the history; for the reloader's thread only.
  std::shared_future<void> history_ends_;
  std::unique_ptr<WritePath> writes_;
  std::unique_ptr<EventPath> events_ BAUDGATE_GUARDED_BY(mutex_);
  bool keeps_events_ = false;
  std::optional<Instant> disks_at_ BAUDGATE_GUARDED_BY(mutex_);
};

}  // namespace baudgate::records
