// SPDX-License-Identifier: Apache-2.0
#include "gateway/records/history/history_view.h"

#include <algorithm>
#include <array>
#include <utility>

#include "gateway/records/history/day_file.h"
#include "gateway/records/history/history_files.h"

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

namespace {

/// A value that does not change is kept again after this, mostly: it is looked for so far back.
constexpr Millis kLookBack = kHour;
constexpr std::size_t kMostPages = 200;  // beyond, minutes have to do

constexpr std::array<Millis, 8> kSteps = {1 * kSecond,  2 * kSecond,  5 * kSecond,  10 * kSecond,
                                          15 * kSecond, 20 * kSecond, 30 * kSecond, kMinute};

/// A round one of at least so much.
Millis StepOf(const ChartQuery& query) {
  const Millis pixels = std::clamp<Millis>(query.pixels, 1, kMostPixels);
  const Millis least = (query.until - query.since + pixels - 1) / pixels;
  for (const Millis step : kSteps) {
    if (step >= least) return step;
  }
  return (least + kMinute - 1) / kMinute * kMinute;
}

std::optional<double> GoodValue(const Entry& entry) {
  if (!IsGood(entry.quality) || !HasValue(entry.value)) return std::nullopt;
  return ToDouble(entry.value);
}

/// By time, and one a step: runs overlap where the clock was set back.
void Tidy(std::vector<Trend>& rows, Millis since) {
  std::erase_if(rows, [since](const Trend& row) { return row.begin < since; });
  std::ranges::stable_sort(rows, {}, &Trend::begin);
  std::vector<Trend> tidy;
  for (const Trend& row : rows) {
    if (!tidy.empty() && tidy.back().begin == row.begin) {
      Merge(tidy.back(), row);
    } else {
      tidy.push_back(row);
    }
  }
  rows = std::move(tidy);
}

/// Empty: there are too many values.
Result<std::optional<Chart>> FromValues(const HistorySource& source, const ChartQuery& query,
                                        Millis step) {
  Chart chart{.step = step};
  Rollup rollup(step);
  PageQuery page_query{
      .point = query.point, .since = query.since - kLookBack, .until = query.until};
  Millis last = 0;
  for (std::size_t pages = 0;; ++pages) {
    if (pages == kMostPages) return std::optional<Chart>();
    const auto page = source.Read(page_query);
    if (!page) return Error{page.error()};
    chart.known = chart.known || page->known;
    for (const HistoryRecord& record : page->records) {
      if (record.gap || record.entry.time < last)
        rollup.Forget(std::max(last, record.entry.time), chart.rows);
      last = record.entry.time;
      if (!record.gap) rollup.Set(last, GoodValue(record.entry), true, chart.rows);
    }
    if (!page->more) break;
    page_query.after = page->next;
  }
  rollup.Forget(std::max(last, query.until), chart.rows);
  Tidy(chart.rows, FloorTo(query.since, step));
  return std::optional(std::move(chart));
}

Result<Chart> FromTrends(const HistorySource& source, const ChartQuery& query, Millis step) {
  Chart chart{.step = std::max(step, kMinute)};
  TrendQuery trend{
      .point = query.point, .since = query.since, .until = query.until, .every = chart.step};
  for (std::size_t pages = 0; pages < kMostPages; ++pages) {
    const auto page = source.ReadTrends(trend);
    if (!page) return Error{page.error()};
    chart.known = chart.known || page->known;
    chart.rows.insert(chart.rows.end(), page->spans.begin(), page->spans.end());
    if (!page->more) break;
    trend.since = page->next;
  }
  return chart;
}

}  // namespace

Result<Chart> ReadChart(const HistorySource& source, const ChartQuery& query) {
  const Millis step = StepOf(query);
  if (query.until - query.since <= kDay && step <= kMinute) {
    auto chart = FromValues(source, query, step);
    if (!chart) return Error{chart.error()};
    if (*chart) return std::move(**chart);
  }
  return FromTrends(source, query, step);
}

}  // namespace baudgate::history
