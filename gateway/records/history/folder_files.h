// The files of a history folder as a whole: how large they are, and which of them have to go.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "gateway/records/history/entry.h"

namespace baudgate::history {

struct FolderFiles {
  struct Day {
    Millis day = 0;
    std::uint64_t bytes = 0;  ///< with its log
  };
  struct Aside {
    std::string name;
    std::uint64_t bytes = 0;                    ///< with its log
    std::filesystem::file_time_type written{};  ///< last
  };
  std::vector<Day> days;     ///< oldest first
  std::vector<Aside> aside;  ///< files that were put aside, oldest first
  std::uint64_t trends = 0;  ///< bytes of trends.db, with its log
  std::uint64_t bytes() const;
};

/// Empty if the folder cannot be read.
FolderFiles ListFiles(const std::filesystem::path& folder);

/// The limit itself is not reached: it is looked once a second, and a commit may be large.
constexpr std::uint64_t Ceiling(std::uint64_t limit) {
  constexpr std::uint64_t kCommit = 10'000'000;
  return limit - std::max(limit / 100, std::min(limit / 10, kCommit));
}

struct TooMuch {
  std::string file;
  std::optional<Millis> day{};  ///< empty: it was put aside
  bool old = false;             ///< true: past `keep`; false: too much for the size limit
};

/// Files that go, in that order: days that ended longer than `keep` before `sure`, then for the
/// limit files that were put aside, then days; oldest first. Never today's, and none that came
/// after it. `sure`: nothing: none is too old.
std::vector<TooMuch> FindTooMuch(FolderFiles folder_files, std::uint64_t limit, Millis keep,
                                 Millis today, std::optional<Millis> sure);

/// "values-20261123.db has 40.0 MB, trends.db 3.1 MB": the two largest.
std::string Largest(const FolderFiles& folder_files);

/// A file with all that belongs to it.
void RemoveFile(const std::filesystem::path& folder, const std::string& file);

}  // namespace baudgate::history
