// Tests of `LineRecorder`: recordings and traces, which must not contain secrets.
// SPDX-License-Identifier: Apache-2.0
#include "gateway/records/trace/line_recorder.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <stdlib.h>

#include <fstream>
#include <optional>
#include <sstream>
#include <thread>

#include "gateway/base/text.h"
#include "gateway/bus/poller/poller.h"
#include "gateway/records/trace/trace_text.h"
#include "tests/support/virtual_line.h"

namespace baudgate::records {
namespace {

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
    protocols::Request request;
    request.bytes = ToBytes(text);
    recorder_->OnSent(device, request, Later());
  }
  void SendSecret() {
    protocols::Request request;
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
  std::string ReceivedText() const {
    std::string text;
    for (const TraceRecord& record : recorder_->Recorded()) {
      if (record.kind == TraceRecord::Kind::received) text += record.text;
    }
    return text;
  }

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

TEST_F(LineRecorderTest, RecordsAnExchangeUnchanged) {
  Send("?A1\r");
  Receive("!A1=");
  Receive("7\xFF\r");
  End(Outcome::corrupt, "checksum");
  EXPECT_THAT(Lines(), ElementsAre("03:00:00.001000 a > 3F 41 31 0D | ?A1.",
                                   "03:00:00.002000 a < 21 41 31 3D | !A1=",
                                   "03:00:00.003000 a < 37 FF 0D | 7..",
                                   "03:00:00.004000 a = corrupt, 2.0 ms: checksum"));
}

TEST_F(LineRecorderTest, StrayBytesAndPortNotesHaveNoDevice) {
  Send("?A1\r", kFirst + 1);
  End(Outcome::no_reply, {}, kFirst + 1);
  Receive("!");
  recorder_->OnDeviceState(kFirst + 1, bus::DeviceState::offline, "no_reply", Later());
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

TEST_F(LineRecorderTest, ABabblingDeviceFillsOnlyOneExchange) {
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

TEST_F(LineRecorderTest, ASubscriberGetsAllLaterRecords) {
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

TEST_F(LineRecorderTest, ALeftSubscriberIsNotWoken) {
  int woken = 0;
  auto queue = recorder_->Subscribe([&] { ++woken; });
  Send("?A1\r");
  EXPECT_EQ(woken, 1);
  queue.reset();
  Send("?A2\r");
  End();
  EXPECT_EQ(woken, 1);
}

TEST_F(LineRecorderTest, ACorruptFrameIsSavedAsARecording) {
  Send("?A1\r");
  End();
  EXPECT_THAT(saved_, IsEmpty());
  Send("?B1\r", kFirst + 1);
  Receive("garbage");
  End(Outcome::corrupt, "checksum", kFirst + 1);
  ASSERT_THAT(saved_, SizeIs(1));
  EXPECT_EQ(saved_[0].line, line_.name);
  EXPECT_EQ(saved_[0].name, line_.devices[1].name);
  EXPECT_EQ(saved_[0].reason, "corrupt");
  EXPECT_EQ(saved_[0].at, now_.wall);
  EXPECT_THAT(Texts(saved_[0].records), SizeIs(5));
  EXPECT_THAT(Texts(saved_[0].records).back(), HasSubstr("= corrupt"));
}

TEST_F(LineRecorderTest, ADeviceGoingOfflineIsSavedAsARecording) {
  Send("?A1\r");
  End(Outcome::no_reply);
  recorder_->OnDeviceState(kFirst, bus::DeviceState::degraded, "no_reply", Later());
  EXPECT_THAT(saved_, IsEmpty());
  recorder_->OnDeviceState(kFirst, bus::DeviceState::offline, "no_reply", Later());
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

TEST_F(LineRecorderTest, RecordingsAreOptional) {
  Make({});
  Send("?A1\r");
  End(Outcome::corrupt);
  EXPECT_THAT(Lines(), SizeIs(2));
}

TEST_F(LineRecorderTest, SecretsOfARequestAreMasked) {
  auto queue = recorder_->Subscribe({});
  SendSecret();
  End();
  const char* const shown =
      "03:00:00.001000 a > 3E 31 57 56 31 36 30 3A ** ** ** 3A ** ** 0D | >1WV160:***:**.";
  EXPECT_EQ(Lines().front(), shown);
  EXPECT_EQ(Texts(queue->Take()).front(), shown);
}

TEST_F(LineRecorderTest, AReplyToASecretIsMaskedInAnyPieces) {
  auto queue = recorder_->Subscribe({});
  for (const std::string_view echo :
       {kRequest, kRequest.substr(7), std::string_view("<1N: wrong password '724'"),
        std::string_view(">1WV160:7z24:5F\r"), std::string_view("724")}) {
    for (std::size_t cut = 0; cut <= echo.size(); ++cut) {
      SendSecret();
      if (cut > 0) Receive(echo.substr(0, cut));
      End();
      if (cut < echo.size()) Receive(echo.substr(cut));
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

TEST_F(LineRecorderTest, NoReasonQuotesTheReplyToASecret) {
  const char* const reason = "the device says: wrong password '724'";
  SendSecret();
  Receive("<1N: wrong password '724'");
  End(Outcome::refused, reason);
  Send("?A1\r");
  End(Outcome::refused, reason);
  recorder_->OnDeviceState(kFirst, bus::DeviceState::degraded, reason, Later());
  for (const std::string& line : Lines()) EXPECT_THAT(line, Not(HasSubstr("724"))) << line;
  Later(LineRecorder::kNoReasons);
  Send("?A1\r");
  End(Outcome::refused, "limit");
  EXPECT_THAT(Lines().back(), HasSubstr("limit"));
}

TEST_F(LineRecorderTest, MaskedBytesAreBounded) {
  SendSecret();
  for (int i = 0; i < 100'000; ++i) Receive("7");
  End(Outcome::partial);
  EXPECT_EQ(ReceivedText(), std::string(LineRecorder::kMostBytes - kRequest.size(), '*'));
}

TEST(LineRecorderOnALine, RecordsEveryExchange) {
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

TEST_F(LineRecorderTest, AListeningLineKeepsItsLatestMessages) {
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

TEST_F(LineRecorderTest, NoiseBetweenRequestsDisplacesNoExchange) {
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

config::Line ALine() {
  config::Line line;
  line.name = "bay-1";
  line.port = "/dev/ttyUSB0";
  line.protocol = "spabus";
  config::Device& device = line.devices.emplace_back();
  device.name = "feeder-1";
  device.protocol = "spabus";
  device.profile = "spaj140c";
  device.options.Set("password", std::string("SECRET"));
  device.options.Set("checksum", false);
  device.options.SetWritten("checksum", "off");
  device.options.SetWritten("asks", "all, and\nmore");
  return line;
}

TEST(TraceHead, NamesTheDevicesAndTheirOptions) {
  EXPECT_THAT(
      TraceHead(ALine()),
      ElementsAre("# line bay-1, port /dev/ttyUSB0 9600 8N1, protocol spabus",
                  "# device feeder-1, protocol spabus, profile spaj140c, set checksum=off"));
}

TEST(TraceHead, IsParsedBack) {
  EXPECT_EQ(ReadTracedDevice(TraceHead(ALine())[1]),
            (TracedDevice{"feeder-1", "spabus", "spaj140c", {"checksum=off"}}));
  for (const char* other : {"", "# line bay-1, protocol spabus", "# device feeder-1",
                            "# device , protocol spabus", "12:00:00.000000 a # device x"}) {
    EXPECT_EQ(ReadTracedDevice(other), std::nullopt) << other;
  }
}

constexpr WallTime kTimeOfDay = WallTime(4h + 5min + 6s + 123456us + 789ns);

TEST(ToText, EachKindOfRecordIsOneLine) {
  TraceRecord record{TraceRecord::Kind::sent, kTimeOfDay, "feeder-1", "3E ** 0D", ">*."};
  EXPECT_EQ(ToText(record), "04:05:06.123456 feeder-1 > 3E ** 0D | >*.");
  record.kind = TraceRecord::Kind::received;
  EXPECT_EQ(ToText(record), "04:05:06.123456 feeder-1 < 3E ** 0D | >*.");
  record.kind = TraceRecord::Kind::note;
  record.text = "offline: no_reply";
  EXPECT_EQ(ToText(record), "04:05:06.123456 feeder-1 # offline: no_reply");
  record.device.clear();
  EXPECT_EQ(ToText(record), "04:05:06.123456 - # offline: no_reply");
}

TEST(ToText, TheEndOfAnExchangeHasOutcomeRoundTripAndReason) {
  TraceRecord record{TraceRecord::Kind::end, kTimeOfDay, "feeder-1", {}, {}};
  record.outcome = Outcome::ok;
  record.round_trip = 19'840us;
  EXPECT_EQ(ToText(record), "04:05:06.123456 feeder-1 = ok, 19.8 ms");
  record.outcome = Outcome::no_reply;
  record.round_trip = {};
  record.text = "silence";
  EXPECT_EQ(ToText(record), "04:05:06.123456 feeder-1 = no_reply: silence");
}

TEST(ToText, TheDayDoesNotMatter) {
  const TraceRecord record{TraceRecord::Kind::note, kTimeOfDay + 24h * 20'000, "a", {}, "x"};
  EXPECT_EQ(ToText(record), "04:05:06.123456 a # x");
}

TEST(TraceQueue, WakesOncePerTake) {
  int woken = 0;
  TraceQueue queue([&] { ++woken; });
  queue.Push({});
  queue.Push({});
  EXPECT_EQ(woken, 1);
  EXPECT_EQ(queue.Take().size(), 2U);
  EXPECT_TRUE(queue.Take().empty());
  queue.Push({});
  EXPECT_EQ(woken, 2);
}

TEST(TraceQueue, ANoteReplacesDroppedRecords) {
  TraceQueue queue({});
  TraceRecord record;
  for (std::size_t i = 0; i < TraceQueue::kMostRecords + 7; ++i) {
    record.text = std::to_string(i);
    queue.Push(record);
  }
  const auto taken = queue.Take();
  ASSERT_EQ(taken.size(), TraceQueue::kMostRecords + 1);
  EXPECT_EQ(taken.front().text, "0");
  EXPECT_EQ(taken[TraceQueue::kMostRecords - 1].text, std::to_string(TraceQueue::kMostRecords - 1));
  EXPECT_EQ(taken.back().kind, TraceRecord::Kind::note);
  EXPECT_EQ(taken.back().text,
            "7 records were dropped, because the reader of the trace is too slow");
  queue.Push(record);
  EXPECT_EQ(queue.Take().size(), 1U) << "told once";
}

namespace fs = std::filesystem;

constexpr WallTime kTime =
    WallTime(std::chrono::sys_days(std::chrono::year(2026) / 11 / 21)) + (4h + 5min + 6s);

class RecordingsTest : public testing::Test {
 protected:
  RecordingsTest() : line_(ToyLine({ToyDevice("feeder-1", "A", {"1"})})) {
    std::string form = (fs::temp_directory_path() / "baudgate-recordings-XXXXXX").string();
    folder_ = mkdtemp(form.data());
    line_.name = "bay-1";
    line_.port = "/dev/ttyUSB0";
    line_.protocol = line_.devices[0].protocol = "spabus";
    line_.devices[0].profile = "spaj140c";
  }
  ~RecordingsTest() override { fs::remove_all(folder_); }

  void Begin(const fs::path& folder) {
    recordings_.emplace(folder, "1.2.3",
                        [this](const std::string& text) { warnings_.push_back(text); });
  }
  void Save(WallTime at, const char* reason = "corrupt") {
    const TraceRecord record{TraceRecord::Kind::sent, at, "feeder-1", "3E", ">"};
    recordings_->Save({line_.name, TraceHead(line_), line_.devices[0].name, reason, at, {record}});
  }
  void End() { recordings_.reset(); }
  std::vector<std::string> Files() const {
    std::vector<std::string> names;
    for (const auto& file : fs::directory_iterator(folder_)) {
      names.push_back(file.path().filename().string());
    }
    std::sort(names.begin(), names.end());
    return names;
  }
  std::string Read(const std::string& name) const {
    std::ostringstream text;
    text << std::ifstream(folder_ / name).rdbuf();
    return text.str();
  }

  fs::path folder_;
  config::Line line_;
  std::vector<std::string> warnings_;
  std::optional<Recordings> recordings_;
};

TEST_F(RecordingsTest, AFileHasAHeaderWithItsContext) {
  Begin(folder_);
  Save(kTime);
  End();
  ASSERT_THAT(Files(), ElementsAre("bay-1-20261121T040506Z-feeder-1-corrupt.trace"));
  const std::string text = Read(Files()[0]);
  EXPECT_THAT(text, HasSubstr("# baudgate 1.2.3"));
  EXPECT_THAT(text, HasSubstr("# line bay-1, port /dev/ttyUSB0 9600 8N1, protocol spabus\n"));
  EXPECT_THAT(text, HasSubstr("# device feeder-1, protocol spabus, profile spaj140c\n"));
  EXPECT_THAT(text, HasSubstr("baudgate decode --device feeder-1 "
                              "bay-1-20261121T040506Z-feeder-1-corrupt.trace\n"));
  EXPECT_THAT(text, HasSubstr("\n04:05:06.000000 feeder-1 > 3E | >\n"));
  std::istringstream lines(text);
  int records = 0;
  for (std::string line; std::getline(lines, line);) records += line.starts_with('#') ? 0 : 1;
  EXPECT_EQ(records, 1);
}

TEST_F(RecordingsTest, TheFolderIsCreated) {
  Begin(folder_ / "a" / "b");
  Save(kTime);
  End();
  EXPECT_TRUE(fs::exists(folder_ / "a" / "b" / "bay-1-20261121T040506Z-feeder-1-corrupt.trace"));
}

TEST_F(RecordingsTest, NamesCanNotLeaveTheFolder) {
  line_.name = "../bay/1";
  line_.devices[0].name = "ü\n..";
  Begin(folder_);
  Save(kTime);
  End();
  EXPECT_THAT(Files(), ElementsAre("___bay_1-20261121T040506Z-_____-corrupt.trace"));
}

TEST_F(RecordingsTest, TheOldestFilesOfALineAreDeleted) {
  const std::vector<std::string> others = {
      "bay-1-1-20200101T000000Z-x-corrupt.trace",  // a file of line "bay-1-1"
      "bay-1-notes.trace", "bay-1-20200101T000000Z-x-corrupt.txt", "readme"};
  for (const std::string& name : others) std::ofstream(folder_ / name) << "x";
  Begin(folder_);
  for (int i = 0; i < 30; ++i) {
    Save(kTime + i * 1h);
    if (i % 10 == 9) {
      End();
      Begin(folder_);
    }
  }
  End();
  EXPECT_THAT(Files(), SizeIs(others.size() + Recordings::kFilesPerLine));
  for (const std::string& name : others) EXPECT_TRUE(fs::exists(folder_ / name)) << name;
  EXPECT_FALSE(fs::exists(folder_ / "bay-1-20261121T130506Z-feeder-1-corrupt.trace"));
  EXPECT_TRUE(fs::exists(folder_ / "bay-1-20261121T140506Z-feeder-1-corrupt.trace"));
  EXPECT_TRUE(fs::exists(folder_ / "bay-1-20261122T090506Z-feeder-1-corrupt.trace"));
}

TEST_F(RecordingsTest, AnUnwritableFolderIsReported) {
  const fs::path blocked = folder_ / "file";
  std::ofstream(blocked) << "not a folder";
  Begin(blocked / "recordings");
  Save(kTime);
  Save(kTime + 1min);
  End();
  ASSERT_THAT(warnings_, Not(IsEmpty()));
  EXPECT_THAT(warnings_.back(), HasSubstr(blocked.string()));
  EXPECT_THAT(warnings_.back(), HasSubstr("Not a directory"));
}

TEST_F(RecordingsTest, ARecordingRefusedByAFullDiskIsRetried) {
  const fs::path part = folder_ / ".bay-1.trace.part";
  fs::create_symlink("/dev/full", part);
  Begin(folder_);
  Save(kTime);
  while (fs::is_symlink(part)) std::this_thread::yield();
  End();
  ASSERT_THAT(warnings_, SizeIs(2));
  EXPECT_THAT(warnings_[0], HasSubstr("the disk is full"));
  EXPECT_EQ(warnings_[1], "") << "it is over";
  EXPECT_THAT(Files(), SizeIs(1));
}

TEST_F(RecordingsTest, TheFolderIsChosenByTheConfiguration) {
  config::Config config;
  unsetenv("STATE_DIRECTORY");
  EXPECT_EQ(Recordings::FolderOf(config), "");
  setenv("STATE_DIRECTORY", "/var/lib/baudgate:/var/lib/other", 1);
  EXPECT_EQ(Recordings::FolderOf(config), "/var/lib/baudgate/recordings");
  config.recordings = "/srv/traces";
  EXPECT_EQ(Recordings::FolderOf(config), "/srv/traces");
  unsetenv("STATE_DIRECTORY");
}

}  // namespace
}  // namespace baudgate::records
