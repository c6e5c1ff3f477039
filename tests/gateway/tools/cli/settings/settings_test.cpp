// Tests of `baudgate settings` with a control server.
// SPDX-License-Identifier: Apache-2.0
#include "gateway/tools/cli/settings/settings.h"

#include <gmock/gmock.h>

#include <csignal>
#include <fstream>
#include <iterator>
#include <sstream>

#include "gateway/tools/cli/settings/sheet.h"
#include "protocols/spabus/protocol.h"
#include "tests/gateway/outputs/control/fixture.h"

namespace baudgate::tools {
namespace {

using settings::WriteReport;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;

config::Point PointOf(const std::string& name, const std::string& item, config::Access access) {
  config::Point point;
  point.name = name;
  point.read = item;
  point.unit = "xIn";
  point.access = access;
  point.group = config::Group::slow;
  return point;
}

config::Config OneRelay() {
  config::Config config = status::TwoLines();
  config::Device& relay = config.lines[0].devices[0];
  relay.traits = &protocols::SpabusProtocol().traits;
  relay.profile = "spaj140c";
  relay.points.clear();
  relay.points.push_back(PointOf("type_designation", "F", config::Access::read));
  relay.points.back().type = config::Type::string;
  relay.points.back().text_length = 16;
  relay.points.push_back(PointOf("current_l1", "I1", config::Access::read));
  relay.points.push_back(PointOf("active_current", "S1", config::Access::read));
  relay.points.push_back(PointOf("main_current", "S21", config::Access::read_write));
  relay.points.push_back(PointOf("main_time", "S22", config::Access::read_write));
  relay.points.back().unit.clear();
  relay.points.push_back(PointOf("main_high", "2S23", config::Access::read_write));
  relay.points.back().sentinels.push_back({999, Quality::bad_out_of_service});
  return config;
}

constexpr std::size_t kName = 0;
constexpr std::size_t kActive = 2;
constexpr std::size_t kCurrent = 3;
constexpr std::size_t kTime = 4;
constexpr std::size_t kHigh = 5;

class FakeWriter final : public settings::PointWriter {
 public:
  WriteReport Write(const std::string& point, const std::string& value) override {
    asked.push_back(point + "=" + value);
    if (point == refuse) return {"refused", "NACK 8: the device does not accept the value"};
    if (take) take(point, value);
    return {"ok", {}, read_back};
  }
  std::optional<std::string> WhyNot(const std::string& point, const std::string& value) override {
    return deny == point ? std::optional("no " + value) : std::nullopt;
  }
  std::string deny;
  bool read_back = true;
  std::vector<std::string> asked;
  std::string refuse;
  std::function<void(const std::string& point, const std::string& value)> take;
};

class SettingsTest : public control::ControlTest {
 protected:
  SettingsTest() : control::ControlTest(OneRelay()) {
    Reads(kName, std::string(" SPCJ 4D29 "));
    Reads(kActive, 1.0);
    Reads(kCurrent, 30.3);
    Reads(kTime, 0.5);
    Reads(kHigh, {}, {Quality::bad_out_of_service, Reason::sentinel});
    file_ = directory_ / "relay.yaml";
    writer_.take = [this](const std::string& point, const std::string& value) {
      Reads(point.ends_with(".main_time") ? kTime : kCurrent, std::stod(value));
    };
  }
  void Reads(std::size_t point, const Value& value, Quality quality = Quality::good) {
    const bus::Sample sample{static_cast<std::uint32_t>(point), value, quality};
    store_.UpdateStatus(0,
                        [](bus::DeviceStatus& status) { status.state = bus::DeviceState::online; });
    store_.Update(0, {&sample, 1}, ReadClocks(), 20ms);
  }
  SettingsOptions Options(bool confirm = false) {
    out_.str({});
    err_.str({});
    return {"bay-1.feeder-1", file_.string(), false, confirm, path(), 300ms};
  }
  int Dump() { return RunSettingsDump(Options(), out_, err_); }
  int Compare() { return RunSettingsCompare(Options(), out_, err_); }
  int Restore(bool confirm) { return RunSettingsRestore(Options(confirm), writer_, out_, err_); }

