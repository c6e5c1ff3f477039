// Which readings are kept.
// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <limits>

#include "gateway/records/history/recorder.h"

namespace baudgate::history {
namespace {

constexpr LogRule kPlain{};
const LogRule kHalf{.deadband = 0.5};
constexpr LogRule kEvery{.every = true};
constexpr double kInfinite = std::numeric_limits<double>::infinity();
const Quality kGood = Quality::good;
const Quality kOld = Quality::uncertain_last_usable;
const Quality kSilent = Quality::bad_communication;
const Quality kOpen = {Quality::bad_sensor_failure, Reason::open_sensor};

struct Row {
  const char* why;
  LogRule rule;
  Value from;
  Quality was;
  Value to;
  Quality is;
  Millis later;
  bool kept;
};

const Row kRows[] = {
    {"the same", kPlain, 1.0, kGood, 1.0, kGood, 1000, false},
    {"any change", kPlain, 1.0, kGood, 1.0000001, kGood, 1000, true},
    {"within the deadband", kHalf, 10.0, kGood, 10.4, kGood, 1000, false},
    {"just the deadband", kHalf, 10.0, kGood, 10.5, kGood, 1000, false},
    {"beyond it", kHalf, 10.0, kGood, 10.6, kGood, 1000, true},
    {"beyond it, downwards", kHalf, 10.0, kGood, 9.4, kGood, 1000, true},
    {"whole numbers, too", kHalf, std::int64_t{1}, kGood, std::int64_t{2}, kGood, 1000, true},
    {"a switch within a deadband", LogRule{.deadband = 2}, false, kGood, true, kGood, 1000, false},
    {"text has no deadband", kHalf, std::string("a"), kGood, std::string("b"), kGood, 1000, true},
    {"the same text", kHalf, std::string("a"), kGood, std::string("a"), kGood, 1000, false},
    {"from infinite to itself", kHalf, kInfinite, kGood, kInfinite, kGood, 1000, false},
    {"from infinite", kHalf, kInfinite, kGood, 1.0, kGood, 1000, true},
    {"quality within the deadband", kHalf, 1.0, kGood, 1.0, kOld, 1, true},
    {"quality back", kHalf, 1.0, kOld, 1.0, kGood, 1, true},
    {"another reason", kHalf, Value(), kSilent, Value(), kOpen, 1, true},
    {"bad as before", kPlain, Value(), kSilent, Value(), kSilent, 1000, false},
    {"before max_gap", kPlain, 1.0, kGood, 1.0, kGood, 10 * kMinute - 1, false},
    {"at max_gap", kPlain, 1.0, kGood, 1.0, kGood, 10 * kMinute, true},
    {"bad at max_gap", kPlain, Value(), kSilent, Value(), kSilent, 10 * kMinute, true},
    {"every reading", kEvery, 1.0, kGood, 1.0, kGood, 1, true},
};

TEST(LogRule, Table) {
  for (const Row& row : kRows) {
    const Entry last{5000, row.from, row.was};
    const Entry now{5000 + row.later, row.to, row.is};
    EXPECT_EQ(IsKept(row.rule, &last, now), row.kept) << row.why;
    EXPECT_TRUE(IsKept(row.rule, nullptr, now)) << row.why;
  }
}

}  // namespace
}  // namespace baudgate::history
