// SPDX-License-Identifier: Apache-2.0
#include "gateway/audit/audit_file.h"

#include <sys/stat.h>

#include <utility>

namespace baudgate::audit {
namespace {

/// A clock that was wrong at the start has been set by then, and drops nothing.
constexpr Duration kDropOldEvery = kDay;

}  // namespace

AuditFile::AuditFile(std::filesystem::path path, std::string vfs,
                     const std::array<Room, kKinds>& rooms)
    : path_(std::move(path)), vfs_(std::move(vfs)), rooms_(rooms) {}

/// A connection is kept over errors of the disk: what a failed commit has left in the log is
/// written over by the next one. Another connection might take it for done, and it would be
/// doubled.
std::optional<AuditFile::Opened> AuditFile::Open() {
  if (table_) return std::nullopt;
  const bool again = std::exchange(damaged_, false);
  OpenedEvents events = OpenEvents(path_, vfs_, again);
  Opened opened{.error = std::move(events.error), .put_aside = std::move(events.put_aside)};
  opened.new_file = again || std::exchange(gone_, false) || !opened.put_aside.empty();
  damaged_ = again && !events.database;
  if (!events.database) return opened;
  database_ = std::move(events.database);
  table_.emplace(*database_, rooms_);
  opened.ok = table_->SettleOrphans();
  inode_ = Inode();
  if (opened.ok) return opened;
  opened.error = Failed().message;
  table_.reset();
  return opened;
}

Status AuditFile::Write(std::vector<Draft>& drafts) {
  if (IsGone()) {
    gone_ = true;
    table_.reset();
    database_.reset();
    return Error{path_.string() + ": it was removed, and all records in it"};
  }
  if (!table_->Write(drafts)) return Failed();
  return {};
}

void AuditFile::Tidy(Now now) {
  if (!table_->MakeRoom()) return;
  if (!drop_old_at_) drop_old_at_ = now.instant + kDropOldEvery;
  if (now.instant < *drop_old_at_) return;
  drop_old_at_ = now.instant + kDropOldEvery;
  table_->DropOld(now.wall);
}

bool AuditFile::IsGone() const { return inode_ != 0 && Inode() != inode_; }

std::uint64_t AuditFile::Inode() const {
  struct stat found {};
  if (!vfs_.empty() || ::stat(path_.c_str(), &found) != 0) return 0;
  return found.st_ino;
}

Error AuditFile::Failed() {
  Error error{path_.string() + ": " + database_->error()};
  if (database_->damaged()) {
    damaged_ = true;
    table_.reset();
    database_.reset();
  }
  return error;
}

}  // namespace baudgate::audit
