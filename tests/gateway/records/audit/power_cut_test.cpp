// The power is cut at a random moment, hundreds of times: no record that was kept is lost or
// doubled, none claims a success that was not, and the file opens every time.
// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>
#include <sqlite3.h>

#include <map>
#include <set>

#include "tests/gateway/records/audit/faulty_disk.h"
#include "tests/gateway/records/audit/fixture.h"
#include "tests/support/long_run.h"

namespace baudgate::audit {
namespace {

const std::size_t kSeeds = LongRun(400);
constexpr int kLives = 4;

/// What was told of one record, by its client.
struct Told {
  bool kept = false;            // the file has said so
  std::optional<WriteEnd> end;  // it was told how it ended
  bool end_kept = false;
};

class Life {
 public:
  Life(FaultyDisk& disk, std::mt19937& random, std::map<std::string, Told>& told)
      : disk_(disk), random_(random), told_(told), file_(kEventsFile, disk.vfs()) {}

  /// Until the power fails.
  void Run() {
    disk_.power_left = static_cast<int>(1 + random_() % 250);
    while (!disk_.power_failed()) {
      const auto what = random_() % 8;
      if (what < 3) Begin();
      if (what >= 3 && what < 6) End();
      if (what >= 6) Step();
      // A moment of trouble that passes.
      disk_.write_error = random_() % 50 == 0 ? SQLITE_FULL : 0;
      disk_.sync_error = random_() % 50 == 0 ? SQLITE_IOERR_FSYNC : 0;
    }
    disk_.write_error = disk_.sync_error = 0;
  }

 private:
  void Begin() {
    const std::string client = "c" + std::to_string(told_.size() + 1);
    const auto ticket = book_.Begin(WrittenPoint(client));
    ASSERT_TRUE(ticket);
    told_[client];
    open_[*ticket] = client;
    here_.insert(client);
  }
  void End() {
    if (open_.empty()) return;
    auto one = open_.begin();
    std::advance(one, static_cast<std::ptrdiff_t>(random_() % open_.size()));
    const WriteEnd end = random_() % 2 == 0 ? WriteEnd::ok : WriteEnd::refused;
    book_.End(one->first, {end, {}, 5ms});
    told_[one->second].end = end;
    open_.erase(one);
  }
  void Step() {
    const bool trouble = disk_.write_error != 0 || disk_.sync_error != 0;
    const Status status = Keep(file_, book_);
    if (!status) {
      EXPECT_TRUE(trouble || disk_.power_failed()) << status.error();
      return;
    }
    for (const std::string& client : here_) {
      Told& one = told_[client];
      one.kept = true;
      one.end_kept = one.end.has_value();
    }
  }

  FaultyDisk& disk_;
  std::mt19937& random_;
  std::map<std::string, Told>& told_;
  AuditBook book_;
  AuditFile file_;
  std::map<Ticket, std::string> open_;
  std::set<std::string> here_;  // of this life
};

void Check(const std::vector<WriteRecord>& records, const std::map<std::string, Told>& told) {
  std::set<std::string> seen;
  std::int64_t seq = 0;
  for (const WriteRecord& record : records) {
    EXPECT_EQ(record.seq, ++seq) << "without a gap";
    EXPECT_TRUE(seen.insert(record.client).second) << record.client << " is doubled";
    const auto found = told.find(record.client);
    ASSERT_NE(found, told.end());
    ASSERT_TRUE(record.end.has_value()) << "nothing is under way after a restart";
    ASSERT_TRUE(record.settled.has_value());
    const Told& one = found->second;
    if (one.end_kept) {
      EXPECT_EQ(record.end, one.end);
    } else if (record.end != WriteEnd::unknown) {
      EXPECT_EQ(record.end, one.end) << record.client << " claims what nobody has said";
    }
  }
  for (const auto& [client, one] : told) {
    if (!one.kept) continue;
    EXPECT_EQ(seen.count(client), 1U) << client << " is lost";
  }
}

TEST(PowerCut, LosesNothingThatWasKept) {
  std::size_t kept = 0;
  for (unsigned seed = 1; seed <= kSeeds && !testing::Test::HasFailure(); ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    std::mt19937 random(seed);
    FaultyDisk disk;
    std::map<std::string, Told> told;
    for (int life = 0; life < kLives; ++life) {
      Life(disk, random, told).Run();
      disk.Restore(random);
    }
    AuditFile file(kEventsFile, disk.vfs());
    const auto opened = file.Open();
    ASSERT_TRUE(opened && opened->ok) << opened->error;
    EXPECT_TRUE(opened->put_aside.empty()) << opened->put_aside;
    const auto records = ReadAll(kEventsFile, disk.vfs());
    Check(records, told);
    kept += records.size();
  }
  EXPECT_GT(kept, 10U * kSeeds) << "there was something to be lost";
}

}  // namespace
}  // namespace baudgate::audit
