// Modbus clients and routes in the status, as JSON and as people see them.
// SPDX-License-Identifier: Apache-2.0
#include "gateway/outputs/modbus/service/traffic_json.h"

#include <gmock/gmock.h>

#include "gateway/outputs/status/status_json.h"
#include "gateway/tools/cli/client/status_view.h"
#include "gateway/tools/cli/client/traffic_view.h"
#include "tests/gateway/outputs/fake_output.h"
#include "tests/gateway/outputs/status/table_docs.h"
#include "tests/gateway/outputs/status/two_lines.h"

namespace baudgate::control {
namespace {

using ::testing::EndsWith;
using ::testing::HasSubstr;
using ::testing::Not;

modbus::TrafficStatus TwoClients() {
  modbus::TrafficStatus fake;
  modbus::ClientStatus plc;
  plc.id = 1;
  plc.peer = "10.0.0.7:40112";
  plc.listener = "0.0.0.0:502";
  plc.priority = config::Priority::high;
  plc.since = kNow.wall - 1h;
  plc.last_request = kNow.wall - 30ms;
  plc.requests = 120'000;
  plc.exceptions = 3;
  plc.bytes_in = 1'440'000;
  plc.bytes_out = 1'320'000;
  plc.outstanding = 2;
  modbus::ClientStatus panel;
  panel.id = 2;
  panel.peer = "/dev/ttyS1";
  panel.listener = "/dev/ttyS1";
  panel.since = kNow.wall - 3h;
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
  drive.last_trouble_at = kNow.wall - 12s;
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
  port.since = kNow.wall - 3h;
  port.frames = 980;
  port.damaged = 20;
  port.last_frame = kNow.wall - 2s;
  fake.masters = {port};
  return fake;
}

TEST(Traffic, RoutesAndClientsHaveATableEach) {
  EXPECT_EQ(RenderTraffic(TrafficJson(TwoClients(), {}, kNow), {}), R"(
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

TEST(Traffic, EachCounterOfARouteStandsOnceAndInTheDocumentation) {
  EXPECT_THAT(TroublesOfKeys<modbus::RouteStatus>("of a route"), ::testing::IsEmpty());
}

TEST(Traffic, TheJsonOfARouteIsAsEver) {
  modbus::TrafficStatus traffic = TwoClients();
  traffic.routes.resize(1);
  traffic.routes[0].by_unit.clear();
  const Json route = TrafficJson(traffic, {}, kNow).at("routes").at(0);
  const Json expected = Json::parse(
      R"({"units":"20","target":"line bay-1","requests":120000,"ok":119990,"refused":4,)"
      R"("denied":0,"no_reply":3,"expired":0,"busy":0,"dropped":3,"broadcasts":0,)"
      R"("shared":0,"mean_wait_us":12000,"longest_wait_us":170000,)"
      R"("last_trouble":"no reply within 500ms",)"
      R"("last_trouble_at":"2026-09-21T14:13:08.000Z","late":0,"by_unit":[]})");
  EXPECT_EQ(Known(route, expected).dump(), expected.dump());
}

TEST(Traffic, NothingIsSaidWhereThereIsNeither) {
  EXPECT_EQ(RenderTraffic(TrafficJson({}, {}, kNow), {}), "");
}

/// With the section of a Modbus server that has these clients and routes.
Json Status(const config::Config& config, const PointStore& store,
            const std::optional<Target>& target) {
  const std::string line = target ? config.lines[target->line].name : std::string();
  OutputList outputs;
  outputs.push_back(std::make_unique<FakeOutput>("modbus", TrafficJson(TwoClients(), line, kNow)));
  return StatusJson(config, store, {"1.2.3", kStarted, &outputs}, target, kNow);
}

TEST(Traffic, TheStatusHoldsIt) {
  const config::Config config = TwoLines();
  PointStore store(config);
  const Json all = Status(config, store, std::nullopt);
  EXPECT_EQ(all.at("modbus").at("clients").size(), 2U);
  EXPECT_EQ(all.at("modbus").at("routes").at(0).at("mean_wait_us"), 12'000);
  const std::string shown = RenderStatus(all, {}, {});
  EXPECT_THAT(
      shown,
      HasSubstr("route 20 to line bay-1: 3 of 120000 requests had no good reply, the "
                "last 12 s ago: no reply within 500ms; look at the power and the wire of its "
                "units\n"));
  EXPECT_THAT(shown, HasSubstr("master on /dev/ttyS1: 20 of 1000 frames were damaged"));
}

TEST(Traffic, ALineShowsItsOwnRoutesOnly) {
  const config::Config config = TwoLines();
  PointStore store(config);
  const auto shown = [&](const std::string& line) {
    const auto target = FindTarget(config, line).value();
    return RenderStatus(Status(config, store, target), line, {});
  };
  EXPECT_THAT(shown("bay-1"), HasSubstr("line bay-1"));
  EXPECT_THAT(shown("bay-1"), Not(HasSubstr("10.0.0.9")));
  EXPECT_THAT(shown("io"), Not(HasSubstr("route to")));
  EXPECT_THAT(shown("io"), Not(HasSubstr("master on")));
}

}  // namespace
}  // namespace baudgate::control
