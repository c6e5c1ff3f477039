// SPDX-License-Identifier: Apache-2.0
#include "gateway/records/audit/write_log.h"

#include <algorithm>
#include <utility>

namespace baudgate::audit {

std::string_view Name(Kind kind) {
  constexpr std::array<std::string_view, kKinds> kNames = {"point", "route", "denied", "loan"};
  return kNames[static_cast<std::size_t>(kind)];
}

std::string Clipped(std::string text) {
  if (text.size() <= kLongestText) return text;
  std::size_t end = kLongestText;
  // Not within a character of UTF-8.
  while (end > 0 && (static_cast<unsigned char>(text[end]) & 0xC0U) == 0x80U) --end;
  text.resize(end);
  return text + "…";
}

std::string_view OutcomeOf(const WriteRecord& record) {
  return record.end ? Name(*record.end) : std::string_view("pending");
}

std::optional<WriteEnd> EndNamed(std::string_view name) {
  for (std::size_t i = 0; i < kWriteEnds; ++i) {
    const auto end = static_cast<WriteEnd>(i);
    if (Name(end) == name) return end;
  }
  return std::nullopt;
}

std::optional<Kind> KindNamed(std::string_view name) {
  for (std::size_t i = 0; i < kKinds; ++i) {
    if (Name(static_cast<Kind>(i)) == name) return static_cast<Kind>(i);
  }
  return std::nullopt;
}

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
