// Tests of the folder of the state, which two gateways never share, and of `DeviceMemory`.
// SPDX-License-Identifier: Apache-2.0
#include "gateway/records/disk/state_folder.h"

#include <gtest/gtest.h>

#include <fstream>
#include <thread>

#include "gateway/records/disk/device_memory.h"
#include "gateway/records/disk/disk.h"

namespace baudgate::records {
namespace {

namespace fs = std::filesystem;

fs::path Scratch(const std::string& name) {
  const fs::path folder = fs::path(::testing::TempDir()) / ("baudgate-state-" + name);
  fs::remove_all(folder);
  return folder;
}

TEST(StateFolder, IsTheFirstConfiguredPlace) {
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

TEST(StateFolder, IsCreatedAndLockedUntilItsOwnerEnds) {
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

TEST(StateFolder, IsCreatedAgainAfterItsRemoval) {
  const fs::path path = Scratch("removed") / "plant";
  StateFolder folder(path);
  ASSERT_FALSE(folder.Open());
  fs::remove_all(path);
  EXPECT_FALSE(folder.Open());
  EXPECT_TRUE(fs::is_directory(path));
  EXPECT_TRUE(StateFolder(path).Open()) << "and locked";
}

TEST(StateFolder, NamesAFolderInPlaceOfItsLock) {
  const fs::path path = Scratch("lock") / "plant";
  fs::create_directories(path / "lock");
  const auto failure = StateFolder(path).Open();
  ASSERT_TRUE(failure);
  EXPECT_EQ(failure->text, (path / "lock").string() + ": is a folder; remove it");
}

TEST(StateFolder, IsNeededWhereWritingIsAllowed) {
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

TEST(StateFolder, ReportsWhyItCannotBeCreated) {
  const fs::path file = Scratch("file");
  std::ofstream(file) << "no folder";
  StateFolder folder(file / "plant");
  const auto failure = folder.Open();
  ASSERT_TRUE(failure);
  EXPECT_FALSE(failure->in_use);
  EXPECT_NE(failure->text.find("Not a directory"), std::string::npos) << failure->text;
  fs::remove(file);
  EXPECT_FALSE(folder.Open());
}

class DeviceMemoryTest : public ::testing::Test {
 protected:
  DeviceMemoryTest() {
    fs::remove_all(folder_);
    fs::create_directories(folder_);
    config::Line line;
    line.name = "meters";
    for (const char* name : {"incomer", "feeder"}) {
      config::Device device;
      device.name = name;
      device.protocol = "set4tm";
      device.address = name[0] == 'i' ? "200" : "201";
      device.profile = "set-4tm.03m";
      line.devices.push_back(device);
    }
    config_.lines.push_back(line);
  }

  std::unique_ptr<DeviceMemory> Start() {
    return std::make_unique<DeviceMemory>(
        file(), config_, [this](const std::string& warning) { warnings_.push_back(warning); },
        [this](const std::string& trouble) { troubles_.push_back(trouble); });
  }
  static void AwaitWritten(const DeviceMemory& memory) {
    while (memory.kept() == DeviceMemory::Kept::waits) std::this_thread::yield();
  }
  fs::path file() const { return folder_ / "devices.json"; }
  config::Device& device(std::size_t index) { return config_.lines[0].devices[index]; }

  const fs::path folder_ = fs::path(::testing::TempDir()) / "baudgate-device-memory";
  config::Config config_;
  std::vector<std::string> warnings_;
  std::vector<std::string> troubles_;
};

TEST_F(DeviceMemoryTest, SurvivesARestart) {
  Start()->Set(1, "serial 12345678");
  EXPECT_EQ(Start()->Of(1), "serial 12345678");
  EXPECT_EQ(Start()->Of(0), "");
  Start()->Set(1, "");
  EXPECT_EQ(Start()->Of(1), "");
}

TEST_F(DeviceMemoryTest, BelongsToADeviceWithItsConfiguration) {
  Start()->Set(0, "serial 1");
  std::swap(device(0), device(1));
  EXPECT_EQ(Start()->Of(1), "serial 1") << "its place in the file does not matter";
  std::swap(device(0), device(1));
  const config::Device before = device(0);
  const auto forgets = [&](auto change) {
    change();
    EXPECT_EQ(Start()->Of(0), "");
    device(0) = before;
    config_.lines[0].name = "meters";
  };
  forgets([&] { device(0).name = "other"; });
  forgets([&] { device(0).address = "7"; });
  forgets([&] { device(0).profile = "set-4tm.02"; });
  forgets([&] { device(0).protocol = "other"; });
  forgets([&] { config_.lines[0].name = "other"; });
  EXPECT_EQ(Start()->Of(0), "serial 1");
}

TEST_F(DeviceMemoryTest, AnInvalidFileIsPutAsideAndNamed) {
  for (const char* text : {"", "{", "[]", "{\"devices\": 7}", "\xff\xfe"}) {
    warnings_.clear();
    std::ofstream(file()) << text;
    EXPECT_EQ(Start()->Of(0), "") << text;
    ASSERT_EQ(warnings_.size(), 1U) << text;
    EXPECT_NE(warnings_[0].find("devices.json.bad"), std::string::npos);
    EXPECT_TRUE(fs::exists(file().string() + ".bad"));
  }
}

TEST_F(DeviceMemoryTest, AnUnreadableFileIsPutAside) {
  fs::create_directory(file());
  EXPECT_EQ(Start()->Of(0), "");
  ASSERT_EQ(warnings_.size(), 1U);
  EXPECT_TRUE(fs::is_directory(file().string() + ".bad"));
}

TEST_F(DeviceMemoryTest, ReportsWhetherItIsOnTheDisk) {
  const auto memory = Start();
  EXPECT_EQ(memory->kept(), DeviceMemory::Kept::yes);
  memory->Set(0, "serial 1");
  AwaitWritten(*memory);
  EXPECT_EQ(memory->kept(), DeviceMemory::Kept::yes);
  fs::remove(file());
  fs::create_directories(file() / "in the way");
  memory->Set(0, "serial 2");
  AwaitWritten(*memory);
  EXPECT_EQ(memory->kept(), DeviceMemory::Kept::no);
}

TEST_F(DeviceMemoryTest, StrangeEntriesAreIgnored) {
  std::ofstream(file())
      << R"({"devices": [1, {}, {"line": 3}, {"line": "meters", "device": "incomer",
    "protocol": "set4tm", "address": "200", "profile": "set-4tm.03m", "memory": 5}]})";
  EXPECT_EQ(Start()->Of(0), "");
  EXPECT_TRUE(warnings_.empty());
}

TEST_F(DeviceMemoryTest, FollowsTheDeviceWhenAReloadRenumbersIt) {
  {
    const auto memory = Start();
    memory->Set(0, "serial 1");
    memory->Set(1, "serial 2");
    config::Config slots = config_;
    slots.lines[0] = {};
    slots.lines[0].devices.resize(2);
    slots.lines.push_back(config_.lines[0]);
    slots.lines[1].devices.erase(slots.lines[1].devices.begin());
    memory->OnReload(slots);
    EXPECT_EQ(memory->Of(0), "");
    EXPECT_EQ(memory->Of(1), "");
    EXPECT_EQ(memory->Of(2), "serial 2");
    memory->Set(2, "serial 3");
  }
  EXPECT_EQ(Start()->Of(0), "");
  EXPECT_EQ(Start()->Of(1), "serial 3");
}

TEST_F(DeviceMemoryTest, AFailingDiskIsReportedUntilARetrySucceeds) {
  fs::create_directories(file().string() + ".part");
  {
    const auto memory = Start();
    memory->Set(0, "serial 1");
    AwaitWritten(*memory);
    EXPECT_EQ(memory->kept(), DeviceMemory::Kept::no);
    fs::remove_all(file().string() + ".part");
  }
  ASSERT_GE(troubles_.size(), 2U);
  EXPECT_NE(troubles_[0].find("cannot write"), std::string::npos);
  EXPECT_EQ(troubles_.back(), "") << "it is over";
  EXPECT_EQ(Start()->Of(0), "serial 1");
}

TEST(FileWatch, RequestsALookPeriodically) {
  FileWatch watch;
  for (int round = 0; round < 3; ++round) {
    for (int tick = 1; tick < FileWatch::kLookEvery; ++tick) watch.Tick(false);
    EXPECT_FALSE(watch.look_due());
    watch.Tick(false);
    EXPECT_TRUE(watch.look_due());
    watch.Tick(false);
    EXPECT_TRUE(watch.TakeLook().due);
    EXPECT_FALSE(watch.TakeLook().due);
    for (int tick = 2; tick < FileWatch::kLookEvery; ++tick) watch.Tick(false);
    watch.Tick(false);
    watch.TakeLook();
  }
}

TEST(FileWatch, ADoubtOfAReaderIsCheckedAtTheNextLookOnly) {
  FileWatch watch;
  watch.Doubt();
  EXPECT_FALSE(watch.TakeLook().whole);
  for (int tick = 0; tick < FileWatch::kLookEvery; ++tick) watch.Tick(false);
  EXPECT_TRUE(watch.TakeLook().whole);
  for (int tick = 0; tick < FileWatch::kLookEvery; ++tick) watch.Tick(false);
  EXPECT_FALSE(watch.TakeLook().whole);
}

TEST(FileWatch, ALongWaitOrWriteIsLate) {
  FileWatch watch;
  for (int tick = 0; tick < FileWatch::kMostTicks; ++tick) EXPECT_FALSE(watch.Tick(true));
  EXPECT_TRUE(watch.Tick(true));
  watch.Begin();
  EXPECT_TRUE(watch.Tick(false)) << "the look itself hangs";
  watch.End();
  EXPECT_FALSE(watch.Tick(true));
}

}  // namespace
}  // namespace baudgate::records
