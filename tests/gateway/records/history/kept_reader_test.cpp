// Tests of `KeptReader` with real files: each value comes once and in order, while the files are
// written, packed, deleted and damaged, and although the reader is killed at any moment.
// SPDX-License-Identifier: Apache-2.0
#include "gateway/records/history/kept_reader.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sqlite3.h>

#include <fstream>
#include <map>
#include <random>
#include <set>
#include <tuple>

#include "tests/gateway/records/history/store_fixture.h"

namespace baudgate::history {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;
using ::testing::SizeIs;

/// A reader that can be killed, with what it has read.
struct Client {
  explicit Client(std::filesystem::path its_folder) : folder(std::move(its_folder)) { Kill(); }

  void Kill() {
    reader = std::make_unique<KeptReader>(folder);
    pass = stored;
  }
  /// Reads until everything is read, or `portions`; returns false if a file cannot be read.
  bool Read(std::size_t most = 1000, int portions = 1'000'000) {
    for (; portions > 0; --portions) {
      StoredPart part = reader->Read(pass, most);
      foreign = foreign || part.foreign;
      lost.insert(lost.end(), part.lost.begin(), part.lost.end());
      for (StoredValue& value : part.values) {
        EXPECT_LE(part.values.size(), most);
        const std::int64_t seq = value.entry.time + part.next.offset;
        const bool repeated = !seen[value.point].insert(seq).second;
        if (repeated) ++repeats;
        EXPECT_GT(seq, latest[value.point]) << value.point;
        latest[value.point] = seq;
        if (!repeated) all.push_back(std::move(value));
      }
      pass = part.next;
      if (part.unread) return false;
      if (!part.more) return true;
    }
    return true;
  }
  void Store() {
    stored = pass;
    confirmed = latest;
  }
  void KillAndForget() {
    latest = confirmed;
    Kill();
  }

