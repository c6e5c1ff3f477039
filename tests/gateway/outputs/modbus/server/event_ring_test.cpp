// Test of the event registers over TCP: pymodbus reads them while new events replace the oldest.
// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>
#include <stdio.h>
#include <sys/wait.h>

#include <atomic>
#include <nlohmann/json.hpp>
#include <random>

#include "tests/gateway/outputs/modbus/server/server_fixture.h"

namespace baudgate::modbus {
namespace {

using ::testing::SizeIs;
using Json = nlohmann::json;

class EventRing : public ServerTest {
 protected:
  static constexpr std::int64_t kLast = 3000;

  EventRing() {
    feed_->Renumber({{"", "own"}});
    links_.events = feed_;
  }
  ~EventRing() override {
    stop_ = true;
    if (events_.joinable()) events_.join();
  }

  static bool IsOwn(std::int64_t seq) { return seq % 3 != 1 || seq == kLast; }
  static std::uint32_t CodeOf(std::int64_t seq) { return static_cast<std::uint32_t>(seq * 70'001); }

  void Happen(std::size_t count) {
    std::vector<events::EventRecord> happened;
    for (; count > 0 && seq_ < kLast; --count) {
      events::EventRecord record;
      record.seq = ++seq_;
      record.code = CodeOf(seq_);
      record.device = IsOwn(seq_) ? "own" : "another";
      happened.push_back(record);
    }
    feed_->Add(happened);
  }
  void GoOn() {
    std::mt19937 random(7);
    std::uint64_t requests = 0;
    while (seq_ < kLast && !stop_) {
      const std::uint64_t now = server_->counters().requests;
      if (now == std::exchange(requests, now)) {
        std::this_thread::yield();
        continue;
      }
      Happen(random() % 24);
    }
  }
  Json Read(int unit) {
    StartServer();
    Happen(100);  // more than the 40 events of the ring, so some are lost
    events_ = std::thread([this] { GoOn(); });
    const std::string command = "/usr/bin/python3 tests/system/pymodbus_events.py " +
                                std::to_string(server_->port()) + " " + std::to_string(unit) +
                                " 1 " + std::to_string(kLast);
    FILE* output = ::popen(command.c_str(), "r");
    std::string text;
    for (char piece[4096]; ::fgets(piece, sizeof piece, output) != nullptr;) text += piece;
    const int status = ::pclose(output);
    EXPECT_TRUE(WIFEXITED(status) && WEXITSTATUS(status) == 0)
        << "pymodbus (python3-pymodbus) did not do its part";
    return Json::parse(text, nullptr, false);
  }

  std::shared_ptr<events::EventFeed> feed_ =
      std::make_shared<events::EventFeed>(events::FeedLimits{.events = 40, .remembered = 1000});
  std::int64_t seq_ = 0;
  std::atomic<bool> stop_ = false;
  std::thread events_;
};

TEST_F(EventRing, OfADeviceReportsEachLostEvent) {
  const Json told = Read(1);
  ASSERT_TRUE(told.is_object());
  EXPECT_THAT(told["wrong"], SizeIs(0)) << told["wrong"];
  EXPECT_GT(told["oldest"].size(), 100U) << "the ring did not go on";
  std::int64_t before = 0;
  for (std::size_t i = 0; i < told["numbers"].size(); ++i) {
    const std::int64_t number = told["numbers"][i];
    EXPECT_GT(number, before);
    EXPECT_TRUE(IsOwn(number)) << number;
    EXPECT_EQ(told["codes"][i], CodeOf(number)) << "half of another";
    before = number;
  }
  std::int64_t own = 0;
  for (std::int64_t seq = 1; seq <= kLast; ++seq) own += IsOwn(seq) ? 1 : 0;
  const auto seen = static_cast<std::int64_t>(told["numbers"].size());
  EXPECT_EQ(seen + told["lost"].get<std::int64_t>(), own);
  EXPECT_GT(seen, own / 4);
}

TEST_F(EventRing, OfTheGatewayContainsTheEventsOfAllDevices) {
  const Json told = Read(255);
  ASSERT_TRUE(told.is_object());
  EXPECT_THAT(told["wrong"], SizeIs(0)) << told["wrong"];
  const auto seen = static_cast<std::int64_t>(told["numbers"].size());
  EXPECT_EQ(seen + told["lost"].get<std::int64_t>(), kLast);
  EXPECT_GT(told["lost"], 0);
}

}  // namespace
}  // namespace baudgate::modbus
