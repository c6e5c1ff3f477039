// The interface for records of writes: gateway/records/audit/audit_log.h saves them, tests only
// remember. From any thread; only WaitFor waits.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "gateway/records/audit/audit_book.h"

namespace baudgate::audit {

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

}  // namespace baudgate::audit
