// SPDX-License-Identifier: Apache-2.0
#include "gateway/records/audit/audit_file.h"

#include <algorithm>
#include <numeric>

namespace baudgate::audit {
namespace {

constexpr const char* kInsert =
    "INSERT INTO writes (kind, time, last, client, line, device, point, old, first, new, outcome, "
    "reason, took, count, settled, request_client, request_seq, request) "
    "VALUES (?,?,?,?,?,?,?,?,?,?,?,?,?,?,?,?,?,?)";
constexpr const char* kUpdate =
    "UPDATE writes SET last=?, old=?, first=?, new=?, outcome=?, reason=?, took=?, count=?, "
    "settled=? "
    "WHERE seq=?";
constexpr const char* kOrphans =
    "SELECT seq, line, device, kind='point' AND outcome IS NULL FROM writes WHERE settled IS NULL "
    "ORDER BY seq";
constexpr const char* kSettle =
    "UPDATE writes SET settled=?, outcome=coalesce(outcome, 'unknown'), reason=CASE WHEN outcome "
    "IS NULL THEN 'the gateway was stopped before it had ended' ELSE reason END WHERE seq=?";
constexpr const char* kPointsOf =
    "SELECT line, device, point, count(*), count(settled) FROM writes WHERE kind=? "
    "GROUP BY line, device, point ORDER BY min(seq)";
constexpr const char* kOldestOf =
    "DELETE FROM writes WHERE seq IN (SELECT seq FROM writes WHERE kind=? AND line=? AND device=? "
    "AND point=? AND settled IS NOT NULL ORDER BY seq LIMIT ?)";
/// Records are deleted when a kind exceeds its limit by one part in kSlack (1 %), so that many rows
/// are deleted at once.
constexpr std::int64_t kSlack = 100;

struct Share {
  std::array<std::string, 3> place;  // line, device, point
  std::int64_t rows = 0;
  std::int64_t ended = 0;  // records of ended writes; only these can be deleted

