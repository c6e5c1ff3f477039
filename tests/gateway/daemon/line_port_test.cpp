// What a line does with its port, under virtual time: connections that prove themselves or do not,
// loans, and the write that is ended before the port goes.
// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>

#include <algorithm>
#include <deque>
#include <memory>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "gateway/daemon/line_parts.h"
#include "tests/support/toy_protocol.h"
#include "tests/support/virtual_line.h"

namespace baudgate {
namespace {

using testing::Contains;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Pair;

class FakePort final : public Transport {
 public:
  void Open() override {
    ++opens;
    opens_by_itself = open_on_demand;
  }
  void Close() override { open = false; }
  bool is_open() const override { return open; }
  void Send(View bytes) override {
    sent.emplace_back(bytes.begin(), bytes.end());
    last = sent.back();
    ++sends;
  }
  void DropUnsent() override {}
  Status Apply(const config::SerialSettings&) override { return {}; }
  Status Reset(const config::SerialSettings&) override {
    ++resets;
    sent.clear();
    return refuses ? Status(Error{"refused"}) : Status();
  }
  std::optional<std::string> Restore() override { return std::exchange(changed, {}); }
  std::string Describe() const override { return "fake"; }

  int opens = 0;
  int resets = 0;
  int sends = 0;
  Bytes last;
  bool refuses = false;  ///< to be reset
  bool open = false;
  bool open_on_demand = false;   // a server that takes every connection
  bool opens_by_itself = false;  // right now
  std::deque<Bytes> sent;
  std::optional<std::string> changed;  // by another program
};

class FakeRetries final : public PortRetries {
 public:
  void OnOpened() override {}
  void OnWorked() override { ++worked; }
  bool OnDown(const std::string& reason) override {
    downs.push_back(reason);
    return true;
  }
  void Stop() override { ++stops; }

  int worked = 0;
  int stops = 0;
  std::vector<std::string> downs;
};

class FakeSink final : public EventSink {
 public:
  void OnReported(ReportedEvents) override {}
  void OnDrained(std::uint32_t, Instant) override {}
  void OnNews(const config::Line&, const News& one, Now) override {
    if (!one.first) news.emplace_back(one.what, one.over);
  }
  void OnRead(std::uint32_t, std::span<const std::uint32_t> points, Now) override {
    read.insert(points.begin(), points.end());
  }

  std::vector<std::pair<News::What, bool>> news;
  std::set<std::uint32_t> read;
};

class LinePortTest : public testing::Test {
 protected:
  explicit LinePortTest(const std::string& port = "tcp://server:4001",
                        std::vector<config::Device> devices = {ToyDevice("a", "A", {"1"})}) {
    config_.lines.push_back(ToyLine(std::move(devices)));
    config_.lines[0].port = port;
    store_ = std::make_unique<PointStore>(config_);
    twin_ = ToyProtocol().make_twin(config_.lines[0].devices.back(), values_);
    line_ = std::make_unique<LineParts>(
        config_.lines[0], 0U, [](const std::string&) -> const Protocol& { return ToyProtocol(); },
        *store_, port_, retries_, LineParts::Links{.events = &sink_});
    line_->Start(now_);
  }

