// Events that a consumer still needs but that are no longer in memory. It asks by the last number
// that it has; the thread that writes the file reads them; the consumer takes them here. No lock,
// no disk.
//
//   Take(40)               → nothing: wanted() is 40
//   Supply(40, {41 … 600})
//   Take(40, 100)          → {41 … 140}, and so on with Take(140)
//
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <vector>

#include "gateway/records/events/event_record.h"

namespace baudgate::events {

class Backlog {
 public:
  /// A page that its consumer does not take is not kept for ever.
  static constexpr std::size_t kMostPages = 8;

  /// nullopt: it is requested now. An empty list: the file has no event after `after` either.
  std::optional<std::vector<EventRecord>> Take(std::int64_t after, std::size_t most);
  std::optional<std::int64_t> wanted() const;
  void Supply(std::int64_t after, std::vector<EventRecord> events);

 private:
  std::set<std::int64_t> wanted_;
  std::map<std::int64_t, std::vector<EventRecord>> pages_;  // by the number before them
};

}  // namespace baudgate::events
