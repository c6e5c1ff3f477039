// events.db, and two connections to it.
// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>
#include <sys/resource.h>

#include <csignal>
#include <filesystem>
#include <fstream>

#include "gateway/state/events_connection.h"

namespace baudgate {
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
  static std::string First(Database& database, const std::string& sql) {
    return ToText(database.First(sql));
  }

 private:
  std::filesystem::path folder_;
};

TEST_F(EventsFileTest, WhatSqliteSaysIsOneLine) {
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
  // Behind its header nothing is right any more, and both are told so by SQLite.
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

/// What some file systems leave behind a power cut.
TEST_F(EventsFileTest, AnEmptyFileIsALoss) {
  std::ofstream(file()).close();
  std::ofstream(file().string() + "-wal") << "what it would have been told";
  EventsConnection connection(file());
  const auto opened = connection.Open();
  EXPECT_TRUE(opened.ok) << opened.error;
  EXPECT_TRUE(opened.new_file);
  EXPECT_EQ(opened.put_aside, file().string() +
                                  " is damaged (it is empty: its content is lost) and was renamed "
                                  "to events.db.bad; a new one begins");
  EXPECT_TRUE(std::filesystem::exists(file().string() + ".bad-wal"));
  EventsConnection second(file());
  EXPECT_EQ(second.Open().put_aside, "");
}

/// A disk that is full when it is made: what we have made ourselves is no loss.
TEST_F(EventsFileTest, OneThatCouldNotBeMadeIsNotTakenForALoss) {
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

TEST_F(EventsFileTest, ARemovedFileIsFoundOut) {
  EventsConnection connection(file());
  ASSERT_TRUE(connection.Open().ok);
  EXPECT_TRUE(connection.CheckThere());
  std::filesystem::remove(file());
  EXPECT_FALSE(connection.CheckThere());
  EXPECT_FALSE(connection.is_open());
  const auto opened = connection.Open();
  EXPECT_TRUE(opened.ok) << opened.error;
  EXPECT_TRUE(opened.new_file);
}

/// rm events.db-wal, or another file over it, while two connections write; then kill -9.
TEST_F(EventsFileTest, WhatAGoneLogHoldsIsSavedAndSoIsWhatFollows) {
  for (const bool replaced : {false, true}) {
    const auto writer = std::make_shared<EventsWriter>();
    EventsConnection one(file(), {}, writer);
    EventsConnection other(file(), {}, writer);
    ASSERT_TRUE(one.Open().ok);
    ASSERT_TRUE(other.Open().ok);
    const auto add = [](EventsConnection& to, const std::string& name) {
      EXPECT_TRUE(to.database().Execute("INSERT INTO event_cursors VALUES ('" + name + "', 1, 1)"));
      to.OnCommit();
    };
    add(one, "before");
    EXPECT_TRUE(one.CheckThere());
    EXPECT_TRUE(other.CheckThere());
    const std::string log = file().string() + "-wal";
    std::filesystem::remove(log);
    if (replaced) std::ofstream(log) << "of another database";
    EXPECT_NE(one.CheckThere().error().find("(-wal) was removed or replaced"), std::string::npos);
    EXPECT_TRUE(one.CheckThere()) << "it is said once";
    EXPECT_FALSE(other.CheckThere());
    add(one, "behind");
    add(other, "last");
    EXPECT_FALSE(std::filesystem::exists(log));
    const auto copy = file().string() + ".copy";
    std::filesystem::copy_file(file(), copy);
    Database alone(copy, Database::Mode::read);
    EXPECT_EQ(First(alone, "SELECT group_concat(name) FROM event_cursors"), "before,behind,last");
    one.Close();
    other.Close();
    std::filesystem::remove(copy);
    std::filesystem::remove(file());
  }
}

/// mv backup.db events.db, with a gateway running.
TEST_F(EventsFileTest, AnotherFileInItsPlaceIsLeftAsItIs) {
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
  ASSERT_TRUE(one.CheckThere());
  ASSERT_TRUE(other.CheckThere());
  std::filesystem::rename(backup, file());
  EXPECT_FALSE(one.CheckThere());
  ASSERT_TRUE(one.Open().ok);
  EXPECT_EQ(First(one.database(), "SELECT name FROM event_cursors"), "backup");
  ASSERT_TRUE(one.database().Execute("UPDATE event_cursors SET seq=2"));
  EXPECT_FALSE(other.CheckThere());
  ASSERT_TRUE(other.Open().ok);
  EXPECT_EQ(First(other.database(), "SELECT seq FROM event_cursors"), "2");
  EXPECT_TRUE(one.CheckThere()) << "its log is there";
}

}  // namespace
}  // namespace baudgate
