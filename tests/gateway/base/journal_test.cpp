// Tests of the log: the fields for journald, the folding of repeated texts, and its thread.
// SPDX-License-Identifier: Apache-2.0
#include <fcntl.h>
#include <fmt/chrono.h>
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <csignal>
#include <cstdlib>
#include <string>

#include "gateway/base/log_outlet.h"
#include "tests/support/journald.h"

namespace baudgate::log {
namespace {

using ::testing::HasSubstr;
using ::testing::MatchesRegex;
using ::testing::Not;
using ::testing::StartsWith;

TEST(Journal, AMessageContainsItsFields) {
  EXPECT_EQ(JournalMessage(Level::warning, {"bay", "relay", "no_reply"}, "offline"),
            "MESSAGE=offline\nPRIORITY=4\nSYSLOG_IDENTIFIER=baudgate\nLINE=bay\nDEVICE=relay\n"
            "OUTCOME=no_reply\n");
  EXPECT_EQ(JournalMessage(Level::info, {}, "runs"),
            "MESSAGE=runs\nPRIORITY=6\nSYSLOG_IDENTIFIER=baudgate\n");
}

TEST(Journal, ALineBreakInAValueCreatesNoField) {
  const std::string message = JournalMessage(Level::error, {}, "a\nLINE=other");
  EXPECT_THAT(message, HasSubstr(std::string("MESSAGE\n\x0C\0\0\0\0\0\0\0a\nLINE=other\n", 29)));
}

TEST(Journal, SendingFailsWithoutAJournalSocket) {
  const Journal journal("/nowhere/socket");
  EXPECT_FALSE(journal.Send(Level::info, {}, "runs"));
  EXPECT_FALSE(Journal(std::string(200, 'x')).Send(Level::info, {}, "runs"));
}

TEST(Journal, JournalStreamMustMatchTheOwnOutput) {
  struct stat info {};
  ASSERT_EQ(::fstat(STDERR_FILENO, &info), 0);
  ::setenv("JOURNAL_STREAM", "1:2", 1);
  EXPECT_FALSE(IsJournal(STDERR_FILENO)) << "our output goes elsewhere";
  ::setenv("JOURNAL_STREAM", fmt::format("{}:{}", info.st_dev, info.st_ino).c_str(), 1);
  EXPECT_TRUE(IsJournal(STDERR_FILENO));
  ::unsetenv("JOURNAL_STREAM");
  EXPECT_FALSE(IsJournal(STDERR_FILENO));
}

TEST(Log, LinesThatCannotBeWrittenAreCounted) {
  Begin(Level::info);
  const std::uint64_t before = Dropped();
  const int kept = ::dup(STDERR_FILENO);
  const int full = ::open("/dev/full", O_WRONLY);
  ::dup2(full, STDERR_FILENO);
  Write(Level::info, "nobody reads this");
  Flush();
  ::dup2(kept, STDERR_FILENO);
  ::close(full);
  ::close(kept);
  EXPECT_EQ(Dropped(), before + 1);
  Write(Level::info, "this is read");
  Flush();
  EXPECT_EQ(Dropped(), before + 1);
}

TEST(Log, ALineBeginsWithLocalTimeAndLevel) {
  ForgetRepeats();
  Begin(Level::info);
  testing::internal::CaptureStderr();
  Warn({.line = "bay"}, "slow");
  Info("no trouble");
  Flush();
  EXPECT_THAT(testing::internal::GetCapturedStderr(),
              MatchesRegex("....-..-.. ..:..:..\\.... warning line bay: slow\n"
                           "....-..-.. ..:..:..\\.... info    no trouble\n"));
}

TEST(Journal, TheLogIsSentToTheJournalWithItsFields) {
  const Journald journald;
  journald.TakeLog();
  ForgetRepeats();

  const About relay{"bay", "relay", "no_reply"};
  Warn(relay, "offline ({} of {})", 3, 3);
  EXPECT_EQ(journald.Next(),
            "MESSAGE=line bay: device relay: offline (3 of 3)\nPRIORITY=4\n"
            "SYSLOG_IDENTIFIER=baudgate\nLINE=bay\nDEVICE=relay\nOUTCOME=no_reply\n");
  Warn(relay, "offline ({} of {})", 3, 3);
  EXPECT_EQ(journald.Next(), "") << "held back";
  TellRepeats();
  const std::string repeat = journald.Next();
  EXPECT_THAT(repeat, StartsWith("MESSAGE=repeated once at "));
  EXPECT_THAT(repeat, HasSubstr(": line bay: device relay: offline (3 of 3)\n"));
  EXPECT_THAT(repeat, HasSubstr("\nLINE=bay\nDEVICE=relay\nOUTCOME=no_reply\n"));
  Info("control socket {}", "/run/x");
  EXPECT_THAT(journald.Next(), Not(HasSubstr("LINE=")));
  for (int act = 0; act < 2; ++act) {
    Act(Level::info, "reload by {}", "user:anna");
    EXPECT_THAT(journald.Next(), HasSubstr("MESSAGE=reload by user:anna\n"));
  }
  for (const char* state : {"active", "active"}) {
    WriteAct(
        Level::warning,
        {.line = "bay", .device = "relay", .fields = {{"ALARM", "no answer"}, {"STATE", state}}},
        "alarm active");
    EXPECT_EQ(journald.Next(),
              "MESSAGE=line bay: device relay: alarm active\nPRIORITY=4\n"
              "SYSLOG_IDENTIFIER=baudgate\nLINE=bay\nDEVICE=relay\nALARM=no answer\n"
              "STATE=active\n");
  }
  SetLeast(Level::error);
  Info("nobody asked for it");
  EXPECT_EQ(journald.Next(), "");
}

Now At(Duration since) { return {Instant{} + 1h + since, WallTime{} + 1h + since}; }

TEST(LogFolder, ARepeatedTextIsHeldBackForAMinute) {
  Folder folder;
  EXPECT_TRUE(folder.Pass("online", Level::info, At(0s)));
  EXPECT_FALSE(folder.Pass("online", Level::info, At(59s)));
  EXPECT_TRUE(folder.Pass("offline", Level::warning, At(59s)));
  EXPECT_TRUE(folder.Pass("online", Level::info, At(61s)));
}

TEST(LogFolder, HeldBackRepeatsAreReportedAfterAMinute) {
  Folder folder;
  folder.Pass("offline", Level::warning, At(0s));
  folder.Pass("offline", Level::warning, At(10s));
  folder.Pass("offline", Level::warning, At(20s));
  EXPECT_TRUE(folder.Due(At(59s).instant).empty());
  const auto due = folder.Due(At(60s).instant);
  ASSERT_EQ(due.size(), 1U);
  EXPECT_EQ(due[0].text, "offline");
  EXPECT_EQ(due[0].level, Level::warning);
  EXPECT_EQ(due[0].times, 2);
  EXPECT_EQ(due[0].last.instant, At(20s).instant);
  EXPECT_TRUE(folder.Due(At(200s).instant).empty()) << "told once";
}

TEST(LogFolder, ARepeatReportsItsTimes) {
  const auto local = [](Duration since) {
    const std::time_t time = std::chrono::system_clock::to_time_t(
        std::chrono::time_point_cast<std::chrono::system_clock::duration>(At(since).wall));
    return fmt::format("{:%H:%M:%S}", fmt::localtime(time));
  };
  Folder folder;
  for (const Duration at : {0s, 5s, 30s, 58s}) folder.Pass("offline", Level::warning, At(at));
  folder.Pass("online", Level::info, At(6s));
  folder.Pass("online", Level::info, At(31s));
  const auto due = folder.Due(At(60s).instant);
  ASSERT_EQ(due.size(), 2U);
  EXPECT_EQ(RepeatText(due[0]), "repeated once at " + local(31s) + ": online");
  EXPECT_EQ(RepeatText(due[1]),
            "repeated 3 times between " + local(5s) + " and " + local(58s) + ": offline");
  for (const Duration at : {70s, 80s}) folder.Pass("offline", Level::warning, At(at));
  const auto next = folder.Due(At(120s).instant);
  ASSERT_EQ(next.size(), 1U);
  EXPECT_EQ(next[0].first.instant, At(70s).instant) << "each count has its own times";
}

TEST(LogFolder, AtTheEndAllHeldBackTextsAreReported) {
  Folder folder;
  folder.Pass("a: offline", Level::warning, At(0s));
  folder.Pass("a: online", Level::info, At(1s));
  folder.Pass("a: online", Level::info, At(2s));
  folder.Pass("a: offline", Level::warning, At(3s));
  const auto all = folder.All(At(4s).instant);
  ASSERT_EQ(all.size(), 2U);
  EXPECT_EQ(all[0].text, "a: online");
  EXPECT_EQ(all[1].text, "a: offline") << "the true state";
  EXPECT_TRUE(folder.All(At(4s).instant).empty()) << "told once";
}

TEST(LogFolder, TheLatestTextIsReportedLast) {
  Folder folder;
  folder.Pass("a: offline", Level::warning, At(0s));
  folder.Pass("z: online", Level::info, At(1s));
  folder.Pass("z: online", Level::info, At(20s));
  folder.Pass("a: offline", Level::warning, At(30s));
  const auto due = folder.Due(At(60s).instant);
  ASSERT_EQ(due.size(), 2U);
  EXPECT_EQ(due[0].text, "z: online");
  EXPECT_EQ(due[1].text, "a: offline") << "the log ends with the state in which things are";
}

TEST(LogFolder, ManyTextsTakeBoundedMemory) {
  Folder folder;
  for (int i = 0; i < 10'000; ++i) {
    folder.Pass("text " + std::to_string(i), Level::info, At(0s));
    folder.Pass("text " + std::to_string(i), Level::info, At(1s));
  }
  EXPECT_LE(folder.Due(At(60s).instant).size(), 256U);
}

TEST(LogFolder, TextsWithTheSameKeyAreRepeats) {
  Folder folder;
  EXPECT_TRUE(folder.Pass("10.0.0.7", "10.0.0.7:40112 refused", Level::warning, At(0s)));
  EXPECT_FALSE(folder.Pass("10.0.0.7", "10.0.0.7:40113 refused", Level::warning, At(1s)));
  EXPECT_FALSE(folder.Pass("10.0.0.7", "10.0.0.7:40114 refused", Level::warning, At(2s)));
  EXPECT_TRUE(folder.Pass("10.0.0.8", "10.0.0.8:40112 refused", Level::warning, At(3s)));
  const auto due = folder.Due(At(60s).instant);
  ASSERT_EQ(due.size(), 1U);
  EXPECT_EQ(due[0].text, "10.0.0.7:40114 refused");
  EXPECT_EQ(due[0].times, 2);
}

TEST(LogFolder, ManyKeysTakeBoundedMemoryAndLines) {
  Folder folder;
  constexpr int kStrangers = 10'000;
  int written = 0;
  for (int i = 0; i < kStrangers; ++i) {
    const std::string stranger = "stranger " + std::to_string(i);
    if (folder.Pass(stranger, stranger + " refused", Level::warning, At(0s))) ++written;
  }
  EXPECT_LE(written, 129);
  const auto due = folder.Due(At(60s).instant);
  ASSERT_EQ(due.size(), 1U) << "those that are too many are told together";
  EXPECT_EQ(due[0].text, "stranger 9999 refused");
  EXPECT_EQ(due[0].times, kStrangers - written);
}

TEST(LogFolder, ManyKeysTakeNoRoomFromTexts) {
  Folder folder;
  for (int i = 0; i < 10'000; ++i) {
    folder.Pass("stranger " + std::to_string(i), "refused", Level::warning, At(0s));
  }
  EXPECT_TRUE(folder.Pass("offline", Level::warning, At(1s)));
  EXPECT_FALSE(folder.Pass("offline", Level::warning, At(2s)));
}

TEST(LogFolder, ATextIsWrittenAtOnceWhenTheFolderIsFull) {
  Folder folder;
  for (int i = 0; i < 256; ++i) {
    folder.Pass("text " + std::to_string(i), Level::info, At(0s));
    folder.Pass("text " + std::to_string(i), Level::info, At(1s));
  }
  EXPECT_TRUE(folder.Pass("one more", Level::info, At(2s)));
  EXPECT_TRUE(folder.Pass("one more", Level::info, At(3s)));
  EXPECT_EQ(folder.Due(At(60s).instant).size(), 256U) << "nothing was forgotten for it";
  folder.Pass("one more", Level::info, At(200s));
  EXPECT_FALSE(folder.Pass("one more", Level::info, At(201s)));
}

// ---------------- A slow reader of the log never blocks the program.

/// A pipe of the smallest size, to log into. It is read only when the test calls ReadUntil.
class StalledReader {
 public:
  StalledReader() {
    EXPECT_EQ(::pipe2(ends_, O_CLOEXEC), 0);
    capacity_ = static_cast<std::size_t>(::fcntl(ends_[1], F_SETPIPE_SZ, 4096));
  }
  ~StalledReader() {
    ::close(ends_[0]);
    ::close(ends_[1]);
  }
  int descriptor() const { return ends_[1]; }
  std::string ReadUntil(const std::string& text) {
    std::string all;
    char buffer[512];
    while (all.find(text) == std::string::npos) {
      const ssize_t count = ::read(ends_[0], buffer, sizeof buffer);
      if (count <= 0) break;
      all.append(buffer, static_cast<std::size_t>(count));
    }
    return all;
  }
  void CloseReader() {
    ::close(ends_[0]);
    ends_[0] = -1;
  }
  void Fill() const {
    const std::string filler(capacity_, '#');
    EXPECT_EQ(::write(ends_[1], filler.data(), filler.size()), static_cast<ssize_t>(capacity_));
  }

