// Tests of `AlarmService`, which makes alarms from reports of lines, routes and disks.
// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>

#include "gateway/records/event_path.h"

namespace baudgate::records {
namespace {

using Slave = RoutedEnd::Slave;
using ::testing::ElementsAre;
using ::testing::IsEmpty;
using ::testing::UnorderedElementsAre;

std::shared_ptr<const config::Config> Configured() {
  auto config = std::make_shared<config::Config>();
  config->lines.resize(1);
  config->lines[0].name = "drive";
  config->lines[0].devices.resize(1);
  config->lines[0].devices[0].name = "pump";
  config::Route to_line;
  to_line.first = to_line.last = 51;
  to_line.line = "drive";
  config::Route to_server;
  to_server.first = to_server.last = 70;
  to_server.host = "10.0.0.9";
  config->modbus.routes = {to_line, to_server};
  return config;
}

class AlarmServiceTest : public ::testing::Test {
 protected:
  void Routed(std::uint8_t unit, Slave slave, Outcome outcome, const std::string& reason = {},
              Bytes pdu = {}) {
    bus::RoutedReply reply;
    reply.outcome = outcome;
    reply.reason = reason;
    reply.pdu = std::move(pdu);
    service_.OnRouted({config_->modbus.routes[unit == 51 ? 0 : 1], unit, slave, reply}, now_);
  }
  std::vector<std::string> AfterAMinute(std::span<const AlarmService::DiskState> disks = {}) {
    service_.Look(disks, now_);
    now_.instant += 1min;
    service_.Look(disks, now_);
    return std::exchange(told_, {});
  }

