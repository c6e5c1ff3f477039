// Tests of the files of the history: restarts, power cuts and disks that fail.
// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>
#include <sqlite3.h>

#include <atomic>
#include <condition_variable>
#include <fstream>
#include <functional>
#include <mutex>
#include <random>
#include <set>

#include "gateway/records/disk/state_folder.h"
#include "gateway/records/history/chunk.h"
#include "gateway/records/history/history_log.h"
#include "gateway/records/history/history_view.h"
#include "tests/gateway/records/audit/faulty_disk.h"
#include "tests/gateway/records/history/folder.h"
#include "tests/gateway/records/history/store_fixture.h"
#include "tests/support/long_run.h"

namespace baudgate::history {
namespace {

using audit::FaultyDisk;
using ::testing::HasSubstr;

TEST_F(ValueStoreTest, StoredValuesAreReadBack) {
  auto store = Open(kBegin);
  for (Millis time = kBegin; time < kBegin + 3 * kHour; time += kMinute) {
    const Status status =
        store->Write(Seconds(1, time, time + kMinute, {}, kBegin), At(time + kMinute));
    ASSERT_TRUE(status) << status.error();
  }
  for (const char* point : {"bay.f1.a", "bay.f1.on"}) {
    const auto records = All({.point = point});
    ASSERT_EQ(records.size(), 3 * 3600U);
    for (std::size_t i = 0; i < records.size(); ++i) {
      const Millis time = kBegin + static_cast<Millis>(i) * kSecond;
      ASSERT_EQ(records[i].entry.time, time);
      const Value value = point == std::string("bay.f1.a")
                              ? Value(static_cast<double>(time / kSecond % 1000) / 10)
                              : Value(time / kSecond % 2 == 0);
      ASSERT_EQ(records[i].entry.value, value);
      ASSERT_FALSE(records[i].gap);
    }
  }
  const auto some =
      All({.point = "bay.f1.a", .since = kBegin + kHour - 500, .until = kBegin + 2 * kHour});
  ASSERT_EQ(some.size(), 3600U);
  EXPECT_EQ(some.front().entry.time, kBegin + kHour);
  EXPECT_FALSE(ReadPage(folder(), {.point = "bay.f1.z"})->known);
}

TEST_F(ValueStoreTest, ARestartIsAGap) {
  Open(kBegin)->Write(Seconds(1, kBegin, kBegin + 5 * kSecond), At(kBegin + 5 * kSecond), true);
  auto store = Open(kBegin + kHour);
  ASSERT_TRUE(store->Write(Seconds(1, kBegin + kHour, kBegin + kHour + 2 * kSecond),
                           At(kBegin + kHour + 2 * kSecond)));
  const auto records = All({.point = "bay.f1.on"});
  ASSERT_EQ(records.size(), 8U);
  EXPECT_EQ(records[4].entry.value, Value(true)) << "a switch is one behind the restart, too";
  ASSERT_TRUE(records[5].gap);
  EXPECT_EQ(records[5].entry.time, kBegin + 5 * kSecond);
  EXPECT_EQ(records[5].gap->until, kBegin + kHour);
  EXPECT_EQ(records[5].gap->why, RunBegin::started);
  EXPECT_EQ(records[6].entry.time, kBegin + kHour);
}

TEST_F(ValueStoreTest, AClockSetBackReordersNothing) {
  auto store = Open(kBegin + kHour);
  ASSERT_TRUE(store->Write(Seconds(1, kBegin + kHour, kBegin + kHour + 3 * kSecond),
                           At(kBegin + kHour + 3 * kSecond)));
  const Millis back = kBegin - kHour;
  ASSERT_TRUE(
      store->Write(Seconds(2, back, back + 3 * kSecond, RunBegin::clock), At(back + 3 * kSecond)));
  const auto records = All({.point = "bay.f1.a"});
  ASSERT_EQ(records.size(), 7U);
  EXPECT_EQ(records[0].entry.time, kBegin + kHour);
  EXPECT_EQ(records[3].gap->why, RunBegin::clock);
  EXPECT_EQ(records[4].entry.time, back);
  EXPECT_TRUE(std::filesystem::exists(folder() / DayFileName(kBegin - kDay)));
}

TEST_F(ValueStoreTest, AnEmptyDayFileIsNamedUnlessItIsTheLatest) {
  auto store = Open(kBegin);
  ASSERT_TRUE(store->Write(Seconds(1, kBegin, kBegin + kSecond), At(kBegin + kSecond)));
  std::ofstream(folder() / DayFileName(kBegin - kDay)).close();
  std::ofstream(folder() / DayFileName(kBegin + kDay)).close();
  const auto page = ReadPage(folder(), {.point = "bay.f1.a", .since = 0});
  ASSERT_TRUE(page);
  ASSERT_EQ(page->unread.size(), 1U);
  EXPECT_EQ(page->unread[0].text,
            DayFileName(kBegin - kDay) + ": the file is empty: its content is lost");
}

TEST_F(ValueStoreTest, PagesAndDaysJoin) {
  auto store = Open(kBegin + kDay - kHour);
  for (Millis time = kBegin + kDay - kHour; time < kBegin + kDay + kHour; time += kMinute) {
    ASSERT_TRUE(store->Write(Seconds(1, time, time + kMinute, {}, kBegin + kDay - kHour),
                             At(time + kMinute)));
  }
  const auto records = All({.point = "bay.f1.a"});
  ASSERT_EQ(records.size(), 7200U);
  for (std::size_t i = 1; i < records.size(); ++i) {
    ASSERT_EQ(records[i].entry.time - records[i - 1].entry.time, kSecond) << i;
  }
}

TEST_F(ValueStoreTest, ADamagedFileIsPutAside) {
  { Open(kBegin)->Write(Seconds(1, kBegin, kBegin + kMinute), At(kBegin + kMinute), true); }
  const auto path = folder() / DayFileName(kBegin);
  {
    std::fstream bytes(path, std::ios::in | std::ios::out | std::ios::binary);
    bytes << "this is no database";
  }
  auto store = Open(kBegin + kHour);
  const auto news = store->TakeNews();
  ASSERT_EQ(news.size(), 1U);
  EXPECT_THAT(news[0].text, HasSubstr("values-"));
  EXPECT_TRUE(std::filesystem::exists(path.string() + ".bad"));
  ASSERT_TRUE(store->Write(Seconds(1, kBegin + kHour, kBegin + kHour + kSecond),
                           At(kBegin + kHour + kSecond)));
  EXPECT_EQ(All({.point = "bay.f1.a"}).size(), 1U);
}

TEST_F(ValueStoreTest, SpansAreMerged) {
  auto store = Open(kBegin);
  Batch batch;
  batch.runs = {{1, kBegin, kBegin + 2 * kHour, RunBegin::started}};
  for (int i = 0; i < 90; ++i) {
    const double v = i;
    batch.trends.push_back(
        {0, 1, kMinute, {kBegin + i * kMinute, v, v - 1, v + 1, v, v, 60, kMinute}});
  }
  batch.trends.push_back({0, 1, kHour, {kBegin, 29.5, -1, 60, 0, 59, 3600, kHour}});
  ASSERT_TRUE(store->Write(std::move(batch), At(kBegin + 2 * kHour)));
  const auto quarters = ReadTrends(folder(), {.point = "bay.f1.a", .every = 15 * kMinute});
  ASSERT_TRUE(quarters);
  ASSERT_EQ(quarters->spans.size(), 6U);
  EXPECT_EQ(quarters->spans[1], (Trend{kBegin + 15 * kMinute, 22, 14, 30, 15, 29, 900, kHour / 4}));
  const auto hours = ReadTrends(folder(), {.point = "bay.f1.a", .every = kHour});
  ASSERT_EQ(hours->spans.size(), 2U);
  EXPECT_EQ(hours->spans[0].mean, 29.5);
  EXPECT_EQ(hours->spans[1].mean, 74.5) << "out of the minutes of an hour that is not over";
  store.reset();
  // A killed gateway has not written the trend of this hour, so it is computed from the minutes.
  store = Open(kBegin + 3 * kHour);
  Batch later;
  later.runs = {{1, kBegin + 3 * kHour, kBegin + 3 * kHour, RunBegin::started}};
  ASSERT_TRUE(store->Write(std::move(later), At(kBegin + 3 * kHour)));
  const auto mended = ReadTrends(folder(), {.point = "bay.f1.a", .every = kHour});
  ASSERT_EQ(mended->spans.size(), 2U);
  EXPECT_EQ(mended->spans[1], hours->spans[1]);
}

TEST(ValuePowerCuts, LoseASecondAtMost) {
  std::mt19937 random(14);
  const std::vector<PointName> names = {{"a", config::Type::float64}};
  for (std::size_t cut = 0; cut < LongRun(60); ++cut) {
    FaultyDisk disk;
    const std::string path = "/" + DayFileName(kBegin);
    Millis written = kBegin;
    std::int64_t count = 0;
    {
      DayFile file(path, names, disk.vfs());
      ASSERT_TRUE(file.Open().ok) << file.error();
      disk.power_left = static_cast<int>(random() % 600);
      for (int second = 0; second < 100; ++second) {
        std::vector<Sample> samples;
        for (int i = 0; i < 5; ++i) {
          samples.push_back(
              {0, 1, {written + 1 + i, static_cast<double>(count + i), Quality::good}});
        }
        if (!file.Write(samples, {{1, kBegin, written + 5, RunBegin::started}})) break;
        written += 5;
        count += 5;
        if (!file.packing() && second % 10 == 9) file.BeginPacking();
        if (file.packing() && !file.Pack(20)) break;
      }
    }
    disk.Restore(random);
    DayFile file(path, names, disk.vfs());
    const DayFile::Opened opened = file.Open();
    ASSERT_TRUE(opened.ok) << file.error();
    EXPECT_EQ(opened.put_aside, "");
    records::Database database(path, records::Database::Mode::read, disk.vfs());
    std::vector<Entry> entries;
    records::Statement chunks(database, "SELECT bytes FROM chunks ORDER BY first");
    while (chunks.Next() == records::Statement::Step::row) {
      const auto chunk = DecodeChunk(chunks.Blob(0));
      ASSERT_TRUE(chunk);
      entries.insert(entries.end(), chunk->begin(), chunk->end());
    }
    for (std::size_t i = 0; i < entries.size(); ++i) {
      ASSERT_EQ(entries[i].value, Value(static_cast<double>(i))) << "none lost between, none twice";
    }
    EXPECT_GE(static_cast<std::int64_t>(entries.size()), count) << "what was committed";
    EXPECT_LE(static_cast<std::int64_t>(entries.size()), count + 5);
  }
}

TEST_F(ValueStoreTest, TheVersionsOfItsFilesAreKnown) {
  ValueStore store(folder(), {{"bay.f1.a", config::Type::float32}}, {});
  ASSERT_TRUE(store.Open(At(kBegin)));
  Batch batch;
  batch.runs = {{1, kBegin, kBegin + kSecond, RunBegin::started}};
  batch.samples = {{0, 1, {kBegin, 8.5, Quality::good}}};
  ASSERT_TRUE(store.Write(std::move(batch), At(kBegin + kSecond), true));
  for (const auto& [name, application] :
       {std::pair(DayFileName(kBegin), kValuesApplication),
        std::pair(std::string("trends.db"), kTrendsApplication)}) {
    records::Database file((folder() / name).string(), records::Database::Mode::read);
    EXPECT_EQ(file.First("PRAGMA user_version"), Value(records::KnownVersion(application))) << name;
  }
}

TEST(ValueDisk, AFullDiskRecoversWhenThereIsRoom) {
  FaultyDisk disk;
  const std::vector<PointName> names = {{"a", config::Type::float64}};
  ValueStore store("/", names, {}, disk.vfs());
  ASSERT_TRUE(store.Open(At(kBegin)));
  disk.write_error = SQLITE_FULL;
  Batch batch;
  batch.runs = {{1, kBegin, kBegin + 1, RunBegin::started}};
  batch.samples = {{0, 1, {kBegin + 1, 1.0, Quality::good}}};
  EXPECT_FALSE(store.Write(std::move(batch), At(kBegin + 1)));
  EXPECT_TRUE(store.waits());
  EXPECT_FALSE(store.Write({}, At(kBegin + 2)));
  disk.write_error = 0;
  EXPECT_TRUE(store.Write({}, At(kBegin + 3)));
  EXPECT_FALSE(store.waits());
}

using ::testing::Contains;

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
    store_ = std::make_unique<bus::PointStore>(config_);
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
    const bus::Sample sample{0, value, Quality::good};
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
  /// Waits until `ready` is true. Calls it after each round of the log's thread, and every 100 ms,
  /// because the thread may not run again.
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
  std::unique_ptr<bus::PointStore> store_;
  std::function<bool()> taken_;

