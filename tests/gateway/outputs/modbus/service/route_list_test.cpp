// Tests how routes keep their numbers when the configuration is reloaded, and of the connections to
// remote servers.
// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>

#include "gateway/outputs/modbus/service/route_table.h"
#include "gateway/outputs/modbus/service/router.h"
#include "gateway/outputs/modbus/service/traffic_book.h"
#include "tests/gateway/outputs/modbus/registers/points.h"
#include "tests/gateway/outputs/modbus/service/fake_target.h"
#include "tests/gateway/outputs/modbus/service/service_fixture.h"
#include "tests/gateway/records/audit/remembering_log.h"

namespace baudgate::modbus {
namespace {

using testing::ElementsAre;

config::Route Unit(std::uint8_t unit) {
  config::Route route;
  route.first = route.last = unit;
  return route;
}

config::Route Elsewhere(std::uint8_t unit, std::uint16_t port) {
  config::Route route = Unit(unit);
  route.host = "127.0.0.1";
  route.port = port;
  return route;
}

TEST(RouteList, RouteNumbersAreNeverReused) {
  RouteList list({Unit(20), Unit(21)});
  EXPECT_THAT(list.numbers(), ElementsAre(0U, 1U));
  list.Renew({Unit(33), Unit(21)}, {std::nullopt, 1});
  EXPECT_THAT(list.numbers(), ElementsAre(2U, 1U));
  EXPECT_EQ(list.at(2).first, 33);
  EXPECT_EQ(list.at(0).first, 20) << "of a request that is still under way";
  list.Renew({Unit(20), Unit(33)}, {std::nullopt, 0});
  EXPECT_THAT(list.numbers(), ElementsAre(3U, 2U)) << "it has gone, and is another one";
  EXPECT_EQ(list.size(), 4U);
}

TEST(RouteList, AnUnchangedRouteGetsTheNewIndexOfItsLine) {
  config::Route route = Unit(20);
  route.line = "drive";
  RouteList list({route});
  route.line_index = 7;
  list.Renew({route}, {0});
  EXPECT_THAT(list.numbers(), ElementsAre(0U));
  EXPECT_EQ(list.at(0).line_index, 7U);
}

class RouteTargetsTest : public testing::Test {
 protected:
  void Renew(const std::vector<config::Route>& routes, const Origins& origins) {
    list_.Renew(routes, origins);
    book_->Show(list_);
    targets_.Relink(lines_);
  }

  asio::io_context io_;
  FakeTarget drive_;
  FakeTarget pumps_;
  std::vector<bus::RouteTarget*> lines_ = {&drive_, &pumps_};
  RouteList list_{{Elsewhere(50, 1), Elsewhere(51, 2)}};
  std::shared_ptr<TrafficBook> book_ = std::make_shared<TrafficBook>();
  RouteTargets targets_{list_, lines_};
};

TEST_F(RouteTargetsTest, AServerConnectionIsKeptWhileARouteUsesIt) {
  targets_.Open(io_, book_);
  bus::RouteTarget* const server = targets_.of(0);
  ASSERT_NE(server, nullptr);
  Renew({Elsewhere(52, 1), Elsewhere(51, 2)}, {std::nullopt, 1});
  EXPECT_EQ(targets_.of(0), nullptr);
  EXPECT_EQ(targets_.of(2), server) << "one connection a server";
  EXPECT_NE(targets_.of(1), server);
  Renew({Elsewhere(51, 2)}, {1});
  Renew({Elsewhere(51, 2), Elsewhere(50, 1)}, {0, std::nullopt});
  EXPECT_EQ(targets_.of(3), server) << "it is back";
  targets_.Close();
}

TEST_F(RouteTargetsTest, ALineMayReplaceAServer) {
  targets_.Open(io_, book_);
  config::Route route = Unit(50);
  route.line = "pumps";
  route.line_index = 1;
  Renew({route}, {std::nullopt});
  EXPECT_EQ(targets_.of(2), &pumps_);
  EXPECT_EQ(targets_.NameOf(&pumps_), "pumps");
  ASSERT_EQ(targets_.lines().size(), 1U);
  EXPECT_EQ(targets_.lines()[0].target, &pumps_);
  targets_.Close();
}

TEST_F(RouteTargetsTest, ARemovedRouteIsNotShown) {
  book_->Show(list_);
  book_->Asked(0, 50);
  Renew({Elsewhere(51, 2), Elsewhere(60, 2)}, {1, std::nullopt});
  book_->Ended(0, 50, RouteOutcome::ok, GoodReply("03 02 00 07"), {});
  book_->Asked(2, 60);
  const auto routes = book_->Status({}).routes;
  ASSERT_EQ(routes.size(), 2U);
  EXPECT_EQ(routes[0].units, "51");
  EXPECT_EQ(routes[0].ok, 0U);
  EXPECT_EQ(routes[1].units, "60");
  EXPECT_EQ(routes[1].requests, 1U);
}

using Kind = Way::Kind;

class RouteTableTest : public testing::Test {
 protected:
  RouteTableTest() : config_(MakeConfig({MakeDevice(20, {}), MakeDevice(21, {})})) {
    AddRoutedLines(config_);
  }
  void Add(std::uint8_t first, std::uint8_t last) {
    config_.modbus.routes.push_back(RouteTo(config_, 1, first, last));
  }
  Way Of(std::uint8_t unit) const { return Of(unit, RouteList(config_.modbus.routes)); }
  Way Of(std::uint8_t unit, const RouteList& routes) const {
    return RouteTable(config_, routes).of(unit);
  }

