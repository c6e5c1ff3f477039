// The plan of the house (docs/rooms.txt), and the includes of a source held against it.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <set>
#include <string>
#include <string_view>
#include <vector>

namespace baudgate::house {

struct Room {
  std::string name;              ///< "gateway/line": the folder
  std::vector<std::string> may;  ///< rooms, or single headers, that it may enter
};

/// Bottom to top, as the table has them. Every room may enter kGroundFloor.
std::vector<Room> ReadRooms(std::string_view table);
inline constexpr std::string_view kGroundFloor = "gateway/base";

/// An include of one of our own headers: `#include "gateway/bus/exchange/line.h"` in line 12.
struct Include {
  int line = 0;
  std::string header;
};
std::vector<Include> IncludesOf(std::string_view source);

/// "gateway/line" of "gateway/bus/exchange/line.h".
std::string RoomOf(std::string_view path);

/// One sentence for each include of `path` that its room may not have:
/// "gateway/bus/exchange/line.cpp:12: gateway/line may not enter gateway/poll
/// (gateway/bus/poller/poller.h)". What `path` uses of the table is added to `used`: room → entry.
std::vector<std::string> WrongIncludes(
    const std::vector<Room>& rooms, const std::string& path, std::string_view source,
    std::map<std::string, std::set<std::string>>* used = nullptr);

/// One sentence for each entry that names a room of its own line or below, or none at all.
std::vector<std::string> WrongEntries(const std::vector<Room>& rooms);

}  // namespace baudgate::house
