// The events of the whole program: a relay's twin that forgets what it has told, a gateway that is
// killed in bursts of events, and what `baudgate events` says.
// $BAUDGATE_EVENT_KILLS: how often, 5 if not given.
// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>
#include <sys/resource.h>

#include <algorithm>
#include <csignal>
#include <random>

#include "tests/support/long_run.h"
#include "tests/system/event_station.h"

namespace baudgate::system_test {
namespace {

using ::testing::HasSubstr;
using ::testing::StartsWith;

using Events = EventStation;

TEST_F(Events, AreTold) {
  const auto relay = StartRelay("every:300ms,count=2,numbered");
  const auto daemon = StartDaemon(Yaml());
  ASSERT_TRUE(Eventually([&] { return Records().size() >= 6; })) << Ask().errors;
  const Json first = Records().front();
  const std::vector<std::string> fields = {"seq",   "receive_time", "device_time", "clock_quality",
                                           "line",  "device",       "channel",     "code",
                                           "state", "text",         "record"};
  EXPECT_EQ(first.size(), fields.size());
  for (const std::string& field : fields) EXPECT_TRUE(first.contains(field)) << field;
  EXPECT_EQ(first["seq"], 1);
  EXPECT_EQ(first["line"], "bay");
  EXPECT_EQ(first["device"], "bay-1");
  EXPECT_EQ(first["channel"], 0);
  EXPECT_EQ(first["code"], 1);
  EXPECT_EQ(first["state"], "on");
  EXPECT_EQ(first["text"], "stage I> started: 1");
  EXPECT_TRUE(first["clock_quality"].is_number_unsigned());
  EXPECT_THAT(first["receive_time"].get<std::string>(), StartsWith("20"));
  EXPECT_EQ(Records().back()["clock_quality"], 2) << "the relay's time, which the minute fits";

  EXPECT_EQ(Records({"--from", "3"}).front()["seq"], 3);
  EXPECT_GE(Records({"--device", "bay-1"}).size(), 6U);
  EXPECT_GE(Records({"--device", "bay.bay-1", "--since", "1h"}).size(), 6U);
  EXPECT_TRUE(Records({"--since", "2200-01-01"}).empty());
  const Finished unknown = Ask({"--device", "bay-7"});
  EXPECT_EQ(unknown.code, 2);
  EXPECT_THAT(unknown.errors, HasSubstr("there is no device 'bay-7'"));
  EXPECT_THAT(Ask().output, HasSubstr("stage I> started: 1"));
  EXPECT_THAT(Ask({"--csv"}).output,
              StartsWith("seq,receive_time,device_time,clock_quality,line,device,channel,code,"
                         "state,text,record\r\n1,20"));
  EXPECT_EQ(Ask({"--csv", "--json"}).code, 2);
  const Json status = Status()["events"];
  EXPECT_EQ(status["state"], "fine");
  EXPECT_GE(status["newest"].get<int>(), 6);

  const auto follower =
      Start({"events", "--follow", "--json", "--from", "1000000", "--socket", socket()});
  const auto all = Start({"events", "--follow", "--json", "--socket", socket()});
  const auto newest = Status()["events"]["newest"].get<int>();
  EXPECT_TRUE(Eventually([&] {
    return all->Output().find("\"seq\":" + std::to_string(newest + 2) + ",") != std::string::npos;
  }));
  EXPECT_EQ(follower->Output(), "");
  all->Signal(SIGINT);
  EXPECT_EQ(all->WaitForEnd(), 0);
}

/// What the relay has recorded of a start is read behind it, and stands with it.
TEST_F(Events, HaveTheirRecords) {
  const auto relay = StartRelay("every:4s");
  const auto daemon = StartDaemon(Yaml());
  Json record;
  ASSERT_TRUE(Eventually([&] {
    for (const Json& one : Records()) {
      if (one.contains("record") && one["record"]["state"] == "read") record = one["record"];
    }
    return !record.is_null();
  })) << Ask().output;
  EXPECT_EQ(record["name"], "trip");
  EXPECT_EQ(record["values"].size(), 41U) << "V6 and V11 to V58";
  EXPECT_EQ(record["values"][0]["name"], "trip_phases");
  for (const Json& value : record["values"]) EXPECT_EQ(value["quality_text"], "good") << value;
  EXPECT_THAT(Ask().output, HasSubstr("trip, read 20"));
  EXPECT_THAT(Ask().output, HasSubstr("record1_current_l1 1.2 xIn"));
  EXPECT_THAT(Ask({"--csv"}).output, HasSubstr("trip, read 20"));
}

const char* const kHighAlarm =
    ", points: [{ name: current_l1, events: [{ on: above, value: -1, alarm: high, text: too much "
    "}, "
    "{ on: below, value: -1 }] }]";

TEST_F(Events, AnAcknowledgementThatIsNotOnTheDiskIsSaid) {
  const auto relay = StartRelay("every:1h");
  const auto daemon = StartDaemon(Yaml(kHighAlarm, "events: {}\n"));
  ASSERT_TRUE(Eventually([&] { return Status()["events"]["alarms"]["active"] == 1; }));
  const auto limit_files = [&daemon](rlim_t bytes) {
    const rlimit limit{bytes, RLIM_INFINITY};
    ASSERT_EQ(::prlimit(daemon->id(), RLIMIT_FSIZE, &limit, nullptr), 0);
  };
  limit_files(0);
  const Finished seen = Station::Ask({"ack", "bay.bay-1.current_l1"});
  EXPECT_EQ(seen.code, 4);
  EXPECT_EQ(seen.output, "1 alarm acknowledged\n");
  EXPECT_THAT(seen.errors, HasSubstr("not on the disk yet"));
  limit_files(RLIM_INFINITY);
  EXPECT_TRUE(Eventually([&] { return Status()["events"]["state"] == "fine"; }));
  EXPECT_EQ(Status()["events"]["alarms"]["unacknowledged"], 0);
}

/// A point that exceeds its limit, seen by somebody, over a kill; and a relay that goes away.
TEST_F(Events, OfPointsAreAlarmsUntilSomebodyHasSeenThem) {
  const std::string yaml = Yaml(kHighAlarm, "events: {}\n");
  const auto alarms = [this] { return JsonLines(Station::Ask({"alarms", "--json"}).output); };
  const auto ack = [this](const std::string& target) { return Station::Ask({"ack", target}); };
  const auto count = [this](int code) {
    const auto records = Records();
    return std::ranges::count_if(records, [&](const Json& one) { return one["code"] == code; });
  };
  auto relay = StartRelay("every:1h");
  {
    const auto daemon = StartDaemon(yaml);
    ASSERT_TRUE(Eventually([&] { return alarms().size() == 1; })) << daemon->Errors();
    const Json alarm = alarms().front();
    EXPECT_EQ(alarm["state"], "active");
    EXPECT_EQ(alarm["priority"], "high");
    EXPECT_EQ(alarm["point"], "current_l1");
    EXPECT_THAT(alarm["text"].get<std::string>(), HasSubstr(": too much"));
    EXPECT_EQ(Status()["events"]["alarms"]["unacknowledged"], 1);
    EXPECT_THAT(Station::Ask({"status"}).output, HasSubstr("1 alarm active"));
    const Finished first = Ask();
    EXPECT_THAT(first.output, HasSubstr("has started"));
    EXPECT_EQ(ack("bay.bay-1.nothing").code, 2);
    EXPECT_EQ(ack("999").code, 2);
    const Finished seen = ack("bay.bay-1.current_l1");
    EXPECT_EQ(seen.code, 0) << seen.errors;
    EXPECT_EQ(seen.output, "1 alarm acknowledged\n");
    EXPECT_THAT(ack("bay.bay-1").output, StartsWith("no alarm of bay.bay-1 waits"));
    EXPECT_EQ(alarms().front()["state"], "acknowledged");
    EXPECT_THAT(alarms().front()["acknowledged_by"].get<std::string>(), StartsWith("user:"));
    daemon->Signal(SIGKILL);
    daemon->WaitForEnd();
  }
  const auto daemon = StartDaemon(yaml);
  ASSERT_TRUE(Eventually([&] { return count(1000001) == 2; })) << daemon->Errors();
  EXPECT_THAT(Ask().output, HasSubstr("the run before was broken off"));
  EXPECT_EQ(alarms().front()["state"], "acknowledged");
  relay.reset();
  ASSERT_TRUE(Eventually([&] { return count(1000005) + count(1000009) > 0; })) << Ask().output;
  EXPECT_EQ(count(1000014), 1) << "it was above before: " << Ask().output;
  EXPECT_EQ(count(1000016), 1);
}

TEST_F(Events, AreNotAskedForByThemselves) {
  const auto relay = StartRelay("every:300ms");
  const auto daemon = StartDaemon(Yaml(""));
  const Finished events = Ask();
  EXPECT_EQ(events.code, 4);
  EXPECT_THAT(events.errors, HasSubstr("no device of this gateway is asked for events"));
  EXPECT_EQ(Status()["events"]["in_memory"], true) << "alarms of the gateway itself alone";
}

TEST_F(Events, OfAGatewayThatIsKilledAreNeitherLostNorDoubled) {
  const std::size_t kills = Setting("BAUDGATE_EVENT_KILLS", 5);
  const auto relay = StartRelay("every:500ms,count=12,numbered");
  std::mt19937 random(static_cast<unsigned>(::getpid()));
  std::size_t known = 0;
  for (std::size_t kill = 0; kill < kills; ++kill) {
    const auto daemon = StartDaemon(Yaml());
    ASSERT_TRUE(Eventually([&] { return Status()["events"]["newest"] > known; }))
        << daemon->Errors();
    std::this_thread::sleep_for(std::chrono::microseconds(random() % 600'000));
    daemon->Signal(SIGKILL);
    daemon->WaitForEnd();
    known += 1;
  }
  const auto daemon = StartDaemon(Yaml());
  ASSERT_TRUE(Eventually([&] { return Status()["events"]["newest"] > known; }));
  const std::size_t newest = Status()["events"]["newest"];
  ASSERT_TRUE(Eventually([&] { return Status()["events"]["newest"] > newest + 20; }));
  int number = 0;
  for (const Json& record : Records()) {
    EXPECT_EQ(record["seq"], ++number);
    const std::string text = record["text"];
    if (record["code"] == 51) {
      ADD_FAILURE() << "the register has overflown: the machine is too slow for this test";
      break;
    }
    ASSERT_EQ(text.substr(text.rfind(' ') + 1), std::to_string(number)) << record;
  }
  std::cout << kills << " kills, " << number << " events\n";
}

}  // namespace
}  // namespace baudgate::system_test
