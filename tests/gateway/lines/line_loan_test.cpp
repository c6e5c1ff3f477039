// Tests of a port that is lent to another program, by hand or over the network.
// SPDX-License-Identifier: Apache-2.0
#include "gateway/lines/lines.h"
#include "tests/gateway/lines/line_port_fixture.h"

namespace baudgate::lines {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::Pair;

class PortInAWrite : public LocalPort {
 protected:
  void ReleaseDuringAWrite() {
    Open();
    Pass(2s);
    answers_ = false;
    Write();
    Pass(20ms);
    Handle([&] { line_->port.Release(10s, now_); });
  }
};

TEST_F(LocalPort, ALentPortComesBackByItself) {
  Open();
  Pass(2s);
  Handle([&] { line_->port.Release(10s, now_); });
  EXPECT_FALSE(port_.open);
  EXPECT_EQ(status().port, bus::LineStatus::Port::released);
  EXPECT_EQ(status().released_until, now_.wall + 10s);
  Pass(9900ms);
  EXPECT_EQ(port_.opens, 1);
  Pass(200ms);
  EXPECT_EQ(port_.opens, 2);
  EXPECT_EQ(status().port_text, "being taken back");
}

TEST_F(LocalPort, ARenewedLoanRestartsItsTimeAndEndsWhenTakenBack) {
  Open();
  Handle([&] { line_->port.Release(10s, now_); });
  Pass(8s);
  Handle([&] { line_->port.Release(10s, now_); });
  Pass(8s);
  EXPECT_EQ(port_.opens, 1);
  Handle([&] { line_->port.EndRelease(now_); });
  EXPECT_EQ(port_.opens, 2);
  Handle([&] { line_->port.EndRelease(now_); });
  Pass(1min);
  EXPECT_EQ(port_.opens, 2);
}

TEST_F(PortInAWrite, IsLentAfterTheWriteUnderWay) {
  ReleaseDuringAWrite();
  EXPECT_TRUE(port_.open);
  Pass(1s);
  EXPECT_FALSE(port_.open) << "nobody waits longer than a second";
  EXPECT_EQ(ends_.size(), 1U);
}

TEST_F(PortInAWrite, TakenBackBeforeTheWriteHasEndedIsNotLent) {
  ReleaseDuringAWrite();
  Pass(100ms);
  Handle([&] { line_->port.EndRelease(now_); });
  answers_ = true;
  Pass(5s);
  EXPECT_TRUE(port_.open);
  EXPECT_EQ(port_.opens, 1);
  EXPECT_EQ(status().port, bus::LineStatus::Port::open);
  const int sends = port_.sends;
  Pass(2s);
  EXPECT_GT(port_.sends, sends) << "polls go on";
}

TEST_F(PortInAWrite, AReleaseThatWaitsForTheWriteSurvivesAReload) {
  const auto until = [&] { return ManualSettingsOf(*store_, 0, config_.lines[0]).released_until; };
  ReleaseDuringAWrite();
  EXPECT_EQ(until(), now_.wall + 10s);
  Handle([&] { line_->port.EndRelease(now_); });
  EXPECT_EQ(until(), WallTime{});
}

TEST_F(PortInAWrite, TakenBackDuringTheStopStillStops) {
  ReleaseDuringAWrite();
  int stopped = 0;
  Handle([&] { line_->port.Stop("the gateway stops", now_, [&] { ++stopped; }); });
  Handle([&] { line_->port.EndRelease(now_); });
  Pass(1s);
  EXPECT_EQ(stopped, 1);
  EXPECT_FALSE(port_.open);
}

TEST_F(LocalPort, NoRequestOpensThePortAfterTheStop) {
  Open();
  Handle([&] { line_->port.Release(10s, now_); });
  int stopped = 0;
  Handle([&] { line_->port.Stop("the gateway stops", now_, [&] { ++stopped; }); });
  EXPECT_EQ(stopped, 1);
  Handle([&] { line_->port.EndRelease(now_); });
  Handle([&] { line_->port.Release(1s, now_); });
  Pass(1min);
  EXPECT_EQ(port_.opens, 1);
  EXPECT_EQ(stopped, 1);
  EXPECT_FALSE(line_->Deadline().has_value());
}

TEST_F(LocalPort, CommandsThatWaitAtTheStopAreAnswered) {
  Open();
  Pass(2s);
  answers_ = false;
  Write();
  Write();
  int stopped = 0;
  Handle([&] { line_->port.Stop("the gateway stops", now_, [&] { ++stopped; }); });
  EXPECT_EQ(stopped, 0) << "a write is under way";
  Pass(1s);
  EXPECT_EQ(stopped, 1);
  EXPECT_EQ(ends_.size(), 2U);
}

struct FakeUser final : serial_server::PortUser {
  void Grant(transports::Transport& port, const config::SerialSettings&, Now) override {
    has = &port;
  }
  void TakeBack(Now) override {
    has = nullptr;
    ++taken_back;
  }
  void OnPort(View bytes, Now) override { Append(heard, bytes); }
  void OnPortRoom() override {}
  serial_server::Visit visit() const override { return its; }

