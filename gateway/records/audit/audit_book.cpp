// SPDX-License-Identifier: Apache-2.0
#include "gateway/records/audit/audit_book.h"

#include <algorithm>
#include <utility>

namespace baudgate::audit {

std::optional<Ticket> AuditBook::Begin(WriteRecord record) {
  const auto kind = static_cast<std::size_t>(record.kind);
  if (held_[kind] >= kLimits[kind]) {
    ++lost_;
    return std::nullopt;
  }
  ++held_[kind];
  const Ticket ticket = next_++;
  Entry& entry = entries_[ticket];
  entry.record = std::move(record);
  entry.record.seq = 0;
  ++due_;
  ++unwritten_;
  return ticket;
}

void AuditBook::Changed(Entry& entry) {
  if (entry.written_version == entry.version) ++due_;
  ++entry.version;
}

void AuditBook::End(Ticket ticket, const Ending& ending) {
  const auto found = entries_.find(ticket);
  if (found == entries_.end() || found->second.ended) return;
  Entry& entry = found->second;
  Changed(entry);
  entry.ended = true;
  entry.record.end = ending.end;
  entry.record.reason = Clipped(ending.reason);
  entry.record.took = ending.took;
}

void AuditBook::Change(Ticket ticket, const WriteRecord& record, bool last) {
  const auto found = entries_.find(ticket);
  if (found == entries_.end() || found->second.ended) return;
  Entry& entry = found->second;
  Changed(entry);
  entry.ended = last;
  const std::int64_t seq = entry.record.seq;
  entry.record = record;
  entry.record.seq = seq;
}

std::vector<Draft> AuditBook::Due() const {
  std::vector<Draft> drafts;
  drafts.reserve(due_);
  for (const auto& [ticket, entry] : entries_) {
    if (entry.written_version == entry.version) continue;
    drafts.push_back({ticket, entry.version, entry.ended, entry.record});
  }
  return drafts;
}

void AuditBook::OnWritten(const std::vector<Draft>& drafts) {
  for (const Draft& draft : drafts) {
    newest_written_ = std::max(newest_written_, draft.ticket);
    const auto found = entries_.find(draft.ticket);
    if (found == entries_.end()) continue;
    Entry& entry = found->second;
    if (entry.written_version == 0) --unwritten_;
    entry.written_version = draft.version;
    entry.record.seq = draft.record.seq;
    if (entry.version != draft.version) continue;
    --due_;
    if (!entry.ended) continue;
    --held_[static_cast<std::size_t>(entry.record.kind)];
    entries_.erase(found);
  }
}

void AuditBook::NewFile() {
  for (auto& [ticket, entry] : entries_) {
    if (entry.written_version == entry.version) ++due_;
    if (entry.written_version != 0) ++unwritten_;
    entry.written_version = 0;
    entry.record.seq = 0;
  }
}

}  // namespace baudgate::audit
