// The history with its threads, on disks that work, fail and hang.
// SPDX-License-Identifier: Apache-2.0
#include "gateway/records/history/history_log.h"

#include <gmock/gmock.h>
#include <sqlite3.h>

#include <atomic>
#include <condition_variable>
#include <fstream>
#include <functional>
#include <mutex>
#include <set>

#include "tests/gateway/records/audit/faulty_disk.h"
#include "tests/gateway/records/history/folder.h"

namespace baudgate::history {
namespace {

using audit::FaultyDisk;
using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

class HistoryLogTest : public FolderTest {
 protected:
  HistoryLogTest() {
    config::Line line;
    line.name = "bay";
    config::Device device;
    device.name = "f1";
    config::Point point;
    point.name = "a";
    point.type = config::Type::int32;
    device.points = {point};
    line.devices = {device};
    config_.lines = {line};
    config_.history.points = {{.device = 0, .point = 0}};
    store_ = std::make_unique<PointStore>(config_);
  }
  std::unique_ptr<HistoryLog> Start(const std::filesystem::path& folder,
                                    const std::string& vfs = {}) {
    HistoryLog::Options options;
    options.config = &config_;
    options.store = store_.get();
    options.folder = folder;
    options.why_no_folder = "there is no place for it";
    options.vfs = vfs;
    options.taken = taken_;
    options.clocks = [this] {
      {
        const std::lock_guard lock(round_mutex_);
        ++rounds_;
      }
      round_.notify_all();
      return ReadClocks();
    };
    options.warn = [this](const std::string& text) { Hear("warn: " + text); };
    options.inform = [this](const std::string& text) { Hear("inform: " + text); };
    return std::make_unique<HistoryLog>(std::move(options));
  }
  void Set(std::int64_t value) {
    const baudgate::Sample sample{0, value, Quality::good};
    store_->Update(0, {&sample, 1}, ReadClocks(), 1ms);
  }
  void Hear(const std::string& text) {
    const std::lock_guard lock(mutex_);
    heard_.push_back(text);
  }
  std::vector<std::string> heard() {
    const std::lock_guard lock(mutex_);
    return heard_;
  }
  /// Looks again whenever the log has looked at the clock, as it does in each of its rounds; and a
  /// moment later, as what is awaited may be the end of its last round.
  template <typename Ready>
  void Await(Ready ready) {
    for (;;) {
      std::unique_lock lock(round_mutex_);
      const std::uint64_t rounds = rounds_;
      lock.unlock();
      if (ready()) return;
      lock.lock();
      round_.wait_for(lock, 100ms, [&] { return rounds_ != rounds; });
    }
  }

  config::Config config_;
  std::unique_ptr<PointStore> store_;
  std::function<bool()> taken_;

