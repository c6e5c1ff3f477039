// Tests the checks on structs, without YAML. Every problem must be reported at the line and column
// (Mark) of its key.
// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "config/catalog/option_values.h"
#include "config/checks/device_checks.h"
#include "config/checks/modbus_checks.h"
#include "config/checks/point_checks.h"
#include "tests/config/fake_protocol.h"

namespace baudgate::testing {
namespace {

using config::Device;
using config::Keys;
using config::Mark;
using config::Point;
using config::Problems;

std::string Sorted(const Problems& problems) { return Shown(problems.Sorted()); }

Point Named(const char* name, const char* read) {
  Point point;
  point.name = name;
  point.read = read;
  return point;
}

TEST(Checks, AnAbsentKeyHasThePlaceOfItsMap) {
  const Keys keys{{"f", 3, 1}, {{"poll", {"f", 4, 9}}}};
  EXPECT_TRUE(keys.Has("poll"));
  EXPECT_FALSE(keys.Has("slow"));
  EXPECT_EQ(keys.MarkOf("poll").ToString(), "f:4:9");
  EXPECT_EQ(keys.MarkOf("slow").ToString(), "f:3:1");
}

TEST(Checks, ProblemsOfAPointNameThePlacesOfItsKeys) {
  const protocols::Protocol protocol = MakeFakeProtocol("fake");
  Point point = Named("p", "X1");
  point.scale = 0;
  Problems problems;
  CheckPoint(point, &protocol, {{"f", 1, 1}, {{"scale", {"f", 2, 5}}}}, problems);
  EXPECT_EQ(
      Sorted(problems),
      "f:1:1: error: point 'p': read 'X1' is not understood; write A and a number\nf:2:5: error: "
      "scale: 0 would make every value the same; write another number, or remove the key\n");
}

TEST(Checks, WithoutAProtocolItsChecksAreSkipped) {
  Problems problems;
  CheckPoint(Named("p", "X1"), nullptr, {}, problems);
  Device device;
  device.points = {Named("p", "X1")};
  CheckDevice(device, nullptr, {{}, {{"points", {}}}}, problems);
  EXPECT_EQ(Sorted(problems), "");
}

TEST(Checks, ADeviceIsCheckedByItsProtocol) {
  const protocols::Protocol protocol = MakeFakeProtocol("fake");
  Device device;
  device.name = "d";
  device.mark = {"f", 1, 1};
  device.options = config::DefaultOptions(protocol);
  device.options.Set("mode", std::string("slow"));
  device.options.Set("width", std::int64_t{20});
  Problems problems;
  CheckDevice(device, &protocol, {device.mark, {{"profile", {"f", 1, 9}}}}, problems);
  EXPECT_EQ(Sorted(problems), "f:1:1: error: device 'd': mode slow has no room for width 20\n");
}

TEST(Checks, TwoSpellingsOfOneAddressAreOneDevice) {
  const protocols::Protocol protocol = MakeFakeProtocol("fake");
  config::LineAddresses addresses;
  Problems problems;
  Device first;
  first.name = "first";
  first.address = "7";
  Device second = first;
  second.name = "second";
  second.address = "07";
  addresses.Add(first, protocol, {"f", 1, 1}, problems);
  addresses.Add(second, protocol, {"f", 2, 1}, problems);
  second.address = "8";
  addresses.Add(second, protocol, {"f", 3, 1}, problems);
  second.address = "700";
  addresses.Add(second, protocol, {"f", 4, 1}, problems);
  EXPECT_EQ(Sorted(problems),
            "f:2:1: warning: address: '07' is also the address of device 'first' on this line, "
            "written there as '7'; give each device its own address\nf:4:1: error: address: '700' "
            "is no address; allowed: 1…99\n");
}

TEST(Checks, ARouteNeedsExactlyOneTarget) {
  const Mark mark = {"f", 1, 1};
  Problems problems;
  CheckTarget({mark, {{"line", {"f", 1, 5}}}}, problems);
  EXPECT_EQ(Sorted(problems), "");
  CheckTarget({mark, {}}, problems);
  CheckTarget({mark, {{"line", {"f", 1, 5}}, {"server", {"f", 1, 9}}}}, problems);
  EXPECT_EQ(Sorted(problems),
            "f:1:1: error: a route needs 'line' or 'server'; for example line: drive or server: "
            "\"10.0.0.9:502\"\nf:1:9: error: server: the route already has a line; remove line or "
            "server\n");
}

}  // namespace
}  // namespace baudgate::testing
