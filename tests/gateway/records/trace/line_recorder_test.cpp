// What the flight recorder keeps, what a live reader sees, and that no secret is in either, however
// it comes back.
// SPDX-License-Identifier: Apache-2.0
#include "gateway/records/trace/line_recorder.h"

#include <gmock/gmock.h>

#include "gateway/base/text.h"
#include "gateway/bus/poller/poller.h"
#include "tests/support/virtual_line.h"

namespace baudgate {
namespace {

using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;
using ::testing::SizeIs;

constexpr std::string_view kRequest = ">1WV160:724:5F\r";

class LineRecorderTest : public testing::Test {
 protected:
  LineRecorderTest() : line_(ToyLine({ToyDevice("a", "A", {"1"}), ToyDevice("b", "B", {"1"})})) {
    Make([this](Recording recording) { saved_.push_back(std::move(recording)); });
  }
  void Make(LineRecorder::Sink sink) { recorder_.emplace(line_, kFirst, std::move(sink)); }

  Now Later(Duration time = 1ms) {
    now_.instant += time;
    now_.wall += time;
    return now_;
  }
  void Send(std::string_view text, std::uint32_t device = kFirst) {
    Request request;
    request.bytes = ToBytes(text);
    recorder_->OnSent(device, request, Later());
  }
  /// The password 724 and its check value are secret.
  void SendSecret() {
    Request request;
    request.bytes = ToBytes(kRequest);
    request.expect.secrets = {{8, 3}, {12, 2}};
    recorder_->OnSent(kFirst, request, Later());
  }
  void Receive(std::string_view text) { recorder_->OnReceived(ToBytes(text), Later()); }
  void End(Outcome outcome = Outcome::ok, std::string reason = {}, std::uint32_t device = kFirst) {
    recorder_->OnExchangeEnd(device, {outcome, std::move(reason), 2ms}, Later());
  }
  std::vector<std::string> Lines() const { return Texts(recorder_->Recorded()); }
  static std::vector<std::string> Texts(const std::vector<TraceRecord>& records) {
    std::vector<std::string> lines;
    for (const TraceRecord& record : records) lines.push_back(ToText(record));
    return lines;
  }
  /// All characters received, as shown.
  std::string ReceivedText() const {
    std::string text;
    for (const TraceRecord& record : recorder_->Recorded()) {
      if (record.kind == TraceRecord::Kind::received) text += record.text;
    }
    return text;
  }

  /// What the last exchange received.
  std::string LastReceivedText() const {
    std::string text;
    const auto records = recorder_->Recorded();
    for (auto it = records.rbegin(); it->kind != TraceRecord::Kind::sent; ++it) {
      if (it->kind == TraceRecord::Kind::received) text.insert(0, it->text);
    }
    return text;
  }

