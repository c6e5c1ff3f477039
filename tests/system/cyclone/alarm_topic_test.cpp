// Tests the topic of alarms with a subscriber on Fast DDS and one on Cyclone DDS
// (tests/system/cyclone/cyclone_alarms.c).
// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>
#include <stdio.h>
#include <sys/wait.h>

#include <map>
#include <set>
#include <string>

#include "tests/gateway/outputs/dds/fixture.h"

namespace baudgate::dds {
namespace {

using testing::Published;
using testing::TestDomain;
using testing::TestSubscriber;

AlarmSample Alarm(std::uint64_t number, std::uint16_t state) {
  const std::string name = std::to_string(number);
  return {.gateway = "substation-7",
          .line = "bay-1",
          .device = "feeder-1",
          .name = "0:" + name,
          .point = "",
          .state = state,
          .priority = 3,
          .seq = 1000 + number,
          .raised_time_ns = 1795224874250000000,
          .changed_time_ns = 1795224874300000000,
          .text = "stage " + name,
          .acknowledged_by = state == 2 ? "user:anna" : ""};
}

TEST(AlarmTopic, LateSubscribersGetTheLatestStateOfEachAlarm) {
  auto writer =
      CreateFastWriter(TestSubscriber().participant, {.points = 10, .devices = 2, .events = 2});
  ASSERT_TRUE(writer.ok()) << writer.error();
  constexpr std::uint64_t kAlarms = 5000;  // more alarms than one DDS writer accepts
  for (std::uint64_t number = 1; number <= kAlarms; ++number) {
    ASSERT_EQ((*writer)->Write(Alarm(number, 1)), Sent::yes) << number;
  }
  ASSERT_EQ((*writer)->Write(Alarm(7, 2)), Sent::yes);
  std::mutex mutex;
  std::condition_variable changed;
  std::map<std::string, AlarmSample> states;
  Published heard;
  SubscriberCallbacks callbacks = heard.Callbacks();
  callbacks.on_alarm = [&](const AlarmSample& alarm, const Origin&) {
    const std::lock_guard lock(mutex);
    states[alarm.name] = alarm;
    changed.notify_all();
  };
  const auto subscriber = DdsSubscriber::Create(TestSubscriber(), std::move(callbacks));
  ASSERT_TRUE(subscriber.ok()) << subscriber.error();
  std::unique_lock lock(mutex);
  ASSERT_TRUE(changed.wait_for(lock, std::chrono::seconds(30), [&] {
    return states.size() == kAlarms;
  })) << states.size();
  EXPECT_EQ(states["0:7"], Alarm(7, 2));
  EXPECT_EQ(states["0:8"], Alarm(8, 1));
  ASSERT_EQ((*writer)->Write(Alarm(8, 0)), Sent::yes);
  ASSERT_TRUE(
      changed.wait_for(lock, std::chrono::seconds(30), [&] { return states["0:8"].state == 0; }));
}

TEST(AlarmTopic, IsReadByAnotherVendor) {
  auto writer =
      CreateFastWriter(TestSubscriber().participant, {.points = 10, .devices = 2, .events = 2});
  ASSERT_TRUE(writer.ok()) << writer.error();
  ASSERT_EQ((*writer)->Write(Alarm(1, 1)), Sent::yes);
  ASSERT_EQ((*writer)->Write(Alarm(1, 2)), Sent::yes);
  ASSERT_EQ((*writer)->Write(Alarm(2, 3)), Sent::yes);
  const std::string command = std::string(CYCLONE_ALARMS) + " --domain " +
                              std::to_string(TestDomain()) + " --seconds 30 --count 3";
  FILE* output = ::popen(command.c_str(), "r");
  ASSERT_NE(output, nullptr);
  std::multiset<std::string> lines;
  for (char line[512]; ::fgets(line, sizeof line, output) != nullptr;) {
    lines.insert(line);
    if (lines.size() != 2) continue;
    EXPECT_EQ((*writer)->Write(Alarm(1, 0)), Sent::yes);
  }
  EXPECT_EQ(lines, (std::multiset<std::string>{"1001 bay-1 feeder-1 0:1 - 0 3 - stage 1\n",
                                               "1001 bay-1 feeder-1 0:1 - 2 3 user:anna stage 1\n",
                                               "1002 bay-1 feeder-1 0:2 - 3 3 - stage 2\n"}));
  const int status = ::pclose(output);
  EXPECT_TRUE(WIFEXITED(status) && WEXITSTATUS(status) == 0);
}

TEST(AlarmTopic, RefusesAlarmsWithoutEventsInTheConfiguration) {
  auto writer = CreateFastWriter(TestSubscriber().participant, {.points = 10, .devices = 2});
  ASSERT_TRUE(writer.ok()) << writer.error();
  EXPECT_EQ((*writer)->Write(Alarm(1, 1)), Sent::refused);
}

}  // namespace
}  // namespace baudgate::dds
