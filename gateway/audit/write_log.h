// Where records of writes go: gateway/audit/audit_log.h keeps them, tests only remember. From any
// thread; nothing but WaitFor waits.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "gateway/audit/audit_book.h"

namespace baudgate::audit {

class WriteLog {
 public:
  enum class Kept : std::uint8_t {
    yes,      ///< it is on the disk
    failing,  ///< the disk has said that it cannot
    late,     ///< the disk has said nothing in time
  };
  virtual ~WriteLog() = default;
  /// A record of what is about to be done. Nothing: there is no room for it.
  virtual std::optional<Ticket> Begin(WriteRecord record) = 0;
  virtual void End(Ticket ticket, const Ending& ending) = 0;
  /// Waits until the record of Begin is kept, and all before it.
  virtual Kept WaitFor(Ticket ticket, Instant until) = 0;
  /// What has been done already, or was denied, `asked` at that time: repeats share a record.
  virtual void Note(WriteRecord record, Instant asked) = 0;
  /// As the last answers of WaitFor were, in words; empty: all is well.
  virtual std::string Trouble() const = 0;
};

}  // namespace baudgate::audit