  serial_server::Visit its{.client = "10.0.0.7:40000", .place = "127.0.0.1:4001"};
  transports::Transport* has = nullptr;
  int taken_back = 0;
  Bytes heard;
};

struct NetworkLoan : LinePortTest {
  explicit NetworkLoan(const std::string& port = "/dev/ttyUSB0") : LinePortTest(port) {}

  void Want(FakeUser& user) {
    Handle([&] { line_->loan.Want(user, user.its, now_); });
  }
  void Return(FakeUser& user) {
    user.has = nullptr;
    Handle([&] { line_->loan.Return(user, user.its, "it disconnected", now_); });
  }
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
    store_->Read(0, [&](const bus::DeviceRecord& record) {
      out = record.override_quality == Quality::bad_out_of_service;
    });
    return out;
  }

  FakeUser user_;
};

TEST_F(NetworkLoan, BeginsAfterTheExchangeUnderWay) {
  Open();
  Pass(2s);
  const Bytes request = BeginPoll();
  Want(user_);
  EXPECT_EQ(user_.has, nullptr);
  EXPECT_FALSE(OutOfService());
  const std::uint64_t before = Polls();
  Handle([&] { line_->port.PassOn(twin_->Answer(request, now_.instant), now_); });
  Pass(100ms);
  EXPECT_EQ(user_.has, &port_);
  EXPECT_EQ(Polls(), before + 1) << "it has ended in order";
  EXPECT_TRUE(OutOfService());
  EXPECT_EQ(status().port, bus::LineStatus::Port::released);
  EXPECT_THAT(status().port_text, HasSubstr("lent to 10.0.0.7:40000 at 127.0.0.1:4001, raw"));
  Pass(1min);
  EXPECT_EQ(Polls(), before + 1) << "nobody is asked meanwhile";
}

TEST_F(NetworkLoan, TheLinePollsBetweenTwoLoans) {
  Open();
  Pass(2s);
  Want(user_);
  Pass(100ms);
  ASSERT_NE(user_.has, nullptr);
  Return(user_);
  FakeUser next;
  Want(next);
  const std::uint64_t before = Polls();
  Pass(4s);
  EXPECT_EQ(next.has, nullptr);
  EXPECT_EQ(next.taken_back, 0) << "it waits";
  EXPECT_GT(Polls(), before + 2);
  EXPECT_FALSE(OutOfService());
  Pass(3s);
  EXPECT_EQ(next.has, &port_);
  Return(next);
  Pass(1s);
  Want(next);
  Pass(1s);
  EXPECT_EQ(next.has, nullptr);
  Return(next);
  Want(user_);
  Pass(1s);
  Handle([&] { line_->loan.Offer({}, 1min, now_); });
  Pass(100ms);
  EXPECT_EQ(user_.has, &port_) << "somebody has asked for it by hand";
}

