// SPDX-License-Identifier: Apache-2.0
#include "gateway/records/audit/repeats.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

namespace baudgate::audit {
namespace {

/// "40.1 is above the maximum, 40" and "41 is above the maximum, 40" are one reason.
std::string ReasonOf(const WriteRecord& record) {
  std::string reason = record.reason;
  std::erase_if(reason, [](char c) { return (c >= '0' && c <= '9') || c == '.' || c == '-'; });
  return reason;
}

std::string KeyOf(const WriteRecord& record) {
  return fmt::format("{}\n{}\n{}\n{}\n{}\n{}", Name(record.kind), AddressOf(record.client),
                     record.line, record.device, record.point, OutcomeOf(record));
}

std::string ClientOf(const WriteRecord& record) {
  return fmt::format("{}\n{}", Name(record.kind), AddressOf(record.client));
}

}  // namespace

std::string AddressOf(const std::string& client) {
  const auto colon = client.rfind(':');
  if (colon == std::string::npos || colon + 1 == client.size()) return client;
  const bool port = std::all_of(client.begin() + static_cast<std::ptrdiff_t>(colon) + 1,
                                client.end(), [](char c) { return c >= '0' && c <= '9'; });
  return port ? client.substr(0, colon) : client;
}

WriteRecord Repeats::Shared(WriteRecord record) const {
  const auto client = of_client_.find(ClientOf(record));
  const bool many_points = client != of_client_.end() && client->second >= kMostOfClient;
  const bool many_clients = of_kind_[static_cast<std::size_t>(record.kind)] >= kMost;
  if (many_points || many_clients) {
    record.line = record.device = {};
    record.point = kManyPoints;
    record.before = record.value = {};
  }
  if (many_clients) record.client = kManyClients;
  return record;
}

void Repeats::Count(const Open& open, bool more) {
  if (open.shared) return;
  const auto client = of_client_.try_emplace(ClientOf(open.record)).first;
  std::size_t& of_kind = of_kind_[static_cast<std::size_t>(open.record.kind)];
  client->second = more ? client->second + 1 : client->second - 1;
  of_kind = more ? of_kind + 1 : of_kind - 1;
  if (client->second == 0) of_client_.erase(client);
}

void Repeats::Add(WriteRecord record, Instant now) {
  Key key = KeyOf(record) + "\n" + ReasonOf(record);
  auto found = open_.find(key);
  bool shared = false;
  if (found == open_.end()) {
    record = Shared(std::move(record));
    shared = record.point == kManyPoints;
    if (shared) key = KeyOf(record);
    found = open_.find(key);
  }
  if (found == open_.end()) {
    const auto ticket = book_.Begin(record);
    if (!ticket) return;
    const Open open{std::move(record), *ticket, now + kWindow, false, shared};
    Count(open, true);
    open_.emplace(std::move(key), open);
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
    if (over) Count(open, false);
    entry = over ? open_.erase(entry) : std::next(entry);
  }
}

void Repeats::Close() {
  for (auto& [key, open] : open_) book_.Change(open.ticket, open.record, true);
  open_.clear();
  of_kind_ = {};
  of_client_.clear();
}

}  // namespace baudgate::audit
