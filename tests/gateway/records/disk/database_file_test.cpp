// Tests of damaged and newer database files, of lost logs, and of disks that hang.
// SPDX-License-Identifier: Apache-2.0
#include "gateway/records/disk/database_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <fstream>
#include <map>
#include <sstream>
#include <vector>

#include "gateway/records/disk/disk.h"
#include "gateway/records/disk/events_file.h"
#include "gateway/records/disk/state_folder.h"

namespace baudgate::records {
namespace {

namespace fs = std::filesystem;

constexpr const char* kTables[] = {"CREATE TABLE t (a)"};
constexpr DatabaseKind kKind = {0x42477431, kTables, "PRAGMA synchronous=FULL;"};

class DatabaseFileTest : public ::testing::Test {
 protected:
  DatabaseFileTest() : folder_(fs::path(::testing::TempDir()) / "baudgate-database-file") {
    fs::remove_all(folder_);
    fs::create_directories(folder_);
  }
  ~DatabaseFileTest() override {
    std::error_code ignored;
    fs::remove_all(folder_, ignored);
  }
  fs::path file() const { return folder_ / "some.db"; }
  fs::path log() const { return folder_ / "some.db-wal"; }

  void MakeFile(int rows) const {
    OpenedDatabase made = OpenDatabase(file(), kKind);
    ASSERT_TRUE(made.database) << made.error;
    for (int row = 0; row < rows; ++row) {
      ASSERT_TRUE(made.database->Execute("INSERT INTO t VALUES (1)"));
    }
  }
  void MakeKilled() const {
    MakeFile(1);
    OpenedDatabase made = OpenDatabase(file(), kKind);
    for (int row = 0; row < 3; ++row) {
      ASSERT_TRUE(made.database->Execute("INSERT INTO t VALUES (1)"));
    }
    for (const char* name : {"some.db", "some.db-wal"}) {
      fs::copy_file(folder_ / name, folder_ / ("kept-" + std::string(name)));
    }
    made.database.reset();
    fs::remove(log());
    for (const char* name : {"some.db", "some.db-wal"}) {
      fs::rename(folder_ / ("kept-" + std::string(name)), folder_ / name);
    }
  }
  static void Invert(const fs::path& path, std::size_t at) {
    std::fstream bytes(path, std::ios::in | std::ios::out | std::ios::binary);
    bytes.seekg(static_cast<std::streamoff>(at));
    const char byte = static_cast<char>(~bytes.get());
    bytes.seekp(static_cast<std::streamoff>(at));
    bytes.put(byte);
  }
  static std::int64_t Rows(Database& database) {
    const Value rows = database.First("SELECT count(*) FROM t");
    const auto* number = std::get_if<std::int64_t>(&rows);
    return number == nullptr ? -1 : *number;
  }
  /// Returns the offset of the checksum of a frame in the log. Frames count from 0.
  static std::size_t SumOf(std::size_t frame) { return 32 + frame * (24 + 4096) + 16; }
  std::size_t frames() const { return (fs::file_size(log()) - 32) / (24 + 4096); }

