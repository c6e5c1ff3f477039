// Tests of events.db with two connections to it: damage, removed files, lost logs.
// SPDX-License-Identifier: Apache-2.0
#include "gateway/records/disk/events_file.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/resource.h>
#include <unistd.h>

#include <csignal>
#include <filesystem>
#include <fstream>
#include <functional>

#include "gateway/records/disk/state_folder.h"

namespace baudgate::records {
namespace {

class EventsFileTest : public ::testing::Test {
 protected:
  EventsFileTest() : folder_(std::filesystem::path(::testing::TempDir()) / "baudgate-events-file") {
    std::filesystem::remove_all(folder_);
    std::filesystem::create_directories(folder_);
  }
  ~EventsFileTest() override {
    std::error_code ignored;
    std::filesystem::remove_all(folder_, ignored);
  }
  std::filesystem::path file() const { return folder_ / "events.db"; }
  std::filesystem::path log() const { return folder_ / "events.db-wal"; }
  static std::string First(Database& database, const std::string& sql) {
    return baudgate::ToText(database.First(sql));
  }
  void OpenBoth() {
    const auto writer = std::make_shared<EventsWriter>();
    one_ = std::make_unique<EventsConnection>(file(), "", writer);
    other_ = std::make_unique<EventsConnection>(file(), "", writer);
    ASSERT_TRUE(one_->Open().ok);
    ASSERT_TRUE(other_->Open().ok);
  }
  void CloseBoth() {
    one_.reset();
    other_.reset();
  }
  static void Add(EventsConnection& to, const std::string& name) {
    EXPECT_TRUE(to.database().Execute("INSERT INTO event_cursors VALUES ('" + name + "', 1, 1)"))
        << to.database().error();
  }
  std::string Names() const {
    Database reader(file().string(), Database::Mode::read);
    EXPECT_TRUE(reader.is_open()) << reader.error();
    const Value names = reader.First(
        "SELECT coalesce(group_concat(name), '') FROM (SELECT name FROM event_cursors ORDER BY "
        "name='old' DESC, name)");
    EXPECT_TRUE(HasValue(names)) << reader.error();
    return baudgate::ToText(names);
  }

  std::unique_ptr<EventsConnection> one_;
  std::unique_ptr<EventsConnection> other_;

