// What `baudgate check` prints of listeners and routes, letter by letter.
// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdio>
#include <fstream>
#include <sstream>

#include "gateway/tools/cli/offline/check.h"
#include "gateway/tools/cli/offline/check_parts.h"
#include "tests/config/fake_protocol.h"
#include "tests/support/file_cases.h"

namespace baudgate::testing {
namespace {

using ::testing::HasSubstr;

constexpr const char* kLines =
    "lines:\n"
    "- { name: bay, port: /dev/a, protocol: fake, devices: [\n"
    "    { name: feeder, address: 1, unit: 36, profile: relay },\n"
    "    { name: spare, address: 2, unit: 5, profile: relay, enabled: false },\n"
    "    { name: hidden, address: 3, profile: relay }] }\n"
    "- { name: drive, port: /dev/b, protocol: modbus_rtu }\n"
    "- { name: text, port: /dev/c, protocol: modbus_ascii }\n";

std::string Table(const std::string& modbus) {
  const auto loaded = LoadModbus("modbus: { " + modbus + " }\n" + kLines);
  EXPECT_TRUE(loaded.ok()) << Shown(loaded.problems);
  std::ostringstream out;
  PrintRouteTable(loaded.config, out);
  return out.str();
}

std::string CheckUnits(const std::string& text) {
  const std::string path = ::testing::TempDir() + "baudgate_route_table.yaml";
  std::ofstream(path) << text;
  std::ostringstream out;
  std::ostringstream err;
  EXPECT_EQ(RunCheck(path, ModbusCatalog(), out, err, false), 0) << err.str();
  std::remove(path.c_str());
  return out.str();
}

TEST(RouteTable, IsPrintedAsInTheFile) {
  const auto cases = ReadFileCases("tests/gateway/tools/cli/offline/units.txt");
  EXPECT_GT(cases.size(), 10U);
  for (const FileCase& one : cases) {
    SCOPED_TRACE(one.place);
    std::string given;
    for (const std::string& line : one.given) given += line + "\n";
    const std::string printed = one.head == "units" ? Table(given) : CheckUnits(given + kLines);
    std::string whole;
    std::string part;
    for (const auto& [sign, line] : one.results) {
      if (sign == '=') whole += line + "\n";
      if (sign == '~') part += (part.empty() ? "" : "\n") + line;
      if (sign == '!') {
        EXPECT_EQ(printed.find(line), std::string::npos) << printed;
      }
    }
    EXPECT_THAT(printed, HasSubstr(part));
    if (!whole.empty()) {
      EXPECT_EQ(printed, whole);
    }
  }
}

}  // namespace
}  // namespace baudgate::testing