  /// As LineRunner does.
  template <typename Input>
  void Handle(Input input) {
    input();
    line_->Settle(now_);
  }
  void Open() {
    port_.open = true;
    Handle([&] { line_->port.OnOpened(now_); });
  }
  void Lose(const std::string& reason) {
    port_.open = false;
    Handle([&] { line_->port.OnLost(reason, now_); });
  }
  void End() {
    port_.open = false;
    port_.sent.clear();  // nobody is there any more
    Handle([&] { line_->port.OnEnded("closed", now_); });
  }
  void Say(std::string_view text) {
    Handle([&] { line_->port.OnBytes(ToBytes(text), now_); });
  }
  /// Time goes on; the device answers after 30 ms, while it does.
  void Pass(Duration time) {
    const Instant until = now_.instant + time;
    for (;;) {
      if (std::exchange(port_.opens_by_itself, false)) {
        GoTo(now_.instant + 1ms);
        Open();
        continue;
      }
      if (!port_.sent.empty()) {
        const Bytes request = port_.sent.front();
        port_.sent.pop_front();
        if (!answers_) continue;
        if (closes_for_.contains(request[1])) {
          End();
          continue;
        }
        GoTo(now_.instant + 30ms);
        Handle([&] { line_->port.OnBytes(twin_->Answer(request, now_.instant), now_); });
        if (closes_) End();
        continue;
      }
      const auto deadline = line_->Deadline();
      if (!deadline || *deadline > until) break;
      GoTo(std::max(now_.instant, *deadline));
      Handle([&] { line_->OnTimer(now_); });
    }
    GoTo(std::max(now_.instant, until));
  }
  LineStatus status() { return store_->ReadLine(0); }
  void Write() {
    WriteCommand command;
    command.writes = {{0, Value(5.0)}};
    command.deadline = now_.instant + 1h;
    command.done = [this](const WriteResult& result) { ends_.push_back(result.end); };
    Handle([&] { line_->Submit(std::move(command), now_); });
  }

  /// By hand.
  std::shared_ptr<Telegram> Ask(std::string_view text, Duration patience = 5s) {
    auto telegram = std::make_shared<Telegram>();
    telegram->bytes = ToBytes(text);
    WriteCommand command;
    command.telegram = telegram;
    command.deadline = now_.instant + patience;
    command.done = [this](const WriteResult& result) { ends_.push_back(result.end); };
    Handle([&] { line_->Submit(std::move(command), now_); });
    return telegram;
  }

