// Tests of the audit and of alarms over the control socket.
// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>

#include <atomic>
#include <future>
#include <semaphore>
#include <sstream>

#include "gateway/outputs/control/request_handler.h"
#include "gateway/tools/cli/client/records.h"
#include "gateway/tools/cli/client/status_view.h"
#include "tests/gateway/outputs/control/fixture.h"

namespace baudgate::control {
namespace {

using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;

struct FakeAudit final : audit::AuditSource {
  audit::AuditState state() const override { return shown; }
  std::optional<bus::PastRequests> Past() const override { return past; }
  Result<audit::Page> Read(const audit::PageQuery& query) const override {
    if (hangs) {
      reading.release();
      goes_on.acquire();
    }
    if (!trouble.empty()) return Error{trouble};
    audit::Page page;
    page.next = query.after;
    for (const audit::WriteRecord& record : records) {
      if (record.seq <= query.after || (query.since && record.time < *query.since)) continue;
      page.more = page.records.size() == 2;
      if (page.more) break;
      page.records.push_back(record);
      page.next = record.seq;
    }
    return page;
  }
  audit::AuditState shown;
  std::atomic<bool> hangs = false;
  mutable std::counting_semaphore<> reading{0};
  mutable std::counting_semaphore<> goes_on{0};
  std::string trouble;
  std::optional<bus::PastRequests> past = bus::PastRequests();
  std::vector<audit::WriteRecord> records;
};

class WritesTest : public ControlTest {
 protected:
  ~WritesTest() override { StopServer(); }
  WritesTest() {
    audit_.shown.disk = records::Disk::fine;
    for (int i = 1; i <= 5; ++i) {
      audit::WriteRecord record;
      record.seq = i;
      record.time = record.last = status::kNow.wall + i * 1s;
      record.client = "192.0.2.5:40312";
      record.line = "bay-1";
      record.device = "feeder-1";
      record.point = "group";
      record.before = 0.5;
      record.value = std::int64_t{i};
      record.end = WriteEnd::ok;
      record.took = 12345us;
      audit_.records.push_back(record);
    }
  }
  void Start() {
    info_.audit = &audit_;
    StartServerWith(info_);
  }
  int Run(bool json = false, std::optional<WallTime> since = {}) {
    out_.str({});
    err_.str({});
    tools::WritesOptions options;
    options.json = json;
    options.since = since;
    options.socket = path();
    return RunWrites(options, out_, err_);
  }

