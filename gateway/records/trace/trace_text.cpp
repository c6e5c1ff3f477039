// SPDX-License-Identifier: Apache-2.0
#include "gateway/records/trace/trace_text.h"

#include <fmt/format.h>

#include <utility>

namespace baudgate {
namespace {

/// "04:05:06.123456", UTC.
std::string ClockText(WallTime at) {
  const auto day = std::chrono::floor<std::chrono::days>(at);
  const std::chrono::hh_mm_ss clock(std::chrono::floor<std::chrono::microseconds>(at - day));
  return fmt::format("{:02}:{:02}:{:02}.{:06}", clock.hours().count(), clock.minutes().count(),
                     clock.seconds().count(), clock.subseconds().count());
}

std::string EndText(const TraceRecord& record) {
  std::string text = fmt::format("= {}", Name(record.outcome));
  if (record.round_trip > Duration::zero()) {
    text += fmt::format(", {:.1f} ms", static_cast<double>(record.round_trip.count()) / 1e6);
  }
  if (!record.text.empty()) text += ": " + record.text;
  return text;
}

}  // namespace

std::string ToText(const TraceRecord& record) {
  const std::string head =
      ClockText(record.at) + " " + (record.device.empty() ? "-" : record.device) + " ";
  switch (record.kind) {
    case TraceRecord::Kind::sent:
      return head + "> " + record.hex + " | " + record.text;
    case TraceRecord::Kind::received:
      return head + "< " + record.hex + " | " + record.text;
    case TraceRecord::Kind::end:
      return head + EndText(record);
    case TraceRecord::Kind::note:
      break;
  }
  return head + "# " + record.text;
}

void TraceQueue::Push(const TraceRecord& record) {
  bool was_empty = false;
  {
    const MutexLock lock(mutex_);
    if (records_.size() >= kMostRecords) {
      ++dropped_;
      return;
    }
    was_empty = records_.empty();
    records_.push_back(record);
  }
  if (was_empty && wake_) wake_();
}

std::vector<TraceRecord> TraceQueue::Take() {
  const MutexLock lock(mutex_);
  std::vector<TraceRecord> taken(std::make_move_iterator(records_.begin()),
                                 std::make_move_iterator(records_.end()));
  records_.clear();
  if (dropped_ > 0) {
    // The queue was full and nothing was taken until now: what is missing came last.
    TraceRecord note;
    note.at = taken.back().at;
    note.text =
        fmt::format("{} records were dropped: the reader is too slow", std::exchange(dropped_, 0));
    taken.push_back(std::move(note));
  }
  return taken;
}

}  // namespace baudgate
