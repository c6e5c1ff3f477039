// Tests of check, map, protocols, profiles and decode: their texts and exit codes.
// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdio>
#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>

#include "gateway/tools/cli/offline/check.h"
#include "gateway/tools/cli/offline/check_parts.h"
#include "gateway/tools/cli/offline/decode.h"
#include "gateway/tools/cli/offline/map.h"
#include "gateway/tools/cli/offline/profiles.h"
#include "tests/config/fake_protocol.h"
#include "tests/config/shipped.h"
#include "tests/support/file_cases.h"

namespace baudgate::testing {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;
using Json = nlohmann::json;

constexpr const char* kGood =
    "gateway: { name: gate }\n"
    "modbus: { listen: { at: \"0.0.0.0:502\", allow: [10.0.0.0/8], write: deny } }\n"
    "lines:\n"
    "- name: bay\n"
    "  port: /dev/l\n"
    "  protocol: fake\n"
    "  devices:\n"
    "  - { name: d, address: 1, unit: 7, profile: relay, password: hunter, write: allow }\n"
    "  - { name: e, address: 2, enabled: false, points: [{ name: p, read: A1, type: string(5) }] "
    "}\n";

class ConfigFile {
 public:
  explicit ConfigFile(const std::string& text)
      : path_(::testing::TempDir() + "baudgate_cli_" +
              ::testing::UnitTest::GetInstance()->current_test_info()->name() + ".yaml") {
    std::ofstream(path_) << text;
  }
  ~ConfigFile() { std::remove(path_.c_str()); }
  const std::string& path() const { return path_; }

