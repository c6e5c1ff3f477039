// SPDX-License-Identifier: Apache-2.0
#include "gateway/outputs/outlet/cursor_file.h"

#include <array>

namespace baudgate::outlet {
namespace {

constexpr std::array<const char*, 1> kMigrations = {R"sql(
CREATE TABLE cursor (
  one       INTEGER PRIMARY KEY CHECK (one = 1),
  run       INTEGER NOT NULL,
  from_time INTEGER NOT NULL,
  until     INTEGER NOT NULL,
  point     TEXT NOT NULL,
  time      INTEGER NOT NULL,
  offset    INTEGER NOT NULL
);
)sql"};
constexpr records::DatabaseKind kCursors = {
    0x4247'6f75, kMigrations, "PRAGMA synchronous=NORMAL; PRAGMA wal_autocheckpoint=64;"};

}  // namespace

Error CursorFile::Failed() {
  Error error{path_.string() + ": " + database_->error()};
  database_.reset();
  return error;
}

Status CursorFile::Open(std::string& news) {
  if (database_) return {};
  if (auto why = records::WhyNoFile(path_)) return Error{*why};
  records::OpenedDatabase opened = records::OpenDatabase(path_, kCursors, vfs_);
  news = opened.put_aside;
  if (!opened.database) return Error{opened.error};
  database_ = std::move(opened.database);
  open_ = records::OpenFile(path_, vfs_, *database_);
  return {};
}

Result<std::optional<history::Pass>> CursorFile::Load() {
  using Step = records::Statement::Step;
  history::Pass pass;
  Step step = Step::failed;
  {
    records::Statement row(*database_,
                           "SELECT run, from_time, until, point, time, offset FROM cursor");
    step = row.Next();
    if (step == Step::row) {
      pass = {row.Number(0), row.Number(1), row.Number(2), std::string(row.Text(3)),
              row.Number(4), row.Number(5)};
    }
  }
  if (step == Step::failed) return Failed();
  if (step == Step::done) return std::optional<history::Pass>();
  return std::optional(pass);
}

Status CursorFile::Save(const history::Pass& pass) {
  using Found = records::OpenFile::Found;
  if (database_ && open_.LookAt(*database_).found != Found::whole) database_.reset();
  std::string news;
  if (Status status = Open(news); !status) return status;
  bool ok = false;
  {
    records::Statement row(*database_, "INSERT OR REPLACE INTO cursor VALUES (1,?,?,?,?,?,?)");
    ok = row.Run(pass.run, pass.from, pass.until, pass.point, pass.time, pass.offset);
  }
  return ok ? Status() : Failed();
}

}  // namespace baudgate::outlet
