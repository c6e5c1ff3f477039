// Tests of Modbus clients and routes in the status, as JSON and as text.
// SPDX-License-Identifier: Apache-2.0
#include "gateway/outputs/modbus/service/traffic_json.h"

#include <fmt/format.h>
#include <gmock/gmock.h>

#include <algorithm>

#include "gateway/outputs/modbus/service/traffic.h"
#include "gateway/outputs/status/status_json.h"
#include "gateway/tools/cli/client/status_view.h"
#include "gateway/tools/cli/client/traffic_view.h"
#include "tests/gateway/outputs/fake_output.h"
#include "tests/gateway/outputs/modbus/service/service_fixture.h"
#include "tests/gateway/outputs/status/table_docs.h"
#include "tests/gateway/outputs/status/two_lines.h"

namespace baudgate::modbus {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

modbus::TrafficStatus TwoClients() {
  modbus::TrafficStatus fake;
  modbus::ClientStatus plc;
  plc.id = 1;
  plc.peer = "10.0.0.7:40112";
  plc.listener = "0.0.0.0:502";
  plc.priority = config::Priority::high;
  plc.since = status::kNow.wall - 1h;
  plc.last_request = status::kNow.wall - 30ms;
  plc.requests = 120'000;
  plc.exceptions = 3;
  plc.bytes_in = 1'440'000;
  plc.bytes_out = 1'320'000;
  plc.outstanding = 2;
  modbus::ClientStatus panel;
  panel.id = 2;
  panel.peer = "/dev/ttyS1";
  panel.listener = "/dev/ttyS1";
  panel.since = status::kNow.wall - 3h;
  fake.clients = {plc, panel};
  modbus::RouteStatus drive;
  drive.units = "20";
  drive.target = "line bay-1";
  drive.requests = 120'000;
  drive.ok = 119'990;
  drive.refused = 4;
  drive.no_reply = 3;
  drive.dropped = 3;
  drive.total_wait = 119'994 * 12ms;
  drive.longest_wait = 170ms;
  drive.last_trouble = "no reply within 500ms";
  drive.last_trouble_at = status::kNow.wall - 12s;
  drive.by_unit[20] = drive;
  modbus::RouteStatus rest;
  rest.units = "50-59";
  rest.target = "server 10.0.0.9:502";
  rest.requests = rest.ok = 10;
  rest.by_unit[50].requests = rest.by_unit[50].ok = 7;
  rest.by_unit[51].requests = rest.by_unit[51].ok = 3;
  fake.routes = {drive, rest};
  modbus::MasterStatus port;
  port.port = "/dev/ttyS1";
  port.is_open = true;
  port.text = "/dev/ttyS1, 19200 8E1";
  port.since = status::kNow.wall - 3h;
  port.frames = 980;
  port.damaged = 20;
  port.last_frame = status::kNow.wall - 2s;
  fake.masters = {port};
  return fake;
}

TEST(Traffic, RoutesAndClientsAreShownInTables) {
  EXPECT_EQ(tools::RenderTraffic(TrafficJson(TwoClients(), {}, status::kNow), {}), R"(
units  route to             requests      ok  refused  no reply  too late  queue full  client left  mean wait
20     line bay-1             120000  119990        4         3         0           0            3    12.0 ms
50-59  server 10.0.0.9:502        10      10        0         0         0           0            0     0.0 ms
  50                               7       7        0         0         0           0            0     0.0 ms
  51                               3       3        0         0         0           0            0     0.0 ms

master on   port  frames  damaged  last
/dev/ttyS1  open     980       20  2.0 s

client          on           priority  requests  exceptions  waiting  bytes in  bytes out  last
10.0.0.7:40112  0.0.0.0:502  high        120000           3        2   1440000    1320000  0.0 s
/dev/ttyS1      /dev/ttyS1   normal           0           0        0         0          0  -
)");
}

TEST(Traffic, EachRouteCounterIsUniqueAndDocumented) {
  EXPECT_THAT(status::TroublesOfKeys<modbus::RouteStatus>("field of a route"),
              ::testing::IsEmpty());
}

TEST(Traffic, TheJsonOfARouteIsUnchanged) {
  modbus::TrafficStatus traffic = TwoClients();
  traffic.routes.resize(1);
  traffic.routes[0].by_unit.clear();
  const status::Json route = TrafficJson(traffic, {}, status::kNow).at("routes").at(0);
  const status::Json expected = status::Json::parse(
      R"({"units":"20","target":"line bay-1","requests":120000,"ok":119990,"refused":4,)"
      R"("denied":0,"no_reply":3,"expired":0,"busy":0,"dropped":3,"broadcasts":0,)"
      R"("shared":0,"mean_wait_us":12000,"longest_wait_us":170000,)"
      R"("last_trouble":"no reply within 500ms",)"
      R"("last_trouble_at":"2026-09-21T14:13:08.000Z","late":0,"by_unit":[]})");
  EXPECT_EQ(status::Known(route, expected).dump(), expected.dump());
}

TEST(Traffic, IsEmptyWithoutRoutesAndClients) {
  EXPECT_EQ(tools::RenderTraffic(TrafficJson({}, {}, status::kNow), {}), "");
}

status::Json StatusOf(const config::Config& config, const bus::PointStore& store,
                      const std::optional<status::Target>& target) {
  const std::string line = target ? config.lines[target->line].name : std::string();
  outputs::OutputList outputs;
  outputs.push_back(std::make_unique<outputs::FakeOutput>(
      "modbus", TrafficJson(TwoClients(), line, status::kNow)));
  return StatusJson(config, store, {"1.2.3", status::kStarted, &outputs}, target, status::kNow);
}

TEST(Traffic, IsPartOfTheStatus) {
  const config::Config config = status::TwoLines();
  bus::PointStore store(config);
  const status::Json all = StatusOf(config, store, std::nullopt);
  EXPECT_EQ(all.at("modbus").at("clients").size(), 2U);
  EXPECT_EQ(all.at("modbus").at("routes").at(0).at("mean_wait_us"), 12'000);
  const std::string shown = tools::RenderStatus(all, {}, {});
  EXPECT_THAT(shown,
              HasSubstr("route 20 to line bay-1: 3 of 120000 requests had no good reply, the "
                        "last 12 s ago: no reply within 500ms; check power and wiring of the "
                        "units\n"));
  EXPECT_THAT(shown, HasSubstr("master on /dev/ttyS1: 20 of 1000 frames were damaged"));
}

TEST(Traffic, ALineShowsItsOwnRoutesOnly) {
  const config::Config config = status::TwoLines();
  bus::PointStore store(config);
  const auto shown = [&](const std::string& line) {
    const auto target = status::FindTarget(config, line).value();
    return tools::RenderStatus(StatusOf(config, store, target), line, {});
  };
  EXPECT_THAT(shown("bay-1"), HasSubstr("line bay-1"));
  EXPECT_THAT(shown("bay-1"), Not(HasSubstr("10.0.0.9")));
  EXPECT_THAT(shown("io"), Not(HasSubstr("route to")));
  EXPECT_THAT(shown("io"), Not(HasSubstr("master on")));
}

}  // namespace
}  // namespace baudgate::modbus