 private:
  std::mutex round_mutex_;
  std::condition_variable round_;
  std::uint64_t rounds_ = 0;
  std::mutex mutex_;
  std::vector<std::string> heard_;
};

TEST_F(HistoryLogTest, AnUnreadableFileIsReported) {
  const auto path = folder();
  const auto log = Start(path);
  Await([&] { return log->view()->state().disk == records::Disk::fine; });
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
  EXPECT_THAT(heard(),
              Contains("warn: history: " + damaged +
                       ": file is not a database; query results lack values of this file"));
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
    Await([&] { return log->view()->state().disk == records::Disk::fine; });
  }
  store_ = std::make_unique<bus::PointStore>(config_);
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

TEST_F(HistoryLogTest, ARemovedFileIsCreatedAgain) {
  const auto log = Start(folder());
  Set(7);
  const auto kept = [&] { return log->view()->Read({.point = "bay.f1.a"})->records; };
  Await([&] { return kept().size() == 1; });
  // The database file is removed last, because the log creates a new one as soon as it is missing.
  std::set<std::filesystem::path, std::greater<>> files;
  for (const auto& entry : std::filesystem::directory_iterator(folder())) {
    if (entry.path().filename().string().starts_with("values-")) files.insert(entry.path());
  }
  for (const auto& file : files) std::filesystem::remove(file);
  Await([&] { return log->view()->state().counters.kept == 2 && !kept().empty(); });
  Await([&] { return !kept().back().gap; });
  EXPECT_EQ(kept().back().entry.value, Value(std::int64_t{7}));
  ASSERT_EQ(heard().size(), 1U) << heard().back();
  EXPECT_THAT(heard()[0], HasSubstr("warn: history: "));
  EXPECT_THAT(heard()[0], HasSubstr("the file was removed, and its content is lost"));
}

TEST_F(HistoryLogTest, AFailingDiskDelaysNoReading) {
  FaultyDisk disk;
  const auto log = Start("/", disk.vfs());
  Set(1);
  Await([&] { return log->view()->state().disk == records::Disk::fine; });
  disk.write_error = SQLITE_FULL;
  Set(2);
  Await([&] { return log->view()->state().disk == records::Disk::failing; });
  const auto before = log->view()->state().counters.readings;
  for (int i = 0; i < 1000; ++i) Set(i);
  Await([&] { return log->view()->state().counters.readings > before; });
  EXPECT_FALSE(log->view()->state().trouble.empty());
  disk.write_error = 0;
  Await([&] {
    return log->view()->state().disk == records::Disk::fine && log->view()->state().waiting == 0;
  });
  const auto lines = heard();
  ASSERT_EQ(lines.size(), 2U);
  EXPECT_THAT(lines[0], HasSubstr("warn: history: "));
  EXPECT_THAT(lines[1], HasSubstr("inform: history: values are recorded again"));
}

TEST_F(HistoryLogTest, AHangingDiskIsShown) {
  FaultyDisk disk;
  const auto log = Start("/", disk.vfs());
  Await([&] { return log->view()->state().disk == records::Disk::fine; });
  disk.Hang(true);
  Set(1);
  Await([&] { return log->view()->state().disk == records::Disk::stalled; });
  Set(2);
  disk.Hang(false);
  Await([&] {
    return log->view()->state().disk == records::Disk::fine &&
           log->view()->state().counters.kept == 2;
  });
}

TEST_F(HistoryLogTest, WaitsForThePreviousOwnerOfTheFiles) {
  std::atomic<bool> taken = true;
  taken_ = [&taken] { return taken.load(); };
  const auto log = Start(folder());
  Set(1);
  Await([&] { return log->view()->state().disk == records::Disk::stalled; });
  EXPECT_FALSE(std::filesystem::exists(folder() / kTrendsFile));
  taken = false;
  Await([&] { return log->view()->state().disk == records::Disk::fine; });
  Await([&] { return log->view()->Read({.point = "bay.f1.a"})->records.size() == 1; });
}

TEST_F(HistoryLogTest, ReportsAMissingPlace) {
  const auto log = Start({});
  Set(1);
  EXPECT_EQ(log->view()->state().disk, records::Disk::failing);
  EXPECT_FALSE(log->view()->Read({}));
}

}  // namespace
}  // namespace baudgate::history
