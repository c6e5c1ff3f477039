// Tests of `WriteGate`: the order of its rules, and that a refused write sends nothing.
// SPDX-License-Identifier: Apache-2.0
#include "gateway/bus/writes/write_gate.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>

#include "gateway/bus/writes/write_command.h"
#include "tests/support/keeping_sink.h"
#include "tests/support/times.h"

namespace baudgate::bus {
namespace {

using config::Access;
using config::Type;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Optional;
using Why = WriteDenial::Why;

config::Point MakePoint(const std::string& name, Type type, Access access) {
  config::Point point;
  point.name = name;
  point.type = type;
  point.access = access;
  point.writing.allowed = access != Access::read;
  return point;
}

enum : std::uint32_t { kCurrent, kSetting, kScaled, kTrip, kClosed, kLocal, kOff };

config::Config MakeConfig() {
  config::Device device;
  device.name = "feeder";
  device.points = {MakePoint("current", Type::float32, Access::read),
                   MakePoint("setting", Type::float32, Access::read_write),
                   MakePoint("scaled", Type::int16, Access::read_write),
                   MakePoint("trip", Type::boolean, Access::write),
                   MakePoint("close", Type::boolean, Access::write),
                   MakePoint("local", Type::boolean, Access::read),
                   MakePoint("off", Type::uint16, Access::read_write)};
  device.points[kSetting].writing.min = 0.5;
  device.points[kSetting].writing.max = 40;
  device.points[kScaled].scale = 0.1;
  device.points[kScaled].offset = -5;
  device.points[kTrip].writing.select = true;
  device.points[kClosed].writing.allow_when = {
      {"line.feeder.local", Value(false), Value(), 0, kLocal}};
  device.points[kOff].writing.allowed = false;
  config::Config config;
  config.lines.resize(1);
  config.lines[0].name = "line";
  config.lines[0].devices = {device};
  return config;
}

class WriteGateTest : public testing::Test {
 protected:
  std::optional<Why> Write(std::vector<WriteAsk::Part> parts, const Writer& writer = kAnna,
                           bool confirmed = false) {
    WriteAsk ask;
    ask.parts = std::move(parts);
    ask.without_selection = confirmed;
    ask.deadline = now_ + 5s;
    ask.done = [](const WriteResult&) {};
    const auto denial = gate_.Submit(writer, std::move(ask), now_);
    text_ = denial ? denial->text : "";
    if (!denial) return std::nullopt;
    return denial->why;
  }
  void Show(std::uint32_t point, const Value& value, Quality quality = Quality::good) {
    const Sample sample{point, value, quality};
    store_.Update(0, {&sample, 1}, {now_, {}}, 10ms);
  }
  template <typename Change>
  void Configure(std::uint32_t point, Change change) {
    config::Line line = *store_.LineAt(0);
    change(line.devices[0].points[point].writing);
    store_.Reconfigure(0, std::make_shared<const config::Line>(line));
  }

  static inline const Writer kAnna{"192.0.2.5:40312", 1};
  static inline const Writer kBert{"192.0.2.6:40312", 2};

