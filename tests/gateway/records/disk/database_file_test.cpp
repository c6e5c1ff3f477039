// Database files that are damaged, that are no files, and logs that have lost what was committed.
// SPDX-License-Identifier: Apache-2.0
#include "gateway/records/disk/database_file.h"

#include <gtest/gtest.h>
#include <sys/stat.h>

#include <fstream>

namespace baudgate {
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

  /// With so many rows, each of a transaction of its own; all in the file, none in the log.
  void MakeFile(int rows) const {
    OpenedDatabase made = OpenDatabase(file(), kKind);
    ASSERT_TRUE(made.database) << made.error;
    for (int row = 0; row < rows; ++row) {
      ASSERT_TRUE(made.database->Execute("INSERT INTO t VALUES (1)"));
    }
  }
  /// As a gateway leaves it that is killed: three transactions are in the log.
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
  /// Where the checksum of a frame of the log stands; frames count from 0.
  static std::size_t SumOf(std::size_t frame) { return 32 + frame * (24 + 4096) + 16; }
  std::size_t frames() const { return (fs::file_size(log()) - 32) / (24 + 4096); }

 private:
  fs::path folder_;
};

TEST_F(DatabaseFileTest, EachByteOfItsHeadMayBeDamaged) {
  MakeFile(2);
  const fs::path good = fs::path(::testing::TempDir()) / "baudgate-good.db";
  fs::copy_file(file(), good, fs::copy_options::overwrite_existing);
  for (std::size_t at = 0; at < 100; ++at) {
    for (const auto& old : fs::directory_iterator(file().parent_path())) fs::remove(old.path());
    fs::copy_file(good, file());
    Invert(file(), at);
    const OpenedDatabase opened = OpenDatabase(file(), kKind);
    if (opened.put_aside.empty()) {
      // What the byte says matters to nobody, or the file is of a newer program.
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

TEST_F(DatabaseFileTest, WhatIsNoFileIsNotOpened) {
  for (const char* part : {"", "-wal", "-shm"}) {
    const std::string path = file().string() + part;
    ASSERT_EQ(::mkfifo(path.c_str(), 0600), 0);
    const OpenedDatabase opened = OpenDatabase(file(), kKind);
    EXPECT_FALSE(opened.database);
    EXPECT_NE(opened.error.find(path + " is a FIFO, and no regular file: remove it"),
              std::string::npos)
        << opened.error;
    fs::remove(path);
    EXPECT_TRUE(OpenDatabase(file(), kKind).database) << part;
  }
}

TEST_F(DatabaseFileTest, AWholeLogHasLostNothing) {
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

TEST_F(DatabaseFileTest, CommittedChangesBehindDamageAreToldAsLost) {
  for (const std::size_t damaged : {SumOf(0), SumOf(0) - 4, SumOf(0) + 100}) {
    for (const auto& old : fs::directory_iterator(file().parent_path())) fs::remove(old.path());
    MakeKilled();
    Invert(log(), damaged);
    const OpenedDatabase opened = OpenDatabase(file(), kKind);
    ASSERT_TRUE(opened.database) << opened.error;
    EXPECT_EQ(Rows(*opened.database), 1);
    ASSERT_TRUE(opened.lost) << damaged;
    EXPECT_NE(opened.lost->find("committed changes behind the damage are lost"), std::string::npos)
        << *opened.lost;
  }
}

TEST_F(DatabaseFileTest, ALogWithoutItsHeadHasLostAll) {
  MakeKilled();
  Invert(log(), 26);
  EXPECT_EQ(LogDamage(file()), "the head of its log is damaged: all changes in the log are lost");
}

TEST_F(DatabaseFileTest, FramesOfTheLastRoundAreNoLoss) {
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

}  // namespace
}  // namespace baudgate
