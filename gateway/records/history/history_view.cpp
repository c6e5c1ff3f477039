// SPDX-License-Identifier: Apache-2.0
#include "gateway/records/history/history_view.h"

#include <utility>
#include <vector>

#include "gateway/records/history/day_file.h"
#include "gateway/records/history/trend_file.h"

namespace baudgate::history {

HistoryState HistoryView::state() const {
  const MutexLock lock(mutex_);
  HistoryState state = state_;
  for (const UnreadFiles::Entry& entry : unread_.entries()) state.unread.push_back(entry.file.text);
  return state;
}

Result<Page> HistoryView::Read(const PageQuery& query) const {
  if (options_.folder.empty()) return Error{options_.why_no_folder};
  if (state().disk == Disk::opening) return Page{.next = query.after, .known = true};
  auto page = ReadPage(options_.folder, query);
  if (!page) return page;
  for (const UnreadFile& file : page->unread) Note(file, query);
  return page;
}

/// Each is told once: a file that is damaged while the gateway runs is found by its first reader.
void HistoryView::Note(const UnreadFile& file, const PageQuery& query) const {
  {
    const MutexLock lock(mutex_);
    if (file.damaged) doubts_.insert(DayFileName(file.day));
    if (!unread_.Note(file, query)) return;
  }
  options_.warn("history: " + file.text + "; its values are missing in answers");
}

Result<TrendPage> HistoryView::ReadTrends(const TrendQuery& query) const {
  if (options_.folder.empty()) return Error{options_.why_no_folder};
  if (state().disk == Disk::opening) return TrendPage{.next = query.since, .known = true};
  bool damaged = false;
  auto page = history::ReadTrends(options_.folder, query, &damaged);
  if (damaged) {
    const MutexLock lock(mutex_);
    doubts_.insert(kTrendsFile);
  }
  return page;
}

std::set<std::string> HistoryView::TakeDoubts() {
  const MutexLock lock(mutex_);
  return std::exchange(doubts_, {});
}

void HistoryView::LookAgain() {
  std::vector<UnreadFiles::Entry> entries;
  {
    const MutexLock lock(mutex_);
    entries = unread_.entries();
  }
  for (const UnreadFiles::Entry& entry : entries) {
    if (!UnreadFiles::CanBeRead(options_.folder, entry)) continue;
    {
      const MutexLock lock(mutex_);
      unread_.Forget(entry.file);
    }
    options_.inform("history: this is over: " + entry.file.text);
  }
}

}  // namespace baudgate::history