TEST_F(NetworkLoan, IsNotCarriedOverByAReloadLikeAManualLoan) {
  const auto until = [&] { return ManualSettingsOf(*store_, 0, config_.lines[0]).released_until; };
  Open();
  Pass(2s);
  Want(user_);
  Pass(100ms);
  ASSERT_TRUE(OutOfService());
  EXPECT_EQ(until(), WallTime{});
  Return(user_);
  ASSERT_TRUE(OutOfService());
  EXPECT_EQ(until(), WallTime{});
  Pass(5s);
  Handle([&] { line_->port.Release(1min, now_); });
  EXPECT_EQ(until(), now_.wall + 1min);
}

TEST_F(NetworkLoan, TheStopRestoresThePortSettings) {
  Open();
  Pass(2s);
  Want(user_);
  Pass(100ms);
  const int before = port_.resets;
  Handle([&] { line_->port.Stop("a reload", now_, [] {}); });
  EXPECT_EQ(user_.taken_back, 1);
  EXPECT_EQ(port_.resets, before + 1);
}

TEST_F(NetworkLoan, EndsOnARetiredLine) {
  Open();
  Pass(2s);
  Want(user_);
  Pass(100ms);
  ASSERT_NE(user_.has, nullptr);
  store_->Retire(0);
  Handle([&] { line_->port.Stop("a reload", now_, [] {}); });
  EXPECT_EQ(user_.taken_back, 1);
}

TEST_F(NetworkLoan, AManualTelegramIsRefusedWithTheNameOfTheClient) {
  Open();
  Pass(2s);
  Want(user_);
  Pass(100ms);
  std::string reason;
  bus::WriteCommand command;
  command.kind = std::make_shared<bus::Telegram>();
  command.telegram()->bytes = ToBytes(":A");
  command.done = [&](const WriteResult& result) { reason = result.reason; };
  Handle([&] { line_->Submit(std::move(command), now_); });
  EXPECT_THAT(reason, HasSubstr("in use by 10.0.0.7:40000"));
  EXPECT_NE(user_.has, nullptr);
}

TEST_F(NetworkLoan, BeginsAlthoughAnExchangeIsNotAnswered) {
  Open();
  Pass(2s);
  answers_ = false;
  Write();
  Want(user_);
  Pass(10s);
  EXPECT_NE(user_.has, nullptr);
}

TEST_F(NetworkLoan, BytesOfTheLoanGoOnlyToTheClient) {
  Open();
  Pass(2s);
  Want(user_);
  Pass(100ms);
  const bus::LineStatus before = status();
  Say("secret");
  EXPECT_EQ(user_.heard, Bytes({'s', 'e', 'c', 'r', 'e', 't'}));
  EXPECT_EQ(status().bytes_in, before.bytes_in);
  EXPECT_EQ(status().stray_bytes, before.stray_bytes);
  for (const records::TraceRecord& record : line_->recorder.Recorded()) {
    EXPECT_THAT(ToText(record), testing::Not(HasSubstr("73 65 63")));
  }
}

TEST_F(NetworkLoan, PollsContinueWhenTheBusIsSilentAfterTheLoan) {
  Open();
  Pass(2s);
  Want(user_);
  Pass(100ms);
  const std::uint64_t before = Polls();
  Return(user_);
  EXPECT_EQ(port_.resets, 2);
  EXPECT_TRUE(OutOfService()) << "an answer to the client may still come";
  const std::uint64_t stray = status().stray_bytes;
  for (int piece = 0; piece < 4; ++piece) {
    Pass(150ms);
    Say(":late\r");
    EXPECT_TRUE(OutOfService()) << "the bus is not silent yet";
  }
  EXPECT_EQ(status().stray_bytes, stray) << "no reply to the line";
  Pass(5s);
  EXPECT_FALSE(OutOfService());
  EXPECT_GT(Polls(), before);
  EXPECT_EQ(port_.opens, 1) << "the port was open all the time";
}

