// When the failures of a device began and ended, and what stood between.
// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>

#include <string>
#include <string_view>

#include "gateway/bus/points/device_status.h"

namespace baudgate {
namespace {

constexpr Instant kStart{1000s};

/// 'o' is answered, 'x' fails, each a second behind the other; '-' is a minute in which nothing is
/// asked.
FailureRuns After(std::string_view exchanges) {
  FailureRuns failures;
  Instant now = kStart;
  for (const char exchange : exchanges) {
    if (exchange == '-') {
      now += 59s;
    } else {
      failures.Add(exchange == 'o', now += 1s);
    }
  }
  return failures;
}

/// "2x3": three that failed, behind two that were answered; "2x3." is not over yet.
std::string ShownRuns(const FailureRuns& failures) {
  std::string text;
  for (const FailureRuns::Run& run : failures.runs()) {
    text += std::to_string(run.answered) + "x" + std::to_string(run.failed);
    text += run.after ? " " : ". ";
  }
  return text + std::to_string(failures.answered());
}

std::string Repeated(std::string_view part, int times) {
  std::string text;
  for (int i = 0; i < times; ++i) text += part;
  return text;
}

TEST(FailureRuns, StandBetweenAnswers) {
  const struct {
    std::string exchanges;
    std::string runs;
  } rows[] = {
      {"", "0"},
      {"ooo", "3"},
      {"xx", "0x2. 0"},
      {"ooxxxo", "2x3 1"},
      {"oxoxxoox", "1x1 1x2 2x1. 0"},
      {"x" + Repeated("o", 40) + "-----o", "41"},
      {"x" + Repeated("o", 20) + "-----o", "0x1 21"},
      {"x" + Repeated("o", 40) + "----o", "0x1 41"},
      {Repeated("ox", 20) + "o", Repeated("1x1 ", 16) + "1"},
  };
  for (const auto& row : rows)
    EXPECT_EQ(ShownRuns(After(row.exchanges)), row.runs) << row.exchanges;
}

TEST(FailureRuns, KnowTheirTimes) {
  const FailureRuns::Run run = After("ooxxxo").runs().front();
  EXPECT_EQ(run.before, kStart + 2s);
  EXPECT_EQ(run.first, kStart + 3s);
  EXPECT_EQ(run.last, kStart + 5s);
  EXPECT_EQ(run.after, kStart + 6s);
}

}  // namespace
}  // namespace baudgate
