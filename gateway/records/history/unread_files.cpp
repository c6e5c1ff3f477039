// SPDX-License-Identifier: Apache-2.0
#include "gateway/records/history/unread_files.h"

#include <algorithm>
#include <utility>

namespace baudgate::history {

bool UnreadFiles::Note(const UnreadFile& file, const PageQuery& query) {
  const bool known = std::ranges::find(entries_, file, &Entry::file) != entries_.end();
  if (known || entries_.size() >= kMost) return false;
  PageQuery its = query;
  its.since = std::max(its.since, file.day);
  its.until = std::min(its.until, file.day + kDay);
  entries_.push_back({file, std::move(its)});
  return true;
}

void UnreadFiles::Forget(const UnreadFile& file) {
  std::erase_if(entries_, [&](const Entry& entry) { return entry.file == file; });
}

bool UnreadFiles::CanBeRead(const std::filesystem::path& folder, const Entry& entry) {
  const auto page = ReadPage(folder, entry.query);
  return page && std::ranges::find(page->unread, entry.file) == page->unread.end();
}

}  // namespace baudgate::history