  std::string Text() const {
    std::ifstream stream(file_);
    return {std::istreambuf_iterator<char>(stream), {}};
  }
  void Replace(const std::string& from, const std::string& to) {
    std::string text = Text();
    ASSERT_NE(text.find(from), std::string::npos) << from << " in\n" << text;
    text.replace(text.find(from), from.size(), to);
    std::ofstream(file_) << text;
  }

  std::filesystem::path file_;
  FakeWriter writer_;
  std::ostringstream out_;
  std::ostringstream err_;
};

TEST_F(SettingsTest, ADumpContainsTheSettingsAndTheirDevice) {
  StartServer();
  ASSERT_EQ(Dump(), 0) << err_.str();
  const std::string text = Text();
  EXPECT_THAT(text, HasSubstr("line: \"bay-1\"\ndevice: \"feeder-1\"\nprotocol: \"spabus\"\n"
                              "profile: \"spaj140c\"\ndesignation: \"SPCJ 4D29\"\n"));
  EXPECT_THAT(text,
              HasSubstr("settings:\n"
                        "  - { point: \"active_current\", item: \"S1\", value: \"1\", unit: "
                        "\"xIn\" }\n"
                        "  - { point: \"main_current\", item: \"S21\", value: \"30.3\", unit: "
                        "\"xIn\" }\n"
                        "  - { point: \"main_time\", item: \"S22\", value: \"0.5\" }\n"
                        "  - { point: \"main_high\", item: \"2S23\", value: \"999\", unit: "
                        "\"xIn\" }\n"));
  EXPECT_THAT(text, Not(HasSubstr("current_l1"))) << "a measurement";
}

TEST_F(SettingsTest, ADumpNeverOverwritesAFile) {
  StartServer();
  ASSERT_EQ(Dump(), 0);
  EXPECT_EQ(Dump(), 4);
  EXPECT_THAT(err_.str(), HasSubstr("the file exists already"));
  file_ = directory_ / "no" / "such" / "folder";
  EXPECT_EQ(Dump(), 4);
}

TEST_F(SettingsTest, AnUnknownSettingIsWrittenWithoutAValue) {
  Reads(kTime, 0.5, Quality::bad_communication);
  StartServer();
  EXPECT_EQ(Dump(), 3);
  EXPECT_THAT(err_.str(), HasSubstr("1 setting of 4 got no value"));
  EXPECT_THAT(Text(), HasSubstr("item: \"S22\", quality: \"bad: communication failure\""));
  EXPECT_THAT(Text(), Not(HasSubstr("\"0.5\""))) << "it was so once";
  EXPECT_EQ(Compare(), 3);
  EXPECT_THAT(err_.str(), HasSubstr("main_time (S22) has no value in the file"));
  Reads(kTime, 0.5);
  EXPECT_EQ(Restore(true), 3) << "the file is not whole";
  EXPECT_THAT(writer_.asked, IsEmpty());
}

TEST_F(SettingsTest, AFileOfAnotherScaleIsRefused) {
  config_.lines[0].devices[0].points[kHigh].scale = 400;
  StartServer();
  ASSERT_EQ(Dump(), 0) << err_.str();
  EXPECT_THAT(Text(), HasSubstr("item: \"2S23\", value: \"399600\", unit: \"xIn\", scale: 400 }"));
  EXPECT_EQ(Compare(), 0) << err_.str();
  Replace("scale: 400", "scale: 600");
  EXPECT_EQ(Restore(true), 3);
  EXPECT_THAT(err_.str(),
              HasSubstr("xIn (600 times the value of the device) in this file, but in xIn (400"));
}

TEST_F(SettingsTest, YamlAndJsonAreReadBack) {
  StartServer();
  for (const bool json : {false, true}) {
    file_ = directory_ / (json ? "relay.json" : "other.yaml");
    SettingsOptions options = Options();
    options.json = json;
    ASSERT_EQ(RunSettingsDump(options, out_, err_), 0) << err_.str();
    EXPECT_EQ(Compare(), 0) << err_.str();
    EXPECT_THAT(out_.str(), HasSubstr("bay-1.feeder-1 (SPCJ 4D29): no setting differs"));
    EXPECT_THAT(out_.str(), HasSubstr("s ago\n"));
  }
}

TEST_F(SettingsTest, ComparisonShowsEachDifference) {
  StartServer();
  ASSERT_EQ(Dump(), 0);
  Reads(kCurrent, 0.9);
  Reads(kHigh, 4.0);
  EXPECT_EQ(Compare(), 3);
  EXPECT_THAT(out_.str(), HasSubstr("main_current  S21   0.9     30.3  xIn"));
  EXPECT_THAT(out_.str(), HasSubstr("main_high     2S23  4       999   xIn"));
  EXPECT_THAT(out_.str(), HasSubstr("2 settings of 4 differ"));
  SettingsOptions options = Options();
  options.json = true;
  EXPECT_EQ(RunSettingsCompare(options, out_, err_), 3);
  const status::Json json = status::Json::parse(out_.str());
  EXPECT_EQ(json["same"], false);
  EXPECT_EQ(json["different"].size(), 2U);
  EXPECT_EQ(json["different"][0]["device"], "0.9");
  EXPECT_TRUE(json["oldest_ms"].is_number_integer());
}

TEST_F(SettingsTest, AFileOfAnotherDeviceIsRefused) {
  StartServer();
  ASSERT_EQ(Dump(), 0);
  const std::string good = Text();
  for (const auto& [from, to, why] :
       {std::tuple("SPCJ 4D29", "SPCU 3D45", "'SPCU 3D45', but bay-1.feeder-1 is a"),
        {"spaj140c", "spau130c", "profile 'spau130c'"},
        {"designation: \"SPCJ 4D29\"", "designation: \"\"", "does not name the device"},
        {"item: \"S21\"", "item: \"S41\"", "is item S41 in this file, but item S21"},
        {"value: \"30.3\", unit: \"xIn\"", "value: \"30.3\", unit: \"A\"", "`ratios` or `scale`"},
        {"\"main_time\"", "\"mean_time\"", "has no setting 'mean_time'"}}) {
    std::ofstream(file_) << good;
    Replace(from, to);
    for (const bool restores : {false, true}) {
      EXPECT_EQ(restores ? Restore(true) : Compare(), 3) << to;
      EXPECT_THAT(err_.str(), HasSubstr(file_.string() + ":")) << to;
      EXPECT_THAT(err_.str(), HasSubstr(why));
    }
  }
  std::ofstream(file_) << good;
  Replace("SPCJ 4D29", "spcj4d29");
  EXPECT_EQ(Compare(), 0) << "spaces and case do not count";
  EXPECT_THAT(writer_.asked, IsEmpty());
}

TEST_F(SettingsTest, AnUnidentifiedDeviceIsNotWritten) {
  StartServer();
  ASSERT_EQ(Dump(), 0);
  Reads(kCurrent, 0.9);
  Reads(kName, {}, Quality::bad_communication);
  EXPECT_EQ(Restore(true), 3);
  EXPECT_THAT(err_.str(), HasSubstr("has not sent its designation yet"));
  EXPECT_THAT(writer_.asked, IsEmpty());
}

TEST_F(SettingsTest, ErrorsInFilesAreReportedWithTheirPlaces) {
  StartServer();
  std::ofstream(file_) << "line: a\nline: b\nsettings: [{ point: x, item: S1, valeu: 1 }]\n";
  EXPECT_EQ(Restore(true), 3);
  EXPECT_THAT(err_.str(), HasSubstr("relay.yaml:2:1: error: "));
  EXPECT_THAT(err_.str(), HasSubstr("relay.yaml:3:"));
  EXPECT_THAT(err_.str(), HasSubstr("valeu"));
  std::ofstream(file_) << ": [\n";
  EXPECT_EQ(Compare(), 3);
  file_ = directory_ / "missing";
  EXPECT_EQ(Compare(), 3);
  EXPECT_THAT(err_.str(), HasSubstr("missing: error: cannot be opened"));
}

TEST_F(SettingsTest, RestoreOnlyShowsChangesWithoutConfirm) {
  StartServer();
  ASSERT_EQ(Dump(), 0);
  EXPECT_EQ(Restore(false), 0) << "nothing differs";
  Reads(kActive, 0.9);
  Reads(kCurrent, 0.9);
  EXPECT_EQ(Restore(false), 3);
  EXPECT_THAT(out_.str(), HasSubstr("main_current    S21   0.9     30.3  xIn"));
  EXPECT_THAT(out_.str(), HasSubstr("active_current  S1    0.9     1     xIn   read-only"));
  EXPECT_THAT(out_.str(), HasSubstr("1 setting would be written"));
  EXPECT_THAT(out_.str(), HasSubstr("add --confirm"));
  EXPECT_THAT(writer_.asked, IsEmpty());
}

TEST_F(SettingsTest, DifferentSettingsAreWrittenInOrderAndReadBack) {
  StartServer();
  ASSERT_EQ(Dump(), 0);
  Reads(kCurrent, 0.9);
  Reads(kTime, 0.1);
  EXPECT_EQ(Restore(true), 0) << err_.str();
  EXPECT_THAT(writer_.asked,
              ElementsAre("bay-1.feeder-1.main_current=30.3", "bay-1.feeder-1.main_time=0.5"));
  EXPECT_THAT(out_.str(), HasSubstr("main_current (S21): 0.9 -> 30.3 xIn: written and read back"));
  EXPECT_THAT(out_.str(), HasSubstr("2 of 2 settings written"));
  EXPECT_EQ(Compare(), 0);
}

TEST_F(SettingsTest, TheFirstRefusalEndsARestore) {
  StartServer();
  ASSERT_EQ(Dump(), 0);
  Reads(kCurrent, 0.9);
  Reads(kTime, 0.1);
  writer_.refuse = "bay-1.feeder-1.main_current";
  EXPECT_EQ(Restore(true), 3);
  EXPECT_THAT(writer_.asked, ElementsAre("bay-1.feeder-1.main_current=30.3"));
  EXPECT_THAT(err_.str(), HasSubstr("main_current (S21): 0.9 -> 30.3 xIn: refused: NACK 8"));
  EXPECT_THAT(out_.str(), HasSubstr("0 of 2 settings written\n"));
  EXPECT_THAT(err_.str(), HasSubstr("main_time (S22): 0.1 -> 0.5: not written\n"));
}

TEST_F(SettingsTest, AValueThatReadsBackDifferentlyIsReported) {
  StartServer();
  ASSERT_EQ(Dump(), 0);
  Reads(kCurrent, 0.9);
  writer_.take = [this](const std::string&, const std::string&) { Reads(kCurrent, 25.0); };
  EXPECT_EQ(Restore(true), 3);
  EXPECT_THAT(err_.str(),
              HasSubstr("main_current (S21) has changed since the write: the relay shows 25\n"));
  Reads(kCurrent, 0.9);
  writer_.read_back = false;
  EXPECT_EQ(Restore(true), 3);
  EXPECT_THAT(err_.str(), HasSubstr("(S21): 0.9 -> 30.3 xIn: written, but the relay shows 25\n"));
}

TEST_F(SettingsTest, AFailedReadBackIsReportedOnce) {
  StartServer();
  ASSERT_EQ(Dump(), 0);
  Reads(kCurrent, 0.9);
  Reads(kTime, 0.1);
  Reads(kHigh, 4.0);
  writer_.refuse = "bay-1.feeder-1.main_time";
  writer_.take = [this](const std::string&, const std::string&) {
    Reads(kCurrent, {}, Quality::bad_communication);
  };
  EXPECT_EQ(Restore(true), 3);
  EXPECT_THAT(out_.str(), HasSubstr("(S21): 0.9 -> 30.3 xIn: written and read back\n"));
  EXPECT_EQ(err_.str(),
            "baudgate: main_time (S22): 0.1 -> 0.5: refused: NACK 8: the device does not accept "
            "the value\nbaudgate: main_high (2S23): 4 -> 999 xIn: not written\n");
  EXPECT_THAT(out_.str(), HasSubstr("1 of 3 settings written\n"));
  Reads(kCurrent, 0.9);
  writer_.read_back = false;
  EXPECT_EQ(Restore(true), 3);
  EXPECT_THAT(out_.str(), Not(HasSubstr("xIn: written")));
  EXPECT_THAT(err_.str(), HasSubstr("(S21): 0.9 -> 30.3 xIn: written, but not read back in time; "
                                    "compare the settings again\n"));
}

TEST_F(SettingsTest, ASignalEndsARestoreBetweenTwoSettings) {
  StartServer();
  ASSERT_EQ(Dump(), 0);
  Reads(kCurrent, 0.9);
  Reads(kTime, 0.1);
  writer_.take = [this](const std::string&, const std::string&) {
    Reads(kCurrent, 30.3);
    std::raise(SIGINT);
  };
  EXPECT_EQ(Restore(true), 3);
  EXPECT_THAT(writer_.asked, ElementsAre("bay-1.feeder-1.main_current=30.3"));
  EXPECT_EQ(err_.str(), "baudgate: main_time (S22): 0.1 -> 0.5: not written\n");
}

TEST_F(SettingsTest, DeniedSettingsAreNamedBeforeAnyWrite) {
  StartServer();
  ASSERT_EQ(Dump(), 0);
  Reads(kCurrent, 0.9);
  Reads(kTime, 0.1);
  writer_.deny = "bay-1.feeder-1.main_time";
  for (const bool confirmed : {false, true}) {
    EXPECT_EQ(Restore(confirmed), 3);
    EXPECT_THAT(out_.str(), HasSubstr("main_time     S22   0.1     0.5         denied\n"));
    EXPECT_THAT(err_.str(), HasSubstr("main_time (S22) would be denied: no 0.5\n"));
    EXPECT_THAT(out_.str(), HasSubstr("nothing is written: 1 setting of 2 would be denied"));
  }
  EXPECT_THAT(writer_.asked, IsEmpty());
}

TEST_F(SettingsTest, NumbersAreComparedAsNumbers) {
  using settings::IsSameValue;
  EXPECT_TRUE(IsSameValue("1.0", "1"));
  EXPECT_TRUE(IsSameValue("0.30", "0.3", 0.01));
  EXPECT_FALSE(IsSameValue("12345678", "12345679", 1));
  EXPECT_FALSE(IsSameValue("12345678", "12345679")) << "whole numbers are exact";
  EXPECT_FALSE(IsSameValue("12345.67", "12345.68", 0.01));
  EXPECT_TRUE(IsSameValue("12120", "12120.0001")) << "what a float32 holds";
  EXPECT_FALSE(IsSameValue("SPCJ", "SPCU"));
}

TEST_F(SettingsTest, NothingIsWrittenWithUncertainValuesOrTypingErrors) {
  StartServer();
  ASSERT_EQ(Dump(), 0);
  Reads(kCurrent, 0.9);
  Reads(kTime, 0.5, Quality::uncertain);
  EXPECT_EQ(Restore(true), 3);
  EXPECT_THAT(err_.str(),
              HasSubstr("nothing was written, because some settings of bay-1.feeder-1"));
  Reads(kTime, 0.5);
  Replace("\"30.3\"", "3O.3");
  EXPECT_EQ(Restore(true), 3);
  EXPECT_THAT(err_.str(), HasSubstr("value: '3O.3' is no number"));
  EXPECT_THAT(writer_.asked, IsEmpty());
}

TEST_F(SettingsTest, OnlyRelaysHaveSettings) {
  StartServer();
  SettingsOptions options = Options();
  for (const auto& [target, why] : {std::pair("io.ai-1", "has no settings"),
                                    {"bay-1", "name one device"},
                                    {"bay-1.feeder-9", "feeder-9"}}) {
    options.target = target;
    EXPECT_EQ(RunSettingsDump(options, out_, err_), 2) << target;
    EXPECT_THAT(err_.str(), HasSubstr(why));
  }
  EXPECT_FALSE(std::filesystem::exists(file_));
  StopServer();
  EXPECT_EQ(Dump(), 4);
}

TEST_F(SettingsTest, ADenialOfTheGatewayIsReportedWithItsReason) {
  StartServer();
  settings::SocketWriter writer(path());
  const WriteReport report = writer.Write("bay-9.feeder-1.main_current", "1");
  EXPECT_FALSE(report.done());
  EXPECT_FALSE(report.reason.empty());
  EXPECT_THAT(
      writer.WhyNot("bay-1.feeder-1.main_current", "1").value_or(""),
      HasSubstr("may not be written: add it to 'write' of the device in the configuration"));
  EXPECT_THAT(writer.WhyNot("bay-1.feeder-1.active_current", "1").value_or(""),
              HasSubstr("can only be read"));
  EXPECT_THAT(lines_.calls(), IsEmpty());
  StopServer();
  EXPECT_EQ(writer.Write("bay-1.feeder-1.main_current", "1").end, "not_sent");
  EXPECT_TRUE(writer.WhyNot("bay-1.feeder-1.main_current", "1"));
}

}  // namespace
}  // namespace baudgate::tools
