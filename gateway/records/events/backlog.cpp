// SPDX-License-Identifier: Apache-2.0
#include "gateway/records/events/backlog.h"

#include <algorithm>
#include <iterator>
#include <utility>

namespace baudgate::events {

std::optional<std::vector<EventRecord>> Backlog::Take(std::int64_t after, std::size_t most) {
  const auto found = pages_.find(after);
  if (found == pages_.end()) {
    wanted_.insert(after);
    return std::nullopt;
  }
  std::vector<EventRecord> page = std::move(found->second);
  pages_.erase(found);
  if (page.size() > most) {
    const auto rest = page.begin() + static_cast<std::ptrdiff_t>(most);
    pages_[std::prev(rest)->seq] = {std::make_move_iterator(rest),
                                    std::make_move_iterator(page.end())};
    page.erase(rest, page.end());
  }
  return page;
}

std::optional<std::int64_t> Backlog::wanted() const {
  return wanted_.empty() ? std::nullopt : std::optional(*wanted_.begin());
}

void Backlog::Supply(std::int64_t after, std::vector<EventRecord> events) {
  wanted_.erase(after);
  if (pages_.size() == kMostPages) pages_.clear();
  pages_[after] = std::move(events);
}

}  // namespace baudgate::events