  config::Config config_;
  std::unique_ptr<PointStore> store_;
  FixedValues values_ = ToyValues();
  std::unique_ptr<Twin> twin_;
  bool answers_ = true;
  bool closes_ = false;                // behind each answer
  std::set<std::uint8_t> closes_for_;  // in place of an answer of these devices
  FakePort port_;
  FakeRetries retries_;
  FakeSink sink_;
  std::unique_ptr<LineParts> line_;
  Now now_{Instant() + 1h, WallTime(1'790'000'000s)};
  std::vector<WriteEnd> ends_;

 private:
  void GoTo(Instant instant) {
    now_.wall += instant - now_.instant;
    now_.instant = instant;
  }
};

struct LocalPort : LinePortTest {
  LocalPort() : LinePortTest("/dev/ttyUSB0") {}
};

TEST_F(LocalPort, HasWorkedOnceItOpens) {
  EXPECT_EQ(port_.opens, 1);
  Open();
  EXPECT_EQ(status().port, LineStatus::Port::open);
  EXPECT_TRUE(line_->port.is_open());
  Lose("gone");
  EXPECT_THAT(retries_.downs, ElementsAre("gone"));
  EXPECT_EQ(status().port_text, "gone");
  EXPECT_EQ(status().times_lost, 1U);
  EXPECT_FALSE(line_->port.is_open());
}

TEST_F(LocalPort, SaysThatAnotherProgramHasChangedItsSettings) {
  Open();
  Pass(2s);
  EXPECT_EQ(status().port_text, "fake");
  port_.changed = "echo is on";
  Pass(2s);
  EXPECT_THAT(status().port_text, HasSubstr("changed its settings once, last "));
  EXPECT_THAT(status().port_text, HasSubstr("(echo is on); they were set again"));
  port_.changed = "9600 7E1 became 38400 8N1";
  Pass(2s);
  EXPECT_THAT(status().port_text, HasSubstr("changed its settings 2 times"));
  Lose("unplugged");
  Open();
  EXPECT_EQ(status().port_text, "fake");
}

TEST_F(LocalPort, TellsWhatIsToBeKept) {
  using What = News::What;
  Open();
  Pass(3s);
  EXPECT_THAT(sink_.read, Contains(0U));
  EXPECT_THAT(sink_.news, IsEmpty());
  answers_ = false;
  Pass(30s);
  Lose("gone");
  Handle([&] { line_->port.OnOpenFailed("no such file", now_); });
  answers_ = true;
  Open();
  Pass(10s);
  Handle([&] { line_->port.Release(1min, now_); });
  Handle([&] { line_->port.TakeBack(now_); });
  Open();
  EXPECT_THAT(sink_.news, ElementsAre(Pair(What::no_answer, false), Pair(What::port_down, false),
                                      Pair(What::port_down, true), Pair(What::no_answer, true),
                                      Pair(What::port_lent, false), Pair(What::port_lent, true)));
}

TEST_F(LocalPort, IsPolledAndWritten) {
  Open();
  Pass(3s);
  EXPECT_EQ(store_->ReadLine(0).outcomes[static_cast<std::size_t>(Outcome::no_reply)], 0U);
  Write();
  Pass(1s);
  EXPECT_THAT(ends_, ElementsAre(WriteEnd::ok));
}

TEST_F(LocalPort, ATelegramByHandHasTheLineToItselfAndPollsGoOn) {
  Open();
  Pass(2s);
  const auto before = store_->ReadLine(0).outcomes[static_cast<std::size_t>(Outcome::ok)];
  const auto telegram = Ask("?A1\r");
  Pass(2s);
  EXPECT_THAT(ends_, ElementsAre(WriteEnd::ok));
  EXPECT_EQ(telegram->outcome, "ok");
  EXPECT_EQ(telegram->reply, twin_->Answer(telegram->bytes, now_.instant));
  EXPECT_GT(store_->ReadLine(0).outcomes[static_cast<std::size_t>(Outcome::ok)], before);
}

TEST_F(LocalPort, ATelegramByHandWaitsForTheEndOfThePoll) {
  answers_ = false;
  Open();
  Pass(20ms);  // a poll is under way
  Ask("?A1\r");
  EXPECT_THAT(port_.sent, IsEmpty());
  answers_ = true;
  Pass(5s);
  EXPECT_THAT(ends_, ElementsAre(WriteEnd::ok));
}

TEST_F(LocalPort, NobodyKnowsWhatBecameOfATelegramThatWasNotAnswered) {
  Open();
  Pass(2s);
  answers_ = false;
  const auto telegram = Ask("?A1\r");
  Pass(5s);
  EXPECT_THAT(ends_, ElementsAre(WriteEnd::unknown));
  EXPECT_EQ(telegram->outcome, "no_reply");
  EXPECT_THAT(telegram->reply, IsEmpty());
  answers_ = true;
  Pass(1min);
  ends_.clear();
  Ask("?A1\r");
  Pass(1s);
  EXPECT_THAT(ends_, ElementsAre(WriteEnd::ok));
}

TEST_F(LocalPort, ATelegramOnALineThatGoesAwayIsAnswered) {
  Ask("?A1\r");
  EXPECT_THAT(ends_, ElementsAre(WriteEnd::not_sent)) << "the port is not open yet";
  Open();
  Pass(2s);
  answers_ = false;
  Ask("?A1\r");
  Ask("?A1\r");
  Pass(10ms);
  Lose("gone");
  EXPECT_THAT(ends_, ElementsAre(WriteEnd::not_sent, WriteEnd::unknown, WriteEnd::not_sent));
  answers_ = true;
  Open();
  Pass(2s);
  EXPECT_EQ(status().port, LineStatus::Port::open);
}

TEST_F(LocalPort, ATelegramWhoseTimeIsOverIsNotSent) {
  answers_ = false;
  Open();
  Pass(20ms);  // a poll is under way
  Ask("?A1\r", 5ms);
  Pass(10s);
  EXPECT_THAT(ends_, ElementsAre(WriteEnd::not_sent));
}

TEST_F(LocalPort, OneThatDoesNotOpenIsDown) {
  Handle([&] { line_->port.OnOpenFailed("busy", now_); });
  EXPECT_THAT(retries_.downs, ElementsAre("busy"));
  EXPECT_EQ(status().port, LineStatus::Port::closed);
}

TEST_F(LinePortTest, AConnectionThatEndsInGoodOrderRests) {
  port_.open_on_demand = true;
  Open();
  Pass(1500ms);
  const int opens = port_.opens;
  End();
  EXPECT_EQ(status().port, LineStatus::Port::open);
  EXPECT_TRUE(line_->port.is_open());
  EXPECT_EQ(status().times_lost, 0U);
  EXPECT_EQ(port_.opens, opens) << "on demand, and not before";
  Write();
  Pass(5s);
  EXPECT_THAT(ends_, ElementsAre(WriteEnd::ok));
  EXPECT_EQ(port_.opens, opens + 1);
  EXPECT_EQ(status().outcomes[static_cast<std::size_t>(Outcome::no_reply)], 0U);
  EXPECT_THAT(retries_.downs, IsEmpty());
}

TEST_F(LinePortTest, AServerThatClosesBehindEachAnswerIsNoOutage) {
  port_.open_on_demand = true;
  closes_ = true;
  Open();
  Pass(1min);
  store_->Read(0,
               [](const DeviceRecord& record) { EXPECT_TRUE(IsGood(record.points[0].reported)); });
  EXPECT_LE(status().outcomes[static_cast<std::size_t>(Outcome::no_reply)], 1U);
  EXPECT_EQ(status().times_lost, 0U);
  EXPECT_THAT(retries_.downs, IsEmpty());
  Write();
  Pass(2s);
  EXPECT_THAT(ends_, ElementsAre(WriteEnd::ok));
}

TEST_F(LinePortTest, AServerThatIsGoneWhenItIsWantedIsAnOutage) {
  Open();
  Pass(1500ms);
  End();
  Pass(2s);
  Handle([&] { line_->port.OnOpenFailed("refused", now_); });
  EXPECT_FALSE(line_->port.is_open());
  EXPECT_EQ(status().port, LineStatus::Port::closed);
  EXPECT_THAT(retries_.downs, ElementsAre("refused"));
}

TEST_F(LinePortTest, OneThatEndsWithoutAnAnswerIsAnOutage) {
  Open();
  answers_ = false;
  Pass(300ms);
  End();
  EXPECT_FALSE(line_->port.is_open());
  EXPECT_EQ(retries_.downs.size(), 1U);
}

struct SharedConnection : LinePortTest {
  SharedConnection()
      : LinePortTest("tcp://server:4001",
                     {ToyDevice("a", "A", {"1"}), ToyDevice("b", "B", {"1"})}) {}
};

TEST_F(SharedConnection, AServerThatClosesForOneDeviceLeavesTheOther) {
  port_.open_on_demand = true;
  closes_for_ = {'A'};
  Open();
  Pass(1min);
  store_->Read(
      0, [](const DeviceRecord& record) { EXPECT_EQ(record.status.state, DeviceState::offline); });
  store_->Read(1, [](const DeviceRecord& record) {
    EXPECT_EQ(record.status.state, DeviceState::online);
    EXPECT_TRUE(IsGood(record.points[0].reported));
    EXPECT_LE(record.status.missed, 3U);
  });
  EXPECT_THAT(retries_.downs, IsEmpty());
}

TEST_F(SharedConnection, AServerThatClosesForAllIsAnOutage) {
  port_.open_on_demand = true;
  closes_for_ = {'A', 'B'};
  Open();
  Pass(1min);
  EXPECT_THAT(retries_.downs, ElementsAre(HasSubstr("before it had worked")));
}

TEST_F(LinePortTest, AServerThatClosesBeforeItHasWorkedIsToldSo) {
  Open();
  EXPECT_EQ(status().port, LineStatus::Port::open);
  answers_ = false;
  Pass(100ms);
  Say("busy, come back later\r\n");
  Lose("closed");
  EXPECT_THAT(retries_.downs, ElementsAre(HasSubstr("closed, before it had worked")));
  EXPECT_EQ(retries_.worked, 0) << "a greeting proves nothing";
}

TEST_F(LinePortTest, TheConnectionBehindAUselessOneIsNewsOnceItWorks) {
  Open();
  Lose("closed");
  Pass(1s);
  Open();
  EXPECT_EQ(status().port, LineStatus::Port::closed) << "not shown yet";
  Pass(2s);
  EXPECT_EQ(retries_.worked, 1);
  EXPECT_EQ(status().port, LineStatus::Port::open);
  Lose("reset");
  EXPECT_EQ(retries_.downs.back(), "reset");
  Open();
  EXPECT_EQ(status().port, LineStatus::Port::open) << "at once: the last one had worked";
}

TEST_F(LinePortTest, AServerThatOnlyHoldsHasWorkedAfterHalfAMinute) {
  Open();
  EXPECT_EQ(retries_.worked, 0);
  Handle([&] { line_->poller.SetInUse(0, false, now_); });
  port_.sent.clear();
  Pass(29s);
  EXPECT_EQ(retries_.worked, 0);
  Pass(10s);
  EXPECT_EQ(retries_.worked, 1);
  EXPECT_THAT(retries_.downs, IsEmpty());
}

TEST_F(LinePortTest, AConnectionWithoutAnyAnswerIsMadeAnew) {
  Open();
  Pass(2s);
  answers_ = false;
  Pass(25s);
  EXPECT_THAT(retries_.downs, IsEmpty());
  Pass(2min);
  ASSERT_EQ(retries_.downs.size(), 1U);
  EXPECT_THAT(retries_.downs[0], HasSubstr("no device behind it has answered for 30s"));
  EXPECT_FALSE(port_.open);
}

TEST_F(LocalPort, ThatIsLentComesBackByItself) {
  Open();
  Pass(2s);
  Handle([&] { line_->port.Release(10s, now_); });
  EXPECT_FALSE(port_.open);
  EXPECT_EQ(status().port, LineStatus::Port::released);
  EXPECT_EQ(status().released_until, now_.wall + 10s);
  Pass(9900ms);
  EXPECT_EQ(port_.opens, 1);
  Pass(200ms);
  EXPECT_EQ(port_.opens, 2);
  EXPECT_EQ(status().port_text, "being taken back");
}

TEST_F(LocalPort, ALoanCountsAnewAndEndsWhenItIsTakenBack) {
  Open();
  Handle([&] { line_->port.Release(10s, now_); });
  Pass(8s);
  Handle([&] { line_->port.Release(10s, now_); });
  Pass(8s);
  EXPECT_EQ(port_.opens, 1);
  Handle([&] { line_->port.TakeBack(now_); });
  EXPECT_EQ(port_.opens, 2);
  Handle([&] { line_->port.TakeBack(now_); });
  Pass(1min);
  EXPECT_EQ(port_.opens, 2);
}

TEST_F(LocalPort, IsLentAfterTheWriteUnderWay) {
  Open();
  Pass(2s);
  answers_ = false;
  Write();
  Pass(20ms);
  Handle([&] { line_->port.Release(10s, now_); });
  EXPECT_TRUE(port_.open);
  Pass(1s);
  EXPECT_FALSE(port_.open) << "nobody waits longer than a second";
  EXPECT_EQ(ends_.size(), 1U);
}

TEST_F(LocalPort, NothingOpensItAfterTheStop) {
  Open();
  Handle([&] { line_->port.Release(10s, now_); });
  int stopped = 0;
  Handle([&] { line_->port.Stop(now_, [&] { ++stopped; }); });
  EXPECT_EQ(stopped, 1);
  Handle([&] { line_->port.TakeBack(now_); });
  Handle([&] { line_->port.Release(1s, now_); });
  Pass(1min);
  EXPECT_EQ(port_.opens, 1);
  EXPECT_EQ(stopped, 1);
  EXPECT_FALSE(line_->Deadline().has_value());
}

TEST_F(LocalPort, WhatWaitsAtTheStopIsAnswered) {
  Open();
  Pass(2s);
  answers_ = false;
  Write();
  Write();
  int stopped = 0;
  Handle([&] { line_->port.Stop(now_, [&] { ++stopped; }); });
  EXPECT_EQ(stopped, 0) << "a write is under way";
  Pass(1s);
  EXPECT_EQ(stopped, 1);
  EXPECT_EQ(ends_.size(), 2U);
}

// ---------------------------------------------------------------- lent over the network

/// A client that wants the port, as gateway/serial_server/server.h does.
struct FakeUser final : serial_server::PortUser {
  void Grant(Transport& port, const config::SerialSettings&, Now) override { has = &port; }
  void TakeBack(Now) override {
    has = nullptr;
    ++taken_back;
  }
  void OnPort(View bytes, Now) override { Append(heard, bytes); }
  void OnPortRoom() override {}
  serial_server::Visit visit() const override { return its; }

  serial_server::Visit its{.client = "10.0.0.7:40000", .place = "127.0.0.1:4001"};
  Transport* has = nullptr;
  int taken_back = 0;
  Bytes heard;
};

struct NetworkLoan : LocalPort {
  void Want(FakeUser& user) {
    Handle([&] { line_->loan.Want(user, user.its, now_); });
  }
  void Return(FakeUser& user) {
    user.has = nullptr;
    Handle([&] { line_->loan.Return(user, user.its, "it has left", now_); });
  }
  /// From now on nobody answers, and a poll is under way. Its request.
  Bytes BeginPoll() {
    answers_ = false;
    for (const int before = port_.sends; port_.sends == before;) Pass(1ms);
    return port_.last;
  }
  std::uint64_t Polls() {
    return store_->ReadLine(0).outcomes[static_cast<std::size_t>(Outcome::ok)];
  }
  bool OutOfService() {
    bool out = false;
    store_->Read(0, [&](const DeviceRecord& record) {
      out = record.override_quality == Quality::bad_out_of_service;
    });
    return out;
  }

  FakeUser user_;
};

TEST_F(NetworkLoan, BeginsBehindTheExchangeUnderWay) {
  Open();
  Pass(2s);
  const Bytes request = BeginPoll();
  Want(user_);
  EXPECT_EQ(user_.has, nullptr);
  EXPECT_FALSE(OutOfService());
  const std::uint64_t before = Polls();
  Handle([&] { line_->port.OnBytes(twin_->Answer(request, now_.instant), now_); });
  Pass(100ms);
  EXPECT_EQ(user_.has, &port_);
  EXPECT_EQ(Polls(), before + 1) << "it has ended in order";
  EXPECT_TRUE(OutOfService());
  EXPECT_EQ(status().port, LineStatus::Port::released);
  EXPECT_THAT(status().port_text, HasSubstr("lent to 10.0.0.7:40000 at 127.0.0.1:4001, raw"));
  Pass(1min);
  EXPECT_EQ(Polls(), before + 1) << "nobody is asked meanwhile";
}

TEST_F(NetworkLoan, DoesNotWaitForEverForAnExchange) {
  Open();
  Pass(2s);
  answers_ = false;
  Write();
  Want(user_);
  Pass(10s);
  EXPECT_NE(user_.has, nullptr);
}

TEST_F(NetworkLoan, ItsBytesAreTheClients) {
  Open();
  Pass(2s);
  Want(user_);
  Pass(100ms);
  const LineStatus before = status();
  Say("secret");
  EXPECT_EQ(user_.heard, Bytes({'s', 'e', 'c', 'r', 'e', 't'}));
  EXPECT_EQ(status().bytes_in, before.bytes_in);
  EXPECT_EQ(status().stray_bytes, before.stray_bytes);
  for (const TraceRecord& record : line_->recorder.Recorded()) {
    EXPECT_THAT(ToText(record), testing::Not(HasSubstr("73 65 63")));
  }
}

TEST_F(NetworkLoan, RestsUntilTheBusIsSilentThenPollsGoOn) {
  Open();
  Pass(2s);
  Want(user_);
  Pass(100ms);
  const std::uint64_t before = Polls();
  Return(user_);
  EXPECT_EQ(port_.resets, 2);
  EXPECT_TRUE(OutOfService()) << "an answer to the client may still come";
  Say(":late\r");
  EXPECT_TRUE(OutOfService());
  Pass(5s);
  EXPECT_FALSE(OutOfService());
  EXPECT_GT(Polls(), before);
  EXPECT_EQ(port_.opens, 1) << "the port was open all the time";
}

TEST_F(NetworkLoan, EndsWithItsTime) {
  config_.lines[0].lend.emplace().time = 1min;
  Open();
  Pass(2s);
  Want(user_);
  Pass(1min);
  EXPECT_EQ(user_.taken_back, 1);
  Pass(5s);
  EXPECT_FALSE(OutOfService());
  EXPECT_EQ(status().port, LineStatus::Port::open);
}

TEST_F(NetworkLoan, OneClientHasThePort) {
  Open();
  Pass(2s);
  Want(user_);
  Pass(100ms);
  FakeUser other;
  Want(other);
  EXPECT_EQ(other.taken_back, 1);
  EXPECT_NE(user_.has, nullptr);
}

TEST_F(NetworkLoan, NobodyGetsAPortThatIsClosedReleasedOrEnds) {
  Want(user_);
  EXPECT_EQ(user_.taken_back, 1) << "it is not open";
  Open();
  Pass(2s);
  Handle([&] { line_->port.Release(1min, now_); });
  port_.open = false;
  Want(user_);
  EXPECT_EQ(user_.taken_back, 2);
  Handle([&] { line_->port.TakeBack(now_); });
  Open();
  Handle([&] { line_->port.Stop(now_, [] {}); });
  Want(user_);
  EXPECT_EQ(user_.taken_back, 3);
}

TEST_F(NetworkLoan, EndsWhereThePortIsLostReleasedOrTakenBack) {
  const auto begin = [&] {
    Open();
    Pass(2s);
    Want(user_);
    Pass(100ms);
    ASSERT_NE(user_.has, nullptr);
  };
  begin();
  Lose("gone");
  EXPECT_EQ(user_.taken_back, 1);
  begin();
  Handle([&] { line_->port.TakeBack(now_); });
  EXPECT_EQ(user_.taken_back, 2);
  Pass(5s);
  EXPECT_FALSE(OutOfService());
  begin();
  Handle([&] { line_->port.Release(1min, now_); });
  EXPECT_EQ(user_.taken_back, 3);
  EXPECT_EQ(status().port_text, "released for 1min");
}

TEST_F(NetworkLoan, ThePortIsOpenedAnewWhereItsSettingsDoNotComeBack) {
  Open();
  Pass(2s);
  Want(user_);
  Pass(100ms);
  port_.refuses = true;
  Return(user_);
  EXPECT_FALSE(port_.open);
  EXPECT_THAT(retries_.downs, ElementsAre("refused"));
  port_.refuses = false;
  const std::uint64_t before = Polls();
  Open();
  Pass(5s);
  EXPECT_GT(Polls(), before);
}

TEST_F(NetworkLoan, AClientThatLeavesBeforeItHasThePortChangesNothing) {
  Open();
  Pass(2s);
  BeginPoll();
  Want(user_);
  Return(user_);
  answers_ = true;
  const std::uint64_t before = Polls();
  Pass(5s);
  EXPECT_GT(Polls(), before + 1);
  EXPECT_EQ(port_.resets, 0);
}

TEST_F(NetworkLoan, IsToldOnceWhenItBeginsAndOnceWhenItEnds) {
  using What = News::What;
  Open();
  Pass(2s);
  Want(user_);
  Pass(100ms);
  Return(user_);
  Pass(5s);
  EXPECT_THAT(sink_.news, ElementsAre(Pair(What::port_lent, false), Pair(What::port_lent, true)));
}

}  // namespace
}  // namespace baudgate
