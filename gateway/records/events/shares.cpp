// SPDX-License-Identifier: Apache-2.0
#include "gateway/records/events/shares.h"

#include <algorithm>

#include "gateway/records/events/own_records.h"

namespace baudgate::events {

Shares::Key Shares::KeyOf(const EventRecord& record) {
  return {record.line, record.device, record.code, record.subject};
}

void Shares::Fill(Share& share, Instant now) {
  if (share.left == kAtOnce) {
    share.filled = now;
    share.settles = kSettles;
  }
  const auto more = std::min<std::int64_t>((now - share.filled) / kEach, kAtOnce - share.left);
  share.left += static_cast<int>(more);
  share.filled += more * kEach;
}

bool Shares::Take(const EventRecord& record, bool room, Instant now) {
  Share& share = shares_[KeyOf(record)];
  Fill(share, now);
  if (room && share.left_out == 0 && share.left > 0 && share.waiting < kAtOnce) {
    --share.left;
    ++share.waiting;
    return true;
  }
  if (share.left_out == 0) share.since = record.received;
  ++share.left_out;
  ++left_out_;
  share.last = record;
  share.last_at = now;
  return false;
}

void Shares::OnKept(const EventRecord& record) {
  const auto found = shares_.find(KeyOf(record));
  if (found != shares_.end() && found->second.waiting > 0) --found->second.waiting;
}

std::vector<EventRecord> Shares::TakeLeftOut(Now now, bool all) {
  std::vector<EventRecord> records;
  for (auto& [key, share] : shares_) {
    if (share.left_out == 0) continue;
    Fill(share, now.instant);
    if (share.left == 0) {
      if (!all && now.instant < share.SettledAt()) continue;
      share.settles = std::min(2 * share.settles, kEach);
    } else {
      --share.left;
    }
    ++share.waiting;
    const std::uint64_t more = std::exchange(share.left_out, 0) - 1;
    if (more > 0) records.push_back(LeftOutRecord(more, share.last, share.since, now.wall));
    records.push_back(std::move(share.last));
    share.last = {};
  }
  return records;
}

std::optional<Instant> Shares::NextAt() const {
  std::optional<Instant> next;
  for (const auto& [key, share] : shares_) {
    if (share.left_out == 0) continue;
    const Instant at =
        share.left > 0 ? Instant::min() : std::min(share.filled + kEach, share.SettledAt());
    if (!next || at < *next) next = at;
  }
  return next;
}

}  // namespace baudgate::events
