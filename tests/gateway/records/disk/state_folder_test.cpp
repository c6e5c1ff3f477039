// Where state lies, and that two gateways never share it.
// SPDX-License-Identifier: Apache-2.0
#include "gateway/records/disk/state_folder.h"

#include <gtest/gtest.h>

#include <fstream>

namespace baudgate {
namespace {

namespace fs = std::filesystem;

fs::path Scratch(const std::string& name) {
  const fs::path folder = fs::path(::testing::TempDir()) / ("baudgate-state-" + name);
  fs::remove_all(folder);
  return folder;
}

TEST(StateFolder, TheFirstPlaceThatIsGiven) {
  StatePlaces places{"/srv/state", "/run/a:/run/b", true, "/x", "/home/u"};
  EXPECT_EQ(StateFolderOf(places, "plant"), "/srv/state/plant");
  places.configured = "";
  EXPECT_EQ(StateFolderOf(places, "plant"), "/run/a/plant");
  places.state_directory = "";
  EXPECT_EQ(StateFolderOf(places, "plant"), "/var/lib/baudgate/plant");
  places.system = false;
  EXPECT_EQ(StateFolderOf(places, "plant"), "/x/baudgate/plant");
  places.xdg_state_home = "";
  EXPECT_EQ(StateFolderOf(places, "plant"), "/home/u/.local/state/baudgate/plant");
  places.home = "";
  EXPECT_EQ(StateFolderOf(places, "plant"), "");
}

TEST(StateFolder, IsMadeAndLockedUntilItsOwnerEnds) {
  const fs::path path = Scratch("locked") / "deep" / "plant";
  auto first = std::make_shared<StateFolder>(path);
  ASSERT_FALSE(first->Open());
  EXPECT_FALSE(first->Open()) << "it is ours already";
  EXPECT_TRUE(fs::is_directory(path));
  StateFolder second(path);
  const auto failure = StateFolder::OpenWithin(std::make_shared<StateFolder>(path), 10s);
  ASSERT_TRUE(failure);
  EXPECT_TRUE(failure->in_use);
  EXPECT_NE(failure->text.find("another gateway.name"), std::string::npos);
  first.reset();
  EXPECT_FALSE(second.Open());
}

TEST(StateFolder, IsMadeAgainWhereSomebodyHasRemovedIt) {
  const fs::path path = Scratch("removed") / "plant";
  StateFolder folder(path);
  ASSERT_FALSE(folder.Open());
  fs::remove_all(path);
  EXPECT_FALSE(folder.Open());
  EXPECT_TRUE(fs::is_directory(path));
  EXPECT_TRUE(StateFolder(path).Open()) << "and locked";
}

TEST(StateFolder, AFolderInPlaceOfItsLockIsNamed) {
  const fs::path path = Scratch("lock") / "plant";
  fs::create_directories(path / "lock");
  const auto failure = StateFolder(path).Open();
  ASSERT_TRUE(failure);
  EXPECT_EQ(failure->text, (path / "lock").string() + ": is a folder; remove it");
}

TEST(StateFolder, IsWantedWhereSomethingCanBeWritten) {
  config::Config config;
  EXPECT_FALSE(CanWrite(config));
  config.modbus.listen.resize(2);
  config.modbus.listen[0].permit = config.modbus.listen[1].permit = config::Permit::read;
  config.modbus.routes.resize(1);
  EXPECT_FALSE(CanWrite(config)) << "nobody may write through the route";
  config.modbus.listen[1].permit = config::Permit::data;
  EXPECT_TRUE(CanWrite(config));
  EXPECT_TRUE(NeedsState(config, {}));
  config.modbus.routes.clear();
  EXPECT_FALSE(CanWrite(config));
  config.lines.resize(1);
  config.lines[0].devices.resize(1);
  config.lines[0].devices[0].points.resize(2);
  EXPECT_FALSE(CanWrite(config));
  config.lines[0].devices[0].points[1].writing.allowed = true;
  config.modbus.enabled = false;
  EXPECT_TRUE(CanWrite(config)) << "by DDS, or on the command line";
}

TEST(StateFolder, SaysWhyItCanNotBeMade) {
  const fs::path file = Scratch("file");
  std::ofstream(file) << "no folder";
  StateFolder folder(file / "plant");
  const auto failure = folder.Open();
  ASSERT_TRUE(failure);
  EXPECT_FALSE(failure->in_use);
  EXPECT_NE(failure->text.find("Not a directory"), std::string::npos) << failure->text;
  // What stands in the way goes, and the folder is there.
  fs::remove(file);
  EXPECT_FALSE(folder.Open());
}

}  // namespace
}  // namespace baudgate
