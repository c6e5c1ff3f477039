// SPDX-License-Identifier: Apache-2.0
#include "gateway/outputs/modbus/service/route_table.h"

#include <gtest/gtest.h>

#include <array>

#include "tests/gateway/outputs/modbus/registers/points.h"
#include "tests/gateway/outputs/modbus/service/fake_target.h"

namespace baudgate::modbus {
namespace {

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

TEST_F(RouteTableTest, WithoutRoutesThereAreDevicesAndTheGateway) {
  EXPECT_EQ(Of(20).kind, Kind::device);
  EXPECT_EQ(Of(0).kind, Kind::gateway);
  EXPECT_EQ(Of(255).kind, Kind::gateway);
  for (const std::uint8_t unit : std::array<std::uint8_t, 6>{1, 19, 22, 247, 248, 254})
    EXPECT_EQ(Of(unit).kind, Kind::none);
}

TEST_F(RouteTableTest, DevicesComeBeforeRoutes) {
  Add(1, 247);
  EXPECT_EQ(Of(19).kind, Kind::route);
  EXPECT_EQ(Of(20).kind, Kind::device);
  EXPECT_EQ(Of(21).kind, Kind::device);
  EXPECT_EQ(Of(22).kind, Kind::route);
}

TEST_F(RouteTableTest, TheFirstRouteThatNamesTheUnitWins) {
  Add(33, 40);
  Add(40, 41);
  Add(1, 247);
  EXPECT_EQ(Of(33).route, 0U);
  EXPECT_EQ(Of(40).route, 0U);
  EXPECT_EQ(Of(41).route, 1U);
  EXPECT_EQ(Of(42).route, 2U);
  EXPECT_EQ(Of(248).kind, Kind::none);
}

TEST_F(RouteTableTest, ARouteTakesTheGatewaysUnitsOverWhenItNamesThem) {
  Add(255, 255);
  EXPECT_EQ(Of(0).kind, Kind::gateway);
  EXPECT_EQ(Of(255).kind, Kind::route);
  Add(0, 0);
  EXPECT_EQ(Of(0).kind, Kind::route);
  EXPECT_EQ(Of(0).route, 1U);
}

}  // namespace
}  // namespace baudgate::modbus
