// This file brings writes into the audit: `WriteLog` stores a `WriteRecord` of each write.
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

// `WriteRecord` is one write in the audit: its client, the requested value, and the result. The
// value of a point is in engineering units, as users see it. A routed write has the values of
// registers or bits, and a telegram by hand its bytes in hex. docs/audit.md describes the fields
// for users.

/// The kind of a record. The file limits each kind separately, so that a flood of one kind
/// displaces no record of another.
enum class Kind : std::uint8_t {
  point,  ///< a write to a point: recorded before it is sent
  route,  ///< a Modbus request that was passed on unchanged: recorded after its exchange
  denied,
  loan,
};
inline constexpr std::size_t kKinds = 4;

std::string_view Name(Kind kind);

struct WriteRecord {
  /// Number of the record, from 1 on without a gap, over restarts; 0: not in the file yet.
  std::int64_t seq = 0;
  Kind kind = Kind::point;
  WallTime time{};     ///< time of the request; for repeats, of the first request
  WallTime last{};     ///< for repeats, time of the last request; else equal to `time`
  std::string client;  ///< "192.0.2.5:40312", "user:root", "dds:GUID"
  std::string line;    ///< name of the line, or of the remote server: "10.0.0.9:502"
  std::string device;  ///< name of the device without its line; for a route "unit 20"
  std::string point;  ///< name of the point; for a route its function and address: "06 holding 100"
  Value before;       ///< the point's value before the write; empty: not known
  Value first;        ///< for repeats, the first value; else empty
  Value value;        ///< the value to write; for repeats, the last value
  std::optional<WriteEnd> end;  ///< result; empty: the write has not ended
  std::string reason;  ///< why the write failed, as one sentence; empty: the write succeeded
  Duration took{};
  std::uint64_t count = 1;  ///< number of equal writes that share this record
  /// Client and number of the request; for repeats, of the first request. Empty: the request had no
  /// number.
  std::optional<bus::RequestId> request{};
  /// Number among the ended writes, in the order of their ends. Empty: the write has not ended.
  std::optional<std::int64_t> settled;
};

/// Clipped cuts a longer text to this length in bytes, and appends "…".
inline constexpr std::size_t kLongestText = 240;
std::string Clipped(std::string text);

/// Returns the name of the outcome, for the file and for programs: "ok", "unknown", …; "pending"
/// while the write has not ended.
std::string_view OutcomeOf(const WriteRecord& record);
std::optional<WriteEnd> EndNamed(std::string_view name);
std::optional<Kind> KindNamed(std::string_view name);

using Ticket = std::uint64_t;  ///< number of a record in the log, from 1 on, in the order of Begin

struct Ending {
  WriteEnd end = WriteEnd::unknown;
  std::string reason{};
  Duration took{};
  /// Replaces WriteRecord::before. Empty: that value stays.
  std::optional<Value> before{};
};

struct Draft {
  Ticket ticket = 0;
  std::uint64_t version = 0;
  bool ended = false;  ///< no change of the record follows
  WriteRecord record;
};

/// All functions can be called on any thread. Only WaitFor waits.
class WriteLog {
 public:
  enum class Written : std::uint8_t {
    yes,
    failing,  ///< the disk has reported an error
    late,     ///< the disk did not answer in time
  };
  virtual ~WriteLog() = default;
  /// Adds the record of a write that is about to be sent. Empty: the log has no room for the
  /// record.
  virtual std::optional<Ticket> Begin(WriteRecord record) = 0;
  virtual void End(Ticket ticket, const Ending& ending) = 0;
  /// Waits until the record of this ticket, and all records before it, are on the disk; no longer
  /// than `until`.
  virtual Written WaitFor(Ticket ticket, Instant until) = 0;
  /// Adds the record of a write that has ended, or was denied; it was requested at `asked`. Equal
  /// writes share a record.
  virtual void Note(WriteRecord record, Instant asked) = 0;
  /// Returns why WaitFor fails now, as a sentence; empty: the disk works.
  virtual std::string Trouble() const = 0;
};

