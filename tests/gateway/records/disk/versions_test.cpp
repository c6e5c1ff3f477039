// State of a newer baudgate is left alone.
// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <fstream>
#include <map>
#include <sstream>

#include "gateway/records/disk/events_file.h"
#include "gateway/records/disk/state_folder.h"

namespace baudgate {
namespace {

namespace fs = std::filesystem;

const std::string kNextEvents = std::to_string(kEventsVersion + 1);

class Versions : public ::testing::Test {
 protected:
  Versions() {
    fs::remove_all(folder_);
    fs::create_directories(folder_);
  }
  ~Versions() override { fs::remove_all(folder_); }

  /// A file of a program that knows one version more.
  void MakeNewer(const std::string& name, std::int64_t application) const {
    Database database((folder_ / name).string(), Database::Mode::write);
    EXPECT_TRUE(
        database.Execute("PRAGMA journal_mode=WAL; CREATE TABLE novel (x); PRAGMA application_id=" +
                         std::to_string(application) +
                         "; PRAGMA user_version=" + std::to_string(KnownVersion(application) + 1)));
  }
  std::map<std::string, std::string> Files() const {
    std::map<std::string, std::string> files;
    for (const auto& one : fs::directory_iterator(folder_)) {
      std::ostringstream text;
      text << std::ifstream(one.path(), std::ios::binary).rdbuf();
      if (one.path().filename() != "lock") files[one.path().filename()] = text.str();
    }
    return files;
  }
  /// The sentence, and that nothing was changed.
  void ExpectRefused(const std::string& file, const std::string& versions) const {
    const auto before = Files();
    const auto failure = StateFolder(folder_).Open();
    ASSERT_TRUE(failure);
    EXPECT_TRUE(failure->in_use) << "it must not start without its state";
    EXPECT_EQ(failure->text, (folder_ / file).string() + " was written by a newer baudgate (" +
                                 versions +
                                 "); nothing was changed. Start the newer one, or give this one "
                                 "another gateway.state");
    EXPECT_EQ(Files(), before);
  }

  const fs::path folder_ = fs::path(::testing::TempDir()) / "baudgate-versions";
};

TEST_F(Versions, TodaysAndForeignFilesAreFine) {
  {
    OpenedEvents opened = OpenEvents(folder_ / "events.db");
    ASSERT_TRUE(opened.database) << opened.error;
    std::ofstream(folder_ / "devices.json") << R"({"version": 1, "devices": []})";
    std::ofstream(folder_ / "empty.db");
    std::ofstream(folder_ / "text.db") << std::string(200, 'x');
    Database foreign((folder_ / "foreign.db").string(), Database::Mode::write);
    ASSERT_TRUE(foreign.Execute("CREATE TABLE t (x); PRAGMA user_version=99"));
    EXPECT_EQ(NewerStateIn(folder_), "") << "while it is open, with a log";
  }
  EXPECT_FALSE(StateFolder(folder_).Open());
  EXPECT_EQ(NewerStateIn(folder_ / "none"), "");
}

TEST_F(Versions, NewerEventsAreLeftAlone) {
  MakeNewer("events.db", kEventsApplication);
  ExpectRefused("events.db", "version " + kNextEvents + " of the file, this one knows " +
                                 std::to_string(kEventsVersion));
}

TEST_F(Versions, NewerValuesAndTrendsAreLeftAlone) {
  MakeNewer("values-20261123.db", 0x42477661);
  ExpectRefused("values-20261123.db", "version 2 of the file, this one knows 1");
  fs::remove(folder_ / "values-20261123.db");
  MakeNewer("trends.db", 0x42477472);
  ExpectRefused("trends.db", "version 2 of the file, this one knows 1");
}

TEST_F(Versions, NewerFactsOfDevicesAreLeftAlone) {
  std::ofstream(folder_ / "devices.json") << R"({"version": 2, "novel": []})";
  ExpectRefused("devices.json", "version 2 of the file, this one knows 1");
}

/// kill -9 leaves the version in the log alone: the file itself says 0 as yet.
TEST_F(Versions, ALogThatWasLeftCounts) {
  const fs::path away = folder_ / "away.db";
  {
    Database database(away.string(), Database::Mode::write);
    ASSERT_TRUE(database.Execute(
        "PRAGMA journal_mode=WAL; CREATE TABLE novel (x); PRAGMA application_id=" +
        std::to_string(kEventsApplication) + "; PRAGMA user_version=" + kNextEvents));
    for (const char* tail : {"", "-wal"}) {
      fs::copy_file(away.string() + tail, (folder_ / "events.db").string() + tail);
    }
  }
  fs::remove(away);
  ASSERT_GT(fs::file_size(folder_ / "events.db-wal"), 0U);
  EXPECT_NE(NewerStateIn(folder_).find("version " + kNextEvents + " of the file"),
            std::string::npos);
}

}  // namespace
}  // namespace baudgate
