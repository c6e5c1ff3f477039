// The sink before the lines: every write to a point waits until its record is on the disk, at most
// 500 ms, and then goes to the line; its end completes the record. Commands keep their order.
//
//   Submit(w) → Begin(record of w) → kept → inner.Submit(w) → w.End(ok) → End(record, ok)
//                                  → not kept, require      → w.End(denied)
//                                  → not kept, best_effort  → inner.Submit(w)
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <optional>
#include <vector>

#include "config/model/config.h"
#include "gateway/base/guarded.h"
#include "gateway/base/worker.h"
#include "gateway/bus/points/point_store.h"
#include "gateway/bus/writes/write_command.h"
#include "gateway/records/audit/write_log.h"

namespace baudgate::audit {

class AuditedWrites final : public CommandSink {
 public:
  /// A command waits for its record no longer. No line and no caller of Submit waits with it.
  static constexpr Duration kWaitForRecord = 500ms;
  /// Commands that may wait for their records.
  static constexpr std::size_t kLimit = 1024;

  /// All outlive it; `log` also outlives every command that was handed to `inner`. `audit`: whether
  /// a write without a record is denied (require).
  AuditedWrites(const PointStore& store, CommandSink& inner, WriteLog& log, config::Audit audit,
                std::function<Now()> clocks);
  ~AuditedWrites() override { Stop(); }

  /// From any thread; waits for nothing. A command may end on another thread than the line's.
  bool Submit(WriteCommand command) override;
  void OnNotTaken(const DeniedWrite& denied) override;

  /// Begins to hand commands on, on a thread of its own.
  void Start() { worker_.Start(); }
  /// Hands on, or denies, what still waits. Submit is not called any more.
  void Stop();

  /// Waits for the record of the next command and hands it on. False: none waits. For tests, in
  /// place of Start.
  bool HandOn();

 private:
  struct Waiting {
    WriteCommand command;
    Ticket last = 0;       // its records are kept when this one is
    bool has_room = true;  // in the book, for all of them
    Instant until;
  };

  WriteRecord RecordOf(const WriteCommand& command, const PointWrite& write, Now now) const;
  std::vector<WriteRecord> RecordsOf(const WriteCommand& command, Now now) const;
  /// Without a point: of a telegram.
  WriteRecord Named(Kind kind, std::uint32_t device, std::optional<std::uint32_t> point) const;
  void NoteBusy(const WriteCommand& command, Now now);

  const PointStore& store_;
  CommandSink& inner_;
  WriteLog& log_;
  const bool require_;
  const std::function<Now()> clocks_;
  Mutex mutex_;
  bool stop_ BAUDGATE_GUARDED_BY(mutex_) = false;
  WorkQueue<Waiting> waiting_{kLimit};
  Worker worker_;
};

}  // namespace baudgate::audit