  std::int64_t Beyond(std::int64_t level) const {
    return std::min(ended, std::max<std::int64_t>(rows - level, 0));
  }
};

std::int64_t Beyond(const std::vector<Share>& shares, std::int64_t level) {
  return std::accumulate(
      shares.begin(), shares.end(), std::int64_t{0},
      [level](std::int64_t sum, const Share& one) { return sum + one.Beyond(level); });
}

/// Returns the smallest level such that deleting the records of each point above this level deletes
/// at most `rows` records of all points together.
std::int64_t LevelFor(const std::vector<Share>& shares, std::int64_t rows) {
  std::int64_t low = 0;
  std::int64_t high = 0;
  for (const Share& one : shares) high = std::max(high, one.rows);
  while (low < high) {
    const std::int64_t middle = low + (high - low) / 2;
    if (Beyond(shares, middle) <= rows) {
      high = middle;
    } else {
      low = middle + 1;
    }
  }
  return low;
}

std::int64_t Whole(const Value& value) {
  const auto* number = std::get_if<std::int64_t>(&value);
  return number != nullptr ? *number : 0;
}

}  // namespace

WriteTable::WriteTable(records::Database& database, const std::array<Room, kKinds>& rooms)
    : database_(database), rooms_(rooms), insert_(database, kInsert), update_(database, kUpdate) {}

bool WriteTable::Transaction(bool done) {
  const bool ok = done && database_.Execute("COMMIT");
  if (!ok) database_.Rollback();
  return ok;
}

bool WriteTable::Count() {
  rows_ = {};
  records::Statement count(database_, "SELECT kind, count(*) FROM writes GROUP BY kind");
  records::Statement::Step step = count.Next();
  for (; step == records::Statement::Step::row; step = count.Next()) {
    const auto kind = KindNamed(count.Text(0));
    if (kind) rows_[static_cast<std::size_t>(*kind)] = count.Number(1);
  }
  return step == records::Statement::Step::done;
}

bool WriteTable::SettleOrphans() {
  settled_ = Whole(database_.First("SELECT max(settled) FROM writes"));
  std::vector<std::int64_t> orphans;
  records::Statement find(database_, kOrphans);
  records::Statement::Step step = find.Next();
  for (; step == records::Statement::Step::row; step = find.Next()) {
    orphans.push_back(find.Number(0));
    if (find.Number(3) != 0) unsettled_.emplace(find.Text(1), find.Text(2));
  }
  if (step == records::Statement::Step::failed) return false;
  find.Reset();
  if (!orphans.empty() && !database_.Execute("BEGIN IMMEDIATE")) return false;
  bool ok = true;
  records::Statement settle(database_, kSettle);
  for (const std::int64_t seq : orphans) {
    ok = ok && settle.Run(++settled_, seq);
  }
  return (orphans.empty() || Transaction(ok)) && Count();
}

bool WriteTable::Write(std::vector<Draft>& drafts) {
  if (drafts.empty()) return true;
  const std::int64_t settled = settled_;
  const auto rows = rows_;
  bool ok = database_.Execute("BEGIN IMMEDIATE");
  for (Draft& draft : drafts) {
    if (!ok) break;
    if (draft.ended) draft.record.settled = ++settled_;
    ok = draft.record.seq == 0 ? Insert(draft) : Update(draft);
  }
  if (Transaction(ok)) return true;
  settled_ = settled;
  rows_ = rows;
  return false;
}

bool WriteTable::Insert(Draft& draft) {
  const WriteRecord& record = draft.record;
  insert_.BindAll(Name(record.kind), record.time, record.last, record.client, record.line,
                  record.device, record.point, record.before, record.first, record.value);
  if (record.end) insert_.Bind(11, Name(*record.end));
  insert_.Bind(12, record.reason);
  insert_.Bind(13, record.took / 1us);
  insert_.Bind(14, static_cast<std::int64_t>(record.count));
  if (record.settled) insert_.Bind(15, *record.settled);
  if (record.request) {
    insert_.Bind(16, record.request->client);
    insert_.Bind(17, Value(record.request->seq));
    insert_.Bind(18, record.request->content);
  }
  if (!insert_.Run()) return false;
  draft.record.seq = Whole(database_.First("SELECT last_insert_rowid()"));
  ++rows_[static_cast<std::size_t>(record.kind)];
  return draft.record.seq > 0;
}

bool WriteTable::Update(const Draft& draft) {
  const WriteRecord& record = draft.record;
  update_.BindAll(record.last, record.before, record.first, record.value);
  if (record.end) update_.Bind(5, Name(*record.end));
  update_.Bind(6, record.reason);
  update_.Bind(7, record.took / 1us);
  update_.Bind(8, static_cast<std::int64_t>(record.count));
  if (record.settled) update_.Bind(9, *record.settled);
  update_.Bind(10, record.seq);
  return update_.Run();
}

bool WriteTable::MakeRoom() {
  for (std::size_t kind = 0; kind < kKinds; ++kind) {
    const std::int64_t most = rooms_[kind].rows;
    if (rows_[kind] <= most + most / kSlack) continue;
    if (!database_.Execute("BEGIN IMMEDIATE")) return false;
    if (!Transaction(TakeOut(kind, rows_[kind] - most)) || !Count()) return false;
  }
  return true;
}

/// Deletes `rows` records of a kind: each point with more records than the level of LevelFor loses
/// its oldest records down to this level. If these are fewer than `rows`, some points lose one more
/// record.
bool WriteTable::TakeOut(std::size_t kind, std::int64_t rows) {
  const std::string_view name = Name(static_cast<Kind>(kind));
  std::vector<Share> shares;
  records::Statement find(database_, kPointsOf);
  find.Bind(1, name);
  records::Statement::Step step = find.Next();
  for (; step == records::Statement::Step::row; step = find.Next()) {
    shares.push_back(
        {{std::string(find.Text(0)), std::string(find.Text(1)), std::string(find.Text(2))},
         find.Number(3),
         find.Number(4)});
  }
  if (step == records::Statement::Step::failed) return false;
  find.Reset();
  const std::int64_t level = LevelFor(shares, rows);
  std::int64_t rest = rows - Beyond(shares, level);
  records::Statement oldest(database_, kOldestOf);
  for (const Share& one : shares) {
    std::int64_t gone = one.Beyond(level);
    if (rest > 0 && one.Beyond(level - 1) > gone) {
      ++gone;
      --rest;
    }
    if (gone == 0) continue;
    oldest.Bind(1, name);
    for (std::size_t i = 0; i < 3; ++i) oldest.Bind(static_cast<int>(2 + i), one.place[i]);
    oldest.Bind(5, gone);
    if (!oldest.Run()) return false;
  }
  return true;
}

bool WriteTable::DropOld(WallTime now) {
  if (!database_.Execute("BEGIN IMMEDIATE")) return false;
  bool ok = true;
  for (std::size_t kind = 0; kind < kKinds && ok; ++kind) {
    records::Statement old(database_,
                           "DELETE FROM writes WHERE kind=? AND time<? AND settled IS NOT NULL");
    ok = old.Run(Name(static_cast<Kind>(kind)), now - rooms_[kind].age);
  }
  return Transaction(ok) && Count();
}

namespace {

/// Old records are deleted for the first time a day after the start, so that a clock that was wrong
/// at the start deletes nothing.
constexpr Duration kDropOldEvery = kDay;

}  // namespace

AuditFile::AuditFile(std::filesystem::path path, std::string vfs,
                     const std::array<Room, kKinds>& rooms,
                     std::shared_ptr<records::EventsWriter> writer)
    : rooms_(rooms), connection_(std::move(path), std::move(vfs), std::move(writer)) {}

std::optional<AuditFile::Opened> AuditFile::Open() {
  if (table_) return std::nullopt;
  Opened opened = connection_.Open();
  if (!opened.ok) return opened;
  table_.emplace(connection_.database(), rooms_);
  opened.ok = table_->SettleOrphans();
  if (opened.ok) return opened;
  table_.reset();
  opened.error = connection_.Failed().message;
  connection_.Close();
  return opened;
}

Status AuditFile::Write(std::vector<Draft>& drafts) {
  Status status = connection_.Check();
  if (status && !table_->Write(drafts)) status = connection_.Failed();
  if (!connection_.is_open()) table_.reset();
  return status;
}

Status AuditFile::Check() {
  Status status = connection_.Check(true);
  if (!status) table_.reset();
  return status;
}

void AuditFile::Tidy(Now now) {
  if (!table_->MakeRoom()) return;
  if (!drop_old_at_) drop_old_at_ = now.instant + kDropOldEvery;
  if (now.instant < *drop_old_at_) return;
  drop_old_at_ = now.instant + kDropOldEvery;
  table_->DropOld(now.wall);
}

}  // namespace baudgate::audit