  config::Config config_ = MakeConfig();
  PointStore store_{config_};
  KeepingSink sink_;
  WriteGate gate_{store_, sink_};
  Instant now_ = kStart;
  std::string text_;
};

TEST_F(WriteGateTest, AnAllowedWritePasses) {
  Show(kSetting, 0.9);
  EXPECT_EQ(Write({{kSetting, static_cast<double>(30.3F)}}), std::nullopt);
  ASSERT_EQ(sink_.commands.size(), 1U);
  const WriteCommand& command = sink_.commands[0];
  EXPECT_EQ(command.client, "192.0.2.5:40312");
  EXPECT_EQ(command.deadline, kStart + 5s);
  EXPECT_EQ(command.why_not, nullptr);
  ASSERT_EQ(command.writes().size(), 1U);
  EXPECT_EQ(command.writes()[0].point, kSetting);
  EXPECT_EQ(command.writes()[0].raw, Value(30.3)) << "as it was meant";
  EXPECT_EQ(command.writes()[0].before, Value(0.9));
  EXPECT_THAT(sink_.denied, IsEmpty());
}

TEST_F(WriteGateTest, ABadValueIsNotReportedAsTheValueBefore) {
  Show(kSetting, 0.9);
  Show(kSetting, 0.9, Quality::bad_device_failure);
  EXPECT_EQ(Write({{kSetting, 30.0}}), std::nullopt);
  EXPECT_EQ(sink_.commands.at(0).writes()[0].before, Value());
}

TEST_F(WriteGateTest, ScaleAndOffsetAreRemoved) {
  EXPECT_EQ(Write({{kScaled, std::int64_t{25}}}), std::nullopt);
  EXPECT_EQ(sink_.commands.at(0).writes()[0].raw, Value(std::int64_t{300}));
  EXPECT_EQ(sink_.commands.at(0).writes()[0].shown, Value(std::int64_t{25}));
}

TEST_F(WriteGateTest, OneForbiddenPointRefusesTheWholeCommand) {
  EXPECT_EQ(Write({{kSetting, 1.0}, {kCurrent, 1.0}}), Why::read_only);
  EXPECT_EQ(text_, "'current' can only be read");
  EXPECT_EQ(Write({{kOff, std::int64_t{1}}}), Why::read_only);
  EXPECT_EQ(text_,
            "'off' may not be written: add it to 'write' of the device in the configuration");
  EXPECT_THAT(sink_.commands, IsEmpty());
  ASSERT_EQ(sink_.denied.size(), 3U) << "a record of each point";
  EXPECT_TRUE(sink_.denied[0].counts);
  EXPECT_FALSE(sink_.denied[1].counts) << "one write";
  EXPECT_EQ(sink_.denied[0].client, "192.0.2.5:40312");
  EXPECT_EQ(sink_.denied[0].point, kSetting);
  EXPECT_EQ(sink_.denied[0].value, Value(1.0));
  EXPECT_EQ(sink_.denied[0].reason, "'current' can only be read");
}

TEST_F(WriteGateTest, ValuesOutsideLimitsOrTypeAreRefused) {
  EXPECT_EQ(Write({{kSetting, 40.1}}), Why::value);
  EXPECT_THAT(text_, HasSubstr("'setting': 40.1 is above the maximum"));
  EXPECT_EQ(Write({{kScaled, 1e9}}), Why::value) << "no int16";
  EXPECT_EQ(Write({{kTrip, 2.0}}), Why::value) << "neither on nor off";
  EXPECT_THAT(sink_.commands, IsEmpty());
}

TEST_F(WriteGateTest, ATrippingPointNeedsASelection) {
  EXPECT_EQ(Write({{kTrip, true}}), Why::not_selected);
  EXPECT_THAT(text_, HasSubstr("has to be selected"));
  EXPECT_EQ(gate_.Select(kAnna, 0, kTrip, now_), std::nullopt);
  now_ += 9s;
  EXPECT_EQ(Write({{kTrip, true}}, kBert), Why::not_selected);
  EXPECT_THAT(text_, HasSubstr("by another client"));
  EXPECT_EQ(Write({{kTrip, true}}), std::nullopt);
  EXPECT_EQ(Write({{kTrip, true}}), Why::not_selected) << "a selection is for one write";
  gate_.Select(kAnna, 0, kTrip, now_);
  now_ += 10s;
  EXPECT_EQ(Write({{kTrip, true}}), Why::not_selected);
  EXPECT_THAT(text_, HasSubstr("ended 10s after"));
  EXPECT_EQ(sink_.commands.size(), 1U);
  EXPECT_EQ(sink_.denied.size(), 4U);
}

TEST_F(WriteGateTest, ASelectionIsUsedUpByARefusedWrite) {
  gate_.Select(kAnna, 0, kTrip, now_);
  EXPECT_EQ(Write({{kTrip, true}, {kSetting, 99.0}}), Why::value);
  EXPECT_EQ(Write({{kTrip, true}}), Why::not_selected);
  gate_.Select(kAnna, 0, kTrip, now_);
  gate_.Forget(kAnna);
  EXPECT_EQ(Write({{kTrip, true}}), Why::not_selected) << "its client has left";
}

TEST_F(WriteGateTest, AConfirmedWriteNeedsNoSelection) {
  EXPECT_EQ(Write({{kTrip, true}}, kAnna, true), std::nullopt);
  EXPECT_EQ(Write({{kSetting, 99.0}}, kAnna, true), Why::value) << "and nothing else with it";
}

TEST_F(WriteGateTest, AForbiddenPointCannotBeSelected) {
  EXPECT_EQ(gate_.Select(kAnna, 0, kOff, now_)->why, Why::read_only);
}

struct Lock {
  const char* name;
  std::optional<Value> shown;
  Quality quality;
  bool open;
};
class Interlocks : public WriteGateTest, public testing::WithParamInterface<Lock> {};

TEST_P(Interlocks, OpenOnlyForTheGoodValue) {
  if (GetParam().shown) Show(kLocal, *GetParam().shown, GetParam().quality);
  const auto refused = Write({{kClosed, true}});
  EXPECT_EQ(refused, GetParam().open ? std::nullopt : std::optional(Why::locked));
  EXPECT_THAT(
      text_,
      HasSubstr(GetParam().open ? "" : "'close' is locked by allow_when: line.feeder.local is "));
  EXPECT_EQ(sink_.commands.size(), GetParam().open ? 1U : 0U);
}

INSTANTIATE_TEST_SUITE_P(All, Interlocks,
                         testing::Values(Lock{"RequiredValue", Value(false), Quality::good, true},
                                         Lock{"AnotherValue", Value(true), Quality::good, false},
                                         Lock{"Uncertain", Value(false), Quality::uncertain, false},
                                         Lock{"Bad", Value(false), Quality::bad_sensor_failure,
                                              false},
                                         Lock{"NeverRead", std::nullopt, Quality::good, false}),
                         [](const auto& info) { return std::string(info.param.name); });

TEST_F(WriteGateTest, TheInterlockIsCheckedAgainWhenTheWriteIsSent) {
  Show(kLocal, false);
  ASSERT_EQ(Write({{kClosed, true}}), std::nullopt);
  ASSERT_NE(sink_.commands.at(0).why_not, nullptr);
  EXPECT_EQ(sink_.commands[0].why_not(now_), std::nullopt);
  Show(kLocal, true);
  EXPECT_THAT(sink_.commands[0].why_not(now_),
              Optional(::testing::Field(&Withheld::why, HasSubstr("is true, but must be false"))));
}

TEST_F(WriteGateTest, AnInterlockMayGuardOnlyOneValue) {
  Configure(kClosed, [](config::Writing& writing) { writing.allow_when[0].only = true; });
  EXPECT_EQ(Write({{kClosed, true}}), Why::locked);
  EXPECT_EQ(Write({{kClosed, false}}), std::nullopt);
  EXPECT_EQ(sink_.commands.at(0).why_not(now_), std::nullopt);
}

TEST_F(WriteGateTest, AnInterlockComparesTheDecimalOfAFloat32) {
  Configure(kSetting, [](config::Writing& writing) {
    writing.allow_when = {{"line.feeder.local", Value(false), Value(0.9), 0, kLocal}};
  });
  EXPECT_EQ(Write({{kSetting, static_cast<double>(0.9F)}}), Why::locked);
  EXPECT_EQ(sink_.denied.at(0).value, Value(0.9));
  EXPECT_EQ(Write({{kSetting, static_cast<double>(0.8F)}}), std::nullopt);
}

TEST_F(WriteGateTest, AnInterlockAgesLikeAnyValue) {
  Show(kLocal, false);
  now_ += 1h;
  EXPECT_EQ(Write({{kClosed, true}}), Why::locked) << "read an hour ago, at a poll of a second";
}

TEST_F(WriteGateTest, APointCanBeTheMaximumOfAnotherPoint) {
  Configure(kSetting, [](config::Writing& writing) {
    writing.max.reset();
    writing.max_point = std::string("current");
  });
  EXPECT_EQ(Write({{kSetting, 1.0}}), Why::locked) << "it was never read";
  EXPECT_THAT(text_, HasSubstr("its maximum is not known, because current is bad"));
  Show(kCurrent, 50.0);
  EXPECT_EQ(Write({{kSetting, 500.0}}), Why::value);
  EXPECT_THAT(text_, HasSubstr("500 is above the maximum, 50 (current)"));
  EXPECT_EQ(Write({{kSetting, 0.4}}), Why::value) << "the number holds as well";
  ASSERT_EQ(Write({{kSetting, 50.0}}), std::nullopt);
  const auto& why_not = sink_.commands.at(0).why_not;
  EXPECT_EQ(why_not(now_), std::nullopt);
  Show(kCurrent, 45.0);
  EXPECT_THAT(why_not(now_),
              Optional(::testing::Field(&Withheld::why, HasSubstr("50 is above the maximum, 45"))))
      << "before it is sent";
  Show(kCurrent, 50.0, Quality::uncertain);
  EXPECT_EQ(Write({{kSetting, 1.0}}), Why::locked);
  Show(kCurrent, 50.0);
  now_ += 1h;
  EXPECT_EQ(Write({{kSetting, 1.0}}), Why::locked) << "it is old";
}

TEST_F(WriteGateTest, APointCanBeTheMinimumOfAnotherPoint) {
  Configure(kSetting, [](config::Writing& writing) {
    writing.min.reset();
    writing.min_point = std::string("current");
  });
  Show(kCurrent, 10.0);
  EXPECT_EQ(Write({{kSetting, 9.0}}), Why::value);
  EXPECT_EQ(Write({{kSetting, 10.0}}), std::nullopt);
}

TEST_F(WriteGateTest, AFullQueueIsBusy) {
  sink_.full = true;
  EXPECT_EQ(Write({{kSetting, 1.0}}), Why::busy);
  EXPECT_THAT(sink_.denied, IsEmpty()) << "the sink knows itself";
}

using Taken = Selections::Verdict;

constexpr Selections::Point kTripOutput{0, 7};

TEST(Selections, AreValidOnceAndOnlyForTheirOwner) {
  Selections selections;
  EXPECT_EQ(selections.Take(1, kTripOutput, kStart), Taken::none);
  selections.Select(1, kTripOutput, kStart + 10s);
  EXPECT_EQ(selections.Take(2, kTripOutput, kStart + 1s), Taken::foreign);
  EXPECT_EQ(selections.Take(1, {0, 8}, kStart + 1s), Taken::none) << "another point";
  EXPECT_EQ(selections.Take(1, {1, 7}, kStart + 1s), Taken::none) << "another device";
  EXPECT_EQ(selections.Take(1, kTripOutput, kStart + 2s), Taken::selected);
  EXPECT_EQ(selections.Take(1, kTripOutput, kStart + 3s), Taken::none) << "used up";
}

TEST(Selections, ExpireAfterTheirTime) {
  Selections selections;
  selections.Select(1, kTripOutput, kStart + 10s);
  EXPECT_EQ(selections.Take(1, kTripOutput, kStart + 10s), Taken::expired);
  EXPECT_EQ(selections.Take(1, kTripOutput, kStart + 10s), Taken::none) << "told once";
  selections.Select(1, kTripOutput, kStart + 10s);
  selections.Select(1, kTripOutput, kStart + 20s);
  EXPECT_EQ(selections.Take(1, kTripOutput, kStart + 15s), Taken::selected) << "made anew";
  selections.Select(1, kTripOutput, kStart + 30s);
  EXPECT_EQ(selections.Take(2, kTripOutput, kStart + 31s), Taken::none) << "over for all";
}

TEST(Selections, TwoClientsMaySelectOnePoint) {
  Selections selections;
  selections.Select(1, kTripOutput, kStart + 10s);
  selections.Select(2, kTripOutput, kStart + 10s);
  EXPECT_EQ(selections.Take(2, kTripOutput, kStart), Taken::selected);
  EXPECT_EQ(selections.Take(1, kTripOutput, kStart), Taken::selected);
}

TEST(Selections, TheLongestSelectionOfOtherClientsCounts) {
  Selections selections;
  selections.Select(1, kTripOutput, kStart + 10s);
  selections.Select(2, kTripOutput, kStart + 60s);
  EXPECT_EQ(selections.Take(3, kTripOutput, kStart + 20s), Taken::foreign) << "the second holds";
  EXPECT_EQ(selections.Take(3, kTripOutput, kStart + 60s), Taken::none);
}

TEST(Selections, EndWithTheirClient) {
  Selections selections;
  selections.Select(1, kTripOutput, kStart + 10s);
  selections.Select(2, {0, 8}, kStart + 10s);
  selections.Forget(1);
  EXPECT_EQ(selections.Take(1, kTripOutput, kStart), Taken::none);
  EXPECT_EQ(selections.Take(2, {0, 8}, kStart), Taken::selected);
}

TEST(Selections, AreBounded) {
  Selections selections;
  for (std::uint32_t i = 0; i < 3 * Selections::kLimit; ++i) {
    selections.Select(i, {0, i}, kStart + i * 1ms);
  }
  EXPECT_EQ(selections.size(), Selections::kLimit);
  constexpr std::uint32_t kLast = 3 * Selections::kLimit - 1;
  EXPECT_EQ(selections.Take(kLast, {0, kLast}, kStart), Taken::selected) << "the last stay";
}

struct StateRow {
  WriteState state;
  const char* next;
  const char* ends;
};

TEST(WriteStates, AllowOnlyTheTransitionsAndEndsOfTheTable) {
  const StateRow kRows[] = {
      {WriteState::asked, "134", "busy not_sent denied "},
      {WriteState::queued, "234", "refused busy not_sent denied "},
      {WriteState::sent, "1234", "ok refused busy unknown "},
      {WriteState::reading_back, "14", "ok differs not_sent "},
      {WriteState::ended, "", ""},
  };
  for (const StateRow& row : kRows) {
    std::string next;
    for (std::size_t to = 0; to < kWriteStates; ++to) {
      if (MayFollow(row.state, static_cast<WriteState>(to))) next += std::to_string(to);
    }
    std::string ends;
    for (std::size_t i = 0; i < kWriteEnds; ++i) {
      const auto end = static_cast<WriteEnd>(i);
      if (MayEnd(row.state, end)) ends.append(Name(end)).append(" ");
    }
    EXPECT_EQ(next, row.next) << row.ends;
    EXPECT_EQ(ends, row.ends);
  }
}

}  // namespace
}  // namespace baudgate::bus