 private:
  fs::path folder_;
};

TEST_F(DatabaseFileTest, EachByteOfTheHeaderMayBeDamaged) {
  MakeFile(2);
  const fs::path good = fs::path(::testing::TempDir()) / "baudgate-good.db";
  fs::copy_file(file(), good, fs::copy_options::overwrite_existing);
  for (std::size_t at = 0; at < 100; ++at) {
    for (const auto& old : fs::directory_iterator(file().parent_path())) fs::remove(old.path());
    fs::copy_file(good, file());
    Invert(file(), at);
    const OpenedDatabase opened = OpenDatabase(file(), kKind);
    if (opened.put_aside.empty()) {
      // The damaged byte has no effect, or makes the file look as if a newer version had written
      // it.
      const bool newer = opened.error.find("newer") != std::string::npos;
      EXPECT_TRUE(newer || (opened.database && Rows(*opened.database) == 2))
          << at << ": " << opened.error;
      continue;
    }
    EXPECT_TRUE(opened.database) << at << ": " << opened.error;
    EXPECT_EQ(opened.put_aside.find("()"), std::string::npos) << at << ": " << opened.put_aside;
    EXPECT_TRUE(fs::exists(file().string() + ".bad")) << at;
  }
}

TEST_F(DatabaseFileTest, AFifoIsNotOpened) {
  for (const char* part : {"", "-wal", "-shm"}) {
    const std::string path = file().string() + part;
    ASSERT_EQ(::mkfifo(path.c_str(), 0600), 0);
    const OpenedDatabase opened = OpenDatabase(file(), kKind);
    EXPECT_FALSE(opened.database);
    EXPECT_NE(opened.error.find(path + " is a FIFO, not a regular file: remove it"),
              std::string::npos)
        << opened.error;
    fs::remove(path);
    EXPECT_TRUE(OpenDatabase(file(), kKind).database) << part;
  }
}

TEST_F(DatabaseFileTest, AnIntactLogHasLostNothing) {
  MakeKilled();
  const OpenedDatabase opened = OpenDatabase(file(), kKind);
  ASSERT_TRUE(opened.database) << opened.error;
  EXPECT_FALSE(opened.lost) << *opened.lost;
  EXPECT_EQ(Rows(*opened.database), 4);
}

TEST_F(DatabaseFileTest, ATornLastTransactionIsNoLoss) {
  MakeKilled();
  Invert(log(), SumOf(frames() - 1));
  const OpenedDatabase opened = OpenDatabase(file(), kKind);
  ASSERT_TRUE(opened.database) << opened.error;
  EXPECT_FALSE(opened.lost) << *opened.lost;
  EXPECT_EQ(Rows(*opened.database), 3);
}

TEST_F(DatabaseFileTest, CommittedChangesBehindDamageAreReportedAsLost) {
  for (const std::size_t damaged : {SumOf(0), SumOf(0) - 4, SumOf(0) + 100}) {
    for (const auto& old : fs::directory_iterator(file().parent_path())) fs::remove(old.path());
    MakeKilled();
    Invert(log(), damaged);
    const OpenedDatabase opened = OpenDatabase(file(), kKind);
    ASSERT_TRUE(opened.database) << opened.error;
    EXPECT_EQ(Rows(*opened.database), 1);
    ASSERT_TRUE(opened.lost) << damaged;
    EXPECT_NE(opened.lost->find("committed changes after the damage are lost"), std::string::npos)
        << *opened.lost;
  }
}

TEST_F(DatabaseFileTest, ALogWithADamagedHeaderHasLostAll) {
  MakeKilled();
  Invert(log(), 26);
  EXPECT_EQ(LogDamage(file()),
            "the header of its write-ahead log (-wal) is damaged: all changes in the log are lost");
}

TEST_F(DatabaseFileTest, FramesOfTheEarlierLogRoundAreNoLoss) {
  MakeFile(0);
  OpenedDatabase made = OpenDatabase(file(), kKind);
  for (int row = 0; row < 5; ++row) {
    ASSERT_TRUE(made.database->Execute("INSERT INTO t VALUES (1)"));
  }
  ASSERT_TRUE(made.database->Execute("PRAGMA wal_checkpoint(RESTART)"));
  ASSERT_TRUE(made.database->Execute("INSERT INTO t VALUES (1)"));
  ASSERT_GE(frames(), 5u);
  EXPECT_EQ(LogDamage(file()), std::nullopt);
}

struct ShownDisk {
  Disk disk = Disk::opening;
  std::string trouble;
  WallTime since{};
};

TEST(DiskCondition, BeginAndEndOfATroubleAreReportedOnce) {
  const WallTime start(1000s);
  DiskCondition disk(start);
  struct Row {
    Disk disk;
    std::string trouble;
    bool begun;
    std::string ended;
  };
  const Row rows[] = {
      {Disk::fine, "", false, ""},        {Disk::stalled, "late", true, ""},
      {Disk::stalled, "late", false, ""}, {Disk::failing, "full", false, ""},
      {Disk::fine, "", false, "full"},    {Disk::fine, "", false, ""},
      {Disk::failing, "gone", true, ""},  {Disk::fine, "", false, "gone"},
  };
  WallTime now = start;
  for (const Row& row : rows) {
    now += 1s;
    const DiskCondition::News news = disk.Set(row.disk, row.trouble, now);
    EXPECT_EQ(news.begun, row.begun) << row.trouble;
    EXPECT_EQ(news.ended ? news.ended->trouble : std::string(), row.ended);
    ShownDisk state;
    disk.Fill(state);
    EXPECT_EQ(state.disk, row.disk);
    EXPECT_EQ(disk.trouble(), row.trouble);
  }
}

TEST(DiskCondition, SinceIsTheBeginOfTheCurrentCondition) {
  ShownDisk state;
  DiskCondition disk(WallTime(1s));
  disk.Set(Disk::failing, "full", WallTime(2s));
  disk.Set(Disk::failing, "gone", WallTime(3s));
  disk.Fill(state);
  EXPECT_EQ(state.since, WallTime(2s));
  EXPECT_EQ(state.trouble, "gone");
  const auto news = disk.Set(Disk::fine, "", WallTime(4s));
  ASSERT_TRUE(news.ended);
  EXPECT_EQ(news.ended->since, WallTime(2s));
}

const std::string kNextEvents = std::to_string(kEventsVersion + 1);

class Versions : public ::testing::Test {
 protected:
  Versions() {
    fs::remove_all(folder_);
    fs::create_directories(folder_);
  }
  ~Versions() override { fs::remove_all(folder_); }

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
  void ExpectRefused(const std::string& file, const std::string& versions) const {
    const auto before = Files();
    const auto failure = StateFolder(folder_).Open();
    ASSERT_TRUE(failure);
    EXPECT_TRUE(failure->in_use) << "it must not start without its state";
    EXPECT_EQ(failure->text, (folder_ / file).string() + " was written by a newer baudgate (" +
                                 versions +
                                 "); the file was not changed. Start the newer baudgate, or set "
                                 "another folder in gateway.state");
    EXPECT_EQ(Files(), before);
  }