namespace baudgate::modbus {
namespace {

using testing::IsEmpty;
using testing::SizeIs;

class TrafficTest : public ServiceTest {
 protected:
  static void ExpectSum(const RouteCounters& counters, std::uint64_t under_way) {
    EXPECT_EQ(counters.requests, counters.ok + counters.refused + counters.denied +
                                     counters.no_reply + counters.expired + counters.busy +
                                     counters.dropped + counters.broadcasts + under_way);
  }
};

TEST_F(TrafficTest, RequestsOfAListenerAreCountedByFunctionAndAnswer) {
  Enter(wire_, config::Priority::high);
  Ask(1, "03 00 00 00 01");
  Ask(1, "03 00 00 00 01");
  Ask(1, "03 00 09 00 01");
  Ask(1, "6F");
  services_[0]->Close();
  std::vector<std::string> counts;
  for (const FunctionCount& count : Traffic().functions) {
    counts.push_back(fmt::format("{} {} {} {}", count.listener, count.function, count.exception,
                                 count.requests));
  }
  EXPECT_THAT(counts, testing::ElementsAre("127.0.0.1:1502 3 0 2", "127.0.0.1:1502 3 2 1",
                                           "127.0.0.1:1502 0 1 1"));
}

TEST_F(TrafficTest, RequestsAndBytesOfAClientAreCounted) {
  Add(1, 20, 20);
  Enter(wire_, config::Priority::high);
  const Now entered = Clocks();
  ASSERT_THAT(Traffic().clients, SizeIs(1));
  EXPECT_EQ(Traffic().clients[0].last_request, WallTime{});
  Ask(1, "03 00 00 00 01");
  Ask(1, "03 00 09 00 01");
  Ask(20, kRead);
  now_ += 2s;
  const ClientStatus client = Traffic().clients[0];
  EXPECT_EQ(client.id, drive_.Wait(0).client);
  EXPECT_EQ(client.peer, "10.0.0.7:40112");
  EXPECT_EQ(client.listener, "127.0.0.1:1502");
  EXPECT_EQ(client.priority, config::Priority::high);
  EXPECT_EQ(client.since, entered.wall);
  EXPECT_EQ(client.last_request, entered.wall);
  EXPECT_EQ(client.requests, 3U);
  EXPECT_EQ(client.exceptions, 1U);
  EXPECT_EQ(client.bytes_in, 36U);
  EXPECT_EQ(client.bytes_out, 11U + 9U);
  EXPECT_EQ(client.outstanding, 1U);
  drive_.Wait(0).done(SlaveException("83 02"));
  Settle();
  EXPECT_EQ(Traffic().clients[0].exceptions, 2U);
  EXPECT_EQ(Traffic().clients[0].bytes_out, 11U + 9U + 9U);
  EXPECT_EQ(Traffic().clients[0].outstanding, 0U);
  EXPECT_EQ(shared_->counters().Snapshot().exceptions, 2U);
}

TEST_F(TrafficTest, BytesOfRtuClientsAreCountedPerRtuFrame) {
  listener().framing = Framing::rtu;
  Ask(1, "03 00 00 00 01");
  EXPECT_EQ(Traffic().clients[0].bytes_in, 8U);
  EXPECT_EQ(Traffic().clients[0].bytes_out, 7U);
}

TEST_F(TrafficTest, EachClientHasItsOwnCounters) {
  KeptWire other;
  Enter(wire_);
  Enter(other)->Handle(Frame(1, "03 00 00 00 01"), Clocks());
  ASSERT_THAT(Traffic().clients, SizeIs(2));
  EXPECT_LT(Traffic().clients[0].id, Traffic().clients[1].id);
  EXPECT_EQ(Traffic().clients[0].requests, 0U);
  EXPECT_EQ(Traffic().clients[1].requests, 1U);
  const std::uint64_t second = IdOf(1);
  services_[0]->Close();
  ASSERT_THAT(Traffic().clients, SizeIs(1));
  EXPECT_EQ(IdOf(0), second);
}

TEST_F(TrafficTest, TheEndOfARoutedRequestIsReported) {
  Add(1, 20, 22).remap = 1;
  std::vector<std::string> told;
  links_.routed = [&told](const RoutedReport& end, Now) {
    told.push_back(end.route.Target() + " " + std::to_string(end.unit) + " " +
                   std::to_string(static_cast<int>(end.end)) + " " + end.reply.reason);
  };
  Ask(21, kRead);
  Ask(22, kRead);
  bus::RoutedReply silence;
  silence.outcome = Outcome::no_reply;
  silence.reason = "no reply";
  silence.sent = true;
  drive_.Wait(0).done(SlaveException("83 02"));
  drive_.Wait(1).done(silence);
  Settle();
  EXPECT_THAT(told, testing::ElementsAre("line drive 21 1 ", "line drive 22 2 no reply"));
}

TEST_F(TrafficTest, EveryEndOfARoutedRequestIsCounted) {
  Add(1, 20, 22);
  config_.modbus.routes.back().remap = 1;
  Add(2, 30, 30);
  bus::RoutedReply ok = GoodReply("03 02 00 07");
  ok.waited = 30ms;
  bus::RoutedReply shared = ok;
  shared.shared = true;
  shared.waited = 10ms;
  const std::size_t kLate[] = {5, 6};
  const bus::RoutedReply replies[] = {ok,
                                      shared,
                                      SlaveException("83 02"),
                                      Trouble(Outcome::corrupt, "checksum"),
                                      Trouble(Outcome::line_down, "the port is closed", false),
                                      Trouble(Outcome::no_reply, "waited too long", false),
                                      Trouble(Outcome::no_reply, "silence"),
                                      Trouble(Outcome::no_reply, "the slave is absent", false)};
  std::size_t number = 0;
  for (const bus::RoutedReply& reply : replies) {
    const bool late = std::ranges::find(kLate, number) != std::end(kLate);
    now_ -= late ? 1h : 0h;
    Ask(static_cast<std::uint8_t>(20 + number % 3), kRead);
    now_ += late ? 1h : 0h;
    drive_.Wait(number++).done(reply);
    Settle();
  }
  Ask(20, kRead);
  drive_.full = true;
  Ask(20, kRead);
  const TrafficStatus traffic = Traffic();
  ASSERT_THAT(traffic.routes, SizeIs(2)) << "none for broadcasts, as there were none";
  const RouteStatus& route = traffic.routes[0];
  EXPECT_EQ(route.units, "20-22");
  EXPECT_EQ(route.target, "line drive");
  EXPECT_EQ(route.requests, 10U);
  EXPECT_EQ(route.ok, 2U);
  EXPECT_EQ(route.refused, 1U);
  EXPECT_EQ(route.no_reply, 4U);
  EXPECT_EQ(route.expired, 1U);
  EXPECT_EQ(route.busy, 1U);
  EXPECT_EQ(route.shared, 1U);
  EXPECT_EQ(route.longest_wait, 30ms);
  EXPECT_EQ(route.total_wait, 40ms);
  EXPECT_EQ(route.last_trouble, "the request was not sent, because too many requests wait already");
  ExpectSum(route, 1);
  ASSERT_THAT(route.by_unit, SizeIs(3));
  EXPECT_EQ(route.by_unit.at(20).requests, 5U);
  EXPECT_EQ(route.by_unit.at(21).requests, 3U);
  ExpectSum(route.by_unit.at(20), 1);
  EXPECT_EQ(traffic.routes[1].requests, 0U);
  EXPECT_THAT(traffic.routes[1].by_unit, IsEmpty());
  services_[0]->Close();
  EXPECT_EQ(Traffic().routes[0].dropped, 1U);
  ExpectSum(Traffic().routes[0], 0);
}

TEST_F(TrafficTest, ADeniedRoutedRequestIsCounted) {
  Add(1, 20, 22);
  listener().permit = config::Permit::read;
  Ask(21, "06 00 08 00 07");
  const RouteStatus route = Traffic().routes.at(0);
  EXPECT_EQ(route.denied, 1U);
  EXPECT_EQ(route.by_unit.at(21).denied, 1U);
  EXPECT_EQ(route.last_trouble, "") << "the slave has none";
  ExpectSum(route, 0);
}

TEST(TrafficBookTest, APortShowsTheTimesOfTheCaller) {
  TrafficBook book;
  config::Listener listener;
  listener.path = "/dev/ttyUSB0";
  const std::size_t port = book.AddMaster(listener, WallTime(1h));
  const auto master = [&book] { return book.Status({}).masters.at(0); };
  EXPECT_EQ(master().since, WallTime(1h));
  book.ShowPort(port, true, "open", WallTime(2h));
  book.Heard(port, WallTime(3h));
  book.ShowPort(port, true, "still open", WallTime(4h));
  EXPECT_EQ(master().since, WallTime(2h)) << "since it is open";
  EXPECT_EQ(master().last_frame, WallTime(3h));
  book.HeardEcho(port);
  EXPECT_EQ(master().echoes, 1U);
  book.ShowPort(port, false, "gone", WallTime(5h));
  EXPECT_EQ(master().since, WallTime(5h));
}

TEST_F(TrafficTest, AnExceptionOfASlaveIsNotShownAsTrouble) {
  Add(1, 20, 20);
  Ask(20, kRead);
  drive_.Wait(0).done(Trouble(Outcome::partial, "stopped mid-frame"));
  Ask(20, kRead);
  bus::RoutedReply refused = SlaveException("83 02");
  refused.reason = "illegal data address";
  drive_.Wait(1).done(refused);
  Settle();
  EXPECT_EQ(Traffic().routes[0].last_trouble, "stopped mid-frame");
}

}  // namespace
}  // namespace baudgate::modbus

