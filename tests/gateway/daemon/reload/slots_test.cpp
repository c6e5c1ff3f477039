// Who keeps which number over reloads.
// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "gateway/daemon/reload/difference.h"
#include "tests/gateway/daemon/reload/sample_config.h"

namespace baudgate::reload {
namespace {

using config::Config;
using ::testing::ElementsAre;
using ::testing::IsEmpty;

std::vector<std::string> Names(const Config& config) {
  std::vector<std::string> names;
  for (const config::Line& line : config.lines) names.push_back(line.name);
  return names;
}

Placement Placed(const Config& running, const Config& next) {
  return PlaceInSlots(running, next, Compare(running, next));
}

TEST(Placement, WhatGoesOnKeepsItsNumber) {
  Config next = Sample();
  std::swap(next.lines[0], next.lines[2]);
  const Placement placed = Placed(Sample(), next);
  EXPECT_THAT(Names(placed.config), ElementsAre("x", "y", "z"));
  EXPECT_THAT(placed.gone, IsEmpty());
  EXPECT_THAT(placed.updated, IsEmpty());
  EXPECT_THAT(placed.begun, IsEmpty());
}

TEST(Placement, WhatEndsLeavesAnEmptyPlaceAndWhatBeginsGetsTheNext) {
  Config next = Sample();
  next.lines[0].port = "/dev/other";
  next.lines.erase(next.lines.begin() + 1);
  next.lines.insert(next.lines.begin(), LineOf("w"));
  const Placement placed = Placed(Sample(), next);
  EXPECT_THAT(Names(placed.config), ElementsAre("", "", "z", "w", "x"));
  EXPECT_EQ(placed.config.lines[0].devices.size(), 2U);
  EXPECT_FALSE(placed.config.lines[0].devices[0].unit);
  EXPECT_THAT(placed.gone, ElementsAre(0U, 1U));
  EXPECT_THAT(placed.begun, ElementsAre(3U, 4U));
  EXPECT_EQ(placed.config.lines[4].port, "/dev/other");

  const Placement again = Placed(placed.config, Sample());
  EXPECT_THAT(Names(again.config), ElementsAre("", "", "z", "", "", "x", "y"));
  EXPECT_THAT(again.gone, ElementsAre(3U, 4U)) << "and not those that are gone already";
  EXPECT_THAT(again.begun, ElementsAre(5U, 6U));
}

TEST(Placement, LinesThatAreShownOtherwiseAreNamed) {
  Config next = Sample();
  next.lines[1].devices[0].unit = 7;
  const Placement placed = Placed(Sample(), next);
  EXPECT_THAT(placed.updated, ElementsAre(1U));
  EXPECT_EQ(placed.config.lines[1].devices[0].unit, 7);
}

TEST(Placement, NumbersOfDevicesAndLinesFollow) {
  const auto with_numbers = [](Config config, std::uint32_t device, std::size_t line) {
    config.history.points.push_back({.device = device, .point = 1});
    config::Route route;
    route.line = "y";
    route.line_index = line;
    config.modbus.routes.push_back(route);
    for (config::Line& one : config.lines) {
      if (one.name != "z") continue;
      one.devices[0].points[0].writing.allow_when = {
          {.point = "y.y-b.current", .is = true, .device = device}};
    }
    return config;
  };
  const Config running = with_numbers(Sample(), 3, 1);  // y-b
  Config next = Sample();
  next.lines.erase(next.lines.begin());
  next.lines[0].port = "/dev/other";  // y begins anew
  const Placement placed = Placed(running, with_numbers(next, 1, 0));
  EXPECT_THAT(Names(placed.config), ElementsAre("", "", "z", "y"));
  EXPECT_EQ(placed.config.history.points[0].device, 7U);
  EXPECT_EQ(placed.config.modbus.routes[0].line_index, 3U);
  EXPECT_EQ(placed.config.lines[2].devices[0].points[0].writing.allow_when[0].device, 7U);
  EXPECT_THAT(placed.updated, ElementsAre(2U)) << "its interlock looks at another number";
}

}  // namespace
}  // namespace baudgate::reload
