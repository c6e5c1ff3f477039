// How a write gets into the audit. WriteRecord is one record. WriteLog is the interface for those
// who record: gateway/records/audit/audit_log.h saves records, tests only remember them.
// AuditedWrites is the sink before the lines. BeginLoan and EndLoan record the loan of a port, and
// Witness records a write that a route passes on.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "config/model/config.h"
#include "gateway/base/bytes.h"
#include "gateway/base/guarded.h"
#include "gateway/base/outcome.h"
#include "gateway/base/time.h"
#include "gateway/base/value.h"
#include "gateway/base/worker.h"
#include "gateway/bus/points/point_store.h"
#include "gateway/bus/writes/request_book.h"
#include "gateway/bus/writes/route_queue.h"
#include "gateway/bus/writes/write_command.h"

namespace baudgate::audit {

// One write as the audit keeps it: its client, what it wanted, and the result. Values are in
// engineering units, as users see them, never bytes of a line. docs/audit.md has the fields for
// users.

/// Each kind has its own room in the file, so that a flood of one displaces no other.
enum class Kind : std::uint8_t {
  point,   ///< to a point: recorded before it is sent
  route,   ///< passed on as it was: recorded after its exchange
  denied,  ///< refused by the gateway
  loan,    ///< of a port over the network: its beginning, and its end
};
inline constexpr std::size_t kKinds = 4;

std::string_view Name(Kind kind);  ///< "point"

struct WriteRecord {
  std::int64_t seq = 0;  ///< from 1 on without a gap, over restarts; 0: it is not in the file yet
  Kind kind = Kind::point;
  WallTime time{};              ///< when it was asked for; of repeats the first
  WallTime last{};              ///< of repeats the last; else as `time`
  std::string client;           ///< "192.0.2.5:40312", "user:root", "dds:GUID"
  std::string line;             ///< or the server elsewhere: "10.0.0.9:502"
  std::string device;           ///< its bare name; of a route "unit 20"
  std::string point;            ///< of a route its function and address: "06 holding 100"
  Value before;                 ///< what the point showed before; empty: not known
  Value first;                  ///< of repeats the first value; else empty
  Value value;                  ///< the value to write; of repeats the last
  std::optional<WriteEnd> end;  ///< empty: it is under way
  std::string reason;           ///< one sentence; empty when ok
  Duration took{};              ///< from when it was asked for to its end
  std::uint64_t count = 1;      ///< of repeats, this one included
  std::optional<bus::RequestId> request{};  ///< of repeats the first; empty if there was no number
  std::optional<std::int64_t> settled;  ///< its number among those that have ended; empty: not yet
};

/// Longer texts are cut.
inline constexpr std::size_t kLongestText = 240;
std::string Clipped(std::string text);

/// The name of its outcome, in the file and for programs: "ok", "unknown", …; "pending" while under
/// way.
std::string_view OutcomeOf(const WriteRecord& record);
std::optional<WriteEnd> EndNamed(std::string_view name);
std::optional<Kind> KindNamed(std::string_view name);

using Ticket = std::uint64_t;  ///< from 1 on, in the order of Begin

struct Ending {
  WriteEnd end = WriteEnd::unknown;
  std::string reason{};
  Duration took{};
};

/// A record as it must be in the file.
struct Draft {
  Ticket ticket = 0;
  std::uint64_t version = 0;
  bool ended = false;  ///< no change follows
  WriteRecord record;  ///< seq 0: it is not in the file yet
};

/// May be called from any thread. Only WaitFor waits.
class WriteLog {
 public:
  enum class Written : std::uint8_t {
    yes,      ///< it is on the disk
    failing,  ///< the disk has said that it cannot
    late,     ///< the disk did not answer in time
  };
  virtual ~WriteLog() = default;
  /// A record of a write that is about to be done. Empty: there is no room for it.
  virtual std::optional<Ticket> Begin(WriteRecord record) = 0;
  virtual void End(Ticket ticket, const Ending& ending) = 0;
  /// Waits until the record of Begin, and all before it, are on the disk.
  virtual Written WaitFor(Ticket ticket, Instant until) = 0;
  /// A write that was done already, or denied; it was asked for at `asked`. Repeats share a record.
  virtual void Note(WriteRecord record, Instant asked) = 0;
  /// The last trouble of WaitFor, in words; empty: there is none.
  virtual std::string Trouble() const = 0;
};

// The sink before the lines: every write to a point, and every telegram by hand that may write,
// waits until its record is on the disk, at most 500 ms, and then goes to the line; its end
// completes the record. Writes keep their order; what only reads goes to the line at once.
//
//   Submit(w) → Begin(record of w) → kept → inner.Submit(w) → w.End(ok) → End(record, ok)
//                                  → not kept, require      → w.End(denied)
//                                  → not kept, best_effort  → inner.Submit(w)
//
class AuditedWrites final : public bus::CommandSink {
 public:
  /// A command waits for its record no longer. No line and no caller of Submit waits with it.
  static constexpr Duration kWaitForRecord = 500ms;
  /// Commands that may wait for their records.
  static constexpr std::size_t kLimit = 1024;

  /// All outlive it; `log` also outlives every command that was handed to `inner`. `audit`: whether
  /// a write without a record is denied (require).
  AuditedWrites(const bus::PointStore& store, bus::CommandSink& inner, WriteLog& log,
                config::Audit audit, std::function<Now()> clocks);
  ~AuditedWrites() override { Stop(); }

  /// From any thread; waits for nothing. A command may end on another thread than the line's.
  bool Submit(bus::WriteCommand command) override;
  void OnNotTaken(const bus::DeniedWrite& denied) override;

  /// Begins to hand commands on, on a thread of its own.
  void Start() { worker_.Start(); }
  /// Hands on, or denies, what still waits. Submit is not called any more.
  void Stop();

  /// Waits for the record of the next command and hands it on. False: none waits. For tests, in
  /// place of Start.
  bool HandOn();

 private:
  struct Waiting {
    bus::WriteCommand command;
    Ticket last = 0;       // its records are kept when this one is
    bool has_room = true;  // in the book, for all of them
    Instant until;
  };

  WriteRecord RecordOf(const bus::WriteCommand& command, const bus::PointWrite& write,
                       Now now) const;
  std::vector<WriteRecord> RecordsOf(const bus::WriteCommand& command, Now now) const;
  /// Without a point: of a telegram.
  WriteRecord Named(Kind kind, std::uint32_t device, std::optional<std::uint32_t> point) const;
  void NoteBusy(const bus::WriteCommand& command, Now now);

  const bus::PointStore& store_;
  bus::CommandSink& inner_;
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

  using Done = std::function<void(bus::RoutedReply)>;
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
