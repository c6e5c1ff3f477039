// SPDX-License-Identifier: Apache-2.0
#include "gateway/records/events/past_page.h"

#include <algorithm>

#include "gateway/records/disk/read_once.h"

namespace baudgate::events {
namespace {

constexpr const char* kFind = "SELECT point FROM past_points WHERE line=? AND device=? AND name=?";
constexpr const char* kRows =
    "SELECT seq, time, span, value, quality FROM past WHERE point=?1 AND (time, seq)>(?2, ?3) AND "
    "time>=?4 AND time<?5 ORDER BY time, seq LIMIT ?6";

std::int64_t Micros(WallTime time) { return time.time_since_epoch() / 1us; }

PastRow RowOf(const Statement& row) {
  constexpr std::int64_t kLongest = 366LL * 24 * 3600 * 1'000'000;
  PastRow past;
  past.time = row.Time(1);
  past.span = std::clamp<std::int64_t>(row.Number(2), 0, kLongest) * 1us;
  past.value = row.At(3);
  if (!row.IsNull(4)) past.quality = Quality::OfWord(static_cast<std::uint16_t>(row.Number(4)));
  return past;
}

}  // namespace

Result<PastPage> ReadPast(Database& database, const PastQuery& query) {
  PastPage page;
  page.next = query.after;
  Statement find(database, kFind);
  find.Bind(1, query.line);
  find.Bind(2, query.device);
  find.Bind(3, query.name);
  const Statement::Step found = find.Next();
  if (found == Statement::Step::failed) return Error{database.error()};
  if (found == Statement::Step::done) return page;
  page.known = true;
  Statement rows(database, kRows);
  rows.Bind(1, find.Number(0));
  rows.Bind(2, query.after.time);
  rows.Bind(3, query.after.seq);
  rows.Bind(4, query.since ? Micros(*query.since) : std::numeric_limits<std::int64_t>::min());
  rows.Bind(5, query.until ? Micros(*query.until) : std::numeric_limits<std::int64_t>::max());
  rows.Bind(6, static_cast<std::int64_t>(kPastPage + 1));
  while (true) {
    const Statement::Step step = rows.Next();
    if (step == Statement::Step::failed) return Error{database.error()};
    if (step == Statement::Step::done) return page;
    page.more = page.rows.size() == kPastPage;
    if (page.more) return page;
    page.rows.push_back(RowOf(rows));
    page.next = {rows.Number(0), rows.Number(1)};
  }
}

Result<PastPage> ReadPast(const std::filesystem::path& file, const PastQuery& query,
                          bool* damaged) {
  return ReadOnce(file, damaged, [&](Database& database) { return ReadPast(database, query); });
}

}  // namespace baudgate::events
