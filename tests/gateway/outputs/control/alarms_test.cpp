// Alarms over the control socket: pages, and whom an acknowledgement means.
// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>

#include "gateway/outputs/control/request_handler.h"
#include "tests/gateway/outputs/control/fixture.h"

namespace baudgate::control {
namespace {

using events::AckQuery;
using ::testing::HasSubstr;

struct FakeEvents final : events::EventSource {
  events::EventsState state() const override {
    events::EventsState state;
    state.in_memory = in_memory;
    return state;
  }
  std::vector<events::Alarm> Alarms() const override { return alarms; }
  std::size_t Acknowledge(const AckQuery& query,
                          std::function<void(const events::Acknowledged&)> done) override {
    asked = query;
    const auto meant = static_cast<std::size_t>(std::ranges::count_if(
        alarms, [&query](const events::Alarm& alarm) { return query.Means(alarm); }));
    done({meant, ""});
    return meant;
  }
  Result<events::Page> Read(const events::PageQuery&) const override { return events::Page(); }
  Result<events::PastPage> ReadPast(const events::PastQuery&) const override {
    return events::PastPage();
  }

  void Add(std::int64_t seq, const std::string& device, const std::string& point) {
    events::Alarm alarm;
    alarm.line = "bay-1";
    alarm.device = device;
    alarm.point = point;
    alarm.state = events::AlarmState::active;
    alarm.seq = seq;
    alarms.push_back(alarm);
  }
  std::vector<events::Alarm> alarms;
  bool in_memory = false;
  AckQuery asked;
};

class AlarmsTest : public ::testing::Test {
 protected:
  AlarmsTest() {
    events_.Add(9, "feeder-1", "current");
    events_.Add(4, "feeder-1", "");
    events_.Add(5, "removed", "current");
  }
  Json Ask(const std::string& command, const std::string& more) {
    std::string later;
    const Reply reply =
        service_.Answer(R"({"command":")" + command + "\"" + more + "}", {"user:anna", 1}, kNow,
                        [&later](const std::string& text) { later = text; });
    return Json::parse(reply.text.empty() ? later : reply.text);
  }
  Json Ack(const std::string& target) { return Ask("ack", R"(,"target":")" + target + "\""); }

  FakeEvents events_;
  config::Config config_ = TwoLines();
  PointStore store_{config_};
  FakeLines lines_{store_};
  GatewayInfo Info() {
    GatewayInfo info{"1.2.3", kStarted};
    info.events = &events_;
    return info;
  }
  RequestHandler service_{config_, store_, lines_, lines_, Info()};
};

TEST_F(AlarmsTest, AreListedByTheirEvents) {
  const Json page = Ask("alarms", "");
  ASSERT_EQ(page["records"].size(), 3U);
  EXPECT_EQ(page["records"][0]["seq"], 4);
  EXPECT_EQ(page["records"][0]["state"], "active");
  EXPECT_EQ(page["next"], 9);
  EXPECT_EQ(page["more"], false);
  EXPECT_EQ(Ask("alarms", ",\"after\":5")["records"].size(), 1U);
  for (int i = 0; i < 300; ++i) events_.Add(10 + i, "feeder-2", "current");
  const Json first = Ask("alarms", "");
  EXPECT_EQ(first["records"].size(), events::kPage);
  EXPECT_EQ(first["more"], true);
  const Json second = Ask("alarms", ",\"after\":" + first["next"].dump());
  EXPECT_EQ(second["records"].size(), 303U - events::kPage);
  EXPECT_EQ(second["more"], false);
}

TEST_F(AlarmsTest, AreAcknowledgedByDevicePointOrEvent) {
  EXPECT_EQ(Ack("bay-1.feeder-1")["acknowledged"], 2);
  EXPECT_EQ(events_.asked.by, "user:anna");
  EXPECT_EQ(Ack("bay-1.feeder-1.current")["acknowledged"], 1);
  EXPECT_EQ(Ack("5")["acknowledged"], 1);
  EXPECT_EQ(Ack("bay-1.removed")["acknowledged"], 1) << "not configured any more";
  EXPECT_EQ(Ack("bay-1.feeder-2")["acknowledged"], 0) << "it has none";
}

/// The names of a line, a unit behind a route, a server and the gateway, as `alarms` shows them.
TEST_F(AlarmsTest, AreAcknowledgedByTheNameThatIsShown) {
  EXPECT_EQ(Ack("bay-1")["acknowledged"], 0) << "the alarms of its devices are others";
  events_.Add(20, "", "");
  events_.Add(21, "unit-20", "");
  for (const char* device : {"unit-70", "10.0.0.9:502", ""}) {
    events_.Add(22, device, "");
    events_.alarms.back().line.clear();
  }
  for (const char* name : {"bay-1", "bay-1.unit-20", "unit-70", "10.0.0.9:502", "gateway"}) {
    EXPECT_EQ(Ack(name)["acknowledged"], 1) << name;
  }
}

/// There are alarms of the gateway itself, and no events.
TEST_F(AlarmsTest, AreThereWithoutEvents) {
  events_.in_memory = true;
  EXPECT_EQ(Ask("alarms", "")["records"].size(), 3U);
  EXPECT_EQ(Ask("events", "")["error"], "unavailable");
  EXPECT_EQ(Ask("status", "")["events"]["in_memory"], true);
}

TEST_F(AlarmsTest, SayWhatIsNoTarget) {
  EXPECT_EQ(Ack("77")["error"], "unknown");
  EXPECT_THAT(Ack("77")["message"].get<std::string>(), HasSubstr("event 77 has raised no alarm"));
  EXPECT_THAT(Ack("bay-7")["message"].get<std::string>(), HasSubstr("bay-7"));
  EXPECT_THAT(Ack("")["message"].get<std::string>(), HasSubstr("write LINE, LINE.DEVICE"));
  EXPECT_EQ(Ack("bay-1.nobody")["error"], "unknown");
  EXPECT_EQ(Ack("bay-1.feeder-1.nothing")["error"], "unknown");
  EXPECT_EQ(Ack("a.b.c.d")["error"], "unknown");
}

}  // namespace
}  // namespace baudgate::control
