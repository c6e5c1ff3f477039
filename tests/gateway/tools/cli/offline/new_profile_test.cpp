// Tests of profiles that are made and checked, with the real protocols.
// SPDX-License-Identifier: Apache-2.0
#include "gateway/tools/cli/offline/new_profile.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <sstream>

#include "config/loader.h"
#include "gateway/base/exit_code.h"
#include "gateway/tools/cli/offline/make_line.h"
#include "gateway/tools/cli/offline/map.h"
#include "gateway/tools/cli/offline/profiles.h"
#include "tests/config/fake_protocol.h"
#include "tests/config/shipped.h"

namespace baudgate::testing {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;

class ProfileFiles : public ::testing::Test {
 protected:
  ProfileFiles() {
    std::string form = ::testing::TempDir() + "baudgate-profile-XXXXXX";
    folder_ = mkdtemp(form.data());
  }
  ~ProfileFiles() override { std::filesystem::remove_all(folder_); }

  std::string Write(const std::string& name, const std::string& text) const {
    const auto file = folder_ / name;
    std::filesystem::create_directories(file.parent_path());
    std::ofstream(file) << text;
    return file.string();
  }
  int New(const std::string& csv, std::optional<tools::FirstRegister> first) {
    Clear();
    return tools::RunNewProfile({.file = Write("list.csv", csv), .first = first}, Shipped(), out_,
                                err_);
  }
  int Check(const std::string& name, const std::string& text, const std::string& protocol = {}) {
    Clear();
    return tools::RunCheckProfile({.file = Write(name, text), .protocol = protocol}, Shipped(),
                                  out_, err_);
  }
  void Clear() {
    out_.str({});
    err_.str({});
  }

