// Records that are not in the file yet, or have changed since: the writing thread takes them from
// here, and they wait here while the disk fails. Bounded. No thread, no lock, no disk: audit_log.h
// has them.
//
//   Begin(r)      → 7            a ticket
//   Due()         → {7, r}       to be inserted
//   OnWritten({7, seq 1})        it is on the disk
//   End(7, ok…)   Due() → {7, seq 1, r}   to be updated; OnWritten → it is forgotten here
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <optional>
#include <vector>

#include "gateway/records/audit/write_record.h"

namespace baudgate::audit {

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

class AuditBook {
 public:
  /// The most of each kind: writes to points wait here for their end, all for a disk that fails.
  static constexpr std::array<std::size_t, kKinds> kLimits = {8192, 2048, 2048, 256};

  /// Empty: there is no room, and the record is lost.
  std::optional<Ticket> Begin(WriteRecord record);
  /// Its last change. An unknown ticket is ignored.
  void End(Ticket ticket, const Ending& ending);
  /// Replaces the record, except seq; `last`: no change follows.
  void Change(Ticket ticket, const WriteRecord& record, bool last);

  bool due() const { return due_ > 0; }
  /// The records to write, in the order of their tickets.
  std::vector<Draft> Due() const;
  /// These are on the disk; each has its seq now.
  void OnWritten(const std::vector<Draft>& drafts);
  /// The file is a new one: none of these records is in it.
  void NewFile();

  /// All records up to this ticket have been in the file.
  Ticket newest_written() const { return newest_written_; }
  /// Records that are not in the file yet.
  std::size_t unwritten() const { return unwritten_; }
  std::uint64_t lost() const { return lost_; }

 private:
  struct Entry {
    WriteRecord record;
    std::uint64_t version = 1;
    std::uint64_t written_version = 0;  // 0: it is not in the file
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

}  // namespace baudgate::audit
