// Tests of `Forwarding` with simulated time, a real history on the disk, and a receiver that
// answers, refuses, is away, and sees the gateway killed.
// SPDX-License-Identifier: Apache-2.0
#include "gateway/outputs/outlet/forwarding.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sqlite3.h>

#include <deque>
#include <fstream>
#include <map>
#include <random>
#include <string>

#include "tests/gateway/records/audit/faulty_disk.h"
#include "tests/gateway/records/history/folder.h"
#include "tests/gateway/records/history/store_fixture.h"

namespace baudgate::outlet {
namespace {

using history::Batch;
using history::Entry;
using history::kBegin;
using history::kDay;
using history::kHour;
using history::kMinute;
using history::kSecond;
using history::Millis;
using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::SizeIs;

/// Stores what it confirms. `answer` decides about each portion; empty: it confirms all.
class Server : public Receiver {
 public:
  void Send(Portion portion, std::function<void(Answer)> done) override {
    ++requests;
    largest = std::max(largest, portion.values.size());
    if (silent) {
      waiting = std::move(done);
      return;
    }
    Answer its = answer ? answer(portion) : Answer();
    if (its.kind == Answer::Kind::confirmed) Store(portion);
    done(std::move(its));
  }
  void Store(const Portion& portion) {
    for (const KeptValue& value : portion.values) {
      std::map<std::int64_t, Entry>& series = all[value.point];
      const bool is_new = series.emplace(value.seq, value.entry).second;
      if (is_new) {
        EXPECT_EQ(series.rbegin()->first, value.seq) << value.point << ": not in order";
      } else {
        EXPECT_TRUE(portion.again);
        EXPECT_EQ(series[value.seq], value.entry);
        ++repeats;
      }
    }
  }
  std::size_t count() const {
    std::size_t sum = 0;
    for (const auto& [point, series] : all) sum += series.size();
    return sum;
  }

  std::function<Answer(const Portion& portion)> answer;
  bool silent = false;
  std::function<void(Answer)> waiting;
  std::map<std::string, std::map<std::int64_t, Entry>> all;
  std::size_t requests = 0;
  std::size_t repeats = 0;
  std::size_t largest = 0;
};

class Source : public history::HistorySource {
 public:
  explicit Source(std::string folder) { state_.folder = std::move(folder); }
  history::HistoryState state() const override {
    history::HistoryState state = state_;
    state.disk = records::Disk::fine;
    return state;
  }
  Result<history::Page> Read(const history::PageQuery& query) const override {
    return history::ReadPage(state_.folder, query);
  }
  Result<history::TrendPage> ReadTrends(const history::TrendQuery& /*query*/) const override {
    return history::TrendPage{};
  }

 private:
  history::HistoryState state_;
};

Answer Away() { return {.kind = Answer::Kind::retry, .why = "the receiver does not answer"}; }
Answer Refuse() { return {.kind = Answer::Kind::refused, .why = "not accepted"}; }

class ForwardingTest : public history::ValueStoreTest {
 protected:
  ForwardingTest() { Start(); }

  Now now() const { return history::At(now_, ahead_); }
  /// Starts the gateway, or kills it and starts it again. A kill stores nothing.
  void Start(const std::string& vfs = {}) {
    store_.reset();
    store_ = Open(now_ + ahead_);
    run_ = {1, now_ + ahead_, now_ + ahead_, history::RunBegin::started};
    Forwarder::Options options{.name = "test",
                               .receiver = &server_,
                               .folder = folder(),
                               .clocks = [this] { return now(); },
                               .wanted = wanted_,
                               .warn = [this](const std::string& text) { log_.push_back(text); },
                               .inform = [this](const std::string& text) { log_.push_back(text); }};
    forwarding_ = std::make_shared<Forwarding>(std::move(options), vfs);
    forwarding_->SetHistory(std::make_shared<Source>(folder().string()));
    next_ = {};
  }
  /// Stores one value of each point each `step` until `until`, and forwards meanwhile.
  void Run(Millis until, Millis step = kSecond) {
    while (now_ < until) {
      Batch batch;
      now_ += step;
      const Millis time = now_ + ahead_;
      run_.until = time;
      batch.runs = {run_};
      const auto number = static_cast<double>(now_ / kSecond % 1000);
      batch.samples = {{0, run_.number, {time, number, Quality::good}},
                       {1, run_.number, {time, true, Quality::good}}};
      stored_ += 2;
      ASSERT_TRUE(store_->Write(std::move(batch), now()));
      Forward();
    }
  }
  /// Does the rounds that are due.
  void Forward() {
    for (int rounds = 0; rounds < 100'000; ++rounds) {
      if (next_ > now().instant && !woken_) return;
      woken_ = false;
      next_ = forwarding_->Round(false);
    }
    FAIL() << "the rounds have no end";
  }
  /// Lets time pass without values.
  void Pass(Duration time) {
    for (const Millis until = now_ + time / 1ms; now_ < until;) {
      now_ += 100;
      Forward();
    }
  }
  void SetClock(Millis change) {
    Batch batch;
    batch.runs.push_back(run_);
    ahead_ += change;
    run_ = {run_.number + 1, now_ + ahead_, now_ + ahead_, history::RunBegin::clock};
    batch.runs.push_back(run_);
    ASSERT_TRUE(store_->Write(std::move(batch), now()));
  }
  std::size_t stored() const { return stored_; }