  std::filesystem::path folder;
  std::unique_ptr<KeptReader> reader;
  Pass pass{};
  Pass stored{};
  std::vector<StoredValue> all;
  std::map<std::string, std::set<std::int64_t>> seen;
  std::map<std::string, std::int64_t> latest;
  std::map<std::string, std::int64_t> confirmed;
  std::vector<LostValues> lost;
  std::size_t repeats = 0;
  bool foreign = false;
};

class KeptReaderTest : public ValueStoreTest {
 protected:
  /// Returns how many values of each point the client has: "bay.f1.a 60, bay.f1.on 60".
  static std::map<std::string, std::size_t> Counts(const Client& client) {
    std::map<std::string, std::size_t> counts;
    for (const StoredValue& value : client.all) ++counts[value.point];
    return counts;
  }
  void Execute(Millis day, const std::string& sql) const {
    sqlite3* file = nullptr;
    sqlite3_open((folder() / DayFileName(day)).c_str(), &file);
    char* error = nullptr;
    sqlite3_exec(file, sql.c_str(), nullptr, nullptr, &error);
    EXPECT_EQ(error, nullptr) << error;
    sqlite3_close(file);
  }
};

/// Days of two points with late readings, a clock that is set back and forward, starts, packing
/// and a reader that is killed, with portions of all sizes.
TEST_F(KeptReaderTest, ReadsEachValueOnceAndInOrder) {
  for (unsigned seed = 1; seed <= 2; ++seed) {
    std::filesystem::remove_all(folder());
    std::filesystem::create_directories(folder());
    std::mt19937 random(seed);
    const auto up_to = [&](Millis most) {
      return std::uniform_int_distribution<Millis>(0, most)(random);
    };
    StoreLimits limits;
    limits.open_rows = 3000;
    limits.pack_each = 700;
    Millis steady = kBegin + 20 * kHour;
    Millis ahead = 0;  // clock minus steady
    auto store = Open(steady, limits);
    Client client(folder());
    history::Run run{1, steady, steady, RunBegin::started};
    std::vector<Millis> last(2, 0);
    std::size_t stored = 0;
    for (int step = 0; step < 1500; ++step) {
      steady += 1 + up_to(180'000);
      Batch batch;
      if (up_to(200) == 0) {  // the clock is set
        batch.runs.push_back(run);
        ahead += up_to(1) == 0 ? -up_to(3 * kHour) : up_to(kHour);
        run = {run.number + 1, steady + ahead, steady + ahead, RunBegin::clock};
        last.assign(2, 0);
      } else if (up_to(200) == 0) {  // a start
        EXPECT_TRUE(store->Write({}, At(steady, ahead), true));
        store.reset();
        store = Open(steady + ahead, limits);
        run = {1, steady + ahead, steady + ahead, RunBegin::started};
        last.assign(2, 0);
      }
      const Millis now = steady + ahead;
      for (Millis count = up_to(12); count > 0; --count) {
        const auto point = static_cast<PointNumber>(up_to(1));
        const Millis least =
            std::max({run.began, run.until - Recorder::kSettle + 1, last[point] + 1});
        if (least > now) continue;
        const Millis time = std::max(least, now - up_to(up_to(1) == 0 ? 3000 : 70'000));
        last[point] = time;
        run.until = std::max(run.until, time);
        const Value value = point == 0 ? Value(static_cast<double>(up_to(9))) : Value(true);
        batch.samples.push_back({point, run.number, {time, value, Quality::good}});
        ++stored;
      }
      run.until = std::max(run.until, now);
      batch.runs.push_back(run);
      const Status status = store->Write(std::move(batch), At(steady, ahead));
      ASSERT_TRUE(status) << status.error();
      if (up_to(20) == 0) {
        const auto most = static_cast<std::size_t>(1 + up_to(300));
        ASSERT_TRUE(client.Read(most, static_cast<int>(1 + up_to(40))));
      }
      if (up_to(30) == 0) client.Store();
      if (up_to(60) == 0) client.KillAndForget();
    }
    Batch end;
    end.runs = {run, {run.number + 1, run.until + 1, run.until + kHour, RunBegin::dropped}};
    ASSERT_TRUE(store->Write(std::move(end), At(steady + 1, ahead), true));
    ASSERT_TRUE(client.Read());
    EXPECT_EQ(client.all.size(), stored) << "seed " << seed;
    EXPECT_THAT(client.lost, IsEmpty());
    EXPECT_FALSE(client.foreign);
  }
}

TEST_F(KeptReaderTest, WaitsUntilASpanIsComplete) {
  auto store = Open(kBegin);
  ASSERT_TRUE(store->Write(Seconds(1, kBegin, kBegin + 10 * kSecond), At(kBegin + 10 * kSecond)));
  Client client(folder());
  ASSERT_TRUE(client.Read());
  // The run ends at 10 s, so values up to 8 s are complete: 0 s … 8 s.
  EXPECT_EQ(Counts(client)["bay.f1.a"], 9U);
  EXPECT_TRUE(std::holds_alternative<bool>(client.all.back().entry.value));
  ASSERT_TRUE(store->Write(
      Seconds(1, kBegin + 10 * kSecond, kBegin + 20 * kSecond, RunBegin::started, kBegin),
      At(kBegin + 20 * kSecond)));
  ASSERT_TRUE(client.Read());
  EXPECT_EQ(Counts(client)["bay.f1.a"], 19U);
}

/// A gateway without history before begins at the first value; one that gets a new outlet begins at
/// the present.
TEST_F(KeptReaderTest, KnowsTheNewestPlace) {
  KeptReader reader(folder());
  EXPECT_EQ(reader.Newest()->run, 0);
  auto store = Open(kBegin);
  ASSERT_TRUE(store->Write(Seconds(1, kBegin, kBegin + kMinute), At(kBegin + kMinute)));
  const auto newest = reader.Newest();
  EXPECT_EQ(newest->run, 1);
  EXPECT_EQ(newest->from, kBegin + kMinute - Recorder::kSettle);
}

TEST_F(KeptReaderTest, ReportsDaysThatWereDeleted) {
  auto store = Open(kBegin);
  for (int day = 0; day < 4; ++day) {
    const Millis from = kBegin + day * kDay;
    ASSERT_TRUE(store->Write(Seconds(1, from, from + kMinute, RunBegin::started, kBegin),
                             At(from + kMinute)));
  }
  Client client(folder());
  ASSERT_TRUE(client.Read(10, 3));
  client.Store();
  for (int day = 0; day < 2; ++day) RemoveFile(folder(), DayFileName(kBegin + day * kDay));
  client.Kill();
  ASSERT_TRUE(client.Read());
  ASSERT_THAT(client.lost, SizeIs(1));
  EXPECT_LT(client.lost[0].from, kBegin + kMinute);
  EXPECT_EQ(client.lost[0].until, kBegin + 2 * kDay - 1);
  EXPECT_GE(Counts(client)["bay.f1.a"], 60U + 58U);
}

TEST_F(KeptReaderTest, ReportsRunsThatWereDeleted) {
  {
    auto store = Open(kBegin);
    ASSERT_TRUE(store->Write(Seconds(1, kBegin, kBegin + kMinute), At(kBegin + kMinute), true));
  }
  Client client(folder());
  ASSERT_TRUE(client.Read());
  auto store = Open(kBegin + 2 * kDay);
  ASSERT_TRUE(store->Write(Seconds(1, kBegin + 2 * kDay, kBegin + 2 * kDay + kMinute),
                           At(kBegin + 2 * kDay + kMinute)));
  RemoveFile(folder(), DayFileName(kBegin));
  ASSERT_TRUE(client.Read());
  EXPECT_THAT(client.lost, SizeIs(1));
  EXPECT_EQ(Counts(client)["bay.f1.a"], 59U + 59U);
}

TEST_F(KeptReaderTest, SkipsADamagedChunk) {
  auto store = Open(kBegin);
  ASSERT_TRUE(store->Write(Seconds(1, kBegin, kBegin + kMinute), At(kBegin + kMinute)));
  const Millis later = kBegin + 2 * kHour;
  ASSERT_TRUE(store->Write(Seconds(1, later, later + kMinute, RunBegin::started, kBegin),
                           At(later + kMinute)));
  Execute(kBegin, "UPDATE chunks SET bytes = x'010203' WHERE point = 1");
  Client client(folder());
  ASSERT_TRUE(client.Read());
  ASSERT_FALSE(client.lost.empty());  // one for each span of the chunk
  EXPECT_EQ(client.lost.front().from, kBegin);
  EXPECT_GT(client.lost.back().until, later);
  EXPECT_EQ(Counts(client)["bay.f1.on"], 60U + 59U);
  EXPECT_EQ(Counts(client)["bay.f1.a"], 0U);
}

TEST_F(KeptReaderTest, WaitsForADamagedFileUntilItIsGivenUp) {
  {
    auto store = Open(kBegin);
    for (const Millis from : {kBegin, kBegin + kDay}) {
      ASSERT_TRUE(store->Write(Seconds(1, from, from + kMinute, RunBegin::started, kBegin),
                               At(from + kMinute), true));
    }
  }
  std::ofstream(folder() / DayFileName(kBegin), std::ios::trunc) << std::string(5000, 'x');
  Client client(folder());
  EXPECT_FALSE(client.Read());
  EXPECT_FALSE(client.Read());
  EXPECT_THAT(client.all, IsEmpty());
  client.reader->GiveUp(kBegin);
  EXPECT_TRUE(client.Read());
  EXPECT_THAT(client.lost, SizeIs(1));
  EXPECT_EQ(Counts(client)["bay.f1.a"], 59U);
}

/// The state folder was restored from a backup that is older than the place of the reader.
TEST_F(KeptReaderTest, BeginsAtTheNewestPlaceOfOtherFiles) {
  auto store = Open(kBegin);
  ASSERT_TRUE(store->Write(Seconds(1, kBegin, kBegin + kMinute), At(kBegin + kMinute)));
  Client client(folder());
  client.pass = {.run = 7, .from = kBegin + kDay, .until = kBegin + kDay};
  ASSERT_TRUE(client.Read());
  EXPECT_TRUE(client.foreign);
  EXPECT_EQ(client.pass.run, 1);
  EXPECT_THAT(client.all, IsEmpty());
}

/// In step, a reader that comes each second must not read the rows of the whole hour.
TEST_F(KeptReaderTest, ReadsLittleInStep) {
  StoreLimits limits;
  auto store = Open(kBegin, limits);
  Batch batch;
  batch.runs = {{1, kBegin, kBegin + 1000 * kSecond, RunBegin::started}};
  for (Millis time = kBegin; time < kBegin + 1000 * kSecond; time += 10) {
    batch.samples.push_back({0, 1, {time, 1.0, Quality::good}});
  }
  ASSERT_TRUE(store->Write(std::move(batch), At(kBegin + 1000 * kSecond)));
  Client client(folder());
  ASSERT_TRUE(client.Read(100'000));
  EXPECT_EQ(client.all.size(), 99'801U);
  const auto begin = std::chrono::steady_clock::now();
  for (int second = 1000; second < 1100; ++second) {
    ASSERT_TRUE(store->Write(Seconds(1, kBegin + second * kSecond, kBegin + (second + 1) * kSecond,
                                     RunBegin::started, kBegin),
                             At(kBegin + (second + 1) * kSecond)));
    ASSERT_TRUE(client.Read());
  }
  EXPECT_LT(std::chrono::steady_clock::now() - begin, 5s);
}

}  // namespace
}  // namespace baudgate::history