 private:
  int ends_[2] = {-1, -1};
  std::size_t capacity_ = 0;
};

TEST(Outlet, WritesAllLinesInTheirOrder) {
  StalledReader reader;
  Outlet outlet(reader.descriptor());
  for (int n = 0; n < 100; ++n) outlet.Put("line " + std::to_string(n) + "\n");
  const std::string all = reader.ReadUntil("line 99\n");
  std::string expected;
  for (int n = 0; n < 100; ++n) expected += "line " + std::to_string(n) + "\n";
  EXPECT_EQ(all, expected);
  EXPECT_TRUE(outlet.Flush(10s));
  EXPECT_EQ(outlet.dropped(), 0u);
}

TEST(Outlet, DropsLinesWithoutRoomAndReportsTheirNumber) {
  StalledReader reader;
  reader.Fill();
  Outlet outlet(reader.descriptor(), 10000);
  const std::string line(99, 'x');
  for (int n = 0; n < 1000; ++n) outlet.Put(line + "\n");
  EXPECT_GE(outlet.dropped(), 1000u - 100u - 1u);
  EXPECT_FALSE(outlet.Flush(0s));
  outlet.Put(std::string(250, 'y') + "\n");
  const std::string text = std::to_string(outlet.dropped()) + " log lines were dropped here";
  const std::string all = reader.ReadUntil("was not read in time\n");
  EXPECT_NE(all.find(text), std::string::npos) << all.substr(all.size() - 200);
  EXPECT_EQ(all.find("yy"), std::string::npos);
  outlet.Put("later\n");
  EXPECT_EQ(reader.ReadUntil("later\n"), "later\n");
}

TEST(Outlet, EndsWhileItsThreadWaitsForAStalledReader) {
  StalledReader reader;
  {
    Outlet outlet(reader.descriptor(), 1000000);
    outlet.Put(std::string(100000, 'x') + "\n");
    EXPECT_FALSE(outlet.Flush(1ms));
  }
  EXPECT_EQ(reader.ReadUntil("\n").size(), 100001u);
}

TEST(Outlet, AClosedReaderDoesNotBlockIt) {
  signal(SIGPIPE, SIG_IGN);
  StalledReader reader;
  Outlet outlet(reader.descriptor());
  reader.CloseReader();
  outlet.Put("line\n");
  EXPECT_TRUE(outlet.Flush(10s));
  EXPECT_EQ(outlet.dropped(), 1u);
}

}  // namespace
}  // namespace baudgate::log