 private:
  std::mutex round_mutex_;
  std::condition_variable round_;
  std::uint64_t rounds_ = 0;
  std::mutex mutex_;
  std::vector<std::string> heard_;
};

TEST_F(HistoryLogTest, WhatCannotBeReadIsNotSilentlyMissing) {
  const auto path = folder();
  const auto log = Start(path);
  Await([&] { return log->view()->state().disk == Disk::fine; });
  const Millis yesterday = FloorTo(ToMillis(ReadClocks().wall), kDay) - kDay;
  const std::string damaged = DayFileName(yesterday);
  std::ofstream(path / damaged) << std::string(8192, 'x');
  for (int times = 0; times < 2; ++times) {
    const auto page = log->view()->Read({.point = "bay.f1.a"});
    ASSERT_TRUE(page.ok());
    ASSERT_EQ(page->unread.size(), 1U);
    EXPECT_EQ(page->unread[0].text, damaged + ": file is not a database");
  }
  EXPECT_EQ(log->view()->state().unread.size(), 1U);
  EXPECT_THAT(heard(), Contains("warn: history: " + damaged +
                                ": file is not a database; its values are missing in answers"));
  EXPECT_EQ(heard().size(), 1U) << "once";
}

TEST_F(HistoryLogTest, KeepsOverRestarts) {
  const auto path = folder();
  {
    const auto log = Start(path);
    Set(1);
    Await([&] { return log->view()->state().counters.kept == 1; });
    Set(2);
    Await([&] { return log->view()->state().counters.kept == 2; });
    Await([&] { return log->view()->state().disk == Disk::fine; });
  }
  store_ = std::make_unique<PointStore>(config_);
  const auto log = Start(path);
  Set(2);
  Await([&] { return log->view()->Read({.point = "bay.f1.a"})->records.size() == 4; });
  const auto page = log->view()->Read({.point = "bay.f1.a"});
  EXPECT_EQ(page->records[0].entry.value, Value(std::int64_t{1}));
  EXPECT_EQ(page->records[1].entry.value, Value(std::int64_t{2}));
  EXPECT_TRUE(page->records[2].gap) << "nobody knows what was while it was down";
  EXPECT_EQ(page->records[3].entry.value, Value(std::int64_t{2}));
  const auto spans = log->view()->ReadTrends({.point = "bay.f1.a"});
  ASSERT_TRUE(spans) << spans.error();
  ASSERT_FALSE(spans->spans.empty());
  EXPECT_EQ(spans->spans[0].count, 2);
  EXPECT_EQ(log->view()->state().points, 1U);
  EXPECT_EQ(log->view()->state().counters.dropped, 0U);
}

TEST_F(HistoryLogTest, AFileThatIsRemovedIsBegunAnew) {
  const auto log = Start(folder());
  Set(7);
  const auto kept = [&] { return log->view()->Read({.point = "bay.f1.a"})->records; };
  Await([&] { return kept().size() == 1; });
  // The database last: it is begun anew as soon as it is gone.
  std::set<std::filesystem::path, std::greater<>> files;
  for (const auto& entry : std::filesystem::directory_iterator(folder())) {
    if (entry.path().filename().string().starts_with("values-")) files.insert(entry.path());
  }
  for (const auto& file : files) std::filesystem::remove(file);
  // Nothing changes, and yet what holds is kept again.
  Await([&] { return log->view()->state().counters.kept == 2 && !kept().empty(); });
  Await([&] { return !kept().back().gap; });
  EXPECT_EQ(kept().back().entry.value, Value(std::int64_t{7}));
  ASSERT_EQ(heard().size(), 1U) << heard().back();
  EXPECT_THAT(heard()[0], HasSubstr("warn: history: "));
  EXPECT_THAT(heard()[0], HasSubstr("it was removed, and all that was in it"));
}

TEST_F(HistoryLogTest, ADiskThatFailsHoldsUpNobody) {
  FaultyDisk disk;
  const auto log = Start("/", disk.vfs());
  Set(1);
  Await([&] { return log->view()->state().disk == Disk::fine; });
  disk.write_error = SQLITE_FULL;
  Set(2);
  Await([&] { return log->view()->state().disk == Disk::failing; });
  const auto before = log->view()->state().counters.readings;
  for (int i = 0; i < 1000; ++i) Set(i);
  Await([&] { return log->view()->state().counters.readings > before; });
  EXPECT_FALSE(log->view()->state().trouble.empty());
  disk.write_error = 0;
  Await(
      [&] { return log->view()->state().disk == Disk::fine && log->view()->state().waiting == 0; });
  const auto lines = heard();
  ASSERT_EQ(lines.size(), 2U);
  EXPECT_THAT(lines[0], HasSubstr("warn: history: "));
  EXPECT_THAT(lines[1], HasSubstr("inform: history: values are kept again"));
}

TEST_F(HistoryLogTest, ADiskThatHangsIsShown) {
  FaultyDisk disk;
  const auto log = Start("/", disk.vfs());
  Await([&] { return log->view()->state().disk == Disk::fine; });
  disk.Hang(true);
  Set(1);
  Await([&] { return log->view()->state().disk == Disk::stalled; });
  Set(2);
  disk.Hang(false);
  Await([&] {
    return log->view()->state().disk == Disk::fine && log->view()->state().counters.kept == 2;
  });
}

/// A reload has ended it, and its disk hangs.
TEST_F(HistoryLogTest, WaitsForTheOneThatHasTheFiles) {
  std::atomic<bool> taken = true;
  taken_ = [&taken] { return taken.load(); };
  const auto log = Start(folder());
  Set(1);
  Await([&] { return log->view()->state().disk == Disk::stalled; });
  EXPECT_FALSE(std::filesystem::exists(folder() / kTrendsFile));
  taken = false;
  Await([&] { return log->view()->state().disk == Disk::fine; });
  Await([&] { return log->view()->Read({.point = "bay.f1.a"})->records.size() == 1; });
}

TEST_F(HistoryLogTest, SaysSoWhereThereIsNoPlace) {
  const auto log = Start({});
  Set(1);
  EXPECT_EQ(log->view()->state().disk, Disk::failing);
  EXPECT_FALSE(log->view()->Read({}));
}

}  // namespace
}  // namespace baudgate::history
