// What journald gets of a text: a datagram with its line, device and outcome as fields.
// SPDX-License-Identifier: Apache-2.0
#include <fcntl.h>
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cstdlib>

#include "gateway/base/log_outlet.h"
#include "tests/support/journald.h"

namespace baudgate::log {
namespace {

using ::testing::HasSubstr;
using ::testing::MatchesRegex;
using ::testing::Not;
using ::testing::StartsWith;

TEST(Journal, AMessageHasItsFields) {
  EXPECT_EQ(JournalMessage(Level::warning, {"bay", "relay", "no_reply"}, "offline"),
            "MESSAGE=offline\nPRIORITY=4\nSYSLOG_IDENTIFIER=baudgate\nLINE=bay\nDEVICE=relay\n"
            "OUTCOME=no_reply\n");
  EXPECT_EQ(JournalMessage(Level::info, {}, "runs"),
            "MESSAGE=runs\nPRIORITY=6\nSYSLOG_IDENTIFIER=baudgate\n");
}

/// Nobody writes a field of ours into a text: LINE=other stays part of the message.
TEST(Journal, LinesInAValueMakeNoField) {
  const std::string message = JournalMessage(Level::error, {}, "a\nLINE=other");
  EXPECT_THAT(message, HasSubstr(std::string("MESSAGE\n\x0C\0\0\0\0\0\0\0a\nLINE=other\n", 29)));
}

TEST(Journal, NobodyThere) {
  const Journal journal("/nowhere/socket");
  EXPECT_FALSE(journal.Send(Level::info, {}, "runs"));
  EXPECT_FALSE(Journal(std::string(200, 'x')).Send(Level::info, {}, "runs"));
}

TEST(Journal, AnInheritedVariableIsNotEnough) {
  struct stat info {};
  ASSERT_EQ(::fstat(STDERR_FILENO, &info), 0);
  ::setenv("JOURNAL_STREAM", "1:2", 1);
  EXPECT_FALSE(IsJournal(STDERR_FILENO)) << "our output goes elsewhere";
  ::setenv("JOURNAL_STREAM", fmt::format("{}:{}", info.st_dev, info.st_ino).c_str(), 1);
  EXPECT_TRUE(IsJournal(STDERR_FILENO));
  ::unsetenv("JOURNAL_STREAM");
  EXPECT_FALSE(IsJournal(STDERR_FILENO));
}

TEST(Log, LinesThatNobodyTakesAreCounted) {
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
  EXPECT_EQ(Dropped(), before + 1);
}

TEST(Log, ALineHasItsLocalTimeAndLevel) {
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

/// The log as the program uses it.
TEST(Journal, TheLogGoesThereWithAllItKnows) {
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
  EXPECT_THAT(repeat, StartsWith("MESSAGE=once more at "));
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

}  // namespace
}  // namespace baudgate::log
