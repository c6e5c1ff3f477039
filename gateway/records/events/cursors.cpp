// SPDX-License-Identifier: Apache-2.0
#include "gateway/records/events/cursors.h"

#include <utility>

namespace baudgate::events {

std::optional<Cursor> CursorBook::Of(const std::string& consumer) const {
  const MutexLock lock(mutex_);
  const auto found = cursors_.find(consumer);
  return found == cursors_.end() ? std::nullopt : std::optional(found->second);
}

bool CursorBook::Set(const std::string& consumer, Cursor cursor) {
  if (!consumers_.contains(consumer)) return false;
  {
    const MutexLock lock(mutex_);
    const bool was_kept = cursors_ == kept_;
    cursors_[consumer] = cursor;
    if (!was_kept || cursors_ == kept_) return false;
  }
  const MutexLock lock(telling_);
  if (due_) due_();
  return true;
}

void CursorBook::OnDue(std::function<void()> due) {
  const MutexLock lock(telling_);
  due_ = std::move(due);
}

void CursorBook::OnOpened(const Cursors& kept) {
  const MutexLock lock(mutex_);
  kept_ = kept;
  for (const auto& [name, cursor] : kept) {
    if (consumers_.contains(name)) cursors_.emplace(name, cursor);
  }
}

std::optional<Cursors> CursorBook::Due() const {
  const MutexLock lock(mutex_);
  return cursors_ == kept_ ? std::nullopt : std::optional(cursors_);
}

void CursorBook::OnKept(const Cursors& kept) {
  const MutexLock lock(mutex_);
  kept_ = kept;
}

Cursors CursorBook::all() const {
  const MutexLock lock(mutex_);
  return cursors_;
}

}  // namespace baudgate::events
