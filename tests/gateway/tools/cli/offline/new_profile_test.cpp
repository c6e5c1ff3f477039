// Profiles that are made and checked, with the real protocols.
// SPDX-License-Identifier: Apache-2.0
#include "gateway/tools/cli/offline/new_profile.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <sstream>

#include "gateway/base/exit_code.h"
#include "gateway/tools/cli/offline/profiles.h"
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
  int New(const std::string& csv, std::optional<FirstRegister> first) {
    Clear();
    return RunNewProfile({.file = Write("list.csv", csv), .first = first}, Shipped(), out_, err_);
  }
  int Check(const std::string& name, const std::string& text, const std::string& protocol = {}) {
    Clear();
    return RunCheckProfile({.file = Write(name, text), .protocol = protocol}, Shipped(), out_,
                           err_);
  }
  void Clear() {
    out_.str({});
    err_.str({});
  }

  std::filesystem::path folder_;
  std::ostringstream out_;
  std::ostringstream err_;
};

TEST_F(ProfileFiles, AListBecomesAProfileThatIsAccepted) {
  ASSERT_EQ(New("name;register;type;unit;scale;access;example\n"
                "Voltage;40001;UINT16;V;0,1;R;230,4\n"
                "Energy \"in\";40005-40006;UINT32;kWh;0,1;R;18340,5\n"
                "Relay;1;BOOL;;;R/W;\n",
                FirstRegister::modicon),
            kExitDone)
      << err_.str();
  const std::string profile = out_.str();
  EXPECT_THAT(profile, HasSubstr("  - { name: voltage, read: \"holding 0 uint16\", type: float32, "
                                 "scale: 0.1, unit: \"V\", modbus: 0, simulate: 2304 }\n"));
  EXPECT_THAT(profile, HasSubstr("name: energy_in, read: \"holding 4 uint32\", type: float64"));
  EXPECT_THAT(profile, HasSubstr("description: \"Energy \\\"in\\\"\""));
  EXPECT_THAT(profile,
              HasSubstr("name: relay, read: \"coil 0\", type: bool, access: rw, modbus: 0"));
  EXPECT_THAT(err_.str(), HasSubstr("order: CDAB"));
  EXPECT_EQ(Check("modbus_rtu/list.yaml", profile), kExitDone) << err_.str();
  EXPECT_THAT(out_.str(), AllOf(HasSubstr("modbus_rtu/list, 3 points"), HasSubstr("energy_in")));
}

/// As Excel on Windows saves it: a named separator, dashes of the code page.
TEST_F(ProfileFiles, AListWithOrdersDashesAndATextIsAccepted) {
  ASSERT_EQ(New("sep=;\r\n"
                "name;register;type;word order\r\n"
                "Power;40003\x96"
                "40004;FLOAT;CDAB\r\n"
                "Energy;40005\x96"
                "40008;UINT64;low word first\r\n"
                "Serial number;40011\x96"
                "40018;STRING;CDAB\r\n"
                "State;40021;UINT16;CDAB\r\n",
                FirstRegister::modicon),
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

TEST_F(ProfileFiles, WhatTheFirstRegisterIsCalledIsAskedFor) {
  EXPECT_EQ(New("name,register,type\na,40001,INT\n", {}), kExitUsage);
  EXPECT_THAT(out_.str(), IsEmpty());
  EXPECT_THAT(err_.str(), AllOf(HasSubstr("40001"), HasSubstr("--first-register 1")));
  EXPECT_EQ(New("name,register,type\na,holding 7,INT\n", {}), kExitDone) << err_.str();
}

TEST_F(ProfileFiles, ListsOfOtherCodePages) {
  ASSERT_EQ(New("name,register,type,unit\nt,0,INT,\xB0"
                "C\n",
                FirstRegister::zero),
            kExitDone);
  EXPECT_THAT(out_.str(), HasSubstr("unit: \"°C\""));
  const char utf16[] = "n\0a\0m\0e\0";
  EXPECT_EQ(New(std::string(utf16, sizeof utf16), FirstRegister::zero), kExitBadConfiguration);
  EXPECT_THAT(err_.str(), HasSubstr("UTF-8"));
  EXPECT_EQ(RunNewProfile({.file = "/no/such"}, Shipped(), out_, err_), kExitCanNot);
}

TEST_F(ProfileFiles, AllThatIsWrongIsToldAtOnce) {
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

TEST_F(ProfileFiles, TheProtocolIsThatOfTheFolderOrTheBestFit) {
  const std::string relay = "device: R\npoints: [{ name: i, read: I1, type: float32 }]\n";
  EXPECT_EQ(Check("mine.yaml", relay), kExitDone) << err_.str();
  EXPECT_THAT(out_.str(), HasSubstr("(spabus/mine, 1 points)"));
  EXPECT_EQ(Check("mine.yaml", relay, "dcon"), kExitBadConfiguration);
  EXPECT_EQ(Check("mine.yaml", relay, "dcn"), kExitUsage);
  EXPECT_THAT(err_.str(), HasSubstr("did you mean 'dcon'"));
  EXPECT_EQ(Check("dcon/mine.yaml", relay), kExitBadConfiguration);
}

}  // namespace
}  // namespace baudgate::testing
