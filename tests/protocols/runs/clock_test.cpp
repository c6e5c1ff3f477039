// Relays that are told the time by a line that works: what T and D say is the time at which their
// last character is through, and polls do not suffer.
// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <charconv>

#include "gateway/bus/poller/poller.h"
#include "tests/protocols/runs/rig.h"

namespace baudgate {
namespace {

class ClockRun : public ::testing::Test {
 protected:
  static config::OptionValue Period(Duration period) { return period.count(); }

  Rig rig_{RealLine("Spa9600"), [](config::Line& line) {
             for (config::Device& device : line.devices) {
               device.options.Set("send_seconds", Period(10s));
               device.options.Set("send_date", Period(1min));
             }
           }};

  /// How far what it says is from the time when its last character is through.
  Duration Error(const Sent& sent) const {
    constexpr Duration kCharacter = Duration(1s) / 960;  // 9600 bit/s, ten bits
    const std::size_t at = sent.text.rfind(':', sent.text.size() - 4) - 6;
    double said = 0;
    std::from_chars(sent.text.data() + at, sent.text.data() + at + 6, said);
    const auto characters = static_cast<std::int64_t>(sent.text.size());
    const WallTime end =
        rig_line_.now().wall - (rig_line_.now().instant - sent.at) + characters * kCharacter;
    const Duration minute = end.time_since_epoch() % Duration(1min);
    return std::chrono::abs(minute -
                            std::chrono::round<Duration>(std::chrono::duration<double>(said)));
  }
  VirtualLine& rig_line_ = rig_.line();
};

TEST_F(ClockRun, TellsItWhenTheClockIsRightAndAtTheMomentOfSending) {
  rig_.LearnTruth();
  rig_.Watch();
  rig_->RunFor(1min);
  EXPECT_EQ(rig_->CountSent(">900W"), 0U) << "nobody has said that the clock is right";
  rig_->poller().OnHostClock(true);
  rig_->sent.clear();
  rig_->RunFor(10min);
  EXPECT_NEAR(static_cast<double>(rig_->CountSent(">900WT")), 61, 1);
  EXPECT_NEAR(static_cast<double>(rig_->CountSent(">900WD")), 11, 1);
  for (const Sent& sent : rig_->sent) {
    if (sent.text.starts_with(">900W")) {
      EXPECT_LE(Error(sent), 1ms) << sent.text;
    }
  }
  EXPECT_EQ(rig_.wrong(), 0U);
  EXPECT_TRUE(rig_.AllGood());
  for (std::uint32_t i = 0; i < rig_.devices(); ++i) EXPECT_EQ(rig_->StatusOf(i).retries, 0U);

  rig_->poller().OnHostClock(false);
  rig_->sent.clear();
  rig_->RunFor(2min);
  EXPECT_EQ(rig_->CountSent(">900W"), 0U);
}

/// A relay that is late holds the line up before the message is sent, not behind its stamp.
TEST_F(ClockRun, IsRightBehindSilenceAndLateReplies) {
  rig_.LearnTruth();
  rig_->poller().OnHostClock(true);
  rig_->twin(1).manner.dead = true;
  rig_->twin(0).manner.think = 480ms;
  rig_->sent.clear();
  rig_->RunFor(5min);
  EXPECT_GE(rig_->CountSent(">900WT"), 20U);
  for (const Sent& sent : rig_->sent) {
    if (sent.text.starts_with(">900W")) {
      EXPECT_LE(Error(sent), 1ms) << sent.text;
    }
  }
}

}  // namespace
}  // namespace baudgate