  FakeAudit audit_;
  status::GatewayInfo info_{"1.2.3", status::kStarted};
  std::ostringstream out_;
  std::ostringstream err_;
};

TEST_F(WritesTest, AHangingDiskDelaysNoOtherRequest) {
  audit_.hangs = true;
  limits_.disk = 1ms;
  Start();
  const RawClient reader = Connect();
  reader.Send("{\"command\":\"writes\"}\n");
  audit_.reading.acquire();
  EXPECT_THAT(Ask(Connect(), kStatus), HasSubstr("substation-7"));
  EXPECT_THAT(reader.ReceiveLine().value_or(""), HasSubstr("does not answer in time"));
  for (std::size_t i = 0; i <= RecordReader::kMost; ++i) {
    EXPECT_THAT(Ask(Connect(), R"({"command":"writes"})"), HasSubstr("does not answer in time"));
  }
  EXPECT_THAT(Ask(Connect(), kStatus), HasSubstr("substation-7"));
  audit_.hangs = false;
  audit_.goes_on.release();
}

TEST_F(WritesTest, AReloadWaitsForNoDisk) {
  audit_.hangs = true;
  info_.audit = &audit_;
  RequestHandler handler(config_, store_, lines_, lines_, info_);
  handler.ReadApart();
  auto before = std::make_shared<config::Config>(config_);
  const std::weak_ptr<config::Config> held = before;
  handler.Apply(std::move(before), nullptr);
  std::promise<std::string> page;
  handler.Answer(R"({"command":"writes"})", {"user:anna", 1}, status::kNow,
                 [&page](std::string text) { page.set_value(std::move(text)); });
  audit_.reading.acquire();
  handler.Apply(std::make_shared<config::Config>(config_), nullptr);
  EXPECT_FALSE(held.expired());
  audit_.hangs = false;
  audit_.goes_on.release();
  EXPECT_THAT(page.get_future().get(), HasSubstr("\"records\""));
  handler.StopReading();
  EXPECT_TRUE(held.expired());
}

TEST_F(WritesTest, JsonListsAllPagesOneObjectPerLine) {
  Start();
  EXPECT_EQ(Run(true), 0) << err_.str();
  std::istringstream lines(out_.str());
  int seq = 0;
  for (std::string line; std::getline(lines, line);) {
    const status::Json record = status::Json::parse(line);
    EXPECT_EQ(record["seq"], ++seq);
    EXPECT_EQ(record["old"], 0.5);
    EXPECT_EQ(record["new"], seq);
    EXPECT_EQ(record["outcome"], "ok");
    EXPECT_EQ(record["took_ms"], 12.345);
    EXPECT_EQ(record["first"], nullptr);
    EXPECT_EQ(record["count"], 1);
    for (const char* key : {"time", "client", "line", "device", "point", "reason"}) {
      EXPECT_TRUE(record[key].is_string()) << key;
    }
  }
  EXPECT_EQ(seq, 5);
}

TEST_F(WritesTest, WritesArePrintedAsATable) {
  audit_.records[4].count = 2000;
  audit_.records[4].first = std::int64_t{7};
  audit_.records[3].end = WriteEnd::refused;
  audit_.records[3].reason = "busy\nwith \x1b[31m itself";
  Start();
  EXPECT_EQ(Run(), 0);
  EXPECT_THAT(out_.str(), HasSubstr("bay-1.feeder-1.group"));
  EXPECT_THAT(out_.str(), HasSubstr("0.5 -> 1"));
  EXPECT_THAT(out_.str(), HasSubstr("2000 times until "));
  EXPECT_THAT(out_.str(), HasSubstr("the first 7"));
  EXPECT_THAT(out_.str(), Not(HasSubstr("\x1b")));
  EXPECT_EQ(std::ranges::count(out_.str(), '\n'), 6);
}

TEST_F(WritesTest, LongNamesDoNotShiftColumns) {
  for (audit::WriteRecord& record : audit_.records) {
    record.point = "a_point_whose_name_is_rather_long";
    record.reason = "so it is";
  }
  Start();
  EXPECT_EQ(Run(), 0);
  std::istringstream lines(out_.str());
  std::string line;
  std::getline(lines, line);
  const std::size_t outcome = line.find("outcome");
  const std::size_t reason = line.find("reason");
  ASSERT_NE(reason, std::string::npos) << line;
  while (std::getline(lines, line)) {
    EXPECT_EQ(line.find("ok "), outcome) << line;
    EXPECT_EQ(line.find("so it is"), reason) << line;
  }
}

TEST_F(WritesTest, SinceOmitsEarlierWrites) {
  Start();
  EXPECT_EQ(Run(true, status::kNow.wall + 4s), 0);
  EXPECT_EQ(std::ranges::count(out_.str(), '\n'), 2);
  EXPECT_EQ(Run(false, status::kNow.wall + 1h), 0);
  EXPECT_THAT(out_.str(), HasSubstr("nothing has been written since then"));
}

TEST_F(WritesTest, AnEmptyListIsReportedInASentence) {
  audit_.records.clear();
  Start();
  EXPECT_EQ(Run(), 0);
  EXPECT_EQ(out_.str(), "nothing has been written yet\n");
  EXPECT_EQ(Run(true), 0);
  EXPECT_THAT(out_.str(), IsEmpty()) << "no line that is no object";
  EXPECT_THAT(err_.str(), HasSubstr("nothing has been written yet"));
}

TEST_F(WritesTest, AGatewayWithoutWritesIsAnError) {
  StartServer();
  EXPECT_EQ(Run(), 4);
  EXPECT_THAT(err_.str(), HasSubstr("this gateway permits no writes"));
}

TEST_F(WritesTest, ADamagedAuditFileIsReported) {
  audit_.trouble = "events.db: it is damaged";
  Start();
  EXPECT_EQ(Run(), 4);
  EXPECT_THAT(err_.str(), HasSubstr("cannot be read: events.db: it is damaged"));
}

TEST_F(WritesTest, TheStatusReportsAFailingDisk) {
  audit_.shown = {
      records::Disk::failing, "events.db: disk full", status::kNow.wall, true, 3, 2, "events.db"};
  Start();
  EXPECT_EQ(Run(), 0);
  EXPECT_THAT(err_.str(), HasSubstr("baudgate: audit: events.db: disk full"));
  const RawClient client = Connect();
  const status::Json status = status::Json::parse(Ask(client, R"({"command":"status"})"));
  EXPECT_EQ(status["audit"]["state"], "failing");
  EXPECT_EQ(status["audit"]["mode"], "require");
  EXPECT_EQ(status["audit"]["waiting"], 3);
  EXPECT_EQ(status["audit"]["lost"], 2);
  const std::string text = tools::RenderStatus(status, "", {});
  EXPECT_THAT(text, HasSubstr("audit: events.db: disk full; writes to points are refused"));
  EXPECT_THAT(text, HasSubstr("audit: 2 records of writes lost"));
}

TEST_F(WritesTest, TheStatusListsFilesThatWerePutAside) {
  audit_.shown.file = "/var/lib/gate/events.db";
  audit_.shown.put_aside = {"events.db.bad", "events.db.bad2"};
  Start();
  const status::Json status = status::Json::parse(Ask(Connect(), R"({"command":"status"})"));
  EXPECT_EQ(status["audit"]["put_aside"].size(), 2U);
  EXPECT_THAT(
      tools::RenderStatus(status, "", {}),
      HasSubstr("audit: /var/lib/gate/events.db.bad (and 1 more) was damaged and put aside"));
}

TEST_F(WritesTest, StrangeRequestsAreHarmless) {
  Start();
  const RawClient client = Connect();
  for (const char* request :
       {R"({"command":"writes","after":"x"})", R"({"command":"writes","since_ms":[]})",
        R"({"command":"writes","order":7})", R"({"command":"writes","after":1e300})"}) {
    EXPECT_EQ(status::Json::parse(Ask(client, request)).value("error", ""), "usage") << request;
  }
  const status::Json page = status::Json::parse(
      Ask(client,
          R"({"command":"writes","after":-9223372036854775808,"since_ms":9223372036854775807})"));
  EXPECT_TRUE(page.contains("records"));
}

using events::AckQuery;

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
  status::Json Ask(const std::string& command, const std::string& more) {
    std::string later;
    const Reply reply =
        service_.Answer(R"({"command":")" + command + "\"" + more + "}", {"user:anna", 1},
                        status::kNow, [&later](const std::string& text) { later = text; });
    return status::Json::parse(reply.text.empty() ? later : reply.text);
  }
  status::Json Ack(const std::string& target) {
    return Ask("ack", R"(,"target":")" + target + "\"");
  }

  FakeEvents events_;
  config::Config config_ = status::TwoLines();
  bus::PointStore store_{config_};
  FakeLines lines_{store_};
  status::GatewayInfo Info() {
    status::GatewayInfo info{"1.2.3", status::kStarted};
    info.events = &events_;
    return info;
  }
  RequestHandler service_{config_, store_, lines_, lines_, Info()};
};

