// Which number a route has over reloads, and which servers elsewhere are connected to.
// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "gateway/outputs/modbus/service/route_table.h"
#include "gateway/outputs/modbus/service/router.h"
#include "gateway/outputs/modbus/service/traffic_book.h"
#include "tests/gateway/outputs/modbus/service/fake_target.h"

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

TEST(RouteList, NumbersAreForGood) {
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

TEST(RouteList, OfARouteThatIsTheSameTheLineMayHaveAnotherNumber) {
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
  std::vector<RouteTarget*> lines_ = {&drive_, &pumps_};
  RouteList list_{{Elsewhere(50, 1), Elsewhere(51, 2)}};
  std::shared_ptr<TrafficBook> book_ = std::make_shared<TrafficBook>();
  RouteTargets targets_{list_, lines_};
};

TEST_F(RouteTargetsTest, AServerIsTheSameForAsLongAsARouteLeadsThere) {
  targets_.Open(io_, book_);
  RouteTarget* const server = targets_.of(0);
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

TEST_F(RouteTargetsTest, ALineMayComeInPlaceOfAServer) {
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

TEST_F(RouteTargetsTest, ARouteOfBeforeIsCountedAndNotShown) {
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

}  // namespace
}  // namespace baudgate::modbus