  const fs::path folder_ = fs::path(::testing::TempDir()) / "baudgate-versions";
};

TEST_F(Versions, CurrentAndForeignFilesAreAccepted) {
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

TEST_F(Versions, NewerEventFilesAreRefused) {
  MakeNewer("events.db", kEventsApplication);
  ExpectRefused("events.db", "file version " + kNextEvents + ", this baudgate reads up to " +
                                 std::to_string(kEventsVersion));
}

TEST_F(Versions, NewerValueAndTrendFilesAreRefused) {
  MakeNewer("values-20261123.db", 0x42477661);
  ExpectRefused("values-20261123.db", "file version 2, this baudgate reads up to 1");
  fs::remove(folder_ / "values-20261123.db");
  MakeNewer("trends.db", 0x42477472);
  ExpectRefused("trends.db", "file version 2, this baudgate reads up to 1");
}

TEST_F(Versions, NewerDeviceFilesAreRefused) {
  std::ofstream(folder_ / "devices.json") << R"({"version": 2, "novel": []})";
  ExpectRefused("devices.json", "file version 2, this baudgate reads up to 1");
}

/// After kill -9 the version is only in the log. The file itself still has version 0.
TEST_F(Versions, TheVersionInALeftoverLogCounts) {
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
  EXPECT_NE(NewerStateIn(folder_).find("(file version " + kNextEvents + ","), std::string::npos);
}

using ::testing::ElementsAre;

TEST(DiskCalls, TheResultOfACallIsReturned) {
  DiskCalls calls("test", 1min);
  EXPECT_EQ(calls.Wait([] { return 7; }), 7);
}

TEST(DiskCalls, AHangingDiskBlocksNoCallerAndLosesNoCall) {
  std::promise<void> disk;
  std::vector<int> done;
  {
    DiskCalls calls("test", Duration::zero());
    const auto hang = [&done, answers = disk.get_future().share()](int call) {
      answers.wait();
      done.push_back(call);
      return call;
    };
    EXPECT_EQ(calls.Wait([hang] { return hang(1); }), std::nullopt);
    EXPECT_EQ(calls.Wait([hang] { return hang(2); }), std::nullopt);
    EXPECT_FALSE(calls.Offer([hang] { hang(3); })) << "another call is under way";
    for (int i = 0; i < 100; ++i) {
      EXPECT_EQ(calls.Wait([] { return 4; }), std::nullopt);
    }
    disk.set_value();
    calls.Stop();
    EXPECT_FALSE(calls.Offer([hang] { hang(5); })) << "it has stopped";
  }
  EXPECT_THAT(done, ElementsAre(1, 2));
}

}  // namespace
}  // namespace baudgate::records
