// A write log that only records its calls. The test sets the state of its disk.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <string>
#include <vector>

#include "gateway/records/audit/audited_writes.h"

namespace baudgate::audit {

class RememberingLog final : public WriteLog {
 public:
  std::optional<Ticket> Begin(WriteRecord record) override {
    if (full) return std::nullopt;
    begun.push_back(std::move(record));
    return begun.size();
  }
  void End(Ticket ticket, const Ending& ending) override { ends[ticket].push_back(ending); }
  Written WaitFor(Ticket ticket, Instant until) override {
    waited.push_back({ticket, until});
    return written;
  }
  void Note(WriteRecord record, Instant) override { noted.push_back(std::move(record)); }
  std::string Trouble() const override { return "the disk is full"; }

  bool full = false;
  Written written = Written::yes;
  std::vector<WriteRecord> begun;
  std::map<Ticket, std::vector<Ending>> ends;
  std::vector<std::pair<Ticket, Instant>> waited;
  std::vector<WriteRecord> noted;
};

}  // namespace baudgate::audit
