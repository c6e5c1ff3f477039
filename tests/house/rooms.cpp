// SPDX-License-Identifier: Apache-2.0
#include "tests/house/rooms.h"

#include <algorithm>
#include <sstream>

namespace baudgate::house {
namespace {

const Room* Find(const std::vector<Room>& rooms, std::string_view name) {
  const auto found = std::ranges::find(rooms, name, &Room::name);
  return found == rooms.end() ? nullptr : &*found;
}

bool IsHeader(std::string_view entry) { return entry.ends_with(".h"); }

}  // namespace

std::vector<Room> ReadRooms(std::string_view table) {
  std::vector<Room> rooms;
  std::istringstream lines{std::string(table)};
  for (std::string line; std::getline(lines, line);) {
    const std::size_t colon = line.find(':');
    if (line.empty() || line[0] == '#' || colon == std::string::npos) continue;
    Room& room = rooms.emplace_back();
    room.name = line.substr(0, colon);
    std::istringstream entries(line.substr(colon + 1));
    for (std::string entry; entries >> entry;) room.may.push_back(entry);
  }
  return rooms;
}

std::vector<Include> IncludesOf(std::string_view source) {
  constexpr std::string_view kStart = "#include \"";
  std::vector<Include> includes;
  std::istringstream lines{std::string(source)};
  int number = 0;
  for (std::string line; std::getline(lines, line);) {
    ++number;
    if (!line.starts_with(kStart)) continue;
    const std::string rest = line.substr(kStart.size());
    includes.push_back({number, rest.substr(0, rest.find('"'))});
  }
  return includes;
}

std::string RoomOf(std::string_view path) {
  const std::size_t slash = path.rfind('/');
  return slash == std::string_view::npos ? std::string() : std::string(path.substr(0, slash));
}

std::vector<std::string> WrongIncludes(const std::vector<Room>& rooms, const std::string& path,
                                       std::string_view source,
                                       std::map<std::string, std::set<std::string>>* used) {
  const std::string own = RoomOf(path);
  const Room* room = Find(rooms, own);
  if (room == nullptr) return {path + ": " + own + " is not in docs/rooms.txt"};
  std::vector<std::string> wrong;
  for (const Include& include : IncludesOf(source)) {
    const std::string other = RoomOf(include.header);
    if (other == own || other == kGroundFloor) continue;
    const auto entry = std::ranges::find_if(
        room->may, [&](const std::string& may) { return may == other || may == include.header; });
    if (entry == room->may.end()) {
      wrong.push_back(path + ":" + std::to_string(include.line) + ": " + own + " may not enter " +
                      other + " (" + include.header + ")");
    } else if (used != nullptr) {
      (*used)[own].insert(*entry);
    }
  }
  return wrong;
}

std::vector<std::string> WrongEntries(const std::vector<Room>& rooms) {
  std::vector<std::string> wrong;
  std::set<std::string> below;
  for (const Room& room : rooms) {
    for (const std::string& entry : room.may) {
      if (!below.contains(IsHeader(entry) ? RoomOf(entry) : entry)) {
        wrong.push_back(room.name + " names " + entry + ", which does not stand above it");
      }
    }
    below.insert(room.name);
  }
  return wrong;
}

}  // namespace baudgate::house
