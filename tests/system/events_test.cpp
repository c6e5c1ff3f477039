// Tests events with a simulated relay that deletes events once they were read, and a gateway that
// is killed in bursts of events. $BAUDGATE_EVENT_KILLS: the number of kills, by default 5.
// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>
#include <sys/resource.h>

#include <algorithm>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <random>
#include <thread>

#include "gateway/records/disk/events_file.h"
#include "gateway/records/events/event_file.h"
#include "tests/support/long_run.h"
#include "tests/system/event_station.h"
#include "tests/system/libmodbus_slave.h"
#include "tests/system/null_modem.h"
#include "tests/system/routes_fixture.h"

namespace baudgate::system_test {
namespace {

using ::testing::HasSubstr;
using ::testing::StartsWith;

using Events = EventStation;

TEST_F(Events, AreListedAndFollowed) {
  const auto relay = StartRelay("every:300ms,count=2,numbered");
  const auto daemon = StartDaemon(Yaml());
  ASSERT_TRUE(Eventually([&] { return Records().size() >= 6; })) << Ask().errors;
  const Json first = Records().front();
  const std::vector<std::string> fields = {"seq",   "receive_time", "device_time", "clock_quality",
                                           "line",  "device",       "channel",     "code",
                                           "state", "priority",     "text",        "record"};
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
                         "state,priority,text,record\r\n1,20"));
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

TEST_F(Events, AnUnstoredAcknowledgementIsReported) {
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

TEST_F(Events, OfPointsAreAlarmsUntilTheyAreAcknowledged) {
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
  EXPECT_THAT(Ask().output, HasSubstr("the previous run ended unexpectedly"));
  EXPECT_EQ(alarms().front()["state"], "acknowledged");
  relay.reset();
  ASSERT_TRUE(Eventually([&] { return count(1000005) + count(1000009) > 0; })) << Ask().output;
  EXPECT_EQ(count(1000014), 1) << "it was above before: " << Ask().output;
  EXPECT_EQ(count(1000016), 1);
}

TEST_F(Events, AreNotRequestedByDefault) {
  const auto relay = StartRelay("every:300ms");
  const auto daemon = StartDaemon(Yaml(""));
  const Finished events = Ask();
  EXPECT_EQ(events.code, 4);
  EXPECT_THAT(events.errors, HasSubstr("this gateway records no events"));
  EXPECT_EQ(Status()["events"]["in_memory"], true) << "alarms of the gateway itself alone";
}

TEST_F(Events, OfAKilledGatewayAreNeitherLostNorDoubled) {
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

using ::testing::SizeIs;

constexpr std::int64_t kBefore = 4100;
constexpr std::int64_t kRing = 4000;

class EventRing : public EventStation {
 protected:
  void FillFile() const {
    const auto folder = directory() / "state" / gateway();
    std::filesystem::create_directories(folder);
    const auto opened = records::OpenEvents(folder / "events.db");
    ASSERT_TRUE(opened.database) << opened.error;
    events::EventTable table(*opened.database);
    std::vector<events::Batch> batches;
    for (std::int64_t seq = 1; seq <= kBefore; ++seq) {
      const bool own = seq / 10 % 2 == 0;
      events::EventRecord record;
      record.seq = seq;
      record.received = record.device_time = WallTime(std::chrono::seconds(1'700'000'000 + seq));
      record.line = "bay";
      record.device = own ? "bay-1" : "bay-9";
      record.code = static_cast<std::uint32_t>(100'000 + seq);
      batches.push_back({own ? 0U : 1U, "", false, {record}});
    }
    ASSERT_TRUE(table.Write(batches));
  }
  Json Read(int unit, std::int64_t first, std::int64_t last) const {
    const Finished reader = RunToEnd(
        {"/usr/bin/python3", std::string(SYSTEM_TEST_SOURCES) + "/pymodbus_events.py",
         std::to_string(port()), std::to_string(unit), std::to_string(first), std::to_string(last)},
        directory(), {}, 90s);
    EXPECT_EQ(reader.code, 0) << reader.errors;
    return Json::parse(reader.output, nullptr, false);
  }
};

TEST_F(EventRing, IsReadWithoutErrorsWhileEventsArrive) {
  FillFile();
  const auto relay = StartRelay("every:100ms,count=6,numbered");
  const auto daemon = StartDaemon(Yaml());
  ASSERT_TRUE(Eventually([&] { return Status()["events"]["newest"] >= kBefore + 10; }))
      << daemon->Errors();
  const std::int64_t last = Status()["events"]["newest"].get<std::int64_t>() + 60;

  // Unit 255 returns all events from a ring of registers. Events that leave the ring unread are
  // counted as lost.
  const Json all = Read(255, kBefore - kRing + 1, last);
  EXPECT_THAT(all["wrong"], SizeIs(0)) << all["wrong"];
  EXPECT_GE(all["oldest"].size(), 2U) << "the ring did not go on";
  const std::int64_t lost = all["lost"];
  EXPECT_GT(lost, 0);
  std::int64_t next = kBefore - kRing + 1 + lost;
  for (std::size_t i = 0; i < all["numbers"].size(); ++i, ++next) {
    ASSERT_EQ(all["numbers"][i], next);
    if (next <= kBefore) {
      ASSERT_EQ(all["codes"][i], 100'000 + next) << "half of another";
    }
  }
  EXPECT_GT(next, last);

  // The unit of the relay returns the relay's events only. Other events are skipped, and are not
  // counted as lost.
  const Json own = Read(1, kBefore - 99, last);
  EXPECT_THAT(own["wrong"], SizeIs(0)) << own["wrong"];
  EXPECT_EQ(own["lost"], 0);
  std::int64_t before = 0;
  for (const std::int64_t number : own["numbers"]) {
    if (number <= kBefore) {
      EXPECT_EQ(number / 10 % 2, 0) << number;
      ++before;
    }
  }
  EXPECT_EQ(before, 50) << "of 4001 to 4100";
}

TEST_F(EventRing, ShowsTheNewestEventsWithoutAWrite) {
  const auto relay = StartRelay("every:200ms,count=3,numbered");
  const auto daemon = StartDaemon(Yaml());
  ModbusClient client(port());
  std::optional<std::uint16_t> count;
  ASSERT_TRUE(Eventually([&] {
    count = client.Register(1, 9024);
    return count == 7;
  })) << daemon->Errors();
  const auto block = client.Input(1, 9016, 80);
  ASSERT_TRUE(block.ok());
  for (std::size_t i = 0; i < 7; ++i) {
    const auto number = block.values[11 + 10 * i];
    EXPECT_EQ(number, block.values[3] - 6 + static_cast<int>(i)) << "the newest seven";
    EXPECT_GT(block.values[12 + 10 * i], 0) << "seconds since 1970, high word";
  }
  EXPECT_EQ(client.WriteRegister(1, 9016, 1), 0x03);
  EXPECT_EQ(client.WriteRegisters(1, 9018, {0, 1}), 0x02);
  EXPECT_EQ(client.WriteRegisters(1, 9016, {0, 2}), kNoException);
  EXPECT_EQ(client.Input(1, 9016, 80).values[11], 2);
}

using ::testing::ElementsAre;

class Alarms : public Routes {
 protected:
  std::vector<Json> All() const { return JsonLines(Ask({"alarms", "--json"}).output); }
  /// Returns texts such as "drive unit-20 no answer to clients active high".
  std::vector<std::string> Shown() const {
    std::vector<std::string> shown;
    for (const Json& alarm : All()) {
      std::string text;
      for (const char* key : {"line", "device", "name", "state", "priority"}) {
        text += (text.empty() ? "" : " ") + alarm.at(key).get<std::string>();
      }
      shown.push_back(text);
    }
    return shown;
  }
  bool EventuallyShown(const std::vector<std::string>& alarms) const {
    const bool shown = Eventually([&] { return Shown() == alarms; });
    EXPECT_EQ(Shown(), alarms);
    return shown;
  }
};

TEST_F(Alarms, AreRaisedForARoutedSlaveThatDoesNotAnswer) {
  const NullModem cable(LinkOf("drive"), FarEnd("drive"));
  auto slave = LibmodbusSlave::OnTty(FarEnd("drive"), kUnit);
  const auto daemon =
      StartGateway(Yaml({"{ units: 20, line: drive, alarms: { priority: high, delay: 1s } }"},
                        BareLine("drive", "timing: { reply: 100ms }")));
  const auto follower = Start({"alarms", "--follow", "--json", "--socket", socket()});
  ModbusClient client(port());
  EXPECT_EQ(client.Holding(kUnit, 999, 1).values, std::vector<std::uint16_t>{1999});
  EXPECT_THAT(Shown(), ElementsAre());
  EXPECT_EQ(Ask({"events"}).code, 4) << "it keeps no events";

  slave.reset();
  for (int time = 0; time < 3; ++time) {
    EXPECT_EQ(client.Holding(kUnit, 999, 1).exception, kNotAnswering);
  }
  ASSERT_TRUE(EventuallyShown({"drive unit-20 no answer to clients active high"}));
  const auto followed = [&](const std::string& state) {
    return Eventually([&] {
      return follower->Output().find("\"state\":\"" + state + "\"") != std::string::npos;
    });
  };
  EXPECT_TRUE(followed("active"));
  const Json alarm = All()[0];
  EXPECT_THAT(alarm["text"].get<std::string>(), HasSubstr("no answer to clients for 1s"));
  EXPECT_EQ(alarm["point"], "");
  EXPECT_EQ(Status()["events"]["alarms"]["active"], 1);
  EXPECT_THAT(daemon->Errors(),
              HasSubstr("line drive: device unit-20: alarm active, priority high"));
  EXPECT_THAT(Ask({"ack", "drive.unit-20"}).output, HasSubstr("1 alarm acknowledged"));
  EXPECT_TRUE(EventuallyShown({"drive unit-20 no answer to clients acknowledged high"}));

  slave = LibmodbusSlave::OnTty(FarEnd("drive"), kUnit);
  EXPECT_TRUE(Eventually([&] { return client.Holding(kUnit, 999, 1).exception == 0; }));
  EXPECT_TRUE(EventuallyShown({}));
  EXPECT_TRUE(followed("normal"));
  follower->Signal(SIGINT);
  EXPECT_EQ(follower->WaitForEnd(), 0);
}

TEST_F(Alarms, OfAPortAndADeviceAreStoredAndEndWithTheirConfiguration) {
  const auto yaml = [&](const std::string& line, const std::string& routes = {}) {
    return "gateway: { name: " + gateway() + ", socket: " + socket() +
           ", state: " + (directory() / "state").string() +
           " }\nevents: {}\nmodbus:\n  listen: { at: \"127.0.0.1:" + std::to_string(port()) +
           "\" }\n" + routes + "dds: { enabled: false }\nlines:\n" + line;
  };
  const std::string devices =
      "devices: [{ name: pump, address: 1, profile: mitsubishi-fr-d700, retries: 0 }], timing: { "
      "reply: 50ms }";
  const std::string both = BareLine("absent", "alarms: { delay: 0s }") +
                           BareLine("drive", "alarms: { priority: low, delay: 1s }, " + devices);
  const ScriptedSlave silent(LinkOf("drive"), Nothing);
  const std::vector<std::string> raised = {"absent  port down active medium",
                                           "drive pump no answer active low"};
  {
    const auto daemon = StartDaemon(yaml(both));
    ASSERT_TRUE(EventuallyShown(raised)) << daemon->Errors();
    daemon->Signal(SIGKILL);
    daemon->WaitForEnd();
  }
  const auto daemon = StartDaemon(yaml(both));
  EXPECT_TRUE(EventuallyShown(raised));
  std::this_thread::sleep_for(2s);
  const auto alarms = All();
  ASSERT_EQ(alarms.size(), 2U) << "none twice";
  EXPECT_EQ(Ask({"ack", "absent"}).code, 0);
  EXPECT_TRUE(EventuallyShown({"absent  port down acknowledged medium", raised[1]}));

  Write("baudgate.yaml",
        yaml(BareLine("drive", "alarms: { priority: low, delay: 2s }, " + devices)));
  const Finished reload = Ask({"reload"});
  EXPECT_EQ(reload.code, 0) << reload.errors;
  EXPECT_TRUE(EventuallyShown({raised[1]}));
  EXPECT_EQ(All()[0]["seq"], alarms[1]["seq"]) << "it is the same as before";
}

TEST_F(Alarms, AreForwardedByTheServiceOfTheDocs) {
  std::ifstream document(std::filesystem::path(SYSTEM_TEST_SOURCES) / "../../docs/events.md");
  std::string script;
  constexpr std::string_view kStart = "ExecStart=/bin/sh -c '";
  for (std::string line; std::getline(document, line);) {
    if (line.starts_with(kStart)) script = line.substr(kStart.size());
  }
  ASSERT_TRUE(script.ends_with("'"));
  script.pop_back();
  const auto replace = [&script](const std::string& what, const std::string& by) {
    ASSERT_NE(script.find(what), std::string::npos) << what;
    script.replace(script.find(what), what.size(), by);
  };
  replace("$$alarm", "$alarm");
  replace("/run/baudgate/baudgate.sock", socket());
  const auto tools = directory() / "tools";
  std::filesystem::create_directory(tools);
  std::filesystem::create_symlink(BAUDGATE_BINARY, tools / "baudgate");
  std::ofstream(tools / "curl") << "#!/bin/sh\ncat >> " << (directory() / "posted").string()
                                << "\n";
  std::filesystem::permissions(tools / "curl", std::filesystem::perms::owner_all);
  const auto daemon =
      StartGateway(Yaml({}, BareLine("absent", "alarms: { priority: high, delay: 0s }")), {});
  ASSERT_TRUE(EventuallyShown({"absent  port down active high"}));
  Child service({"/bin/sh", "-c", script}, directory(),
                {{"PATH", tools.string() + ":" + std::getenv("PATH")}});
  const auto posted = [&] {
    std::ifstream file(directory() / "posted");
    std::vector<std::string> states;
    for (std::string line; std::getline(file, line);) {
      const Json alarm = Json::parse(line, nullptr, false);
      states.push_back(alarm.value("name", "") + " " + alarm.value("state", ""));
    }
    return states;
  };
  EXPECT_TRUE(Eventually([&] { return posted().size() == 1; }));
  EXPECT_EQ(Ask({"ack", "absent"}).code, 0);
  EXPECT_TRUE(Eventually([&] { return posted().size() == 2; }));
  EXPECT_THAT(posted(), ElementsAre("port down active", "port down acknowledged"));
}

}  // namespace
}  // namespace baudgate::system_test