  config::Config config_;
};

TEST_F(RouteTableTest, WithoutRoutesUnitsAreDevicesOrTheGateway) {
  EXPECT_EQ(Of(20).kind, Kind::device);
  EXPECT_EQ(Of(0).kind, Kind::gateway);
  EXPECT_EQ(Of(255).kind, Kind::gateway);
  for (const std::uint8_t unit : std::array<std::uint8_t, 6>{1, 19, 22, 247, 248, 254})
    EXPECT_EQ(Of(unit).kind, Kind::none);
}

TEST_F(RouteTableTest, DevicesPrecedeRoutes) {
  Add(1, 247);
  EXPECT_EQ(Of(19).kind, Kind::route);
  EXPECT_EQ(Of(20).kind, Kind::device);
  EXPECT_EQ(Of(21).kind, Kind::device);
  EXPECT_EQ(Of(22).kind, Kind::route);
}

TEST_F(RouteTableTest, TheFirstMatchingRouteIsUsed) {
  Add(33, 40);
  Add(40, 41);
  Add(1, 247);
  EXPECT_EQ(Of(33).route, 0U);
  EXPECT_EQ(Of(40).route, 0U);
  EXPECT_EQ(Of(41).route, 1U);
  EXPECT_EQ(Of(42).route, 2U);
  EXPECT_EQ(Of(248).kind, Kind::none);
}

TEST_F(RouteTableTest, ARouteReplacesTheGatewayUnitsThatItNames) {
  Add(255, 255);
  EXPECT_EQ(Of(0).kind, Kind::gateway);
  EXPECT_EQ(Of(255).kind, Kind::route);
  Add(0, 0);
  EXPECT_EQ(Of(0).kind, Kind::route);
  EXPECT_EQ(Of(0).route, 1U);
}

constexpr const char* kWrite = "06 00 08 00 07";

class RoutedWriteTest : public ServiceTest {
 protected:
  RoutedWriteTest() {
    links_.writes = &log_;
    Add(1, 20, 29);
  }
  std::vector<std::string> Noted() const {
    std::vector<std::string> all;
    for (const audit::WriteRecord& record : log_.noted) {
      all.push_back(record.client + " " + record.line + " " + record.device + " " + record.point +
                    " " + ToText(record.value) + " " + std::string(audit::OutcomeOf(record)));
    }
    return all;
  }
  audit::RememberingLog log_;
};

TEST_F(RoutedWriteTest, IsRecordedAfterItsExchange) {
  Ask(21, kWrite);
  EXPECT_TRUE(log_.noted.empty());
  drive_.Wait(0).done(GoodReply(kWrite));
  EXPECT_THAT(Noted(), ElementsAre("10.0.0.7:40112 drive unit 21 06 holding 8 7 ok"));
  EXPECT_EQ(Settle().size(), 1U);
  EXPECT_TRUE(log_.begun.empty() && log_.waited.empty()) << "it waits for nothing";
}

TEST_F(RoutedWriteTest, ReadsAreNotRecorded) {
  Ask(21, "03 00 00 00 01");
  drive_.Wait(0).done(GoodReply("03 02 00 00"));
  Ask(21, "2B 0E 01 00");
  EXPECT_TRUE(log_.noted.empty());
}

TEST_F(RoutedWriteTest, RefusalSilenceAndUnsentAreRecorded) {
  Ask(21, kWrite);
  drive_.Wait(0).done(SlaveException("86 02"));
  Ask(21, kWrite);
  drive_.Wait(1).done(Trouble(Outcome::no_reply, "silence"));
  Ask(21, kWrite);
  drive_.Wait(2).done(Trouble(Outcome::line_down, "unplugged", false));
  EXPECT_THAT(Noted(), ElementsAre(testing::EndsWith("refused"), testing::EndsWith("unknown"),
                                   testing::EndsWith("not_sent")));
}

TEST_F(RoutedWriteTest, BusyAndDeniedWritesAreRecorded) {
  drive_.full = true;
  Ask(21, kWrite);
  listener().permit = config::Permit::read;
  Ask(21, kWrite);
  EXPECT_THAT(Noted(), ElementsAre(testing::EndsWith("busy"), testing::EndsWith("denied")));
  EXPECT_EQ(log_.noted[0].kind, audit::Kind::denied);
}

TEST_F(RoutedWriteTest, ABroadcastIsRecordedAsUnknown) {
  listener().broadcast = config::Listener::Broadcast::pass;
  Ask(0, kWrite);
  drive_.Wait(0).done(GoodReply(Bytes{}));
  EXPECT_THAT(Noted(), ElementsAre("10.0.0.7:40112 drive unit 0 06 holding 8 7 unknown"));
}

}  // namespace
}  // namespace baudgate::modbus
