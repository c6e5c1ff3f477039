// State of an older baudgate is taken up, that of a newer one is left alone.
// SPDX-License-Identifier: Apache-2.0
#include "gateway/state/versions.h"

#include <gtest/gtest.h>

#include <fstream>
#include <map>
#include <sstream>

#include "gateway/state/device_memory.h"
#include "gateway/state/events_file.h"
#include "gateway/state/state_folder.h"

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
    StateFolder::Failure failure;
    EXPECT_EQ(StateFolder::Open(folder_, failure), nullptr);
    EXPECT_TRUE(failure.in_use) << "it must not start without its state";
    EXPECT_EQ(failure.text, (folder_ / file).string() + " was written by a newer baudgate (" +
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
  StateFolder::Failure failure;
  EXPECT_NE(StateFolder::Open(folder_, failure), nullptr) << failure.text;
  EXPECT_EQ(NewerStateIn(folder_ / "none"), "");
}

TEST_F(Versions, NewerEventsAreLeftAlone) {
  MakeNewer("events.db", kEventsApplication);
  ExpectRefused("events.db", "version " + kNextEvents + " of the file, this one knows " +
                                 std::to_string(kEventsVersion));
}

TEST_F(Versions, NewerValuesAndTrendsAreLeftAlone) {
  MakeNewer("values-20261123.db", 0x42477661);
  ExpectRefused("values-20261123.db", "version 3 of the file, this one knows 2");
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

TEST_F(Versions, DevicesJsonOfTheFirstBaudgate) {
  std::ofstream(folder_ / "devices.json") << R"({
  "devices": [
    {
      "line": "meters",
      "device": "incomer",
      "protocol": "set4tm",
      "address": "200",
      "profile": "set-4tm.03m",
      "memory": "serial 12345678"
    }
  ]
}
)";
  config::Config config;
  config.lines.resize(1);
  config.lines[0].name = "meters";
  config.lines[0].devices.resize(1);
  config::Device& device = config.lines[0].devices[0];
  device.name = "incomer";
  device.protocol = "set4tm";
  device.address = "200";
  device.profile = "set-4tm.03m";
  EXPECT_EQ(NewerStateIn(folder_), "");
  const auto fail = [](const std::string& warning) { ADD_FAILURE() << warning; };
  DeviceMemory(folder_ / "devices.json", config, fail).Set(0, "serial 12345679");
  EXPECT_EQ(DeviceMemory(folder_ / "devices.json", config, fail).Of(0), "serial 12345679");
  EXPECT_NE(Files()["devices.json"].find("\"version\": 1"), std::string::npos);
}

/// As the first two versions of events.db were made.
constexpr const char* kAudit =
    "CREATE TABLE writes (seq INTEGER PRIMARY KEY AUTOINCREMENT, kind TEXT NOT NULL, time INTEGER "
    "NOT NULL, last INTEGER NOT NULL, client TEXT NOT NULL, line TEXT NOT NULL, device TEXT NOT "
    "NULL, point TEXT NOT NULL, old, first, new, outcome TEXT, reason TEXT NOT NULL, took INTEGER "
    "NOT NULL, count INTEGER NOT NULL, settled INTEGER);"
    "CREATE INDEX writes_point ON writes (kind, line, device, point, seq);"
    "CREATE UNIQUE INDEX writes_settled ON writes (settled);"
    "INSERT INTO writes (kind, time, last, client, line, device, point, new, outcome, reason, took,"
    " count, settled) VALUES ('point', 1, 1, 'c', 'l', 'd', 'p', 7, 'ok', '', 0, 1, 1);"
    "PRAGMA journal_mode=WAL; PRAGMA application_id=1111975286; PRAGMA user_version=1;";
constexpr const char* kEvents =
    "CREATE TABLE events (seq INTEGER PRIMARY KEY, receive_time INTEGER NOT NULL, device_time "
    "INTEGER NOT NULL, clock_quality INTEGER NOT NULL, line TEXT NOT NULL, device TEXT NOT NULL, "
    "channel INTEGER NOT NULL, code INTEGER NOT NULL, state TEXT NOT NULL, text TEXT NOT NULL);"
    "CREATE INDEX events_device ON events (device, seq);"
    "CREATE TABLE event_sources (line TEXT NOT NULL, device TEXT NOT NULL, said TEXT NOT NULL, "
    "PRIMARY KEY (line, device)) WITHOUT ROWID;"
    "INSERT INTO events VALUES (5, 1, 1, 0, 'l', 'd', 0, 12, 'on', 'trip');"
    "PRAGMA user_version=2;";

TEST_F(Versions, EventsOfOlderVersionsAreTakenUp) {
  ASSERT_EQ(kEventsApplication, 1111975286);
  for (const int version : {1, 2}) {
    const fs::path file = folder_ / ("events-" + std::to_string(version) + ".db");
    {
      Database database(file.string(), Database::Mode::write);
      ASSERT_TRUE(database.Execute(kAudit)) << database.error();
      if (version == 2) {
        ASSERT_TRUE(database.Execute(kEvents)) << database.error();
      }
    }
    EXPECT_EQ(NewerStateIn(folder_), "");
    OpenedEvents opened = OpenEvents(file);
    ASSERT_TRUE(opened.database) << opened.error;
    EXPECT_EQ(opened.put_aside, "");
    const auto first = [&](const char* sql) { return ToText(opened.database->First(sql)); };
    EXPECT_EQ(first("PRAGMA user_version"), std::to_string(kEventsVersion));
    EXPECT_EQ(first("SELECT new FROM writes"), "7");
    EXPECT_EQ(first("SELECT count(*) FROM events"), std::to_string(version - 1));
    EXPECT_EQ(first("SELECT count(*) FROM alarms"), "0");
  }
}

}  // namespace
}  // namespace baudgate
