// The files of a history folder as a whole: how large they are, and which of them have to go.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstdint>
#include <filesystem>
#include <vector>

#include "gateway/history/entry.h"

namespace baudgate::history {

struct Shelf {
  struct Day {
    Millis day = 0;
    std::uint64_t bytes = 0;  ///< with its log
  };
  std::vector<Day> days;   ///< oldest first
  std::uint64_t rest = 0;  ///< bytes of trends.db, and of files that were put aside
  std::uint64_t bytes() const;
};

/// Of a folder that can not be read: empty.
Shelf LookAtShelf(const std::filesystem::path& folder);

/// The limit itself is not reached: it is looked once a second, and a commit may be large.
constexpr std::uint64_t Ceiling(std::uint64_t limit) {
  constexpr std::uint64_t kCommit = 10'000'000;
  return limit - std::max(limit / 100, std::min(limit / 10, kCommit));
}

/// Days whose files go, oldest first: those that ended longer than `keep` before `today`, and as
/// many as are too much for the limit; never today's, and none that came after it.
std::vector<Millis> TooMuch(const Shelf& shelf, std::uint64_t limit, Millis keep, Millis today);

/// A day's file with all that belongs to it.
void RemoveDay(const std::filesystem::path& folder, Millis day);

}  // namespace baudgate::history
