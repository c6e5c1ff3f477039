// Tests of `OwnAlarms`: when a trouble becomes an alarm, second by second.
// SPDX-License-Identifier: Apache-2.0
#include "gateway/records/events/own_alarms.h"

#include <gmock/gmock.h>

#include <string>
#include <vector>

namespace baudgate::events {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;
using Whose = OwnAlarms::Subject;

config::Line BayWith(config::AlarmSetting line, config::AlarmSetting device) {
  config::Line bay;
  bay.name = "bay-1";
  bay.alarms = line;
  config::Device feeder;
  feeder.name = "feeder-1";
  feeder.alarms = device;
  bay.devices = {feeder};
  return bay;
}

std::shared_ptr<config::Config> ConfigWith(config::AlarmSetting line, config::AlarmSetting device) {
  auto config = std::make_shared<config::Config>();
  config->lines = {BayWith(line, device)};
  config::Route to_line;
  to_line.first = 20;
  to_line.last = 29;
  to_line.line = "bay-1";
  config::Route to_server;
  to_server.first = to_server.last = 70;
  to_server.host = "10.0.0.9";
  to_server.alarms.priority = config::AlarmPriority::low;
  config->modbus.routes = {to_line, to_server};
  return config;
}

const Whose kFeeder{"bay-1", "feeder-1"};
const Whose kBay{"bay-1", ""};

class OwnAlarmsTest : public ::testing::Test {
 protected:
  void At(int second) {
    now_ = {Instant() + 1h + std::chrono::seconds(second),
            WallTime(1'790'000'000s) + std::chrono::seconds(second)};
  }
  void Begin(int second, Trouble trouble, const Whose& place, const std::string& why = {}) {
    At(second);
    alarms_.Begin(trouble, place, why, now_);
  }
  void End(int second, Trouble trouble, const Whose& place) {
    At(second);
    Hear(alarms_.End(trouble, place, now_));
  }
  void InUse(int second, const Whose& place, bool in_use) {
    At(second);
    Hear(alarms_.SetInUse(place, in_use, now_));
  }
  void Renew(std::shared_ptr<config::Config> config, const std::set<std::string>& begun) {
    alarms_.Renew(std::move(config), begun);
  }
  void LookUntil(int second) {
    for (; looked_ <= second; ++looked_) {
      At(looked_);
      Hear(alarms_.Look(now_));
    }
  }
  /// Example: "30: raise bay-1.feeder-1 no answer for 30s: no reply". Ends of alarms that were
  /// active before the start are left out.
  std::vector<std::string> Heard() { return std::exchange(heard_, {}); }
  std::vector<std::string> All() { return std::exchange(all_, {}); }

  void Hear(const OwnAlarms::Records& records) {
    for (const EventRecord& record : records) {
      const char* step = record.mark.step == AlarmMark::Step::raise   ? "raise "
                         : record.mark.step == AlarmMark::Step::pulse ? "pulse "
                                                                      : "clear ";
      const auto second = (record.received - WallTime(1'790'000'000s)) / 1s;
      const std::string key = record.line + "." + record.device + "." + record.subject;
      const std::string said = std::to_string(second) + ": " + step + record.line +
                               (record.device.empty() ? "" : "." + record.device) + " " +
                               record.text;
      all_.push_back(said);
      if (record.mark.step == AlarmMark::Step::raise) raised_.insert(key);
      if (record.mark.step == AlarmMark::Step::clear && raised_.erase(key) == 0) continue;
      heard_.push_back(said);
    }
  }

  Now now_{};
  OwnAlarms alarms_{ConfigWith({}, {config::AlarmPriority::high, 30s})};

 private:
  int looked_ = 0;
  std::set<std::string> raised_;
  std::vector<std::string> heard_;
  std::vector<std::string> all_;
};

TEST_F(OwnAlarmsTest, ATroubleRaisesAnAlarmAfterTheDelay) {
  Begin(0, Trouble::no_answer, kFeeder, "no reply");
  LookUntil(29);
  EXPECT_THAT(Heard(), IsEmpty());
  LookUntil(90);
  EXPECT_THAT(Heard(), ElementsAre("30: raise bay-1.feeder-1 no answer for 30s: no reply"));
  End(91, Trouble::no_answer, kFeeder);
  EXPECT_THAT(Heard(), ElementsAre("91: clear bay-1.feeder-1 no answer, over"));
  Begin(100, Trouble::no_answer, kFeeder);
  LookUntil(129);
  End(129, Trouble::no_answer, kFeeder);
  LookUntil(300);
  EXPECT_THAT(Heard(), IsEmpty()) << "it came back within the delay";
}

TEST_F(OwnAlarmsTest, SettingsSwitchAlarmsOnAndOff) {
  Renew(ConfigWith({config::AlarmPriority::none, 30s}, {config::AlarmPriority::low, 0s}), {});
  Begin(0, Trouble::ring_open, kBay);
  Begin(0, Trouble::wrong_device, kFeeder, "type 0D");
  LookUntil(60);
  EXPECT_THAT(Heard(), ElementsAre("0: raise bay-1.feeder-1 wrong device: type 0D"))
      << "an alarm of the line that is off explains nothing";
  At(61);
  const auto replaced = alarms_.Happen(Trouble::replaced, kFeeder, "another", now_);
  ASSERT_EQ(replaced.size(), 1U);
  EXPECT_EQ(replaced[0].mark.priority, config::AlarmPriority::low);
  Hear(replaced);
  EXPECT_THAT(Heard(), ElementsAre("61: pulse bay-1.feeder-1 another device: another"));
  Renew(ConfigWith({}, {config::AlarmPriority::none, 0s}), {});
  EXPECT_THAT(alarms_.Happen(Trouble::replaced, kFeeder, "another", now_), IsEmpty());
}

TEST_F(OwnAlarmsTest, DevicesReportAPortIfItsLineHasNoAlarm) {
  Renew(ConfigWith({config::AlarmPriority::none, 30s}, {config::AlarmPriority::high, 5s}), {});
  Begin(0, Trouble::port_down, kBay, "lost");
  LookUntil(20);
  EXPECT_THAT(Heard(),
              ElementsAre("5: raise bay-1.feeder-1 no answer for 5s: its port is down: lost"));
  End(21, Trouble::port_down, kBay);
  EXPECT_THAT(Heard(), ElementsAre("21: clear bay-1.feeder-1 no answer, over"));
  LookUntil(60);
  EXPECT_THAT(Heard(), IsEmpty());
}

TEST_F(OwnAlarmsTest, AnAlarmOfTheLineSuppressesThoseOfItsDevices) {
  for (const Trouble line : {Trouble::port_down, Trouble::ring_open}) {
    OwnAlarms alarms(ConfigWith({}, {}));
    const auto at = [](int second) {
      return Now{Instant() + 1h + std::chrono::seconds(second), WallTime()};
    };
    alarms.Begin(Trouble::no_answer, kFeeder, "", at(0));
    alarms.Begin(Trouble::unit_silent, {"bay-1", "unit-20"}, "", at(0));
    alarms.Begin(line, kBay, "", at(10));
    std::vector<std::string> raised;
    const auto look = [&](int from, int to) {
      for (int second = from; second <= to; ++second) {
        for (const auto& record : alarms.Look(at(second))) {
          raised.push_back(std::to_string(second) + " " + record.subject);
        }
      }
    };
    look(10, 100);
    EXPECT_THAT(raised, ElementsAre("40 " + std::string(Name(line))));
    alarms.End(line, kBay, at(101));
    look(101, 129);
    EXPECT_EQ(raised.size(), 1U) << "they have the whole delay to come back";
    look(130, 140);
    EXPECT_EQ(raised.size(), 3U);
  }
}

TEST_F(OwnAlarmsTest, ADisabledDeviceHasNoAlarm) {
  Begin(0, Trouble::no_answer, kFeeder);
  LookUntil(40);
  InUse(41, kFeeder, false);
  LookUntil(100);
  EXPECT_THAT(Heard(), ElementsAre("30: raise bay-1.feeder-1 no answer for 30s",
                                   "41: clear bay-1.feeder-1 no answer, over"));
  InUse(101, kFeeder, true);
  LookUntil(140);
  EXPECT_THAT(Heard(), ElementsAre("130: raise bay-1.feeder-1 no answer for 30s"))
      << "it does not answer yet";
  Begin(141, Trouble::port_down, kBay);
  InUse(141, kBay, false);
  LookUntil(240);
  EXPECT_THAT(Heard(), IsEmpty()) << "the port is lent";
}

TEST_F(OwnAlarmsTest, AnAlarmOfAServerSuppressesThoseOfItsUnits) {
  const Whose unit{"", "unit-70"};
  const Whose server{"", "10.0.0.9:502"};
  Begin(0, Trouble::server_away, server, "refused");
  Begin(0, Trouble::unit_silent, unit);
  LookUntil(60);
  EXPECT_THAT(Heard(), ElementsAre("30: raise .10.0.0.9:502 server away for 30s: refused"));
  End(61, Trouble::server_away, server);
  LookUntil(100);
  EXPECT_THAT(Heard(), ElementsAre("61: clear .10.0.0.9:502 server away, over",
                                   "90: raise .unit-70 no answer to clients for 30s"));
}

TEST_F(OwnAlarmsTest, TheFirstAnswerEndsStoredAlarms) {
  End(0, Trouble::no_answer, kFeeder);
  EXPECT_THAT(All(), ElementsAre("0: clear bay-1.feeder-1 no answer, over",
                                 "0: clear bay-1 ring open, over"));
  End(1, Trouble::no_answer, kFeeder);
  EXPECT_THAT(All(), IsEmpty()) << "once";
  LookUntil(30);
  EXPECT_THAT(All(), ElementsAre("30: clear bay-1.feeder-1 wrong device, over"))
      << "by now it would have been told";
}

TEST_F(OwnAlarmsTest, AReloadLosesAndDuplicatesNoAlarm) {
  struct Row {
    const char* what;
    std::set<std::string> begun;
    bool told_again;
    bool ends;
    std::vector<std::string> heard;
  };
  const Row rows[] = {
      {"the line goes on", {}, false, false, {}},
      {"the line begins anew, and the device is still silent", {"bay-1"}, true, false, {}},
      {"the line begins anew, and the device answers",
       {"bay-1"},
       false,
       true,
       {"50: clear bay-1.feeder-1 no answer, over"}},
  };
  for (const Row& row : rows) {
    OwnAlarmsTest::alarms_ = OwnAlarms(ConfigWith({}, {}));
    std::vector<std::string> heard;
    const auto at = [](int second) {
      return Now{Instant() + 1h + std::chrono::seconds(second),
                 WallTime(1'790'000'000s) + std::chrono::seconds(second)};
    };
    Heard();
    alarms_.Begin(Trouble::no_answer, kFeeder, "", at(0));
    Hear(alarms_.Look(at(30)));
    EXPECT_EQ(Heard().size(), 1U);
    Renew(ConfigWith({}, {}), row.begun);
    if (row.told_again) alarms_.Begin(Trouble::no_answer, kFeeder, "", at(40));
    if (row.ends) Hear(alarms_.End(Trouble::no_answer, kFeeder, at(50)));
    for (int second = 50; second < 100; ++second) Hear(alarms_.Look(at(second)));
    EXPECT_EQ(Heard(), row.heard) << row.what;
  }
}

/// The line was restarted without `echo: verify`, so it no longer reports an open ring.
TEST_F(OwnAlarmsTest, AnUnreportedTroubleSuppressesNoAlarm) {
  Begin(0, Trouble::ring_open, kBay);
  LookUntil(40);
  EXPECT_THAT(Heard(), ElementsAre("30: raise bay-1 ring open for 30s"));
  Renew(ConfigWith({}, {}), {"bay-1"});
  Begin(50, Trouble::no_answer, kFeeder);
  LookUntil(90);
  EXPECT_THAT(Heard(), ElementsAre("80: raise bay-1.feeder-1 no answer for 30s"));
}

TEST(Troubles, HaveTheAlarmSettingsOfTheirSource) {
  const auto config = ConfigWith({config::AlarmPriority::low, 5s}, {config::AlarmPriority::high});
  config->alarms.delay = 7s;
  config->modbus.routes[0].alarms.delay = 9s;
  struct Row {
    Trouble trouble;
    const char* line;
    const char* device;
    Duration delay;  // negative: no alarm
  };
  const Row rows[] = {
      {Trouble::no_answer, "bay-1", "feeder-1", 30s},
      {Trouble::no_answer, "bay-1", "feeder-2", -1s},
      {Trouble::no_answer, "bay-2", "feeder-1", -1s},
      {Trouble::ring_open, "bay-1", "", 5s},
      {Trouble::port_down, "bay-2", "", -1s},
      {Trouble::unit_silent, "bay-1", "unit-20", 9s},
      {Trouble::unit_silent, "", "unit-20", -1s},
      {Trouble::unit_silent, "bay-1", "unit-30", -1s},
      {Trouble::unit_silent, "", "unit-70", 30s},
      {Trouble::server_away, "", "10.0.0.9:502", 30s},
      {Trouble::server_away, "", "10.0.0.8:502", -1s},
      {Trouble::events_lost, "", "", 7s},
  };
  for (const Row& row : rows) {
    const auto setting = SettingOf(*config, row.trouble, row.line, row.device);
    EXPECT_EQ(setting ? setting->delay : Duration(-1s), row.delay)
        << Name(row.trouble) << " of " << row.line << "." << row.device;
    EXPECT_EQ(TroubleNamed(Name(row.trouble)), row.trouble);
  }
  EXPECT_EQ(TroubleNamed("current above 5"), std::nullopt);
}

}  // namespace
}  // namespace baudgate::events
