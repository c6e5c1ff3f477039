// Tests of `Speaker`, for a device that sends unasked, and of `EventBacklog`, its unsaved events.
// SPDX-License-Identifier: Apache-2.0
#include "gateway/bus/jobs/unasked.h"

#include <gtest/gtest.h>

#include "gateway/base/text.h"
#include "tests/support/virtual_line.h"

namespace baudgate::bus {
namespace {

constexpr Now kNow{Instant() + 1h, WallTime(1'790'000'000s)};

/// Sends unasked messages: "7" is a value of point 0, "9" a value of a point that does not exist,
/// "E" an event, "?" is damaged. 2 s after the last message, the value of point 0 becomes 0.
class Talker final : public protocols::Conversation {
 public:
  std::span<const protocols::Query> Queries() const override { return {}; }
  Result<protocols::Request> Ask(const protocols::Task&, Instant) override {
    return Error{"it is not asked"};
  }
  protocols::Answer OnFrame(const protocols::Task&, const protocols::Request&, View,
                            Instant) override {
    return {};
  }
  Outcome Check(View, View) const override { return Outcome::unexpected; }
  protocols::Answer Interpret(View, View) override { return {}; }

  const protocols::Standing* Listens() const override { return &standing_; }
  protocols::Answer OnUnasked(View message, Now received) override {
    protocols::Answer answer;
    for (const char character : AsText(message)) {
      if (character == '?') answer = {.outcome = Outcome::corrupt, .reason = "noise"};
      if (character == '7') answer.readings.push_back({0, std::int64_t{7}});
      if (character == '9') answer.readings.push_back({1, std::int64_t{9}});
      if (character != 'E') continue;
      answer.batch = answer.batch.value_or(protocols::EventBatch{});
      answer.batch->events.push_back({.code = 1});
    }
    due_ = received.instant + 2s;
    return answer;
  }
  std::optional<Instant> DueAt() const override { return due_; }
  protocols::Answer OnDue(Now) override {
    due_.reset();
    protocols::Answer answer;
    answer.readings.push_back({0, std::int64_t{0}});
    return answer;
  }

 private:
  protocols::Standing standing_;
  std::optional<Instant> due_;
};

const protocols::Protocol& TalkerProtocol() {
  static const protocols::Protocol protocol = [] {
    protocols::Protocol p = ToyProtocol();
    p.make_conversation = [](const config::Device&, const protocols::ParsedOptions&,
                             protocols::Bus*) -> std::unique_ptr<protocols::Conversation> {
      return std::make_unique<Talker>();
    };
    return p;
  }();
  return protocol;
}

class SpeakerTest : public ::testing::Test {
 protected:
  SpeakerTest() { line_.devices[1].protocol = "talker"; }

  static const protocols::Protocol& Find(const std::string& name) {
    return name == "talker" ? TalkerProtocol() : ToyProtocol();
  }
  Speaker::Said Say(std::string_view text, Duration since = {}) {
    return speaker().OnMessage({ToBytes(text), since}, kNow);
  }
  Speaker& speaker() {
    if (!speaker_) speaker_.emplace(roster());
    return *speaker_;
  }
  Roster& roster() {
    if (!roster_) roster_.emplace(line_, 0, Find);
    return *roster_;
  }

  config::Line line_ = ToyLine({ToyDevice("a", "A", {"1"}), ToyDevice("b", "B", {"1"})});
  std::optional<Roster> roster_;
  std::optional<Speaker> speaker_;
};

TEST_F(SpeakerTest, TheDeviceThatSendsUnaskedIsFound) {
  EXPECT_EQ(speaker().device(), &roster().device(1));
  EXPECT_NE(speaker().standing(), nullptr);
  EXPECT_TRUE(speaker().in_use());
  roster().device(1).in_use = false;
  EXPECT_FALSE(speaker().in_use());
}

TEST_F(SpeakerTest, ALineWithoutAnUnaskedSenderHasNoSpeaker) {
  line_.devices[1].protocol = "toy";
  EXPECT_EQ(speaker().device(), nullptr);
  EXPECT_EQ(speaker().standing(), nullptr);
  EXPECT_FALSE(speaker().in_use());
  EXPECT_EQ(speaker().DueAt(), std::nullopt);
  EXPECT_FALSE(speaker().OnTimer(kNow));
  EXPECT_FALSE(speaker().drained());
}

TEST_F(SpeakerTest, AMessageYieldsItsSamplesAndEvents) {
  struct Row {
    const char* text;
    Outcome outcome;
    std::size_t samples;
    std::size_t events;
  };
  const Row kRows[] = {
      {"7", Outcome::ok, 1, 0},      {"E", Outcome::ok, 0, 1},  {"7EE", Outcome::ok, 1, 2},
      {"9", Outcome::ok, 0, 0},      {"79", Outcome::ok, 1, 0}, {"", Outcome::ok, 0, 0},
      {"?", Outcome::corrupt, 0, 0},
  };
  for (const Row& row : kRows) {
    SCOPED_TRACE(row.text);
    const Speaker::Said said = Say(row.text, 20ms);
    EXPECT_EQ(said.outcome, row.outcome);
    EXPECT_EQ(said.reason, row.outcome == Outcome::ok ? "" : "noise");
    EXPECT_EQ(said.received.instant, kNow.instant - 20ms);
    EXPECT_EQ(said.received.wall, kNow.wall - 20ms);
    EXPECT_EQ(said.samples.size(), row.samples);
    EXPECT_EQ(said.lost, 0U);
    EXPECT_EQ(said.warning, "");
    ASSERT_EQ(said.events.has_value(), row.events > 0);
    if (!said.events) continue;
    EXPECT_EQ(said.events->device, 1U);
    EXPECT_EQ(said.events->batch.events.size(), row.events);
    EXPECT_EQ(said.events->received.instant, kNow.instant - 20ms);
    EXPECT_EQ(said.events->oldest, std::nullopt);
  }
}

TEST_F(SpeakerTest, TwoSecondsOfSilenceYieldASample) {
  EXPECT_FALSE(speaker().OnTimer(kNow));
  Say("7");
  EXPECT_EQ(speaker().DueAt(), kNow.instant + 2s);
  EXPECT_FALSE(speaker().OnTimer({kNow.instant + 1999ms, kNow.wall + 1999ms}));
  const Now due{kNow.instant + 2s, kNow.wall + 2s};
  const auto said = speaker().OnTimer(due);
  ASSERT_TRUE(said);
  EXPECT_EQ(said->received.instant, due.instant);
  ASSERT_EQ(said->samples.size(), 1U);
  EXPECT_EQ(ToText(said->samples[0].value), "0");
  EXPECT_FALSE(speaker().OnTimer(due));
}

TEST_F(SpeakerTest, ADeviceOutOfUseYieldsNoSampleAfterSilence) {
  Say("7");
  roster().device(1).in_use = false;
  EXPECT_EQ(speaker().DueAt(), std::nullopt);
  EXPECT_FALSE(speaker().OnTimer({kNow.instant + 2s, kNow.wall + 2s}));
}

TEST_F(SpeakerTest, TheSpeakerIsDrainedWhenAllEventsAreStored) {
  EXPECT_TRUE(speaker().drained());
  Say("E");
  Say("7");
  Say("EE");
  EXPECT_FALSE(speaker().drained());
  speaker().OnKept();
  EXPECT_FALSE(speaker().drained());
  speaker().OnKept();
  EXPECT_TRUE(speaker().drained());
}

TEST_F(SpeakerTest, EventsBeyondTheBacklogAreLostAndCountedInTheNextBatch) {
  for (std::size_t i = 0; i < EventBacklog::kMost; ++i) ASSERT_TRUE(Say("E").events);
  struct Row {
    const char* text;
    bool kept_before;
    std::size_t events;
    std::size_t lost;
    bool warns;
    const char* told;
  };
  const Row kRows[] = {
      {"EE", false, 0, 2, true, ""},
      {"7E", false, 0, 1, false, ""},
      {"7", false, 0, 0, false, ""},
      {"EE", true, 3, 0, false, "lost before this event, because the disk failed: 3 events"},
      {"E", true, 1, 0, false, ""},
      {"E", false, 0, 1, true, ""},
      {"E", true, 2, 0, false, "lost before this event, because the disk failed: 1 event"},
  };
  for (const Row& row : kRows) {
    SCOPED_TRACE(row.text);
    if (row.kept_before) speaker().OnKept();
    const Speaker::Said said = Say(row.text);
    EXPECT_EQ(said.lost, row.lost);
    EXPECT_EQ(!said.warning.empty(), row.warns);
    EXPECT_EQ(said.events ? said.events->batch.events.size() : 0, row.events);
    EXPECT_EQ(said.events ? said.events->batch.events.front().text : "", row.told);
  }
}

}  // namespace
}  // namespace baudgate::bus
