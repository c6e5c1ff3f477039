// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>

#include "gateway/records/disk/read_once.h"
#include "gateway/records/history/history_page.h"
#include "gateway/records/history/trend_file.h"

namespace baudgate::history {
namespace {

struct Part {
  std::int64_t run = 0;
  Trend trend{};
};

constexpr const char* kColumns =
    "SELECT run, begin, mean, min, max, first, last, count, good FROM ";

/// Empty: it is no span of a point.
std::optional<Part> PartOf(const Statement& row) {
  Part part{row.Number(0),
            {row.Number(1), row.Real(2), row.Real(3), row.Real(4), row.Real(5), row.Real(6),
             row.Number(7), row.Number(8)}};
  const Trend& trend = part.trend;
  const bool finite = std::isfinite(trend.mean) && std::isfinite(trend.min) &&
                      std::isfinite(trend.max) && std::isfinite(trend.first) &&
                      std::isfinite(trend.last);
  if (!finite || trend.count < 0 || trend.good <= 0 || trend.good > kHour) return std::nullopt;
  return part;
}

class TrendReader {
 public:
  TrendReader(Database& database, const TrendQuery& query) : database_(database), query_(query) {}

  Result<TrendPage> Read() {
    page_.next = query_.since;
    Statement row(database_, "SELECT point FROM points WHERE name=?");
    row.Bind(1, query_.point);
    const Statement::Step step = row.Next();
    if (step == Statement::Step::failed) return Error{database_.error()};
    if (step == Statement::Step::done) return std::move(page_);
    page_.known = true;
    point_ = row.Number(0);
    bool ok = true;
    if (query_.every % kHour == 0) {
      ok = Add("hours", query_.since, "") && AddOpenHour();
    } else {
      ok = Add("minutes", query_.since, "");
    }
    if (!ok) return Error{database_.error()};
    Merge();
    return std::move(page_);
  }

 private:
  /// The current run has minutes of an hour that is not over.
  bool AddOpenHour() {
    Statement run(database_, "SELECT run, began FROM runs ORDER BY run DESC LIMIT 1");
    const Statement::Step step = run.Next();
    if (step != Statement::Step::row) return step == Statement::Step::done;
    const std::int64_t number = run.Number(0);
    Statement last(database_,
                   "SELECT begin FROM hours WHERE point=? AND begin>=? AND run=? ORDER BY begin "
                   "DESC LIMIT 1");
    last.Bind(1, point_);
    last.Bind(2, FloorTo(run.Number(1), kHour));
    last.Bind(3, number);
    Millis from = FloorTo(run.Number(1), kMinute);
    if (last.Next() == Statement::Step::row) from = last.Number(0) + kHour;
    return Add("minutes", std::max(from, query_.since), " AND run=" + std::to_string(number));
  }

  bool Add(const char* table, Millis since, const std::string& where) {
    Statement rows(database_, std::string(kColumns) + table +
                                  " WHERE point=? AND begin>=? AND begin<?" + where +
                                  " ORDER BY begin, run");
    rows.Bind(1, point_);
    rows.Bind(2, since);
    rows.Bind(3, query_.until);
    // A page has so many spans. A client that asks for years by minutes asks again for the rest.
    std::size_t spans = 0;
    Millis span = std::numeric_limits<Millis>::min();
    Statement::Step step = rows.Next();
    for (; step == Statement::Step::row; step = rows.Next()) {
      const auto part = PartOf(rows);
      if (!part) continue;
      const Millis begin = FloorTo(part->trend.begin, query_.every);
      if (begin != span && ++spans > kPage) {
        end_ = std::min(end_, begin);
        return true;
      }
      span = begin;
      parts_.push_back(*part);
    }
    return step == Statement::Step::done;
  }

  void Merge() {
    std::ranges::stable_sort(parts_, [&](const Part& a, const Part& b) {
      const Millis begin_a = FloorTo(a.trend.begin, query_.every);
      const Millis begin_b = FloorTo(b.trend.begin, query_.every);
      if (begin_a != begin_b) return begin_a < begin_b;
      return a.run != b.run ? a.run < b.run : a.trend.begin < b.trend.begin;
    });
    for (const Part& part : parts_) {
      const Millis begin = FloorTo(part.trend.begin, query_.every);
      if (begin >= end_) break;
      if (page_.spans.empty() || page_.spans.back().begin != begin) {
        page_.spans.push_back(part.trend);
        page_.spans.back().begin = begin;
      } else {
        history::Merge(page_.spans.back(), part.trend);
      }
    }
    page_.more = end_ != std::numeric_limits<Millis>::max();
    if (page_.more) page_.next = end_;
  }

  Database& database_;
  const TrendQuery& query_;
  std::int64_t point_ = 0;
  std::vector<Part> parts_;
  Millis end_ = std::numeric_limits<Millis>::max();
  TrendPage page_;
};

}  // namespace

Result<TrendPage> ReadTrends(const std::filesystem::path& folder, const TrendQuery& query,
                             bool* damaged) {
  TrendQuery whole = query;  // a span is whole or not there
  whole.since = FloorTo(query.since, query.every);
  // An hour that ends meanwhile is counted once.
  return ReadOnce(folder / kTrendsFile, damaged,
                  [&](Database& database) { return TrendReader(database, whole).Read(); });
}

}  // namespace baudgate::history
