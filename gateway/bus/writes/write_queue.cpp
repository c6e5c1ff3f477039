// SPDX-License-Identifier: Apache-2.0
#include "gateway/bus/writes/write_queue.h"

#include <algorithm>
#include <iterator>
#include <utility>

#include "gateway/base/time.h"

namespace baudgate::bus {

namespace {

const WriteCommand& CommandOf(const WriteCommand& command) { return command; }
const WriteCommand& CommandOf(const WriteQueue::Confirmed& one) { return one.command; }

/// Removes the commands for which `stays` returns false from `commands`, and returns them.
template <typename Commands, typename Stays>
std::vector<typename Commands::value_type> TakeOut(Commands& commands, const Stays& stays) {
  const auto first = std::stable_partition(commands.begin(), commands.end(), stays);
  std::vector<typename Commands::value_type> taken(std::make_move_iterator(first),
                                                   std::make_move_iterator(commands.end()));
  commands.erase(first, commands.end());
  return taken;
}

}  // namespace

void WriteQueue::Push(WriteCommand command) {
  command.sequence = NextSequence();
  command.MoveTo(WriteState::queued);
  waiting_.push_back(std::move(command));
}

std::optional<WriteCommand> WriteQueue::Take(const MayGo& may_go) {
  const auto next = std::ranges::find_if(waiting_, may_go);
  if (next == waiting_.end()) return std::nullopt;
  WriteCommand command = std::move(*next);
  waiting_.erase(next);
  return command;
}

bool WriteQueue::HasAny(const MayGo& may_go) const { return std::ranges::any_of(waiting_, may_go); }

void WriteQueue::AddReadBack(QueryRef query) {
  const bool known = std::ranges::find(read_backs_, query) != read_backs_.end();
  if (!known) read_backs_.push_back(query);
}

void WriteQueue::AddReadBacks(std::size_t device, std::span<const protocols::Query> queries,
                              std::span<const std::size_t> points) {
  for (std::size_t query = 0; query < queries.size(); ++query) {
    if (std::ranges::find_first_of(queries[query].points, points) != queries[query].points.end()) {
      AddReadBack({device, query});
    }
  }
}

std::vector<std::size_t> WriteQueue::TakeReadBacks(std::size_t device,
                                                   std::span<const protocols::Query> queries) {
  std::vector<std::size_t> points;
  std::erase_if(read_backs_, [&](const QueryRef& one) {
    if (one.device != device) return false;
    const auto& its = queries[one.query].points;
    points.insert(points.end(), its.begin(), its.end());
    return true;
  });
  return points;
}

std::optional<QueryRef> WriteQueue::TakeReadBack(const MayRead& may_read) {
  const auto next = std::ranges::find_if(
      read_backs_, [&may_read](const QueryRef& query) { return may_read(query.device); });
  if (next == read_backs_.end()) return std::nullopt;
  const QueryRef query = *next;
  read_backs_.erase(next);
  return query;
}

void WriteQueue::Confirm(WriteCommand command, std::size_t device, Instant now) {
  confirmed_.push_back({std::move(command), device, now});
  Confirmed& last = confirmed_.back();
  last.written = last.command.writes().size();
  // If the command wrote a point twice, only the last value is compared with the reading.
  auto* const list = std::get_if<Writes>(&last.command.kind);
  if (list == nullptr) return;
  Writes& writes = *list;
  for (std::size_t i = writes.size(); i-- > 0;) {
    const auto same = [&](const PointWrite& one) { return one.point == writes[i].point; };
    const auto here = writes.begin() + static_cast<std::ptrdiff_t>(i);
    if (std::any_of(here + 1, writes.end(), same)) writes.erase(here);
  }
}

void WriteQueue::OnBegun(std::uint32_t device, std::uint32_t point) {
  for (Confirmed& one : confirmed_) {
    auto* const writes = std::get_if<Writes>(&one.command.kind);
    if (one.command.device != device || writes == nullptr) continue;
    const auto erased =
        std::erase_if(*writes, [&](const PointWrite& write) { return write.point == point; });
    if (erased > 0) one.replaced = true;
  }
}

std::vector<WriteQueue::Confirmed> WriteQueue::TakeConfirmed(const IsReadingBack& is_reading_back) {
  return TakeOut(confirmed_, [&](const Confirmed& one) {
    return is_reading_back(one.device) ||
           std::ranges::find(read_backs_, one.device, &QueryRef::device) != read_backs_.end();
  });
}

WriteQueue::Expired WriteQueue::TakeExpired(Instant now) {
  const auto in_time = [now](const auto& one) { return CommandOf(one).deadline > now; };
  return {TakeOut(waiting_, in_time), TakeOut(confirmed_, in_time)};
}

std::vector<WriteCommand> WriteQueue::TakeAll() {
  read_backs_.clear();
  std::vector<WriteCommand> all(std::make_move_iterator(waiting_.begin()),
                                std::make_move_iterator(waiting_.end()));
  waiting_.clear();
  return all;
}

std::optional<Instant> WriteQueue::Deadline() const {
  std::optional<Instant> soonest;
  const auto sooner = [&soonest](const auto& command) {
    soonest = Soonest({soonest, CommandOf(command).deadline});
  };
  std::ranges::for_each(waiting_, sooner);
  std::ranges::for_each(confirmed_, sooner);
  return soonest;
}

}  // namespace baudgate::bus