 private:
  std::string path_;
};

struct Ran {
  int code = 0;
  std::string out;
  std::string err;
};

template <typename Run>
Ran Capture(Run run) {
  std::ostringstream out;
  std::ostringstream err;
  const int code = run(out, err);
  return {code, out.str(), err.str()};
}

Ran Check(const std::string& text, bool json = false) {
  const ConfigFile file(text);
  return Capture([&](auto& out, auto& err) {
    return tools::RunCheck(file.path(), FakeCatalog(), out, err, json);
  });
}

Ran Map(const std::string& text, tools::MapFormat format) {
  const ConfigFile file(text);
  return Capture([&](auto& out, auto& err) {
    return tools::RunMap(file.path(), FakeCatalog(), format, out, err);
  });
}

TEST(Check, AGoodConfigurationIsSummarised) {
  const Ran ran = Check(kGood);
  EXPECT_EQ(ran.code, 0);
  EXPECT_EQ(ran.err, "");
  EXPECT_THAT(ran.out, HasSubstr(": good: 1 line, 2 devices, 4 points\n"));
  EXPECT_THAT(ran.out,
              HasSubstr("modbus 0.0.0.0:502, Modbus TCP, reading only (functions 1-4), for "
                        "10.0.0.0/8\n"));
  EXPECT_THAT(ran.out, HasSubstr("line bay: /dev/l, 19200 8E1, fake, 2 devices\n"));
  EXPECT_THAT(
      ran.out,
      HasSubstr("topics baudgate/points, baudgate/devices, baudgate/gateways; write: deny\n"));
  EXPECT_THAT(
      ran.out,
      HasSubstr("  device  address  protocol  profile  unit  points  on Modbus  poll  slow  note\n"
                "  d       1        fake      relay    7     3       3          2s    2min\n"
                "  e       2        fake               none  1       0          1s    1min  "
                "disabled\n"));
  EXPECT_THAT(ran.out, Not(HasSubstr("hunter")));
}

TEST(Check, ListsTheAddressesWherePortsAreLent) {
  const Ran ran = Check(
      "gateway: { name: g }\ndds: { enabled: false }\nmodbus: { enabled: false }\nlines:\n"
      "  - { name: panel, port: /dev/p, serial: 9600 8N1, serial_server: { at: "
      "\"127.0.0.1:4001\" } }\n"
      "  - { name: bay, port: /dev/l, serial: 9600 8N1, protocol: fake, lend: { at: "
      "\"127.0.0.1:4002\", mode: rfc2217, for: 5min } }\n");
  EXPECT_THAT(ran.out, HasSubstr("line panel: /dev/p, 9600 8N1, served at 127.0.0.1:4001, raw, for "
                                 "everybody who can connect\n"))
      << ran.err;
  EXPECT_THAT(ran.out, HasSubstr("0 devices, can be lent at 127.0.0.1:4002, rfc2217, for everybody "
                                 "who can connect, 5min at most\n"));
}

TEST(Check, ReportsThatDdsMayWrite) {
  const Ran ran = Check(std::string(kGood) + "dds: { write: allow }\n");
  EXPECT_EQ(ran.code, 0) << ran.err;
  EXPECT_THAT(ran.out, HasSubstr("; write: allow: everybody in the domain can write the points "
                                 "that devices allow, with topic baudgate/write\n"));
}

TEST(Check, BadConfigurationIsExitCode3) {
  const Ran ran = Check("lines: 1\n");
  EXPECT_EQ(ran.code, 3);
  EXPECT_EQ(ran.out, "");
  EXPECT_THAT(ran.err, HasSubstr(".yaml:1:8: error: lines: expected a list, found a single value"));
  EXPECT_THAT(ran.err, HasSubstr(".yaml: bad: 1 error\n"));
}

TEST(Check, JsonHasPlacesAndSeverities) {
  const Ran bad = Check("lines: 1\n", true);
  EXPECT_EQ(bad.code, 3);
  EXPECT_EQ(bad.err, "");
  const Json problems = Json::parse(bad.out);
  EXPECT_EQ(problems["ok"], false);
  EXPECT_EQ(problems["problems"][0]["line"], 1);
  EXPECT_EQ(problems["problems"][0]["column"], 8);
  EXPECT_EQ(problems["problems"][0]["severity"], "error");
  const Json good = Json::parse(Check(kGood, true).out);
  EXPECT_EQ(good["ok"], true);
  EXPECT_EQ(good["summary"]["lines"][0]["devices"][0]["unit"], 7);
  EXPECT_TRUE(good["summary"]["lines"][0]["devices"][1]["unit"].is_null());
  EXPECT_EQ(good["summary"]["modbus"]["listen"][0]["permit"], "read");
  EXPECT_EQ(good["summary"]["units"][0]["target"], "device d on line bay (cached)");
}

TEST(Map, TheTableShowsBothNotationsAndCompanionRegisters) {
  const Ran ran = Map(kGood, tools::MapFormat::table);
  EXPECT_EQ(ran.code, 0);
  EXPECT_THAT(ran.out, HasSubstr("device d on line bay: unit 7, word order CDAB; DDS key "
                                 "gate/d/POINT\n"));
  EXPECT_THAT(
      ran.out,
      HasSubstr(
          "  point     address  PLC          regs  type     unit  read FC  write FC  group  quality"
          "  age\n"
          "  current   0        30001/40001  2     float32  A     4,3                fast   20000  "
          "  40000\n"
          "  blocking  0        10001/00001  1     bool           2,1                slow   20000\n"
          "  setting   100      30101/40101  1     uint16         4,3      6,16      fast   20100  "
          "  40100\n"));
  EXPECT_THAT(ran.out, HasSubstr("device e on line bay: not on Modbus (no unit)"));
}

TEST(Check, ListsWritablePointsAndThoseSwitchedOff) {
  const std::string text =
      "lines:\n- { name: l, port: /dev/l, protocol: fake, devices: [\n"
      "{ name: d, address: 1, write: [a], points: [\n"
      "{ name: a, read: A1, type: float32, unit: A, access: rw, min: 0.5, max: 40, step: 0.5,"
      " select: true, allow_when: { point: l.e.p, is: 3 } },\n"
      "{ name: b, read: A2, type: bool, access: rw }] },\n"
      "{ name: e, address: 2, points: [{ name: p, read: A1, type: uint16 }] }] }\n";
  EXPECT_THAT(
      Check(text).out,
      HasSubstr("  writes to d: a (0.5 to 40 A, steps of 0.5, selected first, when l.e.p is "
                "3); b can be written if you add 'write: allow', or a list of points, to the "
                "device\n"));
  const Json json = Json::parse(Check(text, true).out);
  EXPECT_EQ(json["summary"]["lines"][0]["devices"][0]["writes"].dump(),
            R"({"allowed":["a"],"off":["b"]})");
}

TEST(Map, ShowsSelectRegistersAndOnlyAllowedWrites) {
  const std::string text =
      "lines:\n- { name: l, port: /dev/l, protocol: fake, devices: [{ name: d, address: 1, unit: "
      "1, write: [a], points: [{ name: a, read: A1, type: bool, access: w, modbus: 7, select: true "
      "}, { name: b, read: A2, type: int16, access: rw, modbus: 8 }] }] }\n";
  const Json json = Json::parse(Map(text, tools::MapFormat::json).out);
  EXPECT_EQ(json["points"][0]["modbus"]["select"], 60007);
  EXPECT_EQ(json["points"][0]["access"], "w");
  EXPECT_EQ(json["points"][1]["modbus"]["write_fc"], "");
  EXPECT_EQ(json["points"][1]["access"], "r");
  EXPECT_FALSE(json["points"][1]["modbus"].contains("select"));
  EXPECT_THAT(Map(text, tools::MapFormat::table).out, HasSubstr("60007"));
}

TEST(Map, UsesSixDigitNotationBeyondFiveDigits) {
  const std::string text =
      "lines:\n- { name: l, port: /dev/l, protocol: fake, devices: [{ name: d, address: 1, unit: "
      "1, points: [{ name: p, read: A1, type: int16, modbus: 19999 }] }] }\n";
  EXPECT_THAT(Map(text, tools::MapFormat::table).out, HasSubstr("320000/420000"));
}

TEST(Map, CsvHasOneRowPerPoint) {
  const Ran ran = Map(kGood, tools::MapFormat::csv);
  EXPECT_THAT(ran.out,
              HasSubstr("bay,d,7,current,\"input, holding\",\"4,3\",,0,30001/40001,2,"
                        "float32,CDAB,A,r,fast,20000,40000,gate/d/current,A1,current,,\r\n"));
  EXPECT_THAT(ran.out, HasSubstr("bay,e,,p,,,,,,,string(5),,,r,fast,,,gate/e/p,A1,,,\r\n"));
}

TEST(Map, NoCellOfTheCsvIsAFormula) {
  const std::string text =
      "lines:\n- { name: l, port: /dev/l, protocol: fake, devices: [{ name: d, address: 1, points: "
      "[{ name: p, read: A1, type: int16, unit: \"@SUM(A1)\", description: \"=1+1\" }] }] }\n";
  const std::string out = Map(text, tools::MapFormat::csv).out;
  EXPECT_THAT(out, HasSubstr(",'@SUM(A1),"));
  EXPECT_THAT(out, HasSubstr(",'=1+1,,\r\n"));
}

TEST(Map, JsonHasAllPoints) {
  const Json json = Json::parse(Map(kGood, tools::MapFormat::json).out);
  EXPECT_EQ(json["gateway"], "gate");
  ASSERT_EQ(json["points"].size(), 4U);
  EXPECT_EQ(json["points"][2]["modbus"]["address"], 100);
  EXPECT_EQ(json["points"][2]["modbus"]["write_fc"], "6,16");
  EXPECT_TRUE(json["points"][3]["modbus"].is_null());
}

TEST(Map, BadConfigurationIsExitCode3) {
  EXPECT_EQ(Map("lines: 1\n", tools::MapFormat::table).code, 3);
}

TEST(Protocols, WithoutModulesTheSearchedFoldersAreNamed) {
  config::Catalog nothing;
  nothing.module_dirs = {"/opt/baudgate/protocols"};
  const Ran runs[] = {
      Capture(
          [&](auto& out, auto& err) { return tools::RunProtocols("", false, nothing, out, err); }),
      Capture([&](auto& out, auto& err) {
        return tools::RunProfiles("", tools::ProfileFormat::table, nothing, out, err, 0);
      })};
  for (const Ran& ran : runs) {
    EXPECT_EQ(ran.code, 4);
    EXPECT_THAT(ran.err, ::testing::AllOf(HasSubstr("no protocol is installed"),
                                          HasSubstr("/opt/baudgate/protocols"),
                                          HasSubstr("$BAUDGATE_MODULES")));
  }
}

TEST(Protocols, AreListedAndDescribed) {
  const auto run = [](const std::string& name, bool json) {
    return Capture([&](auto& out, auto& err) {
      return tools::RunProtocols(name, json, FakeCatalog(), out, err);
    });
  };
  EXPECT_THAT(run("", false).out, HasSubstr("fake      Fake, for tests  2\n"));
  const Ran one = run("fake", false);
  EXPECT_EQ(one.code, 0);
  EXPECT_THAT(one.out, HasSubstr("  width (device; whole number: 1…20; default 7)\n"));
  EXPECT_THAT(one.out, HasSubstr("  password (device; text; default 000000; secret)\n"));
  EXPECT_THAT(one.out, HasSubstr("timing: { quiet: 5ms, reply: 500ms, gap: 25ms, ceiling: 2s, "
                                 "drain: 100ms }"));
  EXPECT_EQ(Json::parse(run("fake", true).out)["options"][1]["name"], "width");
  EXPECT_EQ(Json::parse(run("", true).out).size(), 2U);
  const Ran none = run("fakt", false);
  EXPECT_EQ(none.code, 2);
  EXPECT_EQ(none.err,
            "protocol 'fakt' is not installed; did you mean 'fake'? installed: fake, other\n");
}

TEST(Profiles, AreListedAndDescribed) {
  const auto run = [](const std::string& name, tools::ProfileFormat format) {
    return Capture([&](auto& out, auto& err) {
      return tools::RunProfiles(name, format, FakeCatalog(), out, err);
    });
  };
  const Ran list = run("", tools::ProfileFormat::table);
  EXPECT_THAT(list.out, HasSubstr("fake      relay    3       Fake relay\n"));
  EXPECT_THAT(list.out,
              HasSubstr("fake      broken   2       (has errors; run 'baudgate profiles NAME')\n"));
  const Ran one = run("relay", tools::ProfileFormat::table);
  EXPECT_THAT(
      one.out,
      HasSubstr("current   0…1       input     float32  A     r       fast   A1    current"));
  EXPECT_THAT(run("fake/relay", tools::ProfileFormat::markdown).out,
              HasSubstr("| blocking | 0 | discrete | bool |  | r | slow | A2 |  |\n"));
  EXPECT_EQ(Json::parse(run("relay", tools::ProfileFormat::json).out)["points"][2]["access"], "rw");
  EXPECT_EQ(run("broken", tools::ProfileFormat::table).code, 3);
  const Ran none = run("relais", tools::ProfileFormat::table);
  EXPECT_EQ(none.code, 2);
  EXPECT_EQ(none.err,
            "profile 'relais' is not installed; did you mean 'relay'? installed: broken, relay\n");
}

}  // namespace
}  // namespace baudgate::testing

