// SPDX-License-Identifier: Apache-2.0
#include "gateway/records/audit/audit_source.h"

#include <algorithm>
#include <limits>
#include <utility>

#include "gateway/base/text.h"

namespace baudgate::audit {
namespace {

constexpr std::string_view kColumns =
    "SELECT seq, kind, time, last, client, line, device, point, old, first, new, outcome, reason, "
    "took, count, settled, request_client, request_seq, request FROM writes ";
/// The limits of the requests that ReadRequests returns: in all, and of one client. They are above
/// the numbers that a running gateway remembers (gateway/bus/writes/request_book.h).
constexpr int kRequests = 8192;
constexpr int kRequestsOfAClient = 33;

Duration DurationOf(std::int64_t microseconds) {
  constexpr std::int64_t kMost = std::numeric_limits<std::int64_t>::max() / 1000;
  return std::chrono::microseconds(std::clamp<std::int64_t>(microseconds, 0, kMost));
}

Value ValueOf(Value value) {
  if (auto* text = std::get_if<std::string>(&value)) *text = Clipped(std::move(*text));
  return value;
}

/// Converts a request number. The database stores a number of 2^63 and above as a text.
std::uint64_t SeqOf(const Value& value) {
  if (const auto* text = std::get_if<std::string>(&value)) {
    return ParseInteger<std::uint64_t>(*text).value_or(0);
  }
  const auto* number = std::get_if<std::int64_t>(&value);
  return number != nullptr ? static_cast<std::uint64_t>(*number) : 0;
}

WriteRecord RecordOf(const records::Statement& row) {
  const auto text = [&](int column) { return Clipped(std::string(row.Text(column))); };
  WriteRecord record;
  record.seq = row.Number(0);
  record.kind = KindNamed(row.Text(1)).value_or(Kind::point);
  record.time = row.Time(2);
  record.last = row.Time(3);
  record.client = text(4);
  record.line = text(5);
  record.device = text(6);
  record.point = text(7);
  record.before = ValueOf(row.At(8));
  record.first = ValueOf(row.At(9));
  record.value = ValueOf(row.At(10));
  // An outcome that this version does not know must not count as a success.
  if (!row.IsNull(11)) record.end = EndNamed(row.Text(11)).value_or(WriteEnd::unknown);
  record.reason = text(12);
  record.took = DurationOf(row.Number(13));
  record.count = static_cast<std::uint64_t>(std::max<std::int64_t>(row.Number(14), 1));
  if (!row.IsNull(15)) record.settled = row.Number(15);
  if (!row.IsNull(16)) {
    record.request = bus::RequestId{text(16), SeqOf(row.At(17)), std::string(row.Text(18))};
  }
  return record;
}

}  // namespace

Result<Page> ReadPage(records::Database& database, const PageQuery& query) {
  const bool settled = query.order == PageQuery::Order::settled;
  const std::string order = settled ? "settled" : "seq";
  std::string sql(kColumns);
  sql += "WHERE " + order + ">?";
  if (query.since) sql += " AND time>=?";
  sql += " ORDER BY " + order + " LIMIT " + std::to_string(kPage + 1);
  records::Statement rows(database, sql);
  rows.BindAll(query.after, query.since);
  Page page;
  page.next = query.after;
  for (;;) {
    const records::Statement::Step step = rows.Next();
    if (step == records::Statement::Step::failed) return Error{database.error()};
    if (step == records::Statement::Step::done) return page;
    page.more = page.records.size() == kPage;
    if (page.more) return page;
    page.records.push_back(RecordOf(rows));
    const WriteRecord& record = page.records.back();
    const std::int64_t next = settled ? record.settled.value_or(page.next) : record.seq;
    // The number must grow from row to row. Otherwise a client that reads page after page would
    // reach no end in a damaged file.
    if (next <= page.next)
      return Error{"the rows of the file are out of order: the file is damaged"};
    page.next = next;
  }
}

Result<std::vector<bus::PastRequest>> ReadRequests(records::Database& database, WallTime now) {
  records::Statement rows(database,
                          std::string(kColumns) +
                              "WHERE seq IN (SELECT seq FROM (SELECT seq, ROW_NUMBER() OVER "
                              "(PARTITION BY request_client ORDER BY seq DESC) AS place FROM "
                              "writes WHERE kind='point' AND request_client IS NOT NULL) "
                              "WHERE place<=" +
                              std::to_string(kRequestsOfAClient) + ") ORDER BY seq DESC LIMIT " +
                              std::to_string(kRequests));
  std::vector<bus::PastRequest> requests;
  for (;;) {
    const records::Statement::Step step = rows.Next();
    if (step == records::Statement::Step::failed) return Error{database.error()};
    if (step == records::Statement::Step::done) return requests;
    WriteRecord record = RecordOf(rows);
    requests.push_back({std::move(*record.request), record.end.value_or(WriteEnd::unknown),
                        std::move(record.reason), record.took,
                        std::max<Duration>(now - record.time, {})});
  }
}

Result<Page> ReadPage(const std::filesystem::path& file, const PageQuery& query, bool* damaged) {
  return records::ReadOnce(file, damaged,
                           [&](records::Database& database) { return ReadPage(database, query); });
}

}  // namespace baudgate::audit