  static constexpr std::uint32_t kFirst = 5;  // index of the line's first device in the store
  config::Line line_;
  Now now_{Instant() + 1h, WallTime(3h)};
  std::vector<Recording> saved_;
  std::optional<LineRecorder> recorder_;
};

TEST_F(LineRecorderTest, KeepsAnExchangeAsItWas) {
  Send("?A1\r");
  Receive("!A1=");
  Receive("7\xFF\r");
  End(Outcome::corrupt, "checksum");
  EXPECT_THAT(Lines(), ElementsAre("03:00:00.001000 a > 3F 41 31 0D | ?A1.",
                                   "03:00:00.002000 a < 21 41 31 3D | !A1=",
                                   "03:00:00.003000 a < 37 FF 0D | 7..",
                                   "03:00:00.004000 a = corrupt, 2.0 ms: checksum"));
}

TEST_F(LineRecorderTest, StrayBytesAndThePortAreNobodys) {
  Send("?A1\r", kFirst + 1);
  End(Outcome::no_reply, {}, kFirst + 1);
  Receive("!");
  recorder_->OnDeviceState(kFirst + 1, DeviceState::offline, "no_reply", Later());
  recorder_->OnPort("port closed: gone", Later());
  EXPECT_THAT(Lines(),
              ElementsAre(HasSubstr(" b > "), HasSubstr(" b = no_reply"),
                          "03:00:00.003000 - < 21 | !", "03:00:00.004000 b # offline: no_reply",
                          "03:00:00.005000 - # port closed: gone"));
}

TEST_F(LineRecorderTest, KeepsTheLastExchanges) {
  for (int i = 0; i < 1000; ++i) {
    Send("?A" + std::to_string(i) + "\r");
    End();
  }
  const auto lines = Lines();
  ASSERT_THAT(lines, SizeIs(2 * LineRecorder::kExchanges));
  EXPECT_THAT(lines.front(), HasSubstr("?A936"));
  EXPECT_THAT(lines[126], HasSubstr("?A999"));
}

TEST_F(LineRecorderTest, ABabblerFillsOneExchangeOnly) {
  Send("?A1\r");
  for (int i = 0; i < 5000; ++i) Receive("x");
  for (int i = 0; i < 5000; ++i) recorder_->OnPort("port closed: again", Later());
  End(Outcome::partial);
  Receive("stray");
  const auto lines = Lines();
  EXPECT_LE(lines.size(), 100U);
  EXPECT_THAT(lines.back(), HasSubstr("… 3985 more bytes"));
  EXPECT_EQ(ReceivedText().size(), LineRecorder::kMostBytes - 4) << "the request counts as well";
}

TEST_F(LineRecorderTest, AReaderSeesEverythingFromNowOn) {
  Send("?A1\r");
  End();
  auto queue = recorder_->Subscribe({});
  Send("?A2\r");
  for (int i = 0; i < 2000; ++i) Receive("x");
  End();
  const auto seen = Texts(queue->Take());
  ASSERT_THAT(seen, SizeIs(2002));
  EXPECT_THAT(seen.front(), HasSubstr("?A2"));
  EXPECT_THAT(seen[2000], HasSubstr(" < 78 | x"));
  EXPECT_THAT(seen.back(), HasSubstr("= ok"));
}

TEST_F(LineRecorderTest, AReaderThatIsGoneIsForgotten) {
  int woken = 0;
  auto queue = recorder_->Subscribe([&] { ++woken; });
  Send("?A1\r");
  EXPECT_EQ(woken, 1);
  queue.reset();
  Send("?A2\r");
  End();
  EXPECT_EQ(woken, 1);
}

// ---------------------------------------------------------------- recordings

TEST_F(LineRecorderTest, ACorruptFrameIsWorthARecording) {
  Send("?A1\r");
  End();
  EXPECT_THAT(saved_, IsEmpty());
  Send("?B1\r", kFirst + 1);
  Receive("garbage");
  End(Outcome::corrupt, "checksum", kFirst + 1);
  ASSERT_THAT(saved_, SizeIs(1));
  EXPECT_EQ(saved_[0].line, &line_);
  EXPECT_EQ(saved_[0].device, &line_.devices[1]);
  EXPECT_EQ(saved_[0].reason, "corrupt");
  EXPECT_EQ(saved_[0].at, now_.wall);
  EXPECT_THAT(Texts(saved_[0].records), SizeIs(5));
  EXPECT_THAT(Texts(saved_[0].records).back(), HasSubstr("= corrupt"));
}

TEST_F(LineRecorderTest, SoIsADeviceThatGoesOffline) {
  Send("?A1\r");
  End(Outcome::no_reply);
  recorder_->OnDeviceState(kFirst, DeviceState::degraded, "no_reply", Later());
  EXPECT_THAT(saved_, IsEmpty());
  recorder_->OnDeviceState(kFirst, DeviceState::offline, "no_reply", Later());
  ASSERT_THAT(saved_, SizeIs(1));
  EXPECT_EQ(saved_[0].reason, "offline");
  EXPECT_THAT(Texts(saved_[0].records).back(), HasSubstr("a # offline: no_reply"));
}

TEST_F(LineRecorderTest, LongTroubleGivesOneRecordingAMinute) {
  for (int i = 0; i < 180; ++i) {
    Send("?A1\r");
    End(Outcome::corrupt);
    Later(1s);
  }
  EXPECT_THAT(saved_, SizeIs(3));
}

TEST_F(LineRecorderTest, NobodyHasToWantRecordings) {
  Make({});
  Send("?A1\r");
  End(Outcome::corrupt);
  EXPECT_THAT(Lines(), SizeIs(2));
}

// ---------------------------------------------------------------- secrets

TEST_F(LineRecorderTest, SecretsOfARequestAreMasked) {
  auto queue = recorder_->Subscribe({});
  SendSecret();
  End();
  const char* const shown =
      "03:00:00.001000 a > 3E 31 57 56 31 36 30 3A ** ** ** 3A ** ** 0D | >1WV160:***:**.";
  EXPECT_EQ(Lines().front(), shown);
  EXPECT_EQ(Texts(queue->Take()).front(), shown);
}

TEST_F(LineRecorderTest, WhatComesBackIsMaskedHoweverItIsSplitOrDamaged) {
  auto queue = recorder_->Subscribe({});
  for (const std::string_view echo :
       {kRequest, kRequest.substr(7), std::string_view("<1N: wrong password '724'"),
        std::string_view(">1WV160:7z24:5F\r"), std::string_view("724")}) {
    for (std::size_t cut = 0; cut <= echo.size(); ++cut) {
      SendSecret();
      if (cut > 0) Receive(echo.substr(0, cut));
      End();
      if (cut < echo.size()) Receive(echo.substr(cut));  // late
      EXPECT_EQ(LastReceivedText(), std::string(echo.size(), '*')) << echo << " cut at " << cut;
    }
  }
  for (const TraceRecord& record : queue->Take()) {
    if (record.kind != TraceRecord::Kind::received) continue;
    EXPECT_THAT(record.hex, testing::MatchesRegex("[* ]+"));
  }
}

TEST_F(LineRecorderTest, TheNextRequestEndsTheMask) {
  SendSecret();
  Receive(kRequest);
  Send("?A1\r");
  Receive("!A1=724\r");
  EXPECT_EQ(LastReceivedText(), "!A1=724.") << "digits of an answer are no password";
}

TEST_F(LineRecorderTest, TheMaskOutlivesTheExchangeAndThePort) {
  SendSecret();
  End(Outcome::no_reply);
  recorder_->OnPort("port closed: gone", Later());
  recorder_->OnPort("serial /dev/ttyUSB0", Later());
  Later(1h);
  Receive("724");
  EXPECT_EQ(LastReceivedText(), "***");
}

/// A task goes on behind its password; what it says at its end may quote any of its replies.
TEST_F(LineRecorderTest, NoReasonQuotesWhatCameBack) {
  const char* const reason = "the device says: wrong password '724'";
  SendSecret();
  Receive("<1N: wrong password '724'");
  End(Outcome::refused, reason);
  Send("?A1\r");
  End(Outcome::refused, reason);
  recorder_->OnDeviceState(kFirst, DeviceState::degraded, reason, Later());
  for (const std::string& line : Lines()) EXPECT_THAT(line, Not(HasSubstr("724"))) << line;
  Later(LineRecorder::kNoReasons);
  Send("?A1\r");
  End(Outcome::refused, "limit");
  EXPECT_THAT(Lines().back(), HasSubstr("limit"));
}

TEST_F(LineRecorderTest, AMaskedBabblerIsBounded) {
  SendSecret();
  for (int i = 0; i < 100'000; ++i) Receive("7");
  End(Outcome::partial);
  EXPECT_EQ(ReceivedText(), std::string(LineRecorder::kMostBytes - kRequest.size(), '*'));
}

TEST(LineRecorderOnALine, HearsOfEveryExchange) {
  const config::Line config = ToyLine({ToyDevice("a", "A", {"1"})});
  std::vector<Recording> saved;
  LineRecorder recorder(config, 0, [&](Recording recording) { saved.push_back(recording); });
  VirtualLine line(config, {&ToyProtocol()});
  line.poller().Attach(recorder);
  line.Open();
  line.RunFor(1500ms);
  ASSERT_EQ(recorder.Recorded().size() % 3, 1U) << "sent, received, end; and one note: online";
  line.twin(0).manner.dead = true;
  line.RunFor(1min);
  ASSERT_THAT(saved, SizeIs(1));
  EXPECT_EQ(saved[0].reason, "offline");
  EXPECT_EQ(saved[0].records.back().text.substr(0, 7), "offline");
}

TEST_F(LineRecorderTest, ALineThatOnlyListensKeepsItsLatestMessages) {
  for (int i = 0; i < 200; ++i) {
    Later(1s);
    recorder_->OnReceived(ToBytes("tag " + std::to_string(i)), Later());
    recorder_->OnReceived(ToBytes("\r\n"), Later());
  }
  const std::string kept = ReceivedText();
  EXPECT_THAT(kept, HasSubstr("tag 199"));
  EXPECT_THAT(kept, Not(HasSubstr("tag 135.")));
  EXPECT_THAT(kept, HasSubstr("tag 136."));
}

TEST_F(LineRecorderTest, AStreamWithoutSilenceKeepsItsLatestBytes) {
  for (int i = 0; i < 2000; ++i) Receive("piece " + std::to_string(i) + ";");
  EXPECT_THAT(ReceivedText(), HasSubstr("piece 1999;"));
  EXPECT_LE(ReceivedText().size(), LineRecorder::kExchanges * LineRecorder::kMostBytes);
}

TEST_F(LineRecorderTest, NoiseBetweenRequestsPushesOutNoExchange) {
  Send("1st");
  End();
  for (int i = 0; i < 9; ++i) {
    Later(LineRecorder::kSilence);
    Receive("noise");
  }
  EXPECT_THAT(recorder_->Recorded().front().text, HasSubstr("1st"));
  for (std::size_t i = 0; i < 2 * LineRecorder::kExchanges; ++i) Receive("noise");
  EXPECT_THAT(recorder_->Recorded().front().text, HasSubstr("1st"));
}

}  // namespace
}  // namespace baudgate