// `AuditedWrites` is the command sink in front of the lines. Each write to a point, and each manual
// telegram that may write, waits until its record is on the disk, 500 ms at most, and then goes to
// the line (`inner`); the end of the write completes the record. Writes do not overtake each other;
// commands that only read go to the line at once.
//
//   Submit(w) → Begin(record of w) → written → inner.Submit(w) → w.End(ok) → End(record, ok)
//                                  → not written, require      → w.End(denied)
//                                  → not written, best_effort  → inner.Submit(w)
class AuditedWrites final : public bus::CommandSink {
 public:
  /// The longest time that a command waits for its record. It waits in a queue, so neither the line
  /// nor the caller of Submit waits.
  static constexpr Duration kWaitForRecord = 500ms;
  /// The number of commands that can wait for their records; CommandRoom limits the share of each
  /// client.
  static constexpr std::size_t kLimit = 1024;

  /// All references must outlive this object; `log` must also outlive every command that was passed
  /// to `inner`. With `audit` `require`, a write without a record is denied.
  AuditedWrites(const bus::PointStore& store, bus::CommandSink& inner, WriteLog& log,
                config::Audit audit, std::function<Now()> clocks);
  ~AuditedWrites() override { Stop(); }

  /// Can be called on any thread; does not wait. The command's result can be reported on another
  /// thread than the line's.
  bool Submit(bus::WriteCommand command) override;
  void OnNotTaken(const bus::DeniedWrite& denied) override;

  void Start() { worker_.Start(); }
  /// Passes on, or denies, the commands that still wait. From now on Submit refuses commands.
  void Stop();

  /// Waits for the record of the next command, and passes the command on or denies it. False: no
  /// command waits. Tests call this in place of Start.
  bool HandOn();

 private:
  struct Waiting {
    bus::WriteCommand command;
    bus::CommandRoom::Ticket place = 0;
    // Ticket of the command's last record; the earlier records are on the disk before it.
    Ticket last = 0;
    bool has_room = true;  // the log had room for all records of the command
    Instant until;
  };

  WriteRecord RecordOf(const bus::WriteCommand& command, const bus::PointWrite& write,
                       Now now) const;
  std::vector<WriteRecord> RecordsOf(const bus::WriteCommand& command, Now now) const;
  /// Makes a record with the names of line, device and point. `point` empty: the record is for a
  /// telegram.
  WriteRecord Named(Kind kind, std::uint32_t device, std::optional<std::uint32_t> point) const;
  void NoteBusy(const bus::WriteCommand& command, Now now);

  const bus::PointStore& store_;
  bus::CommandSink& inner_;
  WriteLog& log_;
  const bool require_;
  const std::function<Now()> clocks_;
  Mutex mutex_;
  bool stop_ BAUDGATE_GUARDED_BY(mutex_) = false;
  bus::CommandRoom room_{kLimit};
  WorkQueue<Waiting> waiting_{kLimit + bus::CommandRoom::kMostAbandoned};
  Worker worker_;
};

// A loan of a port to a network client has two records: its beginning and its end. The records do
// not contain the bytes that the client sent.
struct Loan {
  std::string line;
  std::string client;  ///< "10.0.0.7:40112"
  Now began{};
};

/// `how`: text of the record. Example: "at 127.0.0.1:4001, raw, for 30min".
void BeginLoan(WriteLog& log, const Loan& loan, const std::string& how);
/// `how`: text of the record. Example: "it disconnected; 120 bytes to the port, 340 from it".
void EndLoan(WriteLog& log, const Loan& loan, const std::string& how, Now now);

// RoutedWrite is a write that is routed to a slave unchanged. Its record is made after the
// exchange, and the exchange does not wait for it. gateway/outputs/modbus/service uses it for every
// routed request except reads.
struct RoutedWrite {
  std::string client;
  std::string target;  ///< name of the line, or "10.0.0.9:502"
  std::uint8_t unit = 0;
  bool broadcast = false;
  View pdu;
  Now asked;
};

/// Makes the record of a routed write. Its point contains the function and the address, its value
/// at most 16 values. Examples: "06 holding 100", 7; "16 holding 100-101", "1 2". For functions
/// other than 5, 6, 15, 16, 22 and 23, the point contains only the function.
WriteRecord RecordOf(const RoutedWrite& write);

/// `Witness` records one routed request: it reports once to the log how the request ended. If the
/// function that Watch returned is destroyed without a call, Witness reports that the result is not
/// known.
class Witness {
 public:
  /// `log` must outlive this object.
  Witness(WriteLog& log, const RoutedWrite& write);
  ~Witness();
  Witness(const Witness&) = delete;
  Witness& operator=(const Witness&) = delete;

  using Done = std::function<void(bus::RoutedReply)>;
  /// Returns a function that reports the result to the log and then calls `done`.
  static Done Watch(std::shared_ptr<Witness> witness, Done done);
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
