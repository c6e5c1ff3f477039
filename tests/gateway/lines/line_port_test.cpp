// Tests of connections that are checked before use, and of manual telegrams.
// SPDX-License-Identifier: Apache-2.0
#include "tests/gateway/lines/line_port_fixture.h"

namespace baudgate::lines {
namespace {

using testing::Contains;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Pair;

TEST_F(LocalPort, APortIsReportedOpenUntilItIsLost) {
  EXPECT_EQ(port_.opens, 1);
  Open();
  EXPECT_EQ(status().port, bus::LineStatus::Port::open);
  EXPECT_TRUE(line_->port.is_open());
  Lose("gone");
  EXPECT_THAT(retries_.downs, ElementsAre("gone"));
  EXPECT_EQ(status().port_text, "gone");
  EXPECT_EQ(status().times_lost, 1U);
  EXPECT_FALSE(line_->port.is_open());
}

TEST_F(LocalPort, ReportsThatAnotherProgramHasChangedItsSettings) {
  Open();
  Pass(2s);
  EXPECT_EQ(status().port_text, "fake");
  port_.changed = "echo is on";
  Pass(2s);
  EXPECT_THAT(status().port_text, HasSubstr("changed its settings once, last "));
  EXPECT_THAT(status().port_text, HasSubstr("(echo is on), and the gateway has set them again"));
  port_.changed = "9600 7E1 became 38400 8N1";
  Pass(2s);
  EXPECT_THAT(status().port_text, HasSubstr("changed its settings 2 times"));
  Lose("unplugged");
  Open();
  EXPECT_EQ(status().port_text, "fake");
}

class OtherSettings : public LinePortTest {
 protected:
  static config::Device Slow() {
    config::Device device = ToyDevice("a", "A", {"1"});
    device.serial = config::SerialSettings{.baud = 1200};
    return device;
  }
  OtherSettings() : LinePortTest("/dev/ttyS0", {Slow()}) {}
};

TEST_F(OtherSettings, AreTriedAgainWhenThePortRefusesThem) {
  port_.refuses = true;
  Open();
  Pass(3s);
  const int refused = port_.applied;
  EXPECT_GT(refused, 1);
  port_.refuses = false;
  Pass(10s);
  EXPECT_EQ(port_.applied, refused + 1) << "once, and not with each request";
}

TEST_F(LocalPort, PortAndDeviceChangesAreReportedForTheRecords) {
  using What = bus::News::What;
  Open();
  Pass(3s);
  EXPECT_THAT(sink_.read, Contains(0U));
  EXPECT_THAT(sink_.news, IsEmpty());
  answers_ = false;
  Pass(30s);
  Lose("gone");
  Handle([&] { line_->port.OnOpenFailed("no such file", transports::NoConnection::other, now_); });
  answers_ = true;
  Open();
  Pass(10s);
  Handle([&] { line_->port.Release(1min, now_); });
  Handle([&] { line_->port.EndRelease(now_); });
  Open();
  EXPECT_THAT(sink_.news, ElementsAre(Pair(What::no_answer, false), Pair(What::port_down, false),
                                      Pair(What::port_down, true), Pair(What::no_answer, true),
                                      Pair(What::port_lent, false), Pair(What::port_lent, true)));
}

TEST_F(LocalPort, ReportsThatThePortIsLostAfterALoan) {
  using What = bus::News::What;
  Open();
  Pass(2s);
  Handle([&] { line_->port.Release(3s, now_); });
  port_.open = false;
  Pass(4s);
  Handle([&] { line_->port.OnOpenFailed("no such file", transports::NoConnection::other, now_); });
  EXPECT_THAT(sink_.news, ElementsAre(Pair(What::port_lent, false), Pair(What::port_lent, true),
                                      Pair(What::port_down, false)));
}

TEST_F(LocalPort, IsPolledAndWritten) {
  Open();
  Pass(3s);
  EXPECT_EQ(store_->ReadLine(0).outcomes[static_cast<std::size_t>(Outcome::no_reply)], 0U);
  Write();
  Pass(1s);
  EXPECT_THAT(ends_, ElementsAre(WriteEnd::ok));
}

TEST_F(LocalPort, AManualTelegramIsAnsweredAndPollsContinue) {
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

TEST_F(LocalPort, AManualTelegramWaitsForTheEndOfThePoll) {
  answers_ = false;
  Open();
  Pass(20ms);
  Ask("?A1\r");
  EXPECT_THAT(port_.sent, IsEmpty());
  answers_ = true;
  Pass(5s);
  EXPECT_THAT(ends_, ElementsAre(WriteEnd::ok));
}

TEST_F(LocalPort, AnUnansweredManualTelegramIsUnknown) {
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

struct UntaggedPort : LinePortTest {
  UntaggedPort() : LinePortTest("/dev/ttyUSB0", {ToyDevice("a", "A", {"U1"})}) {}

  void PassUntilSent(int sends) {
    for (int i = 0; i < 5000 && port_.sends < sends; ++i) Pass(1ms);
    ASSERT_EQ(port_.sends, sends);
  }
};

TEST_F(UntaggedPort, TheLateReplyToATelegramIsNotStoredAsAValue) {
  Open();
  Pass(2s);
  answers_ = false;
  ends_.clear();
  Ask("UA2\r");
  PassUntilSent(port_.sends + 1);
  const Bytes reply = twin_->Answer(port_.last, now_.instant);
  const std::string late(AsText(reply));
  for (int i = 0; i < 5000 && ends_.empty(); ++i) Pass(1ms);
  sink_.read.clear();
  PassUntilSent(port_.sends + 1);
  Say(late);
  Pass(1ms);
  EXPECT_THAT(sink_.read, IsEmpty());
}

TEST_F(UntaggedPort, TheLateReplyToAPollIsNotTheReplyToATelegram) {
  Open();
  Pass(2s);
  answers_ = false;
  PassUntilSent(port_.sends + 1);
  const Bytes reply = twin_->Answer(port_.last, now_.instant);
  const std::string late(AsText(reply));
  const auto telegram = Ask("UA2\r");
  for (int i = 0; i < 5000 && port_.last != ToBytes("UA2\r"); ++i) {
    Pass(1ms);
    if (i == 450) Say(late);
  }
  ASSERT_EQ(port_.last, ToBytes("UA2\r"));
  EXPECT_THAT(telegram->reply, IsEmpty());
}

TEST_F(LocalPort, AManualTelegramIsAnsweredWhenThePortIsLost) {
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
  EXPECT_EQ(status().port, bus::LineStatus::Port::open);
}

TEST_F(LocalPort, AManualTelegramPastItsDeadlineIsNotSent) {
  answers_ = false;
  Open();
  Pass(20ms);
  Ask("?A1\r", 5ms);
  Pass(10s);
  EXPECT_THAT(ends_, ElementsAre(WriteEnd::not_sent));
}

TEST_F(LocalPort, AManualTelegramPastItsDeadlineIsNotSentWhenTheProgramResumes) {
  Open();
  Pass(1500ms);
  const int before = port_.sends;
  Ask("WA1=7\r", 50ms);
  EXPECT_EQ(port_.sends, before) << "it waits for a quiet line";
  Stop(100ms);
  Handle([&] { line_->OnTimer(now_); });
  EXPECT_THAT(ends_, ElementsAre(WriteEnd::not_sent));
  EXPECT_EQ(port_.sends, before);
}

TEST_F(LocalPort, APortThatDoesNotOpenIsDown) {
  Handle([&] { line_->port.OnOpenFailed("busy", transports::NoConnection::other, now_); });
  EXPECT_THAT(retries_.downs, ElementsAre("busy"));
  EXPECT_EQ(status().port, bus::LineStatus::Port::closed);
}

TEST_F(LinePortTest, AnOrderlyEndedConnectionReopensOnDemand) {
  port_.open_on_demand = true;
  Open();
  Pass(1500ms);
  const int opens = port_.opens;
  End();
  EXPECT_EQ(status().port, bus::LineStatus::Port::open);
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

TEST_F(LinePortTest, ACommandThatWaitsForAConnectionIsNotSentLate) {
  struct Row {
    const char* what;
    bool by_hand;
    Duration patience;
    Duration stopped;
    bool leaves = false;
  };
  const Row kRows[] = {
      {"a write, the exchange is over", false, 1h, 1min},
      {"a write, its deadline is", false, 100ms, 150ms},
      {"a write, its client has left", false, 1h, 20ms, true},
      {"a telegram, the exchange is over", true, 1h, 1min},
      {"a telegram, its deadline is", true, 100ms, 150ms},
      {"a telegram, its client has left", true, 1h, 20ms, true},
  };
  for (const Row& row : kRows) {
    SCOPED_TRACE(row.what);
    ends_.clear();
    *left_ = false;
    Open();
    Pass(1500ms);
    End();
    const int before = port_.sends;
    if (row.by_hand) {
      Ask("WA1=5\r", row.patience);
      Stop(10ms);
      Handle([&] { line_->OnTimer(now_); });
    } else {
      Write(row.patience);
    }
    *left_ = row.leaves;
    Stop(row.stopped);
    Open();
    EXPECT_EQ(port_.sends, before);
    Pass(2s);
    EXPECT_THAT(ends_, ElementsAre(WriteEnd::not_sent));
    Lose("unplugged");
  }
}

TEST_F(LinePortTest, ACommandThatGetsNoConnectionIsReportedNotSent) {
  const std::pair<const char*, std::function<void()>> kRows[] = {
      {"no connection within the reply time", [] {}},
      {"no connection",
       [this] { line_->port.OnOpenFailed("refused", transports::NoConnection::other, now_); }},
      {"lent", [this] { line_->port.Release(1min, now_); }},
      {"taken back", [this] { line_->port.EndRelease(now_); }},
  };
  for (const bool telegram : {false, true}) {
    for (const auto& [what, happens] : kRows) {
      SCOPED_TRACE(std::string(what) + (telegram ? ", a telegram" : ", a write"));
      ends_.clear();
      Open();
      Pass(1500ms);
      End();
      const int before = port_.sends;
      telegram ? void(Ask("WA1=5\r")) : Write();
      Stop(10ms);
      Handle([&] { line_->OnTimer(now_); });
      EXPECT_THAT(ends_, IsEmpty());
      Handle(happens);
      Pass(3s);
      EXPECT_THAT(ends_, ElementsAre(WriteEnd::not_sent));
      EXPECT_EQ(port_.sends, before);
    }
  }
}

TEST_F(LinePortTest, AWriteWaitingForAConnectionAtTheStopIsReportedNotSent) {
  Open();
  Pass(1500ms);
  End();
  Write();
  bool stopped = false;
  Handle([&] { line_->port.Stop("a reload removes the line", now_, [&] { stopped = true; }); });
  Pass(2s);
  EXPECT_TRUE(stopped);
  EXPECT_THAT(ends_, ElementsAre(WriteEnd::not_sent));
}

TEST_F(LinePortTest, AServerThatClosesAfterEachAnswerIsNoOutage) {
  port_.open_on_demand = true;
  closes_ = true;
  Open();
  Pass(1min);
  store_->Read(
      0, [](const bus::DeviceRecord& record) { EXPECT_TRUE(IsGood(record.points[0].reported)); });
  EXPECT_LE(status().outcomes[static_cast<std::size_t>(Outcome::no_reply)], 1U);
  EXPECT_EQ(status().times_lost, 0U);
  EXPECT_THAT(retries_.downs, IsEmpty());
  Write();
  Pass(2s);
  EXPECT_THAT(ends_, ElementsAre(WriteEnd::ok));
}

TEST_F(LinePortTest, AServerThatRefusesTheNextConnectionIsAnOutage) {
  Open();
  Pass(1500ms);
  End();
  Pass(2s);
  Handle([&] { line_->port.OnOpenFailed("refused", transports::NoConnection::refused, now_); });
  EXPECT_FALSE(line_->port.is_open());
  EXPECT_EQ(status().port, bus::LineStatus::Port::closed);
  EXPECT_THAT(retries_.downs, ElementsAre("refused"));
}

TEST_F(LinePortTest, CountsHowConnectionsEndAndWhatFollows) {
  const auto times = [this](bus::RecentTimes bus::ConnectionEnds::*what) {
    return (status().ends.*what).Since(Instant{});
  };
  Open();
  Pass(1500ms);
  End();
  EXPECT_EQ(times(&bus::ConnectionEnds::idle) + times(&bus::ConnectionEnds::asked), 1U);
  Pass(2s);
  for (int tries = 0; tries < 3; ++tries) {
    Handle([&] { line_->port.OnOpenFailed("refused", transports::NoConnection::refused, now_); });
  }
  EXPECT_EQ(times(&bus::ConnectionEnds::refused), 1U) << "once for each connection that had worked";
  Open();
  Pass(1500ms);
  End();
  answers_ = false;
  Open();
  Pass(300ms);
  End();
  Open();
  Pass(300ms);
  End();
  EXPECT_EQ(times(&bus::ConnectionEnds::shut), 1U);
  EXPECT_EQ(status().ends.alike, 2U) << "both that worked ended at the same age";
  EXPECT_EQ(times(&bus::ConnectionEnds::unreachable), 0U);
}

TEST_F(LinePortTest, AConnectionThatEndsWithoutAnAnswerIsAnOutage) {
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

TEST_F(SharedConnection, AServerThatClosesForOneDeviceDoesNotDisturbTheOther) {
  port_.open_on_demand = true;
  closes_for_ = {'A'};
  Open();
  Pass(1min);
  store_->Read(0, [](const bus::DeviceRecord& record) {
    EXPECT_EQ(record.status.state, bus::DeviceState::offline);
  });
  store_->Read(1, [](const bus::DeviceRecord& record) {
    EXPECT_EQ(record.status.state, bus::DeviceState::online);
    EXPECT_TRUE(IsGood(record.points[0].reported));
    EXPECT_LE(record.status.missed, 3U);
  });
  EXPECT_THAT(retries_.downs, IsEmpty());
}

TEST_F(SharedConnection, AServerThatClosesForAllDevicesIsAnOutage) {
  port_.open_on_demand = true;
  closes_for_ = {'A', 'B'};
  Open();
  Pass(1min);
  EXPECT_THAT(retries_.downs, ElementsAre(HasSubstr("before any good reply")));
}

TEST_F(LinePortTest, AServerThatClosesBeforeAnAnswerIsReported) {
  Open();
  EXPECT_EQ(status().port, bus::LineStatus::Port::open);
  answers_ = false;
  Pass(100ms);
  Say("busy, come back later\r\n");
  Lose("closed");
  EXPECT_THAT(retries_.downs, ElementsAre(HasSubstr("closed, before any good reply")));
  EXPECT_EQ(retries_.worked, 0) << "a greeting proves nothing";
}

TEST_F(LinePortTest, AServerThatEndsAnUnansweredConnectionIsReported) {
  Open();
  answers_ = false;
  Pass(10s);
  Lose("closed");
  EXPECT_THAT(retries_.downs,
              ElementsAre(HasSubstr("closed, with requests unanswered: check the server's mode")));
}

TEST_F(LinePortTest, AfterAUselessConnectionTheNextIsReportedOnceItWorks) {
  Open();
  Lose("closed");
  Pass(1s);
  Open();
  EXPECT_EQ(status().port, bus::LineStatus::Port::closed) << "not shown yet";
  Pass(2s);
  EXPECT_EQ(retries_.worked, 1);
  EXPECT_EQ(status().port, bus::LineStatus::Port::open);
  Lose("reset");
  EXPECT_EQ(retries_.downs.back(), "reset");
  Open();
  EXPECT_EQ(status().port, bus::LineStatus::Port::open) << "at once: the last one had worked";
}

TEST_F(LinePortTest, AnOpenConnectionHasWorkedAfterHalfAMinute) {
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

TEST_F(LinePortTest, AConnectionWithoutAnyAnswerIsReopened) {
  Open();
  Pass(2s);
  answers_ = false;
  Pass(25s);
  EXPECT_THAT(retries_.downs, IsEmpty());
  Pass(2min);
  ASSERT_EQ(retries_.downs.size(), 1U);
  EXPECT_THAT(retries_.downs[0], HasSubstr("no device behind the server has answered for 30s"));
  EXPECT_FALSE(port_.open);
}

}  // namespace
}  // namespace baudgate::lines
