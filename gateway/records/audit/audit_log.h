// `AuditLog` is the audit while the gateway runs: any thread adds records, and the thread of
// events.db writes them to the file. All records that come during a commit share the next commit.
// While the disk fails, records wait in memory, up to the limits of AuditBook, and writing is tried
// again every second.
//
//   WriteLog   the interface for writers of records   AuditSource    the interface for readers
//   AuditLog   the thread and the lock                AuditedWrites  the sink before the lines
//   AuditBook  records that are not in the file yet   Repeats        folds equal records
//   AuditFile  opens the file, WriteTable its rows    Witness        records a routed write
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <condition_variable>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "gateway/base/guarded.h"
#include "gateway/base/worker.h"
#include "gateway/records/audit/audit_file.h"
#include "gateway/records/audit/audit_source.h"
#include "gateway/records/audit/audited_writes.h"
#include "gateway/records/disk/disk.h"

namespace baudgate::audit {

// `AuditBook` contains the records that are not in the file yet, or have changed since they were
// written. The writing thread takes them from here; they wait here while the disk fails. Their
// number is limited. No thread, no lock, no disk: AuditLog provides these.
//
//   Begin(r)      → 7            a ticket
//   Due()         → {7, r}       to be inserted
//   OnWritten({7, seq 1})        it is on the disk
//   End(7, ok…)   Due() → {7, seq 1, r}   to be updated; OnWritten → it is removed from the book
class AuditBook {
 public:
  /// The limits of each kind, in the order of Kind. A record counts until its last change is on the
  /// disk.
  static constexpr std::array<std::size_t, kKinds> kLimits = {8192, 2048, 2048, 256};

  /// Adds a record. Returns nothing if the limit is reached; the record is lost.
  std::optional<Ticket> Begin(WriteRecord record);
  /// Sets the result of the write. The record changes no more. An unknown ticket is ignored.
  void End(Ticket ticket, const Ending& ending);
  /// Replaces the record except its seq. `last`: no change of the record follows.
  void Change(Ticket ticket, const WriteRecord& record, bool last);

  bool due() const { return due_ > 0; }
  /// Returns the records that have to be written, in the order of their tickets.
  std::vector<Draft> Due() const;
  void OnWritten(const std::vector<Draft>& drafts);
  /// Must be called when a new file has replaced the old file: makes all records of the book due.
  void NewFile();

  /// The newest ticket whose record was written. The records of all older tickets were written,
  /// too.
  Ticket newest_written() const { return newest_written_; }
  std::size_t unwritten() const { return unwritten_; }
  std::uint64_t lost() const { return lost_; }

 private:
  struct Entry {
    WriteRecord record;
    std::uint64_t version = 1;
    std::uint64_t written_version = 0;  // 0: the record is not in the file
    bool ended = false;
  };

  void Changed(Entry& entry);

  std::map<Ticket, Entry> entries_;
  std::array<std::size_t, kKinds> held_{};
  Ticket next_ = 1;
  Ticket newest_written_ = 0;
  std::size_t due_ = 0;
  std::size_t unwritten_ = 0;
  std::uint64_t lost_ = 0;
};

// `Repeats` folds equal writes into one record: writes of one client (its address, with any port)
// to one register, with one outcome and one reason. The first write is recorded at once; writes
// within a minute after it change the record's count, last value and time. The number of records is
// limited: the registers of one client beyond kMostOfClient share one record, and clients beyond
// kMost share one record of each kind. No thread, no clock.
class Repeats {
 public:
  /// A record takes repeats for this time after its first write.
  static constexpr Duration kWindow = 1min;
  /// The most records that take repeats at a time: of each kind, and of one client address in a
  /// kind. Shared records do not count.
  static constexpr std::size_t kMost = 1024;
  static constexpr std::size_t kMostOfClient = 64;
  static constexpr const char* kManyPoints = "many points";
  static constexpr const char* kManyClients = "many others";

  explicit Repeats(AuditBook& book) : book_(book) {}

