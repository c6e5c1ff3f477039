// Tests of `SecurityJournal`: the chain of its rows, and what VerifyJournal finds.
// SPDX-License-Identifier: Apache-2.0
#include "gateway/records/audit/security_journal.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <fstream>
#include <iterator>

#include "gateway/base/secrets.h"

namespace baudgate::audit {
namespace {

namespace fs = std::filesystem;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::SizeIs;

class SecurityJournalTest : public ::testing::Test {
 protected:
  SecurityJournalTest() {
    std::string form = (fs::temp_directory_path() / "baudgate-journal-XXXXXX").string();
    folder_ = ::mkdtemp(form.data());
  }
  ~SecurityJournalTest() override { fs::remove_all(folder_); }

  void Write(int rows) const {
    SecurityJournal journal(folder_);
    for (int i = 0; i < rows; ++i) {
      journal.Note({"login", "anna", "10.0.0.7", "page", std::to_string(i)}, WallTime(i * 1s));
    }
    EXPECT_TRUE(journal.Flush(20s));
  }
  std::string Text(const char* name = SecurityJournal::kFile) const {
    std::ifstream file(folder_ / name);
    return {std::istreambuf_iterator<char>(file), {}};
  }
  void Replace(const std::string& text) const {
    std::ofstream(folder_ / SecurityJournal::kFile, std::ios::trunc) << text;
  }
  std::vector<std::string> Faults() const { return VerifyJournal(folder_).value().faults; }

