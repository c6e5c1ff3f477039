// Files of days that could not be read, or not whole. Each is read again from time to time,
// and forgotten when that works: the file was mended or removed, or there are descriptors again.
// No lock: gateway/records/history/history_view.h has it.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "gateway/records/history/history_page.h"

namespace baudgate::history {

class UnreadFiles {
 public:
  static constexpr std::size_t kMost = 16;

  struct Entry {
    UnreadFile file{};
    PageQuery query{};  ///< of this day alone
  };
  /// Whether it is new. Beyond the most it is passed over.
  bool Note(const UnreadFile& file, const PageQuery& query);
  void Forget(const UnreadFile& file);
  const std::vector<Entry>& entries() const { return entries_; }

  /// Reads it once more.
  static bool CanBeRead(const std::filesystem::path& folder, const Entry& entry);

 private:
  std::vector<Entry> entries_;
};

}  // namespace baudgate::history