 private:
  std::filesystem::path folder_;
};

TEST_F(EventsFileTest, AnErrorOfSqliteIsOneLine) {
  Database database(file().string(), Database::Mode::write);
  ASSERT_TRUE(
      database.Execute("CREATE TABLE t (a); CREATE TRIGGER no BEFORE INSERT ON t BEGIN "
                       "SELECT RAISE(ABORT, 'two\nlines'); END"));
  EXPECT_FALSE(database.Execute("INSERT INTO t VALUES (1)"));
  EXPECT_EQ(database.error(), "two lines");
}

TEST_F(EventsFileTest, ADamagedFileIsPutAsideOnceByTwoConnections) {
  const auto writer = std::make_shared<EventsWriter>();
  EventsConnection a(file(), {}, writer);
  EventsConnection b(file(), {}, writer);
  ASSERT_TRUE(a.Open().ok);
  ASSERT_TRUE(b.Open().ok);
  ASSERT_TRUE(a.database().Execute("PRAGMA wal_checkpoint(TRUNCATE)"));
  constexpr int kHeader = 100;
  std::fstream bytes(file(), std::ios::in | std::ios::out | std::ios::binary);
  bytes.seekp(kHeader);
  bytes << std::string(std::filesystem::file_size(file()) - kHeader, 'x');
  bytes.close();
  for (EventsConnection* one : {&a, &b}) {
    ASSERT_TRUE(one->database().Execute("PRAGMA shrink_memory"));
  }
  EXPECT_FALSE(a.database().Execute("SELECT * FROM events"));
  EXPECT_FALSE(b.database().Execute("SELECT * FROM events"));
  a.Failed();
  b.Failed();
  ASSERT_FALSE(a.is_open());
  ASSERT_FALSE(b.is_open());
  const auto first = a.Open();
  EXPECT_TRUE(first.ok) << first.error;
  EXPECT_TRUE(first.new_file);
  ASSERT_TRUE(a.database().Execute("INSERT INTO event_sources VALUES ('l', 'd', 's')"));
  const auto second = b.Open();
  EXPECT_TRUE(second.ok) << second.error;
  EXPECT_TRUE(second.new_file) << "what it had written is not there";
  EXPECT_EQ(First(b.database(), "SELECT count(*) FROM event_sources"), "1")
      << "the new file is not put aside as well";
}

TEST_F(EventsFileTest, TablesChangedByAnotherProgramAreDamage) {
  const std::pair<const char*, const char*> rows[] = {
      {"DROP TABLE event_sources", "no such table: event_sources"},
      {"ALTER TABLE event_sources RENAME COLUMN device TO other",
       "table event_sources has no column named device"},
  };
  for (const auto& [change, why] : rows) {
    EventsConnection connection(file());
    ASSERT_TRUE(connection.Open().ok);
    Database stranger(file().string(), Database::Mode::write);
    ASSERT_TRUE(stranger.Execute(change)) << stranger.error();
    EXPECT_FALSE(connection.database().Execute(
        "INSERT INTO event_sources (line, device, said) VALUES ('l', 'd', 's')"));
    EXPECT_EQ(
        connection.Failed().message,
        file().string() + ": " + why + ": another program has changed the tables of the file");
    const auto again = connection.Open();
    EXPECT_TRUE(again.ok) << again.error;
    EXPECT_NE(again.put_aside.find(why), std::string::npos) << again.put_aside;
    EXPECT_EQ(First(connection.database(), "SELECT count(*) FROM event_sources"), "0");
  }
}

/// Some file systems leave an empty file after a power cut.
TEST_F(EventsFileTest, AnEmptyFileIsALoss) {
  std::ofstream(file()).close();
  std::ofstream(file().string() + "-wal") << "what it would have been told";
  EventsConnection connection(file());
  const auto opened = connection.Open();
  EXPECT_TRUE(opened.ok) << opened.error;
  EXPECT_TRUE(opened.new_file);
  EXPECT_EQ(
      opened.put_aside,
      file().string() +
          " is damaged (the file is empty: its content is lost); it was renamed to events.db.bad "
          "and a new file was created");
  EXPECT_TRUE(std::filesystem::exists(file().string() + ".bad-wal"));
  EventsConnection second(file());
  EXPECT_EQ(second.Open().put_aside, "");
}

TEST_F(EventsFileTest, AFailedCreationIsNotReportedAsALoss) {
  const auto ignore = std::signal(SIGXFSZ, SIG_IGN);
  rlimit before{};
  ASSERT_EQ(getrlimit(RLIMIT_FSIZE, &before), 0);
  const rlimit none{0, before.rlim_max};
  ASSERT_EQ(setrlimit(RLIMIT_FSIZE, &none), 0);
  EventsConnection connection(file());
  const auto full = connection.Open();
  ASSERT_EQ(setrlimit(RLIMIT_FSIZE, &before), 0);
  std::signal(SIGXFSZ, ignore);
  EXPECT_FALSE(full.ok);
  EXPECT_FALSE(std::filesystem::exists(file()));
  const auto opened = connection.Open();
  EXPECT_TRUE(opened.ok) << opened.error;
  EXPECT_EQ(opened.put_aside, "");
}

TEST_F(EventsFileTest, ARemovedFileIsDetected) {
  EventsConnection connection(file());
  ASSERT_TRUE(connection.Open().ok);
  EXPECT_TRUE(connection.Check());
  std::filesystem::remove(file());
  EXPECT_FALSE(connection.Check());
  EXPECT_FALSE(connection.is_open());
  const auto opened = connection.Open();
  EXPECT_TRUE(opened.ok) << opened.error;
  EXPECT_TRUE(opened.new_file);
}

/// A page that changes after a reader began stays in the log until the reader ends. The file is
/// then shorter than the page count in its header says.
TEST_F(EventsFileTest, ACheckpointDelayedByAReaderIsNoDamage) {
  EventsConnection connection(file());
  ASSERT_TRUE(connection.Open().ok);
  Database& database = connection.database();
  const auto pages = [&] { return First(database, "PRAGMA page_count"); };
  int number = 100'000;
  const auto add = [&] { Add(connection, std::to_string(++number) + std::string(300, 'x')); };
  ASSERT_TRUE(database.Execute("PRAGMA wal_checkpoint(TRUNCATE)"));
  const std::string before = pages();
  while (pages() == before) add();
  Database reader(file().string(), Database::Mode::read);
  ASSERT_TRUE(reader.Execute("BEGIN"));
  EXPECT_NE(First(reader, "SELECT count(*) FROM event_cursors"), "0");
  add();
  First(database, "PRAGMA wal_checkpoint(PASSIVE)");
  const auto whole = static_cast<std::uintmax_t>(std::stoi(pages())) * 4096;
  ASSERT_LT(std::filesystem::file_size(file()), whole);
  EXPECT_TRUE(connection.Check());
  EXPECT_TRUE(connection.is_open());
  std::filesystem::resize_file(file(), 4096);
  EXPECT_FALSE(connection.Check()) << "that is damage";
}

TEST_F(EventsFileTest, AnUnreadableFolderLosesNothing) {
  EventsConnection connection(file());
  ASSERT_TRUE(connection.Open().ok);
  const auto folder = file().parent_path();
  const std::string away = folder.string() + ".away";
  std::filesystem::rename(folder, away);
  std::filesystem::create_symlink(folder, folder);  // a link to itself, so it cannot be read
  EXPECT_TRUE(connection.Check());
  EXPECT_TRUE(connection.is_open());
  std::filesystem::remove(folder);
  std::filesystem::rename(away, folder);
  Add(connection, "still");
  EXPECT_EQ(Names(), "still");
}

/// A user runs `rm events.db-wal`, or puts another file in its place, while two connections write.
TEST_F(EventsFileTest, TheContentOfARemovedLogIsSavedAndANewLogBegins) {
  for (const bool replaced : {false, true}) {
    OpenBoth();
    Add(*one_, "before");
    EXPECT_TRUE(one_->Check());
    EXPECT_TRUE(other_->Check());
    std::filesystem::remove(log());
    if (replaced) std::ofstream(log()) << "of another database";
    EXPECT_NE(one_->Check().error().find("(-wal) was removed or replaced"), std::string::npos);
    EXPECT_NE(one_->Open().error.find("(-wal) was removed or replaced"), std::string::npos)
        << "not before the other one is closed: it has the log that is gone";
    EXPECT_FALSE(other_->Check());
    for (EventsConnection* connection : {one_.get(), other_.get()}) {
      const auto opened = connection->Open();
      EXPECT_TRUE(opened.ok) << opened.error;
      EXPECT_FALSE(opened.new_file) << "nothing is lost";
      Add(*connection, connection == one_.get() ? "behind" : "last");
    }
    EXPECT_TRUE(std::filesystem::exists(log()));
    EXPECT_EQ(Names(), "before,behind,last");
    CloseBoth();
    std::filesystem::remove(file());
  }
}

/// All connections of this process share one lock. Without the lock, the next program that reads
/// the file would delete the log when it ends.
TEST_F(EventsFileTest, ChecksAndReadersKeepTheLockOfTheFile) {
  OpenBoth();
  Add(*one_, "a");
  EXPECT_TRUE(one_->Check());
  EXPECT_TRUE(other_->Check(true));
  EXPECT_EQ(Names(), "a");
  EXPECT_EQ(NewerStateIn(file().parent_path()), "");
  constexpr off_t kShared = 0x40000000 + 2;  // sqlite3.c: SHARED_FIRST, SHARED_SIZE
  constexpr off_t kBytes = 510;
  struct flock lock {};
  lock.l_type = F_WRLCK;
  lock.l_start = kShared;
  lock.l_len = kBytes;
  const int reader = ::open(file().c_str(), O_RDWR | O_CLOEXEC);
  ASSERT_EQ(::fcntl(reader, F_OFD_GETLK, &lock), 0);
  EXPECT_EQ(lock.l_type, F_RDLCK);
  CloseBoth();
  ::close(reader);
}

struct InUse {
  const char* name;
  std::function<void(const std::filesystem::path& file, const std::filesystem::path& log)> harm;
  std::string said;
  std::string kept;  ///< what can still be read of "old" (in the file) and "new" (in its log)
  bool aside = false;
};

void Invert(const std::filesystem::path& path, std::streamoff at) {
  std::fstream bytes(path, std::ios::in | std::ios::out | std::ios::binary);
  bytes.seekg(at, at < 0 ? std::ios::end : std::ios::beg);
  const std::streamoff place = bytes.tellg();
  const char byte = static_cast<char>(~bytes.get());
  bytes.seekp(place);
  bytes.put(byte);
}

/// A writer has all pages in memory, so only a check of the file finds the damage.
TEST_F(EventsFileTest, DamageToAFileInUseIsDetectedByACheck) {
  using std::filesystem::path;
  using std::filesystem::resize_file;
  constexpr std::streamoff kFrame = 24 + 4096;
  const InUse rows[] = {
      {"schema format", [](const path& file, const path&) { Invert(file, 47); },
       "invalid schema format", "", true},
      {"write version", [](const path& file, const path&) { Invert(file, 18); },
       "invalid format version", "", true},
      {"application", [](const path& file, const path&) { Invert(file, 68); },
       "another program has changed the header", "", true},
      {"page size", [](const path& file, const path&) { Invert(file, 16); }, "invalid page size",
       "", true},
      {"shortened", [](const path& file, const path&) { resize_file(file, 8192); },
       "the file was truncated while it was in use: 8192 of ", "", true},
      {"emptied", [](const path& file, const path&) { resize_file(file, 0); },
       "the file is too short", "", true},
      {"log emptied", [](const path&, const path& log) { resize_file(log, 0); },
       "the newest records are lost", "old"},
      {"log shortened", [](const path&, const path& log) { resize_file(log, 32 + kFrame - 1); },
       "the newest records are lost", "old"},
      {"last frame", [](const path&, const path& log) { Invert(log, 8 - kFrame); },
       "the newest records are lost", "old"},
      {"head of the log", [](const path&, const path& log) { Invert(log, 17); },
       "no data was lost: the file already contains", "old,new"},
  };
  for (const InUse& row : rows) {
    SCOPED_TRACE(row.name);
    OpenBoth();
    Add(*one_, "old");
    ASSERT_TRUE(one_->database().EmptyLog());
    Add(*other_, "new");
    EXPECT_TRUE(one_->Check());
    EXPECT_TRUE(other_->Check());
    row.harm(file(), log());
    const Status found = one_->Check();
    ASSERT_FALSE(found);
    EXPECT_NE(found.error().find(row.said), std::string::npos) << found.error();
    // This loop does what the threads of both connections do each second.
    std::string aside;
    for (int turns = 0; turns < 2; ++turns) {
      for (EventsConnection* connection : {one_.get(), other_.get()}) {
        if (connection->is_open()) connection->Check();
        if (!connection->is_open()) aside += connection->Open().put_aside;
      }
    }
    ASSERT_TRUE(one_->is_open());
    ASSERT_TRUE(other_->is_open());
    EXPECT_TRUE(one_->Check());
    EXPECT_TRUE(other_->Check());
    EXPECT_EQ(Names(), row.kept);
    EXPECT_EQ(PutAsideOf(file()).size(), row.aside ? 1U : 0U);
    EXPECT_EQ(aside.find(row.said) != std::string::npos, row.aside) << aside;
    CloseBoth();
    std::filesystem::remove_all(file().parent_path());
    std::filesystem::create_directories(file().parent_path());
  }
}

/// While a reader is active, a checkpoint does not copy pages to the file that changed after the
/// reader began.
TEST_F(EventsFileTest, AFileWithAPartOfALostLogIsDamaged) {
  OpenBoth();
  Add(*one_, "a");
  {
    Database reader(file().string(), Database::Mode::read);
    ASSERT_TRUE(reader.Execute("BEGIN; SELECT * FROM event_cursors"));
    Add(*one_, "b");
    ASSERT_TRUE(one_->database().Execute("PRAGMA wal_checkpoint(PASSIVE)"));
  }
  EXPECT_TRUE(one_->Check());
  std::filesystem::resize_file(log(), 32 + 24 + 4096);
  EXPECT_NE(one_->Check().error().find("but the rest is already in the file"), std::string::npos);
  EXPECT_NE(one_->Open().put_aside.find("a part of its write-ahead log"), std::string::npos);
}

TEST_F(EventsFileTest, AReplacementOfTheFileIsLeftUnchanged) {
  const auto backup = file().string() + ".backup";
  {
    EventsConnection connection(file());
    ASSERT_TRUE(connection.Open().ok);
    ASSERT_TRUE(connection.database().Execute("INSERT INTO event_cursors VALUES ('backup', 1, 1)"));
  }
  std::filesystem::copy_file(file(), backup);
  const auto writer = std::make_shared<EventsWriter>();
  EventsConnection one(file(), {}, writer);
  EventsConnection other(file(), {}, writer);
  ASSERT_TRUE(one.Open().ok);
  ASSERT_TRUE(other.Open().ok);
  ASSERT_TRUE(one.database().Execute("UPDATE event_cursors SET name='old'"));
  ASSERT_TRUE(one.Check());
  ASSERT_TRUE(other.Check());
  std::filesystem::rename(backup, file());
  EXPECT_FALSE(one.Check());
  ASSERT_TRUE(one.Open().ok);
  EXPECT_EQ(First(one.database(), "SELECT name FROM event_cursors"), "backup");
  ASSERT_TRUE(one.database().Execute("UPDATE event_cursors SET seq=2"));
  EXPECT_FALSE(other.Check());
  ASSERT_TRUE(other.Open().ok);
  EXPECT_EQ(First(other.database(), "SELECT seq FROM event_cursors"), "2");
  EXPECT_TRUE(one.Check()) << "its log is there";
}

}  // namespace
}  // namespace baudgate::records