TEST_F(NetworkLoan, EndsAfterTheConfiguredTime) {
  config_.lines[0].lend.emplace().time = 1min;
  Open();
  Pass(2s);
  Want(user_);
  Pass(1min);
  EXPECT_EQ(user_.taken_back, 1);
  Pass(5s);
  EXPECT_FALSE(OutOfService());
  EXPECT_EQ(status().port, bus::LineStatus::Port::open);
}

TEST_F(NetworkLoan, OnlyOneClientGetsThePort) {
  Open();
  Pass(2s);
  Want(user_);
  Pass(100ms);
  FakeUser other;
  Want(other);
  EXPECT_EQ(other.taken_back, 1);
  EXPECT_NE(user_.has, nullptr);
}

TEST_F(NetworkLoan, NoClientGetsAPortThatIsClosedReleasedOrStopped) {
  Want(user_);
  EXPECT_EQ(user_.taken_back, 1) << "it is not open";
  Open();
  Pass(2s);
  Handle([&] { line_->port.Release(1min, now_); });
  port_.open = false;
  Want(user_);
  EXPECT_EQ(user_.taken_back, 2);
  Handle([&] { line_->port.EndRelease(now_); });
  Open();
  Handle([&] { line_->port.Stop("the gateway stops", now_, [] {}); });
  Want(user_);
  EXPECT_EQ(user_.taken_back, 3);
}

TEST_F(NetworkLoan, EndsWhenThePortIsLostReleasedOrTakenBack) {
  const auto begin = [&] {
    Open();
    Pass(7s);
    Want(user_);
    Pass(100ms);
    ASSERT_NE(user_.has, nullptr);
  };
  begin();
  Lose("gone");
  EXPECT_EQ(user_.taken_back, 1);
  begin();
  Handle([&] { line_->port.EndRelease(now_); });
  EXPECT_EQ(user_.taken_back, 2);
  Pass(5s);
  EXPECT_FALSE(OutOfService());
  begin();
  Handle([&] { line_->port.Release(1min, now_); });
  EXPECT_EQ(user_.taken_back, 3);
  EXPECT_EQ(status().port_text, "released for 1min");
}

TEST_F(NetworkLoan, ThePortIsReopenedWhenItsSettingsCannotBeRestored) {
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

TEST_F(NetworkLoan, IsReportedOnceAtItsBeginAndOnceAtItsEnd) {
  using What = bus::News::What;
  Open();
  Pass(2s);
  Want(user_);
  Pass(100ms);
  Return(user_);
  Pass(5s);
  EXPECT_THAT(sink_.news, ElementsAre(Pair(What::port_lent, false), Pair(What::port_lent, true)));
}

struct LoanOfAServer : NetworkLoan {
  LoanOfAServer() : NetworkLoan("tcp://server:4001") {}
};

TEST_F(LoanOfAServer, EndsWhenTheServerEndsTheConnection) {
  for (const bool left : {false, true}) {
    Open();
    Pass(7s);
    ASSERT_GT(Polls(), 2U);
    Want(user_);
    Pass(100ms);
    ASSERT_NE(user_.has, nullptr);
    if (left) Return(user_);
    retries_.downs.clear();
    End();
    EXPECT_EQ(user_.taken_back, 1);
    EXPECT_EQ(status().port, bus::LineStatus::Port::closed);
    EXPECT_THAT(retries_.downs, ElementsAre(HasSubstr("closed"))) << "it is opened again";
  }
}

TEST_F(LoanOfAServer, DoesNotBeginIfTheConnectionEndedWhileTheClientWaited) {
  Open();
  Pass(2s);
  const Bytes request = BeginPoll();
  Want(user_);
  port_.sent.clear();
  Handle([&] {
    line_->port.PassOn(twin_->Answer(request, now_.instant), now_);
    port_.open = false;
    line_->port.OnEnded("closed", false, now_);
  });
  answers_ = true;
  port_.open_on_demand = true;
  const std::uint64_t before = Polls();
  Pass(3s);
  EXPECT_EQ(user_.has, nullptr);
  EXPECT_EQ(user_.taken_back, 1);
  EXPECT_GT(Polls(), before) << "the next request opens it again";
}

}  // namespace
}  // namespace baudgate::lines