  const std::shared_ptr<const config::Config> config_ = Configured();
  Now now_{Instant() + 1h, WallTime(1'790'000'000s)};
  std::set<std::string> raised_;
  std::vector<std::string> told_;
  AlarmService service_{config_, [this](const events::EventRecord& record) {
                          const std::string place = record.line + "." + record.device;
                          const bool over = record.state == config::EventState::off;
                          if (over && raised_.erase(place + record.subject) == 0) return;
                          if (!over) raised_.insert(place + record.subject);
                          told_.push_back(place + " " + record.text);
                        }};
};

TEST_F(AlarmServiceTest, ASilentRoutedSlaveRaisesAnAlarm) {
  struct Row {
    const char* what;
    std::uint8_t unit;
    Slave slave;
    Outcome outcome;
    Bytes pdu;
    std::vector<std::string> told;
  };
  const Row rows[] = {
      {"silence",
       51,
       Slave::silent,
       Outcome::no_reply,
       {},
       {"drive.unit-51 no answer to clients for 30s: why"}},
      {"damage", 51, Slave::silent, Outcome::corrupt, {}, {}},
      {"an exception of its own",
       51,
       Slave::answered,
       Outcome::refused,
       {0x83, 2},
       {"drive.unit-51 no answer to clients, over"}},
      {"a gateway behind it says so",
       51,
       Slave::answered,
       Outcome::refused,
       {0x83, 0x0B},
       {"drive.unit-51 no answer to clients for 30s: the remote gateway answers exception 0B"}},
      {"a reply",
       51,
       Slave::answered,
       Outcome::ok,
       {3, 2, 0, 0},
       {"drive.unit-51 no answer to clients, over"}},
      {"its line is down", 51, Slave::silent, Outcome::line_down, {}, {}},
      {"it was not sent in time", 51, Slave::unknown, Outcome::no_reply, {}, {}},
      {"its server is away",
       70,
       Slave::silent,
       Outcome::line_down,
       {},
       {".10.0.0.9:502 server away for 30s: why"}},
      {"its server is back",
       70,
       Slave::answered,
       Outcome::ok,
       {3, 2, 0, 0},
       {".10.0.0.9:502 server away, over"}},
      {"silence behind a server",
       70,
       Slave::silent,
       Outcome::no_reply,
       {},
       {".unit-70 no answer to clients for 30s: why"}},
  };
  for (const Row& row : rows) {
    for (int time = 0; time < 3; ++time) {
      Routed(row.unit, row.slave, row.outcome, "why", row.pdu);
      now_.instant += 1s;
    }
    EXPECT_EQ(AfterAMinute(), row.told) << row.what;
  }
}

TEST_F(AlarmServiceTest, ALostReplyOfARoutedSlaveIsNoAlarm) {
  const auto fails = [&] { Routed(51, Slave::silent, Outcome::no_reply, "why"); };
  const std::string raised = "drive.unit-51 no answer to clients for ";
  fails();
  EXPECT_THAT(AfterAMinute(), IsEmpty()) << "one is";
  Routed(51, Slave::answered, Outcome::ok, {}, {3, 2, 0, 0});
  fails();
  fails();
  EXPECT_THAT(AfterAMinute(), IsEmpty()) << "two at once are";
  fails();
  EXPECT_THAT(AfterAMinute(), ElementsAre(testing::StartsWith(raised)))
      << "and one a minute later makes it";
}

TEST_F(AlarmServiceTest, TheAlarmOfAnUnrequestedRoutedSlaveEnds) {
  for (int time = 0; time < 3; ++time) {
    Routed(51, Slave::silent, Outcome::no_reply, "why");
    now_.instant += 1s;
  }
  EXPECT_EQ(AfterAMinute().size(), 1U);
  now_.instant += 57min;
  EXPECT_THAT(AfterAMinute(), IsEmpty());
  now_.instant += 2min;
  EXPECT_THAT(AfterAMinute(), ElementsAre("drive.unit-51 no answer to clients, over"));
}

TEST_F(AlarmServiceTest, TroublesOfLinesAndDevicesRaiseAlarms) {
  using What = bus::News::What;
  struct Row {
    const char* device;
    bus::News news;
    std::vector<std::string> told;
  };
  const Row rows[] = {
      {"pump",
       {What::no_answer, false, 0U, "no reply"},
       {"drive.pump no answer for 30s: no reply"}},
      {"pump", {What::no_answer, true, 0U, ""}, {"drive.pump no answer, over"}},
      {"pump",
       {What::wrong_device, false, 0U, "type 0D"},
       {"drive.pump wrong device for 30s: type 0D"}},
      {"pump", {What::not_in_use, false, 0U, ""}, {"drive.pump wrong device, over"}},
      {"pump", {What::wrong_device, true, 0U, ""}, {}},
      {"pump", {What::not_in_use, true, 0U, ""}, {}},
      {"pump",
       {What::replaced, false, 0U, "it differs"},
       {"drive.pump another device: it differs"}},
      {"", {What::collisions, false, {}, "echoes differ"}, {}},
      {"", {What::ring_open, false, {}, ""}, {"drive. ring open for 30s"}},
      {"", {What::ring_open, true, {}, ""}, {"drive. ring open, over"}},
      {"", {What::port_lent, false, {}, ""}, {}},
      {"", {What::port_down, false, {}, "lost"}, {}},
      {"", {What::port_lent, true, {}, ""}, {"drive. port down for 30s: lost"}},
      {"", {What::port_down, true, {}, ""}, {"drive. port down, over"}},
  };
  for (const Row& row : rows) {
    service_.OnNews("drive", row.device, row.news, now_);
    EXPECT_EQ(AfterAMinute(), row.told)
        << row.device << " " << static_cast<int>(row.news.what) << " " << row.news.over;
  }
}

TEST_F(AlarmServiceTest, DiskTroublesRaiseAlarms) {
  using events::Trouble;
  const auto all = [](Disk disk) {
    return std::vector<AlarmService::DiskState>{{Trouble::events_lost, disk, "full"},
                                                {Trouble::writes_lost, Disk::fine, ""},
                                                {Trouble::values_lost, disk, "full"}};
  };
  EXPECT_THAT(AfterAMinute(all(Disk::opening)), IsEmpty());
  EXPECT_THAT(AfterAMinute(all(Disk::failing)), ElementsAre(". events are not kept for 30s: full",
                                                            ". values are not kept for 30s: full"));
  EXPECT_THAT(AfterAMinute(all(Disk::stalled)), IsEmpty());
  EXPECT_THAT(AfterAMinute(all(Disk::fine)),
              ElementsAre(". events are not kept, over", ". values are not kept, over"));
}

TEST_F(AlarmServiceTest, ACertificateThatEndsSoonRaisesAnAlarm) {
  const auto after = [this](const std::string& why) {
    service_.OnCertificates(why, now_);
    return AfterAMinute();
  };
  EXPECT_THAT(after(""), IsEmpty());
  EXPECT_THAT(after("The certificate of web ends."),
              ElementsAre(". certificate ends: The certificate of web ends."));
  EXPECT_THAT(after("The certificate of web ends."), IsEmpty());
  EXPECT_THAT(after(""), ElementsAre(". certificate ends, over"));
}

TEST_F(AlarmServiceTest, AReceiverThatIsAwayOrRefusesValuesRaisesAnAlarm) {
  const auto after = [this](const std::string& away, const std::string& refused) {
    service_.OnOutlet("mqtt", away, refused, now_);
    return AfterAMinute();
  };
  EXPECT_THAT(after("", ""), IsEmpty());
  EXPECT_THAT(after("no answer", ""), ElementsAre(".mqtt receiver away for 30s: no answer"));
  EXPECT_THAT(after("", "400"),
              UnorderedElementsAre(".mqtt receiver away, over", ".mqtt values refused: 400"));
  EXPECT_THAT(after("", ""), ElementsAre(".mqtt values refused, over"));
}

}  // namespace
}  // namespace baudgate::records