TEST_F(AlarmsTest, TheNumbersThatWereShownOrAWholeLineAreAcknowledged) {
  EXPECT_EQ(Ask("ack", R"(,"seq":[4,9])")["acknowledged"], 2);
  EXPECT_THAT(events_.asked.seqs, ::testing::ElementsAre(4, 9));
  EXPECT_EQ(events_.asked.by, "user:anna");
  EXPECT_EQ(Ask("ack", R"(,"seq":[4,77])")["acknowledged"], 1) << "77 has gone meanwhile";
  EXPECT_EQ(Ask("ack", R"(,"line":"bay-1")")["acknowledged"], 3) << "also of a removed device";
  EXPECT_EQ(Ask("ack", R"(,"line":"io")")["acknowledged"], 0);
  EXPECT_EQ(Ask("ack", R"(,"line":"bay")")["error"], "unknown");
  EXPECT_EQ(Ask("ack", R"(,"line":"bay-1.feeder-1")")["error"], "unknown");
  for (const char* wrong :
       {"", R"(,"seq":[])", R"(,"seq":["4"])", R"(,"seq":4)", R"(,"seq":[4],"line":"bay-1")"}) {
    EXPECT_TRUE(Ask("ack", wrong).contains("error")) << wrong;
  }
}

TEST_F(AlarmsTest, TheWorstIsToldApart) {
  EXPECT_EQ(Ask("alarms", "")["worst"]["seq"], 9);
  events_.alarms.front().state = events::AlarmState::acknowledged;
  EXPECT_EQ(Ask("alarms", "")["worst"]["seq"], 5);
  EXPECT_EQ(Ask("alarms", "")["worst"]["unacknowledged"], true);
  events_.alarms.clear();
  EXPECT_EQ(Ask("alarms", "")["worst"], nullptr);
}