  Millis now_ = kBegin + 10 * kHour;
  Millis ahead_ = 0;
  std::unique_ptr<history::ValueStore> store_;
  history::Run run_;
  std::size_t stored_ = 0;
  Server server_;
  std::function<bool(const std::string& point)> wanted_;
  std::vector<std::string> log_;
  std::shared_ptr<Forwarding> forwarding_;
  Instant next_{};
  bool woken_ = false;
};

TEST_F(ForwardingTest, SendsEachValueWithinSeconds) {
  Run(now_ + 10 * kMinute);
  // All but those of the last 2 s, which can still get earlier values, and of one round.
  EXPECT_GE(server_.count(), stored() - 8);
  EXPECT_EQ(server_.repeats, 0U);
  EXPECT_EQ(forwarding_->state().behind, 0s);
  EXPECT_EQ(forwarding_->state().trouble, "");
}

/// 72 hours without a receiver, and a gateway that is killed in each hour. Afterwards the receiver
/// has each value, in order, and the gateway has never held more than a portion.
TEST_F(ForwardingTest, CarriesAnOutageOfThreeDays) {
  Run(now_ + kMinute);
  server_.answer = [](const Portion& /*portion*/) { return Away(); };
  const Millis step = 20 * kSecond;
  for (int hour = 0; hour < 72; ++hour) {
    Run(now_ + kHour, step);
    Start();
  }
  Run(now_ + kMinute, kSecond);
  EXPECT_GE(forwarding_->state().behind, 72h);
  EXPECT_THAT(forwarding_->state().trouble, HasSubstr("does not answer"));
  const std::size_t before = server_.count();
  server_.answer = nullptr;
  const Millis back = now_;
  // The receiver is back: all is sent within minutes, also when the gateway is killed meanwhile.
  for (int kills = 0; kills < 5; ++kills) {
    Pass(2s);
    Start();
  }
  Pass(1s);
  while (forwarding_->state().behind > 0s && now_ < back + 10 * kMinute) Pass(1s);
  Run(now_ + 10 * kSecond);
  EXPECT_LT(now_, back + 10 * kMinute);
  EXPECT_GT(server_.count(), before + 25'000);
  EXPECT_GE(server_.count(), stored() - 8);
  EXPECT_LE(server_.largest, 1000U);
}

TEST_F(ForwardingTest, RepeatsAfterAKillWithTheSameNumbers) {
  std::mt19937 random(7);
  for (int kills = 0; kills < 40; ++kills) {
    Run(now_ + 1 + static_cast<Millis>(random() % 90) * kSecond);
    if (random() % 4 == 0) SetClock(-kHour);
    if (random() % 4 == 0) SetClock(kHour);
    // Some kills come after the receiver has stored the values, and before its answer.
    if (random() % 2 == 0) {
      server_.answer = [this](const Portion& portion) {
        server_.Store(portion);
        return Away();
      };
      Run(now_ + 2 * kSecond);
      server_.answer = nullptr;
    }
    Start();
  }
  Run(now_ + 20 * kSecond);
  EXPECT_GE(server_.count(), stored() - 8);
  EXPECT_GT(server_.repeats, 0U);
}

TEST_F(ForwardingTest, WaitsLongerEachTimeUpToAMinute) {
  Run(now_ + 10 * kSecond);
  server_.answer = [](const Portion& /*portion*/) { return Away(); };
  Run(now_ + kSecond * 5);
  const std::size_t before = server_.requests;
  Pass(10min);
  // 1 s, 2 s, 4 s … 60 s, each between half and whole: 10 to 26 requests.
  EXPECT_GE(server_.requests - before, 8U);
  EXPECT_LE(server_.requests - before, 28U);
  // A new session begins at once.
  forwarding_->SetConnected(false);
  forwarding_->SetConnected(true);
  server_.answer = nullptr;
  woken_ = true;
  Pass(3s);
  EXPECT_GE(server_.count(), stored() - 8);
}

TEST_F(ForwardingTest, WaitsAsLongAsTheReceiverSays) {
  Run(now_ + 10 * kSecond);
  server_.answer = [](const Portion& /*portion*/) {
    Answer answer = Away();
    answer.wait = 5min;
    return answer;
  };
  Run(now_ + 5 * kSecond);
  const std::size_t before = server_.requests;
  Pass(4min);
  EXPECT_EQ(server_.requests, before);
  Pass(2min);
  EXPECT_EQ(server_.requests, before + 1);
}

TEST_F(ForwardingTest, SendsNothingWhileNotConnectedOrWithoutAnswer) {
  forwarding_->SetConnected(false);
  Run(now_ + kMinute);
  EXPECT_EQ(server_.requests, 0U);
  EXPECT_GE(forwarding_->state().behind, 50s);
  server_.silent = true;
  forwarding_->SetConnected(true);
  woken_ = true;
  Run(now_ + kMinute);
  EXPECT_EQ(server_.requests, 1U);
  // An answer after the forwarder has ended is ignored.
  forwarding_.reset();
  server_.waiting({});
}

/// One bad value does not hold up the others, and is never sent again.
TEST_F(ForwardingTest, PutsARefusedValueAside) {
  const Millis bad = now_ + 30 * kSecond;
  std::size_t seen = 0;
  server_.answer = [&](const Portion& portion) {
    for (const KeptValue& value : portion.values) {
      if (value.point != "bay.f1.a" || value.entry.time != bad) continue;
      if (portion.values.size() == 1) ++seen;
      return Refuse();
    }
    return Answer();
  };
  forwarding_->SetConnected(false);
  Run(now_ + 10 * kMinute);
  forwarding_->SetConnected(true);
  woken_ = true;
  Pass(10s);
  Start();
  Run(now_ + kMinute);
  EXPECT_EQ(seen, 1U);
  EXPECT_GE(server_.count(), stored() - 9);
  EXPECT_LE(server_.requests, 100U);
  EXPECT_THAT(log_, Contains(HasSubstr("bay.f1.a is refused")));
  std::ifstream file(folder() / "refused-test.jsonl");
  std::string row;
  std::getline(file, row);
  EXPECT_THAT(row, HasSubstr(R"("point":"bay.f1.a")"));
  EXPECT_FALSE(std::getline(file, row));
}

TEST_F(ForwardingTest, PutsOnlyTheNamedValuesAside) {
  server_.answer = [](const Portion& portion) {
    Answer answer;
    for (std::size_t i = 0; i < portion.values.size(); ++i) {
      if (portion.values[i].point != "bay.f1.on") answer.refused.push_back(i);
    }
    if (!answer.refused.empty()) answer.kind = Answer::Kind::refused;
    return answer;
  };
  Run(now_ + kMinute);
  EXPECT_EQ(server_.all.count("bay.f1.a"), 0U);
  EXPECT_GE(server_.all["bay.f1.on"].size(), 56U);
  EXPECT_GE(forwarding_->state().put_aside, 56U);
}

TEST_F(ForwardingTest, SizeOfTheFileOfRefusedValuesIsLimited) {
  server_.answer = [](const Portion& portion) {
    Answer answer = Refuse();
    answer.why = std::string(20'000, 'x');
    for (std::size_t i = 0; i < portion.values.size(); ++i) answer.refused.push_back(i);
    return answer;
  };
  Run(now_ + 2 * kMinute);
  EXPECT_LT(std::filesystem::file_size(folder() / "refused-test.jsonl"), 1'100'000U);
  EXPECT_LT(std::filesystem::file_size(folder() / "refused-test.jsonl.1"), 1'100'000U);
}

/// An outlet that is new in the configuration does not send years of old values.
TEST_F(ForwardingTest, BeginsWithThePresentValues) {
  forwarding_.reset();
  Millis began = now_;
  while (now_ < began + kHour) {
    Batch batch;
    now_ += kMinute;
    run_.until = now_;
    batch.runs = {run_};
    batch.samples = {{0, 1, {now_, 1.0, Quality::good}}};
    ASSERT_TRUE(store_->Write(std::move(batch), now()));
  }
  Start();
  Run(now_ + kMinute);
  EXPECT_GE(server_.count(), 100U);
  EXPECT_LE(server_.count(), 121U);
}

TEST_F(ForwardingTest, SendsOnlyThePointsThatAreWanted) {
  wanted_ = [](const std::string& point) { return point == "bay.f1.on"; };
  Start();
  Run(now_ + kMinute);
  EXPECT_EQ(server_.all.count("bay.f1.a"), 0U);
  EXPECT_GE(server_.all["bay.f1.on"].size(), 56U);
}

TEST_F(ForwardingTest, ReportsDaysThatWereDeletedDuringAnOutage) {
  Run(now_ + kMinute);
  forwarding_->SetConnected(false);
  Run(now_ + 3 * kDay, kHour);
  history::RemoveFile(folder(), history::DayFileName(kBegin + kDay));
  forwarding_->SetConnected(true);
  woken_ = true;
  Pass(1min);
  const ForwarderState state = forwarding_->state();
  EXPECT_EQ(state.gaps, 1U);
  EXPECT_EQ(state.last_gap->from, kBegin + kDay);
  EXPECT_EQ(state.last_gap->until, kBegin + 2 * kDay - 1);
  EXPECT_THAT(log_, Contains(HasSubstr("cannot be sent")));
}

TEST_F(ForwardingTest, GoesOnWithoutADamagedDay) {
  Run(now_ + kMinute);
  forwarding_->SetConnected(false);
  Run(now_ + 3 * kDay, kHour);
  history::RemoveFile(folder(), history::DayFileName(kBegin + kDay));
  std::ofstream(folder() / history::DayFileName(kBegin + kDay)) << std::string(9000, 'x');
  forwarding_->SetConnected(true);
  woken_ = true;
  Pass(50s);
  EXPECT_THAT(forwarding_->state().trouble, HasSubstr("waits for a file"));
  const std::size_t before = server_.count();
  Pass(50s);
  EXPECT_GT(server_.count(), before);
  EXPECT_EQ(forwarding_->state().gaps, 1U);
  EXPECT_EQ(forwarding_->state().trouble, "");
}

/// The disk of the place is full: values are sent nevertheless, and again after a kill.
TEST_F(ForwardingTest, SendsWhileThePlaceCannotBeStored) {
  audit::FaultyDisk disk;
  Start(disk.vfs());
  Run(now_ + 10 * kSecond);
  disk.write_error = SQLITE_FULL;
  Run(now_ + kMinute);
  EXPECT_GE(server_.count(), stored() - 8);
  EXPECT_THAT(forwarding_->state().trouble, HasSubstr("cannot be stored"));
  disk.write_error = 0;
  Start(disk.vfs());
  Run(now_ + 20 * kSecond);
  EXPECT_GE(server_.repeats, 100U);
  EXPECT_GE(server_.count(), stored() - 8);
  EXPECT_EQ(forwarding_->state().trouble, "");
  forwarding_.reset();
}

TEST_F(ForwardingTest, SaysThatTheHistoryIsOlderThanThePlace) {
  Run(now_ + kMinute);
  for (int starts = 0; starts < 5; ++starts) {
    Start();
    Run(now_ + 10 * kSecond);
  }
  for (const auto& file : history::ListFiles(folder()).days) {
    history::RemoveFile(folder(), history::DayFileName(file.day));
  }
  history::RemoveFile(folder(), "trends.db");
  Start();
  const std::size_t before = server_.count();
  Run(now_ + kMinute);
  EXPECT_THAT(log_, Contains(HasSubstr("cannot know")));
  EXPECT_GE(server_.count(), before + 100);
}

/// The thread: it ends within two seconds, also when the receiver never answers.
TEST_F(ForwardingTest, EndsWithoutAnAnswer) {
  Run(now_ + kMinute);
  forwarding_.reset();
  server_.silent = true;
  const auto began = std::chrono::steady_clock::now();
  {
    Forwarder forwarder({.name = "test",
                         .receiver = &server_,
                         .folder = folder(),
                         .warn = [](const std::string&) {},
                         .inform = [](const std::string&) {}});
    forwarder.SetHistory(std::make_shared<Source>(folder().string()));
    forwarder.SetConnected(true);
    EXPECT_TRUE(forwarder.state().has_history);
  }
  EXPECT_LT(std::chrono::steady_clock::now() - began, 3s);
}

}  // namespace
}  // namespace baudgate::outlet
