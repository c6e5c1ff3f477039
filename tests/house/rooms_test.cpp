// The tree against docs/rooms.txt; and that a wrong include would be found.
// SPDX-License-Identifier: Apache-2.0
#include "tests/house/rooms.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <iterator>

namespace baudgate::house {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;

namespace fs = std::filesystem;

std::string ReadFile(const fs::path& path) {
  std::ifstream file(path);
  return {std::istreambuf_iterator<char>(file), {}};
}

/// All of our sources below `top`, as paths from the root.
std::vector<std::string> SourcesBelow(const std::string& top) {
  std::vector<std::string> sources;
  for (const auto& entry : fs::recursive_directory_iterator(top)) {
    const std::string extension = entry.path().extension();
    if (extension == ".h" || extension == ".cpp") sources.push_back(entry.path().string());
  }
  std::ranges::sort(sources);
  return sources;
}

std::vector<Room> TheRooms() { return ReadRooms(ReadFile("docs/rooms.txt")); }

TEST(HouseTest, NoSourceEntersARoomThatItsOwnMayNotEnter) {
  const std::vector<Room> rooms = TheRooms();
  std::size_t sources = 0;
  for (const char* top : {"config", "protocols", "transports", "gateway"}) {
    for (const std::string& path : SourcesBelow(top)) {
      EXPECT_THAT(WrongIncludes(rooms, path, ReadFile(path)), IsEmpty());
      ++sources;
    }
  }
  EXPECT_GT(sources, 300U);
}

TEST(HouseTest, RoomsNameOnlyRoomsFartherDown) { EXPECT_THAT(WrongEntries(TheRooms()), IsEmpty()); }

TEST(HouseTest, EveryArrowIsUsed) {
  const std::vector<Room> rooms = TheRooms();
  std::map<std::string, std::set<std::string>> used;
  for (const char* top : {"config", "protocols", "transports", "gateway"}) {
    for (const std::string& path : SourcesBelow(top)) {
      WrongIncludes(rooms, path, ReadFile(path), &used);
    }
  }
  for (const Room& room : rooms) {
    for (const std::string& entry : room.may) {
      EXPECT_TRUE(used[room.name].contains(entry))
          << room.name << " may enter " << entry
          << " and never does: take it out of docs/rooms.txt";
    }
  }
}

TEST(HouseTest, FoldersOfTestsAreRooms) {
  const std::vector<Room> rooms = TheRooms();
  for (const auto& entry : fs::recursive_directory_iterator("tests/gateway")) {
    if (!entry.is_directory()) continue;
    const std::string folder = entry.path().string().substr(std::string("tests/").size());
    const bool is_room = std::ranges::any_of(rooms, [&](const Room& room) {
      return room.name == folder || room.name.starts_with(folder + "/");
    });
    EXPECT_TRUE(is_room) << entry.path() << " mirrors no room";
  }
}

constexpr std::string_view kTable =
    "# bottom to top\n"
    "gateway/base:\n"
    "config/model:\n"
    "protocols: config/model/point.h\n"
    "gateway/line: config/model protocols\n"
    "gateway/poll: gateway/line\n";

TEST(HouseTest, ATurnedArrowIsNamedWithItsLine) {
  const std::vector<Room> rooms = ReadRooms(kTable);
  const std::string source =
      "// a line that wants the poller\n"
      "#include <string>\n"
      "#include \"gateway/base/text.h\"\n"
      "#include \"gateway/bus/poller/poller.h\"\n";
  EXPECT_THAT(
      WrongIncludes(rooms, "gateway/bus/exchange/line.cpp", source),
      ElementsAre("gateway/bus/exchange/line.cpp:4: gateway/line may not enter gateway/poll "
                  "(gateway/bus/poller/poller.h)"));
  EXPECT_THAT(WrongIncludes(rooms, "gateway/bus/poller/poller.cpp",
                            "#include \"gateway/bus/exchange/line.h\"\n"),
              IsEmpty());
}

TEST(HouseTest, ASingleHeaderOpensNoRoom) {
  const std::vector<Room> rooms = ReadRooms(kTable);
  EXPECT_THAT(WrongIncludes(rooms, "protocols/twin.h", "#include \"config/model/point.h\"\n"),
              IsEmpty());
  EXPECT_THAT(WrongIncludes(rooms, "protocols/twin.h", "#include \"config/model/line.h\"\n"),
              ElementsAre("protocols/twin.h:1: protocols may not enter config/model "
                          "(config/model/line.h)"));
}

TEST(HouseTest, AFolderThatIsNoRoomIsNamed) {
  EXPECT_THAT(WrongIncludes(ReadRooms(kTable), "gateway/attic/box.cpp", ""),
              ElementsAre("gateway/attic/box.cpp: gateway/attic is not in docs/rooms.txt"));
}

TEST(HouseTest, AnArrowThatRunsUpIsNamed) {
  EXPECT_THAT(WrongEntries(ReadRooms("gateway/base:\ngateway/line: gateway/poll\ngateway/poll:\n")),
              ElementsAre("gateway/line names gateway/poll, which does not stand above it"));
}

}  // namespace
}  // namespace baudgate::house
