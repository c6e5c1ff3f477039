// The points of a configuration as variables of a PLC program.
// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <regex>
#include <set>
#include <sstream>

#include "gateway/tools/cli/offline/map.h"
#include "tests/config/fake_protocol.h"

namespace baudgate::testing {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

constexpr const char* kConfig =
    "lines:\n"
    "- name: l\n"
    "  port: /dev/l\n"
    "  protocol: fake\n"
    "  devices:\n"
    "  - name: feeder-1\n"
    "    address: 1\n"
    "    unit: 1\n"
    "    write: allow\n"
    "    points:\n"
    "    - { name: current, read: A1, type: REAL, unit: A, modbus: 10, description: \"x *) y\" }\n"
    "    - { name: started, read: A2, type: DT, modbus: 12 }\n"
    "    - { name: temp, read: A3, type: SINT, modbus: 14, access: rw }\n"
    "    - { name: text, read: A4, type: \"STRING[4]\", modbus: 15 }\n"
    "    - { name: on, read: A5, type: BOOL, modbus: 3 }\n"
    "    - { name: off, read: A6, type: BOOL, modbus: 12, access: rw }\n"
    "    - { name: hidden, read: A7, type: INT }\n"
    "  - { name: 2nd, address: 2, unit: 2, points: [{ name: _n, read: A1, type: UINT, modbus: 0 }] "
    "}\n"
    "  - { name: quiet, address: 3, points: [{ name: n, read: A1, type: UINT, modbus: 0 }] }\n";

TEST(StructuredText, PutsEachPointAtAnAddressOfItsOwn) {
  const config::Loaded loaded = Load(kConfig);
  ASSERT_TRUE(loaded.ok()) << Shown(loaded.problems);
  std::ostringstream out;
  PrintStructuredText(loaded.config, out);
  const std::string text = out.str();
  for (const char* line :
       {"VAR_GLOBAL (* feeder-1 on line l: unit 1, word order ABCD *)",
        "  (* read 7 registers from 10 (function 4 or 3): %IW0 *)",
        "  (* read 10 bits from 3 (function 2 or 1): %IX14.0 *)",
        "  feeder_1_current AT %IW0 : REAL; (* register 10, A, x .) y *)",
        "  feeder_1_started AT %IW2 : DT; (* register 12, s *)",
        "  feeder_1_temp AT %IW4 : INT; (* register 14 *)", "  feeder_1_text AT %IW5 : STRING[4];",
        "  feeder_1_on AT %IX14.0 : BOOL; (* bit 3 *)", "  feeder_1_off AT %IX15.1 : BOOL;",
        "  feeder_1_temp_set AT %QW0 : INT;", "  feeder_1_off_set AT %QX2.0 : BOOL;",
        "  _2nd_n AT %IW8 : UINT; (* register 0 *)", "END_VAR"}) {
    EXPECT_THAT(text, HasSubstr(line)) << text;
  }
  EXPECT_THAT(text, Not(HasSubstr("hidden")));
  EXPECT_THAT(text, Not(HasSubstr("quiet")));
}

}  // namespace
}  // namespace baudgate::testing
