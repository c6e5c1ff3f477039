// The sink before the lines: every write to a point, and every telegram by hand that may write,
// waits until its record is on the disk, at most 500 ms, and then goes to the line; its end
// completes the record. Writes keep their order; what only reads goes to the line at once.
//
//   Submit(w) → Begin(record of w) → kept → inner.Submit(w) → w.End(ok) → End(record, ok)
//                                  → not kept, require      → w.End(denied)
//                                  → not kept, best_effort  → inner.Submit(w)
//
// BeginLoan and EndLoan record the loan of a port, and Witness records a write that a route passes
// on.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "config/model/config.h"
#include "gateway/base/bytes.h"
#include "gateway/base/guarded.h"
#include "gateway/base/worker.h"
#include "gateway/bus/points/point_store.h"
#include "gateway/bus/writes/route_queue.h"
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

// The two records of a loan of a port to a network client: its beginning and its end. Neither has
// what the client sent.
struct Loan {
  std::string line;
  std::string client;  ///< "10.0.0.7:40112"
  Now began{};
};

/// `how`: "at 127.0.0.1:4001, raw, for 30min".
void BeginLoan(WriteLog& log, const Loan& loan, const std::string& how);
/// `how`: "it has left; 120 bytes to the port, 340 from it".
void EndLoan(WriteLog& log, const Loan& loan, const std::string& how, Now now);

// Writes that are passed on to a slave as they are: their records are made after the exchange, and
// nothing waits for them. Called by gateway/outputs/modbus/service for every routed request except
// reads.
struct RoutedWrite {
  std::string client;
  std::string target;     ///< name of the line, or "10.0.0.9:502"
  std::uint8_t unit = 0;  ///< as the client addresses it
  bool broadcast = false;
  View pdu;
  Now asked;
};

/// Function, address and at most 16 values: "06 holding 100", 7; "16 holding 100-101", "1 2". Only
/// the code for functions other than 5, 6, 15, 16, 22 and 23.
WriteRecord RecordOf(const RoutedWrite& write);

/// The record of one request. Reports once to the log how the request ended; if all copies of
/// Watch's function are destroyed without a call, that its result is not known.
class Witness {
 public:
  /// `log` outlives it.
  Witness(WriteLog& log, const RoutedWrite& write);
  ~Witness();
  Witness(const Witness&) = delete;
  Witness& operator=(const Witness&) = delete;

  using Done = std::function<void(RoutedReply)>;
  /// Returns `done`, which also reports to the log.
  static Done Watch(std::shared_ptr<Witness> witness, Done done);
  /// The gateway has denied it.
  void Deny(WriteEnd end, const std::string& reason);

 private:
  void Tell(const Ending& ending);

  WriteLog& log_;
  WriteRecord record_;
  const Instant asked_;
  const bool broadcast_;
  bool told_ = false;
};

}  // namespace baudgate::audit