  fs::path folder_;
};

TEST_F(SecurityJournalTest, RowsAreChainedAcrossRestarts) {
  Write(2);
  Write(1);
  const auto check = VerifyJournal(folder_);
  ASSERT_TRUE(check);
  EXPECT_THAT(check->faults, IsEmpty());
  ASSERT_THAT(check->rows, SizeIs(3));
  EXPECT_EQ(check->rows[2].number, 3);
  EXPECT_EQ(check->rows[1].time, "1970-01-01T00:00:01.000Z");
  EXPECT_EQ(check->rows[1].event.who, "anna");
  EXPECT_THAT(check->last_hash, SizeIs(64));
}

TEST_F(SecurityJournalTest, ManyRowsOfOneUserAndHostAreCounted) {
  {
    SecurityJournal journal(folder_);
    const auto note = [&](const char* who, const char* from, Duration at) {
      journal.Note({"logout", who, from, "page", "ok"}, WallTime(at));
    };
    for (int i = 0; i < 1000; ++i) note("vera", "10.0.0.7:1", 1s);
    note("anna", "10.0.0.7:1", 2s);
    note("vera", "10.0.0.8:1", 3s);
    note("vera", "10.0.0.7:2", 70s);
  }
  const auto rows = VerifyJournal(folder_).value().rows;
  ASSERT_THAT(rows, SizeIs(SecurityJournal::kMostInAMinute + 4));
  EXPECT_EQ(rows[12].event.result, "990 more in a minute, the last: ok");
}

TEST_F(SecurityJournalTest, ACommandThatChangedSomethingIsNeverFolded) {
  {
    SecurityJournal journal(folder_);
    for (int i = 0; i < 40; ++i) {
      journal.Note({"command", "otto", "", "enable nope", "there is no line"}, WallTime(1s));
      if (i % 20 == 19) journal.Note({"command", "otto", "", "disable a.b", "ok"}, WallTime(1s));
    }
  }
  const auto rows = VerifyJournal(folder_).value().rows;
  EXPECT_EQ(
      std::ranges::count(rows, "disable a.b", [](const JournalRow& row) { return row.event.what; }),
      2);
}

TEST_F(SecurityJournalTest, ARemovedFileIsMadeAgainAndTheChainGoesOn) {
  SecurityJournal journal(folder_);
  const auto note = [&] {
    journal.Note({"login", "anna", "", "page", "ok"}, WallTime(1s));
    EXPECT_TRUE(journal.Flush(20s));
  };
  note();
  fs::remove(folder_ / SecurityJournal::kFile);
  note();
  const auto check = VerifyJournal(folder_);
  ASSERT_TRUE(check);
  EXPECT_THAT(check->faults, IsEmpty());
  ASSERT_THAT(check->rows, SizeIs(1));
  EXPECT_EQ(check->rows[0].number, 2) << "shows that a row is missing before it";
}

TEST_F(SecurityJournalTest, AnUnreadableFileAndAForgedNumberAreFaults) {
  Write(1);
  fs::rename(folder_ / SecurityJournal::kFile, folder_ / SecurityJournal::kOldFile);
  fs::create_directory(folder_ / SecurityJournal::kFile);
  EXPECT_THAT(Faults(), ElementsAre(HasSubstr("security.jsonl cannot be read")));
  fs::remove(folder_ / SecurityJournal::kFile);
  const std::string body = R"({"n":"x","prev":""})";
  Replace(body.substr(0, body.size() - 1) + R"(,"hash":")" + Sha256Hex(body) + "\"}\n");
  EXPECT_THAT(Faults(), ElementsAre(HasSubstr("security.jsonl:1: the row was changed")));
}

TEST_F(SecurityJournalTest, NamesOfClientsForgeNoRows) {
  {
    SecurityJournal journal(folder_);
    journal.Note({"login", "x\n99 login \x1B[31m\xE2\x80\xAEolga", "", "page", "ok"}, WallTime(1s));
  }
  const auto rows = VerifyJournal(folder_).value().rows;
  ASSERT_THAT(rows, SizeIs(1));
  EXPECT_EQ(rows[0].event.who, "x\\x0A99 login \\x1B[31m\\xE2\\x80\\xAEolga");
}

TEST_F(SecurityJournalTest, AChangedRowIsFound) {
  Write(3);
  std::string text = Text();
  text.replace(text.find("10.0.0.7", text.find('\n')), 8, "10.0.0.9");
  Replace(text);
  EXPECT_THAT(Faults(), ElementsAre(HasSubstr("security.jsonl:2: the row was changed")));
}

TEST_F(SecurityJournalTest, AMissingRowIsFound) {
  Write(4);
  std::string text = Text();
  const std::size_t first = text.find('\n') + 1;
  text.erase(first, text.find('\n', first) + 1 - first);
  Replace(text);
  EXPECT_THAT(Faults(), ElementsAre(HasSubstr("security.jsonl:2: rows before this row")));
}

TEST_F(SecurityJournalTest, ARowThatAPowerFailureHasCutIsRemovedAtTheNextStart) {
  Write(2);
  for (std::size_t cut = 1; cut < 40; cut += 13) {
    Replace(Text() + std::string("{\"n\":3,\"time\":\"2026-12-01T08:00:00.000Z\"").substr(0, cut));
    EXPECT_THAT(Faults(), ElementsAre(HasSubstr("the last row is cut")));
    Write(1);
    EXPECT_THAT(Faults(), IsEmpty());
  }
}

TEST_F(SecurityJournalTest, AFullFileIsReplacedAndTheChainGoesOn) {
  Write(1);
  const std::string row = Text();
  {
    SecurityJournal journal(folder_);
    const std::string what(200, 'x');
    std::size_t written = row.size();
    int number = 0;  // one row in seven seconds, so that none is only counted
    while (written < SecurityJournal::kMostBytes + 100'000) {
      for (int i = 0; i < 500; ++i) {
        journal.Note({"login", "a", "", what, "ok"}, WallTime(7s * ++number));
      }
      written += 500 * (row.size() + what.size());
      ASSERT_TRUE(journal.Flush(20s));
    }
  }
  EXPECT_LT(Text().size(), SecurityJournal::kMostBytes);
  EXPECT_GE(Text(SecurityJournal::kOldFile).size(), SecurityJournal::kMostBytes);
  EXPECT_THAT(Faults(), IsEmpty());
}

TEST_F(SecurityJournalTest, RowsWithoutADiskAreCountedInTheFile) {
  fs::create_directory(folder_ / SecurityJournal::kFile);  // cannot be opened as a file
  SecurityJournal journal(folder_);
  journal.Note({"login", "anna", "", "page", "ok"}, WallTime(1s));
  journal.Note({"login", "anna", "", "page", "ok"}, WallTime(1s));
  EXPECT_TRUE(journal.Flush(20s));
  fs::remove(folder_ / SecurityJournal::kFile);
  journal.Note({"login", "otto", "", "page", "ok"}, WallTime(2s));
  EXPECT_TRUE(journal.Flush(20s));
  const auto check = VerifyJournal(folder_);
  ASSERT_TRUE(check);
  ASSERT_THAT(check->rows, SizeIs(2));
  EXPECT_EQ(check->rows[1].event.what, "2 rows were lost");
}

TEST_F(SecurityJournalTest, AFolderWithoutAJournalIsAnError) {
  EXPECT_THAT(VerifyJournal(folder_).error(), HasSubstr("no security journal"));
}

}  // namespace
}  // namespace baudgate::audit
