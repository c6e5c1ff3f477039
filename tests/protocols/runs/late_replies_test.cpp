// Devices that answer late, whole and right: once in three times, once in ten. What they say is
// used, inside the ceiling; beyond it nothing wrong is good, and that is all.
// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <cstdio>

#include "tests/protocols/runs/lag_rig.h"

namespace baudgate {
namespace {

class LateReplies : public ::testing::TestWithParam<LagCase> {
 protected:
  /// The share of good readings while every `nth` reply takes as long as `think`.
  double Share(unsigned nth, Duration think) {
    LagRig rig(GetParam(), 1, [](config::Line& line) {
      line.timing.reply = kReply;
      line.devices.resize(1);
      line.devices[0].poll = 1s;
    });
    unsigned count = 0;
    bool late = false;
    Instant free_at{};
    rig->server = [&](View request, Bytes reply, Instant end) {
      const bool is_late = late && !reply.empty() && ++count % nth == 0;
      auto pieces = rig.server().OnRequest(request, std::move(reply), end);
      if (pieces.empty()) return pieces;
      // No reply overtakes another.
      Duration& after = pieces.front().after;
      if (is_late) after = std::max(after, think);
      free_at = std::max(free_at, end + after);
      after = free_at - end;
      return pieces;
    };
    rig.Open();
    late = true;
    rig.RunFor(20s);
    rig.oracle().RestartAvailability();
    rig.RunFor(5min);
    EXPECT_EQ(rig.oracle().wrong(), 0U) << rig.oracle().what();
    return rig.oracle().Availability();
  }
  static constexpr Duration kReply = 300ms;
};

TEST_P(LateReplies, AreUsed) {
  const double third = Share(3, 450ms);
  const double tenth = Share(10, 450ms);
  std::printf("%-28s good: 1 in 3 late %.3f, 1 in 10 late %.3f\n", GetParam().name().c_str(), third,
              tenth);
  EXPECT_GE(third, 0.60);
  EXPECT_GE(tenth, 0.85);
}

/// The latest that is still inside: the reply has to be whole by then.
TEST_P(LateReplies, AreUsedUpToTheCeiling) {
  const config::Timing times = GetParam().setup.protocol->timing(GetParam().setup.serial);
  const Duration whole = *times.ceiling - *times.reply;  // its characters and gaps
  EXPECT_GE(Share(3, kReply + whole / 2), 0.60);
}

TEST_P(LateReplies, BeyondTheCeilingAreNeverWrong) { Share(3, 5s); }

std::vector<LagCase> LateCases() {
  std::vector<LagCase> cases;
  for (const LagCase& one : LagCases()) {
    if (one.CanProve() && one.proof == Proof::answered) cases.push_back(one);
  }
  return cases;
}

INSTANTIATE_TEST_SUITE_P(Lines, LateReplies, ::testing::ValuesIn(LateCases()), LagCaseName);

}  // namespace
}  // namespace baudgate
