// SPDX-License-Identifier: Apache-2.0
#include "gateway/history/shelf.h"

#include <algorithm>
#include <numeric>
#include <system_error>

#include "gateway/history/day_file.h"

namespace baudgate::history {

namespace fs = std::filesystem;

std::uint64_t Shelf::bytes() const {
  return std::accumulate(days.begin(), days.end(), rest,
                         [](std::uint64_t sum, const Day& day) { return sum + day.bytes; });
}

Shelf LookAtShelf(const fs::path& folder) {
  Shelf shelf;
  std::error_code error;
  for (fs::directory_iterator at(folder, error), end; !error && at != end; at.increment(error)) {
    const std::string name = at->path().filename().string();
    std::error_code gone;  // meanwhile
    const std::uintmax_t size = at->file_size(gone);
    if (gone) continue;
    std::string day_name = name;
    for (const char* part : {"-wal", "-shm"}) {
      if (name.ends_with(part)) day_name.resize(name.size() - 4);
    }
    if (const auto day = DayOf(day_name)) {
      auto found = std::ranges::find(shelf.days, *day, &Shelf::Day::day);
      if (found == shelf.days.end()) found = shelf.days.insert(found, {*day, 0});
      found->bytes += size;
    } else if (name.starts_with("values-") || name.starts_with("trends.db")) {
      shelf.rest += size;
    }
  }
  std::ranges::sort(shelf.days, {}, &Shelf::Day::day);
  return shelf;
}

std::vector<Millis> TooMuch(const Shelf& shelf, std::uint64_t limit, Millis keep, Millis today) {
  std::vector<Millis> gone;
  std::uint64_t bytes = shelf.bytes();
  for (const Shelf::Day& day : shelf.days) {
    if (day.day >= today) break;
    const bool old = day.day + kDay + keep <= today;
    if (!old && bytes <= Ceiling(limit)) break;
    gone.push_back(day.day);
    bytes -= day.bytes;
  }
  return gone;
}

void RemoveDay(const fs::path& folder, Millis day) {
  const std::string file = (folder / DayFileName(day)).string();
  std::error_code ignored;
  // The log first: one without its file would be another file's.
  for (const char* part : {"-wal", "-shm", ""}) fs::remove(file + part, ignored);
}

}  // namespace baudgate::history