TEST_F(AlarmsTest, AreListedInPagesByEventNumber) {
  const status::Json page = Ask("alarms", "");
  ASSERT_EQ(page["records"].size(), 3U);
  EXPECT_EQ(page["records"][0]["seq"], 4);
  EXPECT_EQ(page["records"][0]["state"], "active");
  EXPECT_EQ(page["next"], 9);
  EXPECT_EQ(page["more"], false);
  EXPECT_EQ(Ask("alarms", ",\"after\":5")["records"].size(), 1U);
  for (int i = 0; i < 300; ++i) events_.Add(10 + i, "feeder-2", "current");
  const status::Json first = Ask("alarms", "");
  EXPECT_EQ(first["records"].size(), events::kPage);
  EXPECT_EQ(first["more"], true);
  const status::Json second = Ask("alarms", ",\"after\":" + first["next"].dump());
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

TEST_F(AlarmsTest, AreAcknowledgedByTheirShownName) {
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

TEST_F(AlarmsTest, AreServedWithoutAnEventsFile) {
  events_.in_memory = true;
  EXPECT_EQ(Ask("alarms", "")["records"].size(), 3U);
  EXPECT_EQ(Ask("events", "")["error"], "unavailable");
  EXPECT_EQ(Ask("status", "")["events"]["in_memory"], true);
}

TEST_F(AlarmsTest, RefuseUnknownTargets) {
  EXPECT_EQ(Ack("77")["error"], "unknown");
  EXPECT_THAT(Ack("77")["message"].get<std::string>(),
              HasSubstr("event 77 has no alarm in the list"));
  EXPECT_THAT(Ack("bay-7")["message"].get<std::string>(), HasSubstr("bay-7"));
  EXPECT_THAT(Ack("")["message"].get<std::string>(), HasSubstr("write LINE, LINE.DEVICE"));
  EXPECT_EQ(Ack("bay-1.nobody")["error"], "unknown");
  EXPECT_EQ(Ack("bay-1.feeder-1.nothing")["error"], "unknown");
  EXPECT_EQ(Ack("a.b.c.d")["error"], "unknown");
}

}  // namespace
}  // namespace baudgate::control
