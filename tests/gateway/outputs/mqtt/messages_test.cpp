// Tests of the topics and payloads.
// SPDX-License-Identifier: Apache-2.0
#include "gateway/outputs/mqtt/messages.h"

#include <gmock/gmock.h>

#include <cmath>

#include "tests/gateway/outputs/mqtt/fixture.h"

namespace baudgate::mqtt {
namespace {

constexpr WallTime kTime = WallTime(1'790'000'000'250ms);

TEST(Topics, FollowThePattern) {
  const struct {
    std::string pattern;
    std::string topic;
    std::string filter;
    bool own;
  } kCases[] = {
      {"{prefix}/{gateway}/{line}/{device}/{point}", "plant/north/gate/bay/feeder/current",
       "plant/north/gate/+/+/+", true},
      {"{prefix}/{gateway}/{device}.{point}", "plant/north/gate/feeder.current",
       "plant/north/gate/+", true},
      {"site/{device}/values/{point}/now", "site/feeder/values/current/now", "site/+/values/+/now",
       false},
  };
  config::Config config = testing::GatewayConfig();
  config.mqtt.prefix = "plant/north";
  for (const auto& [pattern, topic, filter, own] : kCases) {
    config.mqtt.topic = pattern;
    const Topics topics(config);
    EXPECT_EQ(topics.Of("bay", "feeder", "current"), topic);
    EXPECT_EQ(topics.Filter(), filter);
    EXPECT_EQ(topics.filter_is_own(), own) << pattern;
    EXPECT_EQ(topics.Own("status"), "plant/north/gate/status");
  }
}

TEST(PointPayload, NeverShowsABadValueAsAValue) {
  const Reading kBad{12.25, {Quality::bad_sensor_failure, Reason::open_sensor}, kTime};
  const struct {
    Reading reading;
    std::string json;
    std::string value;
  } kCases[] = {
      {{12.25, Quality::good, kTime},
       R"({"value":12.25,"quality":"good","reason":"","time":"2026-09-21T14:13:20.250Z","unit":"A","seq":7})",
       "12.25"},
      {kBad,
       R"({"value":null,"quality":"bad","reason":"sensor failure, open sensor","time":"2026-09-21T14:13:20.250Z","unit":"A","seq":7})",
       "unavailable"},
      {{12.25, Quality::uncertain_last_usable, kTime},
       R"({"value":12.25,"quality":"uncertain","reason":"last usable","time":"2026-09-21T14:13:20.250Z","unit":"A","seq":7})",
       "unavailable"},
      {{{}, Quality::bad_waiting, {}},
       R"({"value":null,"quality":"bad","reason":"waiting for initial data","time":null,"unit":"A","seq":7})",
       "unavailable"},
      {{std::nan(""), Quality::good, kTime},
       R"({"value":null,"quality":"good","reason":"","time":"2026-09-21T14:13:20.250Z","unit":"A","seq":7})",
       "null"},
      {{std::string("a \"b\"\xFF"), Quality::good, kTime},
       "{\"value\":\"a \\\"b\\\"\xEF\xBF\xBD\",\"quality\":\"good\",\"reason\":\"\",\"time\":"
       "\"2026-09-21T14:13:20.250Z\",\"unit\":\"A\",\"seq\":7}",
       "a \"b\"\xFF"},
      {{true, Quality::good, kTime},
       R"({"value":true,"quality":"good","reason":"","time":"2026-09-21T14:13:20.250Z","unit":"A","seq":7})",
       "true"},
      {{std::uint64_t{18'446'744'073'709'551'615U}, Quality::good, kTime},
       R"({"value":18446744073709551615,"quality":"good","reason":"","time":"2026-09-21T14:13:20.250Z","unit":"A","seq":7})",
       "18446744073709551615"},
  };
  for (const auto& [reading, json, value] : kCases) {
    EXPECT_EQ(PointPayload(config::Mqtt::Payload::json, "A", reading, 7), json);
    EXPECT_EQ(PointPayload(config::Mqtt::Payload::value, "A", reading, 7), value);
  }
}

TEST(AlarmsPayload, HasTheWorstAlarmsFirstAndIsBounded) {
  std::vector<events::Alarm> alarms(kMostAlarms + 5);
  for (std::size_t i = 0; i < alarms.size(); ++i) {
    alarms[i].state = events::AlarmState::acknowledged;
    alarms[i].seq = static_cast<std::int64_t>(i);
  }
  alarms[3].state = events::AlarmState::active;
  const std::string payload = AlarmsPayload(alarms);
  EXPECT_THAT(payload, ::testing::StartsWith(R"([{"seq":3,"state":"active")"));
  EXPECT_THAT(payload, ::testing::Not(::testing::HasSubstr("\"seq\":0,")));
  EXPECT_EQ(AlarmsPayload({}), "[]");
}

}  // namespace
}  // namespace baudgate::mqtt