  std::filesystem::path folder_;
  std::ostringstream out_;
  std::ostringstream err_;
};

TEST_F(ProfileFiles, ARegisterListBecomesAValidProfile) {
  ASSERT_EQ(New("name;register;type;unit;scale;access;example\n"
                "Voltage;40001;UINT16;V;0,1;R;230,4\n"
                "Energy \"in\";40005-40006;UINT32;kWh;0,1;R;18340,5\n"
                "Relay;1;BOOL;;;R/W;\n",
                tools::FirstRegister::modicon),
            kExitDone)
      << err_.str();
  const std::string profile = out_.str();
  EXPECT_THAT(profile,
              HasSubstr("  - { name: voltage, read: \"holding 0 uint16\", type: float32, "
                        "scale: 0.1, precision: 1, unit: \"V\", modbus: 0, simulate: 2304 }\n"));
  EXPECT_THAT(profile, HasSubstr("name: energy_in, read: \"holding 4 uint32\", type: float64"));
  EXPECT_THAT(profile, HasSubstr("description: \"Energy \\\"in\\\"\""));
  EXPECT_THAT(profile,
              HasSubstr("name: relay, read: \"coil 0\", type: bool, access: rw, modbus: 0"));
  EXPECT_THAT(err_.str(), HasSubstr("order: CDAB"));
  EXPECT_EQ(Check("modbus_rtu/list.yaml", profile), kExitDone) << err_.str();
  EXPECT_THAT(out_.str(), AllOf(HasSubstr("modbus_rtu/list, 3 points"), HasSubstr("energy_in")));
}

/// Excel on Windows saves a list like this: a separator line, and dashes of the Windows code page.
TEST_F(ProfileFiles, AListWithWordOrdersDashesAndTextsIsAccepted) {
  ASSERT_EQ(New("sep=;\r\n"
                "name;register;type;word order\r\n"
                "Power;40003\x96"
                "40004;FLOAT;CDAB\r\n"
                "Energy;40005\x96"
                "40008;UINT64;low word first\r\n"
                "Serial number;40011\x96"
                "40018;STRING;CDAB\r\n"
                "State;40021;UINT16;CDAB\r\n",
                tools::FirstRegister::modicon),
            kExitDone)
      << err_.str();
  const std::string profile = out_.str();
  EXPECT_THAT(profile, HasSubstr("name: power, read: \"holding 2 CDAB\", type: float32"));
  EXPECT_THAT(profile, HasSubstr("name: energy, read: \"holding 4 CDAB\", type: uint64"));
  EXPECT_THAT(profile, HasSubstr("name: serial_number, read: \"holding 10\", type: string(16)"));
  EXPECT_THAT(profile, HasSubstr("name: state, read: \"holding 20\", type: uint16"));
  EXPECT_THAT(err_.str(), Not(HasSubstr("order: CDAB"))) << "every order is known";
  EXPECT_EQ(Check("modbus_rtu/list.yaml", profile), kExitDone) << err_.str();
}

TEST_F(ProfileFiles, TheNumberOfTheFirstRegisterIsRequired) {
  EXPECT_EQ(New("name,register,type\na,40001,INT\n", {}), kExitUsage);
  EXPECT_THAT(out_.str(), IsEmpty());
  EXPECT_THAT(err_.str(), AllOf(HasSubstr("40001"), HasSubstr("--first-register 1")));
  EXPECT_EQ(New("name,register,type\na,holding 7,INT\n", {}), kExitDone) << err_.str();
}

TEST_F(ProfileFiles, ListsMayUseOtherCodePages) {
  ASSERT_EQ(New("name,register,type,unit\nt,0,INT,\xB0"
                "C\n",
                tools::FirstRegister::zero),
            kExitDone);
  EXPECT_THAT(out_.str(), HasSubstr("unit: \"°C\""));
  const char utf16[] = "n\0a\0m\0e\0";
  EXPECT_EQ(New(std::string(utf16, sizeof utf16), tools::FirstRegister::zero),
            kExitBadConfiguration);
  EXPECT_THAT(err_.str(), HasSubstr("UTF-8"));
  EXPECT_EQ(tools::RunNewProfile({.file = "/no/such"}, Shipped(), out_, err_), kExitCanNot);
}

TEST_F(ProfileFiles, AllErrorsAreReportedAtOnce) {
  const std::string text =
      "device: Meter\n"
      "pol: 1s\n"
      "points:\n"
      "  - { name: a, read: \"holding 0\", type: flaot32, modbus: 0 }\n"
      "  - { read: \"holdin 2\", type: int16, modbus: 0 }\n"
      "  - { name: 7up, read: \"holding 4\", type: int16, group: quick }\n"
      "  - { name: d, type: int16, scale: 0, modbus: 9050 }\n"
      "  - { name: e, read: \"input 4\", type: int16, access: rw, modbus: 9 }\n";
  EXPECT_EQ(Check("modbus_rtu/m.yaml", text), kExitBadConfiguration);
  const std::string file = (folder_ / "modbus_rtu/m.yaml").string();
  for (const std::string expected :
       {":2:1: error: unknown key 'pol'", ":4:41: error: type: 'flaot32' is unknown; did you mean",
        ":5:5: error: ", "holdin 2", ":6:13: error: name: '7up'", "group: 'quick'",
        ":7:", "scale: 0", "9050", ":8:", "errors, read as a profile of modbus_rtu"}) {
    EXPECT_THAT(err_.str(), HasSubstr(expected.starts_with(":") ? file + expected : expected))
        << err_.str();
  }
  EXPECT_THAT(out_.str(), IsEmpty());
}

TEST_F(ProfileFiles, TheProtocolIsTakenFromTheFolderOrTheBestFit) {
  const std::string relay = "device: R\npoints: [{ name: i, read: I1, type: float32 }]\n";
  EXPECT_EQ(Check("mine.yaml", relay), kExitDone) << err_.str();
  EXPECT_THAT(out_.str(), HasSubstr("(spabus/mine, 1 points)"));
  EXPECT_EQ(Check("mine.yaml", relay, "dcon"), kExitBadConfiguration);
  EXPECT_EQ(Check("mine.yaml", relay, "dcn"), kExitUsage);
  EXPECT_THAT(err_.str(), HasSubstr("did you mean 'dcon'"));
  EXPECT_EQ(Check("dcon/mine.yaml", relay), kExitBadConfiguration);
}

Result<config::Line> Make(const tools::WantedDevice& device, const std::string& protocol = "fake",
                          const std::string& serial = "") {
  return tools::MakeLine({.protocol = protocol, .serial = serial, .devices = {device}},
                         FakeCatalog());
}

std::string ErrorOf(const Result<config::Line>& line) { return line ? "none" : line.error(); }

TEST(MakeLine, MatchesALineOfAConfigurationFile) {
  const auto made = Make({.profile = "relay", .address = "5", .set = {"mode=careful"}});
  ASSERT_TRUE(made) << made.error();
  const auto loaded = Load(
      "lines:\n- { name: line, port: /dev/null, protocol: fake, devices: [{ name: device, "
      "address: 5, profile: relay, mode: careful }] }\n");
  ASSERT_EQ(Shown(loaded.problems), "");
  const config::Line& configured = loaded.config.lines.at(0);
  EXPECT_EQ(made->name, configured.name);
  EXPECT_EQ(made->port, configured.port);
  EXPECT_EQ(made->protocol, configured.protocol);
  EXPECT_EQ(made->serial.ToString(), configured.serial.ToString());
  EXPECT_EQ(made->options.all(), configured.options.all());
  const config::Device& device = made->devices.at(0);
  const config::Device& same = configured.devices.at(0);
  EXPECT_EQ(device.name, same.name);
  EXPECT_EQ(device.address, same.address);
  EXPECT_EQ(device.title, same.title);
  EXPECT_EQ(device.poll, same.poll);
  EXPECT_EQ(device.word_order, same.word_order);
  EXPECT_EQ(device.options.all(), same.options.all());
  EXPECT_EQ(device.options.Text("mode"), "careful");
  EXPECT_EQ(device.points.size(), same.points.size());
}

TEST(MakeLine, TakesProtocolFromProfileAndSerialSettingsFromProtocol) {
  const auto made = Make({.profile = "relay", .address = "5"}, "");
  ASSERT_TRUE(made) << made.error();
  EXPECT_EQ(made->protocol, "fake");
  EXPECT_EQ(made->serial.ToString(), "19200 8E1");
  const auto slow = Make({.profile = "relay", .address = "5"}, "fake", "9600 7E1");
  ASSERT_TRUE(slow) << slow.error();
  EXPECT_EQ(slow->serial.ToString(), "9600 7E1");
}

TEST(MakeLine, ReportsAllErrors) {
  EXPECT_EQ(
      ErrorOf(Make({.address = "100", .set = {"widht=7", "mode=fats", "width"}}, "fake", "9600")),
      "serial: '9600' is not a bit rate with a character format; write for example 9600 "
      "8N1\n--set: unknown key 'widht'; did you mean 'width'? allowed: checksum, width, ratio, "
      "mode, password, pin, pause, tags\n--set: mode: 'fats' is unknown; did you mean 'fast'? "
      "allowed: fast, slow, careful\n--set: write key=value\naddress: '100' is no address; "
      "allowed: 1…99");
  EXPECT_EQ(ErrorOf(Make({.address = "1", .set = {"mode=slow", "width=20"}})),
            "device 'device': mode slow has no room for width 20");
}

TEST(MakeLine, NamesMissingProtocolsAndProfiles) {
  EXPECT_EQ(ErrorOf(Make({.address = "1"}, "fakes")),
            "protocol: 'fakes' is not installed; did you mean 'fake'? installed: fake, other");
  EXPECT_EQ(ErrorOf(Make({.profile = "relai", .address = "1"}, "")),
            "no profile named 'relai'; `baudgate profiles` lists them");
  EXPECT_EQ(ErrorOf(Make({.profile = "./relay.yaml", .address = "1"}, "")),
            "a profile given by its path needs --protocol");
}

TEST(MakeLine, AProblemOfAProfileNamesItsPlace) {
  const std::string error = ErrorOf(Make({.profile = "broken", .address = "1"}));
  EXPECT_EQ(error.find("tests/config/profiles/fake/broken.yaml:3:22: point 'a': read 'X1'"), 0U)
      << error;
}

TEST(MakeLine, NeverShowsASecret) {
  for (const char* setting : {"passwordSECRET", "password:SECRET=1", "pin=SECRET"}) {
    const std::string error = ErrorOf(Make({.address = "1", .set = {setting}}));
    EXPECT_NE(error, "none") << setting;
    EXPECT_EQ(error.find("SECRET"), std::string::npos) << error;
  }
}

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

TEST(StructuredText, GivesEachPointItsOwnAddress) {
  const config::Loaded loaded = Load(kConfig);
  ASSERT_TRUE(loaded.ok()) << Shown(loaded.problems);
  std::ostringstream out;
  tools::PrintStructuredText(loaded.config, out);
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