  /// Adds a write that has ended (`record.end` is set). The first of equal writes is put into the
  /// book at once; the following writes are counted in its record.
  void Add(WriteRecord record, Instant now);
  /// Passes changed records to the book, and ends records that have taken repeats for kWindow. To
  /// be called about once a second.
  void Tick(Instant now);
  void Close();

  bool empty() const { return open_.empty(); }

 private:
  struct Open {
    WriteRecord record;
    Ticket ticket = 0;
    Instant until;
    bool changed = false;
    bool shared = false;
  };
  using Key = std::string;

  /// Returns `record`. If the limit of its client or kind is reached, its line, device and values
  /// are empty, and its point is kManyPoints. If the limit of its kind is reached, its client is
  /// kManyClients.
  WriteRecord Shared(WriteRecord record) const;
  void Count(const Open& open, bool more);

  AuditBook& book_;
  std::map<Key, Open> open_;
  std::array<std::size_t, kKinds> of_kind_{};
  std::map<Key, std::size_t> of_client_;
};

/// Returns "192.0.2.5" for "192.0.2.5:40312". A client without a port is returned unchanged.
std::string AddressOf(const std::string& client);

class AuditLog final : public WriteLog, public AuditSource {
 public:
  static constexpr Duration kTick = 1s;
  struct Options {
    std::filesystem::path file;  ///< empty: there is no folder for the file
    std::string why_no_file{};
    bool require = false;
    std::string vfs{};
    /// The writer of events.db, which the event log also uses. Null: AuditLog makes one.
    std::shared_ptr<records::EventsWriter> writer{};
    std::function<Now()> clocks;
    /// These receive one line for the log, on any thread: `warn` for example when the disk begins
    /// to fail, `inform` when it works again.
    std::function<void(const std::string&)> warn;
    std::function<void(const std::string&)> inform;
    /// Called on the writing thread when the file is first opened, with the devices of writes to
    /// points that the last run of the gateway began and did not end. Can be empty.
    std::function<void(const std::set<Target>& devices)> unsettled{};
  };
  explicit AuditLog(Options options);
  /// Writes the records that are left, however long the disk takes; warns if records are lost.
  ~AuditLog() override;

  std::optional<Ticket> Begin(WriteRecord record) override;
  void End(Ticket ticket, const Ending& ending) override;
  Written WaitFor(Ticket ticket, Instant until) override;
  void Note(WriteRecord record, Instant asked) override;
  std::string Trouble() const override;

  /// To be called once a second, on any thread but the writing thread, because that thread can
  /// hang. Detects a disk that does not answer, and has the file checked every ten calls.
  void Watch();

  AuditState state() const override;
  Result<Page> Read(const PageQuery& query) const override;
  std::optional<bus::PastRequests> Past() const override;

 private:
  Instant Round(bool last);
  bool IsTime(Instant now) const BAUDGATE_REQUIRES(mutex_);
  void WriteDue(records::FileWatch::Look look);
  void SetPutAside();
  void OnWritten(const Status& status, const std::vector<Draft>& drafts);
  void SetDisk(records::Disk disk, const std::string& trouble) BAUDGATE_REQUIRES(mutex_);
  std::string Consequence() const;

  const Options options_;
  AuditFile file_;  // for the writing thread only
  bool was_open_ = false;
  mutable Mutex mutex_;
  std::condition_variable changed_;
  AuditBook book_ BAUDGATE_GUARDED_BY(mutex_);
  Repeats repeats_ BAUDGATE_GUARDED_BY(mutex_){book_};
  records::DiskCondition disk_ BAUDGATE_GUARDED_BY(mutex_);
  /// Requests of earlier runs that had a bus::RequestId. Empty until the file was first opened.
  std::optional<std::vector<bus::PastRequest>> past_ BAUDGATE_GUARDED_BY(mutex_);
  Instant look_at_ BAUDGATE_GUARDED_BY(mutex_){};
  mutable records::FileWatch watch_ BAUDGATE_GUARDED_BY(mutex_);
  Worker worker_;
};

}  // namespace baudgate::audit
