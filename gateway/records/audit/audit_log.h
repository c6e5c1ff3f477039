// The audit while the gateway runs: records come from any thread, the thread of events.db writes
// them to the file, and all that come while the disk is busy share the next commit. While the disk
// fails they wait in memory, as many as audit_book.h holds, and it is tried again every second.
//
//   WriteLog   the interface for writers of records   AuditSource    for readers of its state
//   AuditLog   this: the thread and the lock          AuditedWrites  the sink before the lines
//   AuditBook  records that are not in the file yet   Repeats        folds equal denials
//   AuditFile  opens the file, WriteTable its rows    Witness        records a routed write
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <condition_variable>
#include <functional>

#include "gateway/base/guarded.h"
#include "gateway/base/worker.h"
#include "gateway/records/audit/audit_file.h"
#include "gateway/records/audit/audit_source.h"
#include "gateway/records/audit/repeats.h"
#include "gateway/records/audit/write_log.h"
#include "gateway/records/disk/disk_condition.h"
#include "gateway/records/disk/file_watch.h"

namespace baudgate::audit {

class AuditLog final : public WriteLog, public AuditSource {
 public:
  static constexpr Duration kTick = 1s;
  struct Options {
    std::filesystem::path file;  ///< empty: there is no place for it
    std::string why_no_file{};
    bool require = false;
    std::string vfs{};  ///< as in Database
    /// Shared with the events. Null: AuditLog makes one.
    std::shared_ptr<EventsWriter> writer{};
    std::function<Now()> clocks;
    /// One line when the disk begins to fail, and one when it is well again; from any thread.
    std::function<void(const std::string&)> warn;
    std::function<void(const std::string&)> inform;
    /// Called when the file is first opened, on the writing thread: devices with a write that the
    /// last run began and did not end. Empty: not wanted.
    std::function<void(const std::set<Target>& devices)> unsettled{};
  };
  explicit AuditLog(Options options);
  /// Writes what is left; as long as the disk takes.
  ~AuditLog() override;

  std::optional<Ticket> Begin(WriteRecord record) override;
  void End(Ticket ticket, const Ending& ending) override;
  Written WaitFor(Ticket ticket, Instant until) override;
  void Note(WriteRecord record, Instant asked) override;
  std::string Trouble() const override;

  /// Once a second, from any thread but the one that writes: that one may hang. From time to time
  /// the file is looked at.
  void Watch();

  AuditState state() const override;
  Result<Page> Read(const PageQuery& query) const override;
  std::optional<PastRequests> Past() const override;

 private:
  Instant Round(bool last);
  bool IsTime(Instant now) const BAUDGATE_REQUIRES(mutex_);
  void WriteDue(FileWatch::Look look);
  void SetPutAside();
  void OnWritten(const Status& status, const std::vector<Draft>& drafts);
  void SetDisk(Disk disk, const std::string& trouble) BAUDGATE_REQUIRES(mutex_);
  std::string Consequence() const;

  const Options options_;
  AuditFile file_;         // of the writing thread
  bool was_open_ = false;  // of the writing thread
  mutable Mutex mutex_;
  std::condition_variable changed_;
  AuditBook book_ BAUDGATE_GUARDED_BY(mutex_);
  Repeats repeats_ BAUDGATE_GUARDED_BY(mutex_){book_};
  DiskCondition disk_ BAUDGATE_GUARDED_BY(mutex_);
  /// The requests of earlier runs. Not set until the file has been opened.
  std::optional<std::vector<PastRequest>> past_ BAUDGATE_GUARDED_BY(mutex_);
  Instant look_at_ BAUDGATE_GUARDED_BY(mutex_){};  // a round is due at this time in any case
  mutable FileWatch watch_ BAUDGATE_GUARDED_BY(mutex_);
  Worker worker_;
};

}  // namespace baudgate::audit
