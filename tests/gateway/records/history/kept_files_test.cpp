// Tests which files of the history are deleted, and the messages about removed files.
// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>
#include <sys/stat.h>

#include <fstream>
#include <functional>

#include "gateway/records/history/folder_files.h"
#include "gateway/records/history/history_view.h"
#include "tests/gateway/records/history/store_fixture.h"

namespace baudgate::history {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

std::vector<std::string> FilesOf(const std::vector<TooMuch>& gone) {
  std::vector<std::string> files;
  for (const TooMuch& file : gone) files.push_back(file.file);
  return files;
}

TEST(FolderFiles, OldDaysAreDeletedByAgeAndSize) {
  FolderFiles folder_files;
  folder_files.trends = 10;
  for (int i = 0; i < 5; ++i) folder_files.days.push_back({kBegin + i * kDay, 100});
  const Millis today = kBegin + 4 * kDay;
  const auto gone = [&](std::uint64_t limit, Millis keep, std::optional<Millis> sure) {
    return FilesOf(FindTooMuch(folder_files, limit, keep, today, sure));
  };
  const std::string first = DayFileName(kBegin);
  const std::string second = DayFileName(kBegin + kDay);
  EXPECT_THAT(gone(1000, 365 * kDay, today), IsEmpty());
  EXPECT_THAT(gone(1000, 2 * kDay, today), ElementsAre(first, second));
  EXPECT_THAT(gone(1000, 2 * kDay, std::nullopt), IsEmpty());
  EXPECT_THAT(gone(1000, 2 * kDay, today - kDay), ElementsAre(first));
  EXPECT_THAT(gone(400, 365 * kDay, std::nullopt), ElementsAre(first, second));
  EXPECT_EQ(gone(1, 365 * kDay, today).size(), 4U) << "never today's";
  EXPECT_EQ(gone(1, kDay, today + 365 * kDay).size(), 4U);
}

TEST(FolderFiles, FilesPutAsideAreDeletedBeforeAnyDay) {
  FolderFiles folder_files;
  folder_files.trends = 10;
  folder_files.aside = {{"values-20260101.db.bad", 100}, {"trends.db.bad", 100}};
  folder_files.days = {{kBegin, 100}, {kBegin + kDay, 100}};
  const auto gone = [&](std::uint64_t limit) {
    return FilesOf(FindTooMuch(folder_files, limit, 365 * kDay, kBegin + kDay, std::nullopt));
  };
  EXPECT_THAT(gone(1000), IsEmpty());
  EXPECT_THAT(gone(400), ElementsAre("values-20260101.db.bad"));
  EXPECT_THAT(gone(200),
              ElementsAre("values-20260101.db.bad", "trends.db.bad", DayFileName(kBegin)));
  folder_files.days[1].bytes = 40'000'000;
  folder_files.trends = 3'100'000;
  EXPECT_EQ(Largest(folder_files), DayFileName(kBegin + kDay) + " has 40.0 MB, trends.db 3.1 MB");
}

TEST(SureTime, NeedsAClockThatRanSteadilyForADay) {
  SureTime time;
  time.Begin(At(kBegin + kHour), kBegin);
  EXPECT_FALSE(time.Look(At(kBegin + kHour)));
  EXPECT_FALSE(time.Look(At(kBegin + kDay)));
  EXPECT_EQ(time.Look(At(kBegin + kDay + kHour)), kBegin + kDay + kHour);
  const Millis later = kBegin + 10 * kDay;
  EXPECT_EQ(time.Look(At(later, -kSecond)), later - kSecond) << "a step that is no harm";
  EXPECT_FALSE(time.Look(At(later, 400 * kDay)));
  EXPECT_FALSE(time.Look(At(later + 4 * kSecond)));
  EXPECT_FALSE(time.Look(At(later + kDay)));
  EXPECT_EQ(time.Look(At(later + kDay + 4 * kSecond)), later + kDay + 4 * kSecond);
}

TEST(SureTime, IsNoFasterThanTheMonotonicClock) {
  constexpr Millis kWrong = 70 * 365 * kDay;
  SureTime time;
  time.Begin(At(kBegin, kWrong), kBegin - kDay);
  EXPECT_FALSE(time.Look(At(kBegin + kHour, kWrong)));
  EXPECT_EQ(time.Look(At(kBegin + 2 * kDay, kWrong)), kBegin + 2 * kDay);
  SureTime slow;
  slow.Begin(At(kBegin, -kWrong), kBegin - kDay);
  EXPECT_EQ(slow.Look(At(kBegin + 2 * kDay, -kWrong)), kBegin + 2 * kDay - kWrong);
}

class KeptFiles : public ValueStoreTest {
 protected:
  void SetUp() override {
    for (Millis day = kBegin - 5 * kDay; day < kBegin; day += kDay) {
      Open(day)->Write(Seconds(1, day, day + 2 * kSecond), At(day + 2 * kSecond), true);
    }
  }
  static Batch Hour(std::int64_t run, Millis begin) {
    Batch batch;
    batch.runs = {{run, begin, begin + kHour, RunBegin::started}};
    for (const Millis width : {kMinute, kHour}) {
      batch.trends.push_back({0, run, width, {begin, 1, 1, 1, 1, 1, 1, width}});
    }
    return batch;
  }
  std::size_t days() const { return ListFiles(folder()).days.size(); }
  std::size_t minutes() const {
    const auto page = ReadTrends(folder(), {.point = "bay.f1.a", .every = kMinute});
    return page ? page->spans.size() : 0;
  }
};

TEST_F(KeptFiles, AClockThatIsWrongForSecondsDeletesNothing) {
  StoreLimits limits;
  limits.keep = 3 * kDay;
  auto store = Open(kBegin, limits);
  ASSERT_TRUE(store->Write(Hour(1, kBegin), At(kBegin + kHour)));
  ASSERT_EQ(days(), 6U);
  const Millis wrong = kBegin + 400 * kDay;
  ASSERT_TRUE(store->Write(Hour(2, wrong), At(kBegin + kHour + 2 * kSecond, 400 * kDay)));
  ASSERT_TRUE(store->Write(Seconds(3, kBegin + kHour, kBegin + kHour + 20 * kSecond),
                           At(kBegin + kHour + 20 * kSecond)));
  EXPECT_EQ(minutes(), 2U);
  EXPECT_EQ(All({.point = "bay.f1.a", .until = kBegin}).size(), 14U) << "and four gaps";
  EXPECT_THAT(store->TakeNews(), IsEmpty());
  const Millis later = kBegin + 2 * kDay;
  ASSERT_TRUE(store->Write(Hour(4, later), At(later)));
  const auto news = store->TakeNews();
  ASSERT_EQ(news.size(), 4U);
  EXPECT_EQ(news[0].text,
            DayFileName(kBegin - 5 * kDay) + " was deleted: its day is older than history.keep");
  EXPECT_FALSE(news[0].trouble);
}

TEST_F(KeptFiles, AClockThatIsWrongFromTheStartDeletesNothing) {
  StoreLimits limits;
  limits.keep = 30 * kDay;
  constexpr Millis kWrong = 70 * 365 * kDay;
  auto store = Open(kBegin + kWrong, limits);
  for (Millis time = kBegin; time < kBegin + 3 * kDay; time += 6 * kHour) {
    Batch batch = Hour(1, time + kWrong);
    ASSERT_TRUE(store->Write(std::move(batch), At(time + kWrong)));
  }
  EXPECT_EQ(All({.point = "bay.f1.a", .until = kBegin}).size(), 14U) << "and four gaps";
  EXPECT_THAT(store->TakeNews(), IsEmpty());
}

TEST_F(ValueStoreTest, TheLimitHolds) {
  StoreLimits limits;
  limits.bytes = 1'800'000;
  auto store = Open(kBegin, limits);
  std::uint64_t most = 0;
  std::size_t failed = 0;
  for (int day = 0; day < 14; ++day) {
    for (Millis time = kBegin + day * kDay; time < kBegin + day * kDay + kHour / 2;
         time += kMinute) {
      if (!store->Write(Seconds(1, time, time + kMinute, {}, kBegin), At(time + kMinute))) ++failed;
      most = std::max(most, ListFiles(folder()).bytes());
    }
  }
  EXPECT_LE(most, limits.bytes + limits.bytes / 100);
  EXPECT_EQ(failed, 0U);
  EXPECT_LT(ListFiles(folder()).days.size(), 14U);
  EXPECT_FALSE(All({.point = "bay.f1.a"}).empty());
}

TEST_F(KeptFiles, ARemovedFileIsNoticedAtTheNextCommit) {
  auto store = Open(kBegin);
  ASSERT_TRUE(store->Write(Seconds(1, kBegin, kBegin + 5 * kSecond), At(kBegin + 5 * kSecond)));
  EXPECT_FALSE(store->TakeLost());
  for (const auto& entry : std::filesystem::directory_iterator(folder())) {
    if (entry.path().filename().string().starts_with(DayFileName(kBegin))) {
      std::filesystem::remove(entry);
    }
  }
  const Millis next = kBegin + 6 * kSecond;
  ASSERT_TRUE(
      store->Write(Seconds(1, next, next + 2 * kSecond, {}, kBegin), At(next + 2 * kSecond)));
  EXPECT_TRUE(store->TakeLost());
  const auto news = store->TakeNews();
  ASSERT_EQ(news.size(), 1U);
  EXPECT_THAT(news[0].text,
              HasSubstr(DayFileName(kBegin) + ": the file was removed, and its content"));
  // The batch was made before the recorder learned of the removed file, so it still belongs to the
  // old run. The new run begins with the next batch.
  const Millis anew = next + 3 * kSecond;
  ASSERT_TRUE(store->Write(Seconds(1, next + 2 * kSecond, anew, {}, kBegin), At(anew)));
  ASSERT_TRUE(
      store->Write(Seconds(2, anew, anew + kSecond, RunBegin::dropped), At(anew + kSecond)));
  EXPECT_FALSE(store->TakeLost());
  EXPECT_THAT(store->TakeNews(), IsEmpty());
  const auto records = All({.point = "bay.f1.a", .since = kBegin});
  ASSERT_EQ(records.size(), 5U);
  EXPECT_EQ(records[0].entry.time, next) << "what was in that commit";
  ASSERT_TRUE(records[3].gap);
  EXPECT_EQ(records[3].gap->why, RunBegin::dropped);
  EXPECT_EQ(records[4].entry.time, anew);
}

TEST_F(KeptFiles, ARemovedFileIsAGapAfterThePreviousDay) {
  const Millis began = kBegin + kDay - 2 * kSecond;
  auto store = Open(began);
  ASSERT_TRUE(store->Write(Seconds(1, began, kBegin + kDay), At(kBegin + kDay)));
  ASSERT_TRUE(store->Write(Seconds(1, kBegin + kDay, kBegin + kDay + 5 * kSecond, {}, began),
                           At(kBegin + kDay + 5 * kSecond)));
  std::filesystem::remove(folder() / DayFileName(kBegin + kDay));
  const Millis next = kBegin + kDay + 60 * kSecond;
  ASSERT_TRUE(store->Write(Seconds(1, next, next + kSecond, {}, began), At(next + kSecond)));
  const auto records = All({.point = "bay.f1.a", .since = began});
  ASSERT_EQ(records.size(), 4U);
  ASSERT_TRUE(records[2].gap);
  EXPECT_LE(records[2].entry.time, kBegin + kDay + 5 * kSecond);
  EXPECT_EQ(records[2].gap->until, next);
  EXPECT_EQ(records[2].gap->why, RunBegin::dropped);
  EXPECT_EQ(records[3].entry.time, next);
}

/// A fault of a file ends when the file is readable, not when a reader repeats its request.
TEST_F(KeptFiles, AnUnreadableFileIsForgottenWhenItIsReadableAgain) {
  const std::filesystem::path file = folder() / DayFileName(kBegin - 3 * kDay);
  const std::filesystem::path kept = folder() / "kept";
  const std::function<void()> harms[] = {
      [&] { std::filesystem::create_directory(file.string() + "-wal"); },
      [&] {
        std::filesystem::rename(file, kept);
        std::filesystem::create_directory(file);
      },
      [&] {
        std::filesystem::rename(file, kept);
        ASSERT_EQ(::mkfifo(file.c_str(), 0600), 0);
      },
      [&] {
        std::filesystem::rename(file, kept);
        std::ofstream(file) << std::string(8192, 'x');
      }};
  for (const auto& harm : harms) {
    std::vector<std::string> heard;
    const auto hear = [&heard](const std::string& text) { heard.push_back(text); };
    HistoryView view({.folder = folder(), .warn = hear, .inform = hear});
    view.Update([](HistoryState& state) { state.disk = records::Disk::fine; });
    harm();
    const auto all = [&] { return view.Read({.point = "bay.f1.a"})->records.size(); };
    EXPECT_EQ(all(), 11U) << "what it holds is missing: two values, and a gap";
    EXPECT_EQ(all(), 11U);
    view.LookAgain();
    ASSERT_EQ(view.state().unread.size(), 1U);
    EXPECT_THAT(view.state().unread[0], HasSubstr(file.filename().string()));
    std::filesystem::remove(file.string() + "-wal");
    if (std::filesystem::exists(kept)) {
      std::filesystem::remove(file);
      std::filesystem::rename(kept, file);
    }
    view.LookAgain();
    EXPECT_THAT(view.state().unread, IsEmpty());
    EXPECT_EQ(heard.size(), 2U) << "its begin and its end";
    EXPECT_EQ(all(), 14U);
  }
}

/// SQLite has the undamaged pages in memory, so its writes continue without an error.
TEST_F(KeptFiles, DamageFoundByAReaderIsConfirmedByTheWriter) {
  auto store = Open(kBegin);
  const Millis later = kBegin + 10 * kSecond;
  ASSERT_TRUE(store->Write(Seconds(1, kBegin, later), At(later)));
  const std::string file = DayFileName(kBegin);
  store->Check({file, kTrendsFile});
  ASSERT_TRUE(store->Write({}, At(later)));
  EXPECT_THAT(store->TakeNews(), IsEmpty());
  constexpr std::size_t kPageBytes = 4096;
  const std::filesystem::path log = folder() / (file + "-wal");
  const std::size_t bytes = std::filesystem::file_size(log);
  std::fstream frames(log, std::ios::in | std::ios::out | std::ios::binary);
  for (std::size_t at = 32 + 24; at < bytes; at += 24 + kPageBytes) {
    frames.seekp(static_cast<std::streamoff>(at));
    frames << std::string(kPageBytes, 'x');
  }
  frames.close();
  ASSERT_TRUE(store->Write(Seconds(1, later, later + kSecond), At(later + kSecond)));
  store->Check({file});
  ASSERT_TRUE(store->Write(Seconds(1, later, later + 2 * kSecond), At(later + 2 * kSecond)));
  const auto news = store->TakeNews();
  ASSERT_EQ(news.size(), 1U);
  EXPECT_THAT(news[0].text, HasSubstr(file + " is damaged ("));
  EXPECT_TRUE(store->TakeLost());
}

TEST_F(KeptFiles, FilesPutAsideAreDeletedFirst) {
  const std::string bad = DayFileName(kBegin - 9 * kDay) + ".bad";
  std::ofstream(folder() / bad) << std::string(1'500'000, 'x');
  std::ofstream(folder() / (bad + "-wal")) << std::string(100'000, 'x');
  const std::size_t before = days();
  StoreLimits limits;
  limits.bytes = 1'500'000;
  auto store = Open(kBegin, limits);
  ASSERT_TRUE(store->Write(Seconds(1, kBegin, kBegin + kSecond), At(kBegin + kSecond)));
  EXPECT_EQ(days(), before + 1);
  EXPECT_FALSE(std::filesystem::exists(folder() / bad));
  EXPECT_FALSE(std::filesystem::exists(folder() / (bad + "-wal")));
  const auto news = store->TakeNews();
  ASSERT_EQ(news.size(), 1U);
  EXPECT_THAT(news[0].text, HasSubstr(bad + " was deleted: history.limit of "));
  EXPECT_FALSE(news[0].trouble);
}

TEST_F(KeptFiles, ATooLargeFileIsNamed) {
  StoreLimits limits;
  limits.bytes = 1'500'000;
  auto store = Open(kBegin, limits);
  std::ofstream(folder() / DayFileName(kBegin + 9 * kDay)) << std::string(2'000'000, 'x');
  const Status status = store->Write(Seconds(1, kBegin, kBegin + kSecond), At(kBegin + kSecond));
  ASSERT_FALSE(status);
  EXPECT_THAT(status.error(),
              HasSubstr(" is reached: " + DayFileName(kBegin + 9 * kDay) + " has 2.0 MB, "));
}

TEST_F(KeptFiles, AnEmptyFileIsReportedAsALoss) {
  for (const std::string& name : {DayFileName(kBegin), std::string(kTrendsFile)}) {
    std::filesystem::remove(folder() / name);
    std::ofstream(folder() / name).close();
  }
  const auto store = Open(kBegin);
  const auto news = store->TakeNews();
  ASSERT_EQ(news.size(), 2U);
  EXPECT_THAT(news[0].text,
              HasSubstr("trends.db is damaged (the file is empty: its content is lost); "
                        "it was renamed to trends.db.bad"));
  EXPECT_THAT(news[1].text, HasSubstr(DayFileName(kBegin)));
}

}  // namespace
}  // namespace baudgate::history
