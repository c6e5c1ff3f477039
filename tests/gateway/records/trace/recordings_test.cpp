// The files of the flight recorder: names, contents, limits, and a folder that cannot be written.
// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>
#include <stdlib.h>

#include <atomic>
#include <fstream>
#include <optional>
#include <sstream>
#include <thread>

#include "gateway/records/trace/line_recorder.h"
#include "tests/support/virtual_line.h"

namespace baudgate {
namespace {

namespace fs = std::filesystem;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::SizeIs;

constexpr WallTime kTime =
    WallTime(std::chrono::sys_days(std::chrono::year(2026) / 11 / 21)) + (4h + 5min + 6s);

class RecordingsTest : public testing::Test {
 protected:
  RecordingsTest() : line_(ToyLine({ToyDevice("feeder-1", "A", {"1"})})) {
    std::string form = (fs::temp_directory_path() / "baudgate-recordings-XXXXXX").string();
    folder_ = mkdtemp(form.data());
    line_.name = "bay-1";
    line_.port = "/dev/ttyUSB0";
    line_.protocol = line_.devices[0].protocol = "spabus";
    line_.devices[0].profile = "spaj140c";
  }
  ~RecordingsTest() override { fs::remove_all(folder_); }

  void Begin(const fs::path& folder) {
    recordings_.emplace(folder, "1.2.3",
                        [this](const std::string& text) { warnings_.push_back(text); });
  }
  void Save(WallTime at, const char* reason = "corrupt") {
    const TraceRecord record{TraceRecord::Kind::sent, at, "feeder-1", "3E", ">"};
    recordings_->Save({&line_, &line_.devices[0], line_.devices[0].name, reason, at, {record}});
  }
  /// Everything is written once this returns.
  void End() { recordings_.reset(); }
  std::vector<std::string> Files() const {
    std::vector<std::string> names;
    for (const auto& file : fs::directory_iterator(folder_)) {
      names.push_back(file.path().filename().string());
    }
    std::sort(names.begin(), names.end());
    return names;
  }
  std::string Read(const std::string& name) const {
    std::ostringstream text;
    text << std::ifstream(folder_ / name).rdbuf();
    return text.str();
  }

  fs::path folder_;
  config::Line line_;
  std::vector<std::string> warnings_;
  std::optional<Recordings> recordings_;
};

TEST_F(RecordingsTest, AFileSaysWhatItIsAndHowToReadIt) {
  Begin(folder_);
  Save(kTime);
  End();
  ASSERT_THAT(Files(), ElementsAre("bay-1-20261121T040506Z-feeder-1-corrupt.trace"));
  const std::string text = Read(Files()[0]);
  EXPECT_THAT(text, HasSubstr("# baudgate 1.2.3"));
  EXPECT_THAT(text, HasSubstr("# line bay-1, port /dev/ttyUSB0 9600 8N1, protocol spabus\n"));
  EXPECT_THAT(text, HasSubstr("# device feeder-1, protocol spabus, profile spaj140c\n"));
  EXPECT_THAT(text, HasSubstr("baudgate decode --device feeder-1 "
                              "bay-1-20261121T040506Z-feeder-1-corrupt.trace\n"));
  EXPECT_THAT(text, HasSubstr("\n04:05:06.000000 feeder-1 > 3E | >\n"));
  std::istringstream lines(text);
  int records = 0;
  for (std::string line; std::getline(lines, line);) records += line.starts_with('#') ? 0 : 1;
  EXPECT_EQ(records, 1);
}

TEST_F(RecordingsTest, TheFolderIsMade) {
  Begin(folder_ / "a" / "b");
  Save(kTime);
  End();
  EXPECT_TRUE(fs::exists(folder_ / "a" / "b" / "bay-1-20261121T040506Z-feeder-1-corrupt.trace"));
}

TEST_F(RecordingsTest, NamesCanNotLeaveTheFolder) {
  line_.name = "../bay/1";
  line_.devices[0].name = "ü\n..";
  Begin(folder_);
  Save(kTime);
  End();
  EXPECT_THAT(Files(), ElementsAre("___bay_1-20261121T040506Z-_____-corrupt.trace"));
}

TEST_F(RecordingsTest, TheOldestFilesOfALineGo) {
  const std::vector<std::string> others = {
      "bay-1-1-20200101T000000Z-x-corrupt.trace",  // another line's
      "bay-1-notes.trace", "bay-1-20200101T000000Z-x-corrupt.txt", "readme"};
  for (const std::string& name : others) std::ofstream(folder_ / name) << "x";
  Begin(folder_);
  for (int i = 0; i < 30; ++i) {
    Save(kTime + i * 1h);
    if (i % 10 == 9) {  // never more than may wait
      End();
      Begin(folder_);
    }
  }
  End();
  EXPECT_THAT(Files(), SizeIs(others.size() + Recordings::kFilesPerLine));
  for (const std::string& name : others) EXPECT_TRUE(fs::exists(folder_ / name)) << name;
  EXPECT_FALSE(fs::exists(folder_ / "bay-1-20261121T130506Z-feeder-1-corrupt.trace"));
  EXPECT_TRUE(fs::exists(folder_ / "bay-1-20261121T140506Z-feeder-1-corrupt.trace"));
  EXPECT_TRUE(fs::exists(folder_ / "bay-1-20261122T090506Z-feeder-1-corrupt.trace"));
}

TEST_F(RecordingsTest, AFolderThatCanNotBeWrittenIsSaid) {
  const fs::path blocked = folder_ / "file";
  std::ofstream(blocked) << "not a folder";
  Begin(blocked / "recordings");
  Save(kTime);
  Save(kTime + 1min);
  End();
  ASSERT_THAT(warnings_, Not(IsEmpty()));
  EXPECT_THAT(warnings_.back(), HasSubstr(blocked.string()));
  EXPECT_THAT(warnings_.back(), HasSubstr("Not a directory"));
}

TEST_F(RecordingsTest, WhatAFullDiskDidNotTakeIsTriedAgain) {
  // What is written into the part goes to a device without room.
  const fs::path part = folder_ / ".bay-1.trace.part";
  fs::create_symlink("/dev/full", part);
  Begin(folder_);
  Save(kTime);
  while (fs::is_symlink(part)) std::this_thread::yield();
  End();
  ASSERT_THAT(warnings_, SizeIs(2));
  EXPECT_THAT(warnings_[0], HasSubstr("the disk is full"));
  EXPECT_EQ(warnings_[1], "") << "it is over";
  EXPECT_THAT(Files(), SizeIs(1));
}

TEST_F(RecordingsTest, WhereTheyGo) {
  config::Config config;
  unsetenv("STATE_DIRECTORY");
  EXPECT_EQ(Recordings::FolderOf(config), "");
  setenv("STATE_DIRECTORY", "/var/lib/baudgate:/var/lib/other", 1);
  EXPECT_EQ(Recordings::FolderOf(config), "/var/lib/baudgate/recordings");
  config.recordings = "/srv/traces";
  EXPECT_EQ(Recordings::FolderOf(config), "/srv/traces");
  unsetenv("STATE_DIRECTORY");
}

}  // namespace
}  // namespace baudgate