namespace baudgate::tools {
namespace {

using ::testing::EndsWith;
using ::testing::HasSubstr;
using ::testing::StartsWith;

struct Said {
  int code = 0;
  std::string out;
  std::string err;
};

Said DecodeText(const std::string& text, const DecodeOptions& options = {}) {
  std::istringstream in(text);
  std::ostringstream out;
  std::ostringstream err;
  const int code = RunDecode(options, baudgate::testing::Shipped(), in, out, err);
  return {code, out.str(), err.str()};
}

std::string Eight(const std::string& text) {
  std::string all;
  for (int i = 0; i < 8; ++i) all += text;
  return all;
}

const std::string kFileHead =
    "# baudgate 1.2.3: the last exchanges of a line\n"
    "# line io, port /dev/ttyUSB0 9600 8N1, protocol dcon\n"
    "# device ai-1, protocol dcon, profile icpdas-i-7017\n"
    "# device ai-2, protocol dcon\n";
const std::string kFileTrace =
    "04:05:06.123456 ai-1 > 23 30 31 0D | #01.\n"
    "04:05:06.140000 ai-1 < 3E" +
    Eight(" 2B 30 31 2E 35 30 30") +
    " 0D | >+01.500+01.500\n"
    "04:05:06.140300 ai-1 = ok, 16.8 ms\n"
    "04:05:07.000000 ai-2 > 23 30 32 0D | #02.\n"
    "04:05:07.500000 ai-2 = no_reply: no reply after 500 ms\n";

TEST(Decode, TakesProtocolAndProfileFromTheHeader) {
  const Said decoded = DecodeText(kFileHead + kFileTrace);
  EXPECT_EQ(decoded.code, 0) << decoded.err;
  EXPECT_THAT(decoded.out, HasSubstr(R"("point":"input_0","value":1.5,"unit":"V")"));
  EXPECT_THAT(decoded.out, HasSubstr(R"({"outcome":"no_reply","reason":"no reply after 500 ms")"));
}

TEST(Decode, TheProtocolOptionOverridesTheHeader) {
  const Said decoded = DecodeText(kFileHead + kFileTrace, {.protocol = "dcon"});
  EXPECT_EQ(decoded.code, 0) << decoded.err;
  EXPECT_THAT(decoded.out, HasSubstr(R"({"point":"#[0]","value":1.5,"quality")"));
}

TEST(Decode, RequiresAProtocolWithoutAHeader) {
  const Said decoded = DecodeText(kFileTrace);
  EXPECT_EQ(decoded.code, 2);
  EXPECT_EQ(decoded.err,
            "baudgate: the protocol is unknown, because the captures lack the head that 'baudgate "
            "trace' prints; add --protocol\n");
}

TEST(Decode, PrintsProseForPeople) {
  const Said decoded = DecodeText(kFileHead + kFileTrace, {.prose = true, .width = 40});
  EXPECT_THAT(decoded.out,
              StartsWith("04:05:06.123456 ai-1: ok\n  input_0 1.5 V\n  input_1 1.5 V\n"));
  EXPECT_THAT(decoded.out, EndsWith("04:05:07.000000 ai-2: no_reply: no reply\n  after 500 ms\n"));
}

}  // namespace
}  // namespace baudgate::tools

namespace baudgate::testing {
namespace {

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
  tools::PrintRouteTable(loaded.config, out);
  return out.str();
}

std::string CheckUnits(const std::string& text) {
  const std::string path = ::testing::TempDir() + "baudgate_route_table.yaml";
  std::ofstream(path) << text;
  std::ostringstream out;
  std::ostringstream err;
  EXPECT_EQ(tools::RunCheck(path, ModbusCatalog(), out, err, false), 0) << err.str();
  std::remove(path.c_str());
  return out.str();
}

TEST(RouteTable, MatchesTheCasesOfTheFile) {
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
