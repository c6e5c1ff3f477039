// SPDX-License-Identifier: Apache-2.0
#include "gateway/records/audit/audit_file.h"

#include <utility>

namespace baudgate::audit {
namespace {

/// A clock that was wrong at the start has been set by then, and drops nothing.
constexpr Duration kDropOldEvery = kDay;

}  // namespace

AuditFile::AuditFile(std::filesystem::path path, std::string vfs,
                     const std::array<Room, kKinds>& rooms, std::shared_ptr<EventsWriter> writer)
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
