// SPDX-License-Identifier: Apache-2.0
#include "gateway/audit/repeats.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

namespace baudgate::audit {
namespace {

std::string KeyOf(const WriteRecord& record) {
  return fmt::format("{}\n{}\n{}\n{}\n{}\n{}", Name(record.kind), AddressOf(record.client),
                     record.line, record.device, record.point, OutcomeOf(record));
}

}  // namespace

std::string AddressOf(const std::string& client) {
  const auto colon = client.rfind(':');
  if (colon == std::string::npos || colon + 1 == client.size()) return client;
  const bool port = std::all_of(client.begin() + static_cast<std::ptrdiff_t>(colon) + 1,
                                client.end(), [](char c) { return c >= '0' && c <= '9'; });
  return port ? client.substr(0, colon) : client;
}

void Repeats::Add(WriteRecord record, Instant now) {
  std::string key = KeyOf(record);
  auto found = open_.find(key);
  if (found == open_.end() && open_.size() >= kMost) {
    record.client = kOthers;
    record.line = record.device = record.point = {};
    record.before = record.value = {};
    key = KeyOf(record);
    found = open_.find(key);
  }
  if (found == open_.end()) {
    record.settled = std::nullopt;
    const auto ticket = book_.Begin(record);
    if (!ticket) return;
    open_.emplace(std::move(key), Open{std::move(record), *ticket, now + kWindow});
    return;
  }
  Open& open = found->second;
  WriteRecord& kept = open.record;
  if (kept.count++ == 1) kept.first = kept.value;
  kept.last = record.last;
  kept.value = std::move(record.value);
  kept.reason = std::move(record.reason);
  kept.took = record.took;
  open.changed = true;
}

void Repeats::Tick(Instant now) {
  for (auto entry = open_.begin(); entry != open_.end();) {
    Open& open = entry->second;
    const bool over = open.until <= now;
    if (over || open.changed) book_.Change(open.ticket, open.record, over);
    open.changed = false;
    entry = over ? open_.erase(entry) : std::next(entry);
  }
}

void Repeats::Close() {
  for (auto& [key, open] : open_) book_.Change(open.ticket, open.record, true);
  open_.clear();
}

}  // namespace baudgate::audit
