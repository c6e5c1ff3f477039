// Tests the topic of events with a subscriber on Fast DDS and one on Cyclone DDS
// (tests/system/cyclone/cyclone_events.c).
// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>
#include <stdio.h>
#include <sys/wait.h>

#include <map>
#include <string>
#include <vector>

#include "tests/gateway/outputs/dds/fixture.h"

namespace baudgate::dds {
namespace {

using testing::Published;
using testing::TestDomain;
using testing::TestSubscriber;

EventSample Event(std::uint64_t seq, const std::string& device) {
  return {.gateway = "substation-7",
          .device = device,
          .seq = seq,
          .device_time_ns = 1795224874250000000,
          .receive_time_ns = 1795224874300000000,
          .clock_quality = 2,
          .channel = 3,
          .code = static_cast<std::uint32_t>(100'000 + seq),
          .text = "stage I> started: " + std::to_string(seq)};
}

class Events {
 public:
  std::unique_ptr<DdsSubscriber> Listen() {
    SubscriberCallbacks callbacks = heard_.Callbacks();
    callbacks.on_event = [this](const EventSample& event, const Origin&) {
      const std::lock_guard lock(mutex_);
      of_[event.device].push_back(event);
      changed_.notify_all();
    };
    auto subscriber = DdsSubscriber::Create(TestSubscriber(), std::move(callbacks));
    EXPECT_TRUE(subscriber.ok()) << subscriber.error();
    return subscriber.ok() ? std::move(*subscriber) : nullptr;
  }
  bool WaitFor(const std::string& device, std::size_t count) {
    std::unique_lock lock(mutex_);
    return changed_.wait_for(lock, std::chrono::seconds(30),
                             [&] { return of_[device].size() >= count; });
  }
  std::vector<EventSample> Of(const std::string& device) {
    const std::lock_guard lock(mutex_);
    return of_[device];
  }

 private:
  Published heard_;
  std::mutex mutex_;
  std::condition_variable changed_;
  std::map<std::string, std::vector<EventSample>> of_;
};

TEST(EventTopic, LateSubscribersGetTheNewestThousandOfEachDevice) {
  auto writer =
      CreateFastWriter(TestSubscriber().participant, {.points = 10, .devices = 2, .events = 2});
  ASSERT_TRUE(writer.ok()) << writer.error();
  for (std::uint64_t seq = 1; seq <= 1300; ++seq) {
    ASSERT_EQ((*writer)->Write(Event(seq, seq == 7 ? "quiet" : "busy")), Sent::yes) << seq;
  }
  Events events;
  const auto subscriber = events.Listen();
  ASSERT_NE(subscriber, nullptr);
  ASSERT_TRUE(events.WaitFor("busy", 1000)) << events.Of("busy").size();
  ASSERT_TRUE(events.WaitFor("quiet", 1)) << "another's newer ones have pushed it out";
  const auto busy = events.Of("busy");
  ASSERT_EQ(busy.size(), 1000U);
  for (std::size_t i = 0; i < busy.size(); ++i) {
    ASSERT_EQ(busy[i], Event(301 + i, "busy")) << i;
  }
  ASSERT_EQ((*writer)->Write(Event(1301, "quiet")), Sent::yes);
  ASSERT_TRUE(events.WaitFor("quiet", 2));
  EXPECT_EQ(events.Of("quiet")[1], Event(1301, "quiet"));
}

TEST(EventTopic, IsReadByAnotherVendor) {
  auto writer =
      CreateFastWriter(TestSubscriber().participant, {.points = 10, .devices = 2, .events = 2});
  ASSERT_TRUE(writer.ok()) << writer.error();
  for (std::uint64_t seq = 1; seq <= 300; ++seq) {
    ASSERT_EQ((*writer)->Write(Event(seq, "feeder-1")), Sent::yes);
  }
  const std::string command = std::string(CYCLONE_EVENTS) + " --domain " +
                              std::to_string(TestDomain()) + " --seconds 30 --count 400";
  FILE* output = ::popen(command.c_str(), "r");
  ASSERT_NE(output, nullptr);
  std::uint64_t seq = 0;
  for (char line[512]; ::fgets(line, sizeof line, output) != nullptr;) {
    ++seq;
    const std::string number = std::to_string(seq);
    EXPECT_EQ(line, number + " feeder-1 2 3 " + std::to_string(100'000 + seq) +
                        " stage I> started: " + number + "\n");
    if (seq == 300) {
      for (std::uint64_t more = 301; more <= 400; ++more) {
        EXPECT_EQ((*writer)->Write(Event(more, "feeder-1")), Sent::yes);
      }
    }
  }
  EXPECT_EQ(seq, 400U);
  const int status = ::pclose(output);
  EXPECT_TRUE(WIFEXITED(status) && WEXITSTATUS(status) == 0);
}

TEST(EventTopic, RefusesEventsWithoutEventsInTheConfiguration) {
  auto writer = CreateFastWriter(TestSubscriber().participant, {.points = 10, .devices = 2});
  ASSERT_TRUE(writer.ok()) << writer.error();
  EXPECT_EQ((*writer)->Write(Event(1, "feeder-1")), Sent::refused);
}

}  // namespace
}  // namespace baudgate::dds
