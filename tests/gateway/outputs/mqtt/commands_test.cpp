// Tests of commands: which are carried out, and what is answered.
// SPDX-License-Identifier: Apache-2.0
#include "gateway/outputs/mqtt/commands.h"

#include <gmock/gmock.h>

#include <nlohmann/json.hpp>

#include "tests/gateway/outputs/mqtt/fixture.h"
#include "tests/support/keeping_sink.h"

namespace baudgate::mqtt {
namespace {

using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::SizeIs;

class CommandsTest : public ::testing::Test {
 protected:
  /// Takes a command for the point of that number, and returns its answer; null: there is none yet.
  nlohmann::json Take(const std::string& payload, std::uint32_t point, bool retained = false) {
    commands_.Take("t", bus::PointRef{0, point}, {"t/set", payload, retained}, now_);
    return Answer();
  }
  nlohmann::json Answer() {
    const auto answers = commands_.TakeAnswers();
    if (answers.empty()) return nullptr;
    EXPECT_EQ(answers.front().topic, "t/result");
    return nlohmann::json::parse(answers.front().payload);
  }

  const config::Config config_ = testing::GatewayConfig();
  bus::PointStore store_{config_};
  KeepingSink sink_;
  int woken_ = 0;
  Now now_{Instant(1h), WallTime(1'790'000'000s)};
  Commands commands_{store_, sink_, "mqtt:baudgate-gate", [this] { ++woken_; }};
};

TEST_F(CommandsTest, AreRefusedByTheRulesOfEveryWrite) {
  const struct {
    std::string payload;
    std::uint32_t point;
    std::string reason;
    bool retained = false;
  } kCases[] = {
      {"1", 0, "read"},
      {"41", 1, "40"},
      {"abc", 1, "abc"},
      {"", 1, ""},
      {"null", 1, ""},
      {"true", 2, "confirm"},
      {"12", 1, "retained", true},
      {R"({"valu":12})", 1, "no value"},
      {R"({"value":12,"not_afer":"2026-01-01"})", 1, "no member"},
      {R"({"value":12,"not_after":"2026-01-01"})", 1, "after its time"},
      {R"({"value":12,"not_after":"soon"})", 1, "not_after"},
      {R"({"value":12,"confirm":"yes"})", 1, "no member"},
      {R"({"value":[12]})", 1, "no value"},
      {R"({"value":12)", 1, "not JSON"},
      {R"({"value":12,"value":13})", 1, "occurs twice"},
      {std::string(5000, '1'), 1, "too long"},
  };
  for (const auto& [payload, point, reason, retained] : kCases) {
    sink_.denied.clear();
    const auto answer = Take(payload, point, retained);
    ASSERT_TRUE(answer.is_object()) << payload;
    EXPECT_EQ(answer["result"], "denied") << payload;
    EXPECT_THAT(answer["reason"].get<std::string>(), HasSubstr(reason)) << payload;
    ASSERT_THAT(sink_.denied, SizeIs(1)) << "the audit records it: " << payload;
    EXPECT_EQ(sink_.denied[0].client, "mqtt:baudgate-gate");
  }
  EXPECT_THAT(sink_.commands, IsEmpty());
}

TEST_F(CommandsTest, ReachTheLineAndAreAnsweredAtTheirEnd) {
  const struct {
    std::string payload;
    std::uint32_t point;
    Value raw;
  } kCases[] = {
      {"12.5", 1, 12.5},
      {R"({"value":12.5,"id":"a"})", 1, 12.5},
      {R"({"value":"12.5"})", 1, 12.5},
      {R"({"value":12.0})", 1, 12.0},
      {R"({"value":true,"confirm":true,"not_after":"2027-01-01"})", 2, true},
      {R"({"value":0,"confirm":true})", 2, false},
  };
  for (const auto& [payload, point, raw] : kCases) {
    EXPECT_TRUE(Take(payload, point).is_null()) << payload;
    ASSERT_THAT(sink_.commands, SizeIs(1)) << payload;
    EXPECT_EQ(ToDouble(sink_.commands[0].writes()[0].raw), ToDouble(raw)) << payload;
    EXPECT_EQ(sink_.commands[0].client, "mqtt:baudgate-gate");
    sink_.commands[0].done({.end = WriteEnd::refused, .reason = "the device refuses"});
    sink_.commands.clear();
    const auto answer = Answer();
    EXPECT_EQ(answer["result"], "refused") << payload;
    EXPECT_EQ(answer["reason"], "the device refuses");
    EXPECT_EQ(answer.contains("id"), payload.find("id") != std::string::npos);
  }
  EXPECT_EQ(woken_, 6);
}

TEST_F(CommandsTest, ForNoPointAndAfterTheStopReachNoLine) {
  commands_.Take("t", std::nullopt, {"t/set", "1", false}, now_);
  EXPECT_THAT(Answer()["reason"].get<std::string>(), HasSubstr("no point"));
  sink_.full = true;
  EXPECT_EQ(Take("12", 1)["result"], "busy");
  sink_.full = false;
  commands_.Stop();
  EXPECT_TRUE(Take("12", 1).is_null());
  EXPECT_THAT(sink_.commands, IsEmpty());
}

}  // namespace
}  // namespace baudgate::mqtt