namespace baudgate::modbus {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

constexpr WallTime kToday = WallTime(1000h);

modbus::MasterStatus Open() {
  modbus::MasterStatus master;
  master.port = "/dev/ttyS1";
  master.is_open = true;
  master.text = "19200 8E1";
  master.since = kToday - 3h;
  master.frames = 1000;
  master.last_frame = kToday - 1s;
  return master;
}

TEST(DiagnoseMaster, AWorkingMasterGetsNoAdvice) {
  modbus::MasterStatus master = Open();
  EXPECT_THAT(DiagnoseMaster(master, kToday), IsEmpty());
  master.damaged = 9;
  EXPECT_THAT(DiagnoseMaster(master, kToday), IsEmpty()) << "now and then";
}

TEST(DiagnoseMaster, DamagedFramesAreReportedWithTheSerialSettings) {
  modbus::MasterStatus master = Open();
  master.damaged = 250;
  EXPECT_THAT(
      DiagnoseMaster(master, kToday),
      ElementsAre("250 of 1250 frames were damaged and not answered: check bit rate, parity "
                  "and wiring (19200 8E1)"));
}

TEST(DiagnoseMaster, AMasterOfAnotherFramingIsReported) {
  modbus::MasterStatus master = Open();
  master.other = modbus::Framing::ascii;
  EXPECT_THAT(
      DiagnoseMaster(master, kToday),
      ElementsAre("the requests of the master are not understood: it sends Modbus ASCII, but "
                  "this listener expects Modbus RTU; set framing: ascii at the listener, or "
                  "change the master"));
}

TEST(DiagnoseMaster, AClosedPortIsReportedWithReasonAndDuration) {
  modbus::MasterStatus master = Open();
  master.is_open = false;
  master.text = "No such file or directory";
  master.since = kToday - 5min;
  EXPECT_THAT(DiagnoseMaster(master, kToday),
              ElementsAre("port closed for 5 min: No such file or directory; the gateway tries "
                          "again until the port opens"));
}

TEST(DiagnoseMaster, AnEchoIsReportedInEveryState) {
  modbus::MasterStatus master = Open();
  master.echoes = 7;
  const char* kEcho =
      "the adapter has echoed 7 of the gateway's own replies: set 'echo: strip' at the listener";
  EXPECT_THAT(DiagnoseMaster(master, kToday), ElementsAre(kEcho));
  master.last_frame = kToday - 2min;
  EXPECT_THAT(DiagnoseMaster(master, kToday),
              ElementsAre(kEcho, "no request has come for 2 min: does the master still poll?"));
}

TEST(DiagnoseMaster, TheAdviceOnSilenceDependsOnEarlierFrames) {
  modbus::MasterStatus master = Open();
  master.last_frame = kToday - 2min;
  EXPECT_THAT(DiagnoseMaster(master, kToday),
              ElementsAre("no request has come for 2 min: does the master still poll?"));
  master.last_frame = {};
  master.frames = 0;
  EXPECT_THAT(
      DiagnoseMaster(master, kToday),
      ElementsAre("no byte has come for 3 h: does the master poll, and are A and B swapped?"));
  master.damaged = 7;
  EXPECT_THAT(DiagnoseMaster(master, kToday),
              ElementsAre("bytes arrive, but no complete request has come for 3 h: check bit rate, "
                          "parity and wiring (19200 8E1)"));
  master.since = kToday - 30s;
  master.damaged = 0;
  EXPECT_THAT(DiagnoseMaster(master, kToday), IsEmpty()) << "the port is open for a moment only";
}

TEST(DiagnoseRoute, AWorkingRouteGetsNoAdvice) {
  modbus::RouteStatus route;
  route.requests = 12;
  route.ok = 10;
  route.refused = route.dropped = 1;
  EXPECT_THAT(DiagnoseRoute(route, kToday), IsEmpty());
}

TEST(DiagnoseRoute, FailuresAndLateRepliesAreReported) {
  modbus::RouteStatus route;
  route.requests = 12;
  route.no_reply = route.expired = route.busy = 1;
  route.late = 2;
  route.last_trouble = "is gone";
  route.last_trouble_at = kToday - 30s;
  const std::string failed = "3 of 12 requests had no good reply, the last 30 s ago: is gone; ";
  const std::string late =
      "2 replies came after their deadline and were dropped: raise the route's deadline";
  EXPECT_THAT(DiagnoseRoute(route, kToday),
              ElementsAre(failed + "check power and wiring of the units", late));
  route.no_reply = 0;
  route.busy = 2;
  EXPECT_THAT(
      DiagnoseRoute(route, kToday),
      ElementsAre(
          failed +
              "clients send more requests than the line can carry: let the clients poll less often",
          late));
  route.busy = 0;
  route.expired = 3;
  EXPECT_THAT(DiagnoseRoute(route, kToday),
              ElementsAre(failed + "the line is too busy: let clients poll less often, or raise "
                                   "the route's deadline",
                          late));
  route.last_trouble_at = kToday - 11min;
  EXPECT_THAT(DiagnoseRoute(route, kToday), ElementsAre(late)) << "it is over";
}

TEST(DiagnoseRoute, AUnitThatHasNeverAnsweredIsNamed) {
  modbus::RouteStatus route;
  route.target = "line drive";
  route.requests = route.by_unit[51].requests = 40;
  route.no_reply = route.by_unit[51].no_reply = 40;
  route.last_trouble = "no_reply";
  route.last_trouble_at = kToday - 1s;
  const std::string unit =
      "unit 51 has never answered (40 requests; last failure of the route: no_reply): check its "
      "power, address and wiring; ";
  EXPECT_THAT(DiagnoseRoute(route, kToday),
              ElementsAre(unit + "if no unit of line drive answers, check port, wiring, bit rate "
                                 "and parity"));
  route.by_unit[52].requests = route.by_unit[52].ok = 3;
  EXPECT_THAT(DiagnoseRoute(route, kToday),
              ElementsAre(unit + "line drive works, because unit 52 answers"));
}

}  // namespace
}  // namespace baudgate::modbus
