// Tests the grammar of `read` and `write`, its errors, and which writes are allowed to be repeated.
// SPDX-License-Identifier: Apache-2.0
#include "protocols/dcon/points.h"

#include <algorithm>
#include <limits>

#include "config/loader.h"
#include "gateway/base/text.h"
#include "tests/protocols/dcon/support.h"

namespace baudgate::protocols::dcon {
namespace {

using Selection = ReadAddress::Select;

struct ReadCase {
  std::string_view text;
  std::string_view command;
  Form form;
  Selection select;
  unsigned index;
};

TEST(DconRead, AddressesAreParsed) {
  constexpr ReadCase kCases[] = {
      {"#[0]", "#", Form::numbers, Selection::index, 0},
      {"#[7]", "#", Form::numbers, Selection::index, 7},
      {"#3", "#3", Form::number, Selection::whole, 0},
      {"#0A", "#0A", Form::number, Selection::whole, 0},
      {"#0 counter", "#0", Form::counter, Selection::whole, 0},
      {"#0 decimal", "#0", Form::decimal, Selection::whole, 0},
      {"^[1]", "^", Form::numbers, Selection::index, 1},
      {"$A[2]", "$A", Form::words, Selection::index, 2},
      {"@", "@", Form::bits, Selection::whole, 0},
      {"@[b3]", "@", Form::bits, Selection::bit, 3},
      {"@[high]", "@", Form::bits, Selection::high, 0},
      {"$6[b8]", "$6", Form::status, Selection::bit, 8},
      {"$6[low]", "$6", Form::status, Selection::low, 0},
      {"$6[b1] mask", "$6", Form::hex, Selection::bit, 1},
      {"$62 commanded", "$62", Form::readback, Selection::whole, 0},
      {"$82", "$82", Form::readback, Selection::whole, 0},
      {"$M", "$M", Form::text, Selection::whole, 0},
      {"~0", "~0", Form::hex, Selection::whole, 0},
      {"$4 value", "$4", Form::number, Selection::whole, 0},
      {"$4[b9] status", "$4", Form::status, Selection::bit, 9},
      {"$70[b0] overflow", "$70", Form::hex, Selection::bit, 0},
      {"$A gate", "$A", Form::hex, Selection::whole, 0},
      {"$2[b2]", "$2", Form::text, Selection::bit, 2},
      {"@DI[b8-b9]", "@DI", Form::hex, Selection::bits, 8},
      {"$Y", "$Y", Form::decimal, Selection::whole, 0},
      {"$X1", "$X1", Form::decimal, Selection::whole, 0},
  };
  for (const ReadCase& c : kCases) {
    SCOPED_TRACE(c.text);
    const auto read = ParseRead(c.text);
    ASSERT_TRUE(read) << read.error();
    EXPECT_EQ(read->command, c.command);
    EXPECT_EQ(read->form, c.form);
    EXPECT_EQ(read->select, c.select);
    EXPECT_EQ(read->index, c.index);
  }
}

std::string ReadFailure(std::string_view text) {
  const auto read = ParseRead(text);
  return read ? "accepted" : read.error();
}

TEST(DconRead, AnEmptyAddressIsExplainedByMissingQuotes) {
  EXPECT_NE(ReadFailure("").find("quotes"), std::string::npos);
  EXPECT_NE(ReadFailure("  ").find("quotes"), std::string::npos);
}

TEST(DconRead, RefusesCommandsThatChangeTheModule) {
  for (const std::string_view bad :
       {"%01400640", "%", "~**", "#**", "~1", "~3164", "~5P", "~E1", "$0", "$1", "$9", "$90", "$40",
        "$5", "$5FF", "$7C0R08", "$C", "$C0"}) {
    EXPECT_NE(ReadFailure(bad).find("cannot be polled"), std::string::npos) << ReadFailure(bad);
  }
  EXPECT_NE(ReadFailure("$60").find("resets the counter"), std::string::npos);
  EXPECT_NE(ReadFailure("$4").find("store its outputs"), std::string::npos);
  EXPECT_NE(ReadFailure("$4 commanded").find("possible: value status"), std::string::npos);
  EXPECT_NE(ReadFailure("$70").find("clears the overflow flag"), std::string::npos);
}

TEST(DconRead, RefusesUnknownAddresses) {
  for (const std::string_view bad : {"I1",          "#",          "^",
                                     "#G",          "#a",         "#[32]",
                                     "#[0",         "#[]",        "#[b0]",
                                     "#[-1]",       "#3[0]",      "@[3]",
                                     "@[b16]",      "$2[b8]",     "$F[b2]",
                                     "@DI[b9-b8]",  "@DI[b8-b8]", "@DI[b8-9]",
                                     "@DI[b8-b40]", "@[b15-b16]", "#[b0-b1]",
                                     "$M[0]",       "#0 hex",     "@3C",
                                     "#1301",       "$82[b1]",    "#[0] value extra"}) {
    EXPECT_FALSE(ParseRead(bad)) << bad;
  }
}

TEST(DconRepeat, OnlyReadsAndAbsoluteWritesAreRepeated) {
  for (const std::string_view yes :
       {"#", "#3", "#0A", "$2", "$3", "$6", "$80", "$M", "$F", "@", "~0", "~2", "#1301", "@3C",
        "#2+07.500", "#07.500", "#C0+01.000"}) {
    EXPECT_TRUE(IsRepeatable(yes)) << yes;
  }
  for (const std::string_view no :
       {"%0C400640", "$4", "$40", "$5", "$C", "$C0", "$60", "$1", "$0", "~1", "~3164", "~OABC",
        "#SC0+01.000", "#EC0+01.000", "", "@P000000000"}) {
    EXPECT_FALSE(IsRepeatable(no)) << no;
  }
}

TEST(DconRepeat, SettingsAreNotRepeated) {
  for (const std::string_view no :
       {"$501", "@P00001E240", "$31FFFFFFFF", "~1", "~3164", "~50FF0", "$X0100", "$43", "~53"}) {
    EXPECT_FALSE(IsRepeatable(no)) << no;
  }
}

struct WriteCase {
  std::string_view text;
  Value value;
  std::string_view command;
};

TEST(DconWrite, ValuesAreEncoded) {
  const WriteCase cases[] = {
      {"#13{bit}", true, "#1301"},
      {"#13{bit}", std::int64_t{0}, "#1300"},
      {"#13{bit}", 1.0, "#1301"},
      {"#13{bit}", 2.0, ""},
      {"#00{hex2}", std::uint64_t{0x3C}, "#003C"},
      {"@{hex1}", std::int64_t{15}, "@F"},
      {"@{hex1}", std::int64_t{16}, ""},
      {"@{hex2}", std::int64_t{-1}, ""},
      {"@{hex4}", 4660.0, "@1234"},
      {"@{hex4}", 0.5, ""},
      {"#2{+00.000}", 7.5, "#2+07.500"},
      {"#2{+00.000}", -7.5, "#2-07.500"},
      {"#2{+00.000}", std::int64_t{10}, "#2+10.000"},
      {"#2{+00.000}", 100.0, ""},
      {"#2{+00.000 0..10}", 10.0005, ""},
      {"#2{+00.000 0..10}", -0.1, ""},
      {"#{00.000}", 7.5, "#07.500"},
      {"#{00.000}", -1.0, ""},
      {"#0{+000.00}", 99.999, "#0+100.00"},
      {"#C1{+00.000}", 4.0, "#C1+04.000"},
      {"$60{clear}", true, "$60"},
      {"$60{clear}", false, ""},
      {"~1{clear}", true, "~1"},
      {"$4{store}", true, "$4"},
      {"$43{store}", true, "$43"},
      {"~53{store}", true, "~53"},
      {"$50{flag}", true, "$501"},
      {"$51{flag}", false, "$510"},
      {"$50{flag}", 2.0, ""},
      {"$A{hex1}", std::uint64_t{2}, "$A2"},
      {"@P0{hex8}", std::uint64_t{0x1E240}, "@P00001E240"},
      {"@P0{hex8}", 4294967296.0, ""},
      {"$31{hex8}", 4294967295.0, "$31FFFFFFFF"},
      {"@DO0{hex1}", std::int64_t{3}, "@DO03"},
      {"~3{hex3}", std::uint64_t{0x164}, "~3164"},
      {"~5{hex4}", std::uint64_t{0x0FF0}, "~50FF0"},
      {"$X{dec4}", std::uint64_t{100}, "$X0100"},
      {"$X{dec4}", 10000.0, ""},
      {"$X0{dec4}", std::uint64_t{0}, "$X00000"},
      {"#2{+00.000}", std::string("7.5"), ""},
      {"#2{+00.000}", Value{}, ""},
      {"#2{+00.000}", std::numeric_limits<double>::quiet_NaN(), ""},
  };
  for (const WriteCase& c : cases) {
    SCOPED_TRACE(std::string(c.text) + " " + ToText(c.value));
    const auto write = ParseWrite(c.text);
    ASSERT_TRUE(write) << write.error();
    const auto command = FormatWrite(*write, c.value);
    if (c.command.empty()) {
      EXPECT_FALSE(command) << *command;
      continue;
    }
    ASSERT_TRUE(command) << command.error();
    EXPECT_EQ(*command, c.command);
    const auto back = ParseWritten(*write, *command);
    ASSERT_TRUE(back.has_value());
    EXPECT_NEAR(ToDouble(*back), ToDouble(c.value), 0.005);
  }
}

TEST(DconWrite, RefusesInvalidOutputs) {
  for (const std::string_view bad :
       Split("|#13|{bit}|#1{bit}|$13{bit}|~5{hex2}|%{hex2}|$5{hex2}|@1{hex2}|#{hex2}|"
             "#1{hex1}|@{hex5}|@{hex}|@{+00.000}|#2{+00}|#2{00.}|#2{+.00}|#2{+0x.00}|"
             "#2{+00.000 10..0}|#2{+00.000 0-10}|#2{+00.000 0..100}|#123{bit}|$60{store}|"
             "~1{flag}|~3{hex2}|~5P{store}|$0{clear}|$1{clear}|%{hex8}|$6{clear}|@P{hex8}|"
             "$X{dec}",
             '|')) {
    EXPECT_FALSE(ParseWrite(bad)) << bad;
  }
}

TEST(DconWrite, ValuesThatTheModuleWouldRefuseAreRecognised) {
  const auto bit = ParseWrite("#13{bit}");
  EXPECT_EQ(ParseWritten(*bit, "#1302"), std::optional(Value{}));
  EXPECT_EQ(ParseWritten(*bit, "#1401"), std::nullopt);
  EXPECT_EQ(ParseWritten(*bit, "#13"), std::nullopt);
  const auto volts = ParseWrite("#0{+00.000 0..10}");
  EXPECT_EQ(ParseWritten(*volts, "#0+12.000"), std::optional(Value{}));
  EXPECT_EQ(ParseWritten(*volts, "#012.000"), std::nullopt);
}

std::string PointFailure(config::Point point) {
  const Status status = DconProtocol().check_point(point);
  return status ? "" : status.error();
}

TEST(DconPoint, TypesFitTheReply) {
  using config::Type;
  EXPECT_EQ(PointFailure(ReadPoint("a", "#[0]", Type::float32)), "");
  EXPECT_EQ(PointFailure(ReadPoint("a", "$6[b3]", Type::boolean)), "");
  EXPECT_EQ(PointFailure(ReadPoint("a", "$M", Type::string)), "");
  EXPECT_EQ(PointFailure(ReadPoint("a", "$2[b2]", Type::boolean)), "");
  EXPECT_NE(PointFailure(ReadPoint("a", "$2[b2]", Type::string)), "");
  EXPECT_NE(PointFailure(ReadPoint("a", "$6[b3]", Type::uint16)), "");
  EXPECT_NE(PointFailure(ReadPoint("a", "$6", Type::boolean)), "");
  EXPECT_NE(PointFailure(ReadPoint("a", "$M", Type::float32)), "");
  EXPECT_NE(PointFailure(ReadPoint("a", "#[0]", Type::string)), "");
  EXPECT_NE(PointFailure(ReadPoint("a", "")), "");
}

TEST(DconPoint, WritablePointsNeedAnOutput) {
  using config::Type;
  EXPECT_EQ(PointFailure(WritePoint("a", "", "#13{bit}", Type::boolean)), "");
  EXPECT_EQ(PointFailure(WritePoint("a", "$6[b3]", "#13{bit}", Type::boolean)), "");
  EXPECT_NE(PointFailure(WritePoint("a", "$6[b3]", "", Type::boolean)), "");
  EXPECT_NE(PointFailure(WritePoint("a", "", "#13{bit}", Type::float32)), "");
  EXPECT_NE(PointFailure(WritePoint("a", "", "@{hex2}", Type::boolean)), "");
  EXPECT_EQ(PointFailure(WritePoint("a", "$50[b0]", "$50{flag}", Type::boolean)), "");
  EXPECT_EQ(PointFailure(WritePoint("a", "", "$C{clear}", Type::boolean)), "");
  EXPECT_NE(PointFailure(WritePoint("a", "$L0[b0]", "$C{clear}", Type::boolean)).find("access: w"),
            std::string::npos)
      << "it would never read as what was written";
  EXPECT_NE(PointFailure(WritePoint("a", "", "@{hex2}", Type::string)), "");
}

TEST(DconDescriptor, DecodersAndOptionsAreDescribed) {
  const Protocol& protocol = DconProtocol();
  EXPECT_EQ(protocol.name, "dcon");
  for (const DecoderSpec& decoder : protocol.decoders) {
    EXPECT_TRUE(ParseRead(decoder.form)) << decoder.form;
    EXPECT_FALSE(decoder.help.empty());
  }
  for (const OptionSpec& option : protocol.options)
    EXPECT_FALSE(option.help.empty()) << option.name;
}

TEST(DconDescriptor, TimingCoversTheLongestFrame) {
  for (const int baud : {1200, 9600, 115200}) {
    config::SerialSettings serial;
    serial.baud = baud;
    const config::Timing timing = DconProtocol().timing(serial);
    EXPECT_EQ(*timing.quiet, Duration(5ms));
    EXPECT_EQ(*timing.reply, Duration(300ms));
    EXPECT_GE(*timing.gap, Duration(50ms));
    EXPECT_GE(*timing.gap, 20 * serial.CharacterTime());
    EXPECT_GE(*timing.ceiling, *timing.reply + 268 * serial.CharacterTime());
    EXPECT_GE(*timing.drain, Duration(100ms));
  }
}

TEST(DconRead, AWriteToAnOutputChangesNoOtherPoint) {
  const auto changes = [](const char* command, const char* read) {
    config::Point point;
    point.read = read;
    return Changes(command, point);
  };
  for (const char* read : {"$80", "$6[b0]"}) EXPECT_TRUE(changes("#0+04.500", read)) << read;
  for (const char* read : {"$81", "$70 power_on", "$71 power_on", "~0", "#[0]"}) {
    EXPECT_FALSE(changes("#0+04.500", read)) << read;
  }
  EXPECT_TRUE(changes("#000A", "$6[b0]")) << "digital outputs";
  EXPECT_TRUE(changes("$4N", "$70 power_on")) << "another command may do anything";
}

config::Catalog Installed() {
  config::Catalog catalog;
  catalog.protocols["dcon"] = &DconProtocol();
  catalog.profile_dirs = {"config/profiles"};
  return catalog;
}

config::Loaded Load(const std::string& profile, const std::string& options) {
  const std::string text =
      "lines:\n  - name: io\n    port: /dev/null\n    protocol: dcon\n    devices:\n"
      "      - { name: module, address: 1, unit: 1, profile: " +
      profile + options + " }\n";
  return config::LoadText(text, "test.yaml", Installed());
}

Value Simulated(const config::Point& point) {
  if (!point.simulate) return {};
  if (point.simulate->text && point.type == config::Type::string) return *point.simulate->text;
  return point.simulate->low;
}

class DconProfile : public ::testing::TestWithParam<std::string> {
 protected:
  void RoundTripAll(const std::string& options) {
    const config::Loaded loaded = Load(GetParam(), options);
    for (const auto& problem : loaded.problems) ADD_FAILURE() << config::ToString(problem);
    ASSERT_TRUE(loaded.ok());
    const config::Device& device = loaded.config.lines.at(0).devices.at(0);
    FixedValues values;
    for (std::size_t i = 0; i < device.points.size(); ++i) {
      values.values[i] = Simulated(device.points[i]);
      EXPECT_TRUE(HasValue(values.values[i])) << device.points[i].name << " has no simulate";
      EXPECT_FALSE(device.points[i].description->empty()) << device.points[i].name;
    }
    DconTwin twin(device, values);
    Talk talk(DconProtocol(), device);
    std::vector<bool> seen(device.points.size(), false);
    for (std::size_t i = 0; i < seen.size(); ++i) {
      seen[i] = device.points[i].access == config::Access::write;
    }
    for (std::size_t query = 0; query < talk->Queries().size(); ++query) {
      Answer answer = talk.Run(Poll(query), twin);
      for (int more = 0; more < 3 && answer.then == Then::replan; ++more) {
        answer = talk.Run(Poll(query), twin);
      }
      EXPECT_EQ(answer.outcome, Outcome::ok) << answer.reason;
      for (const Reading& reading : answer.readings) Check(device, values, reading, seen);
    }
    EXPECT_EQ(std::count(seen.begin(), seen.end(), false), 0);
    for (std::size_t i = 0; i < device.points.size(); ++i) {
      if (device.points[i].access == config::Access::read) continue;
      const Answer answer = talk.Run(Write(i, 1.0), twin);
      EXPECT_EQ(answer.outcome, Outcome::ok) << device.points[i].name << ": " << answer.reason;
      const double expected = IsAction(device.points[i].write) ? 0 : 1;
      EXPECT_EQ(ToDouble(values.values[i]), expected) << device.points[i].name;
    }
  }

  static bool IsAction(std::string_view write) { return write.ends_with("{clear}"); }

  static void Check(const config::Device& device, const FixedValues& values, const Reading& reading,
                    std::vector<bool>& seen) {
    Value truth = values.values.at(reading.point);
    if (device.points[reading.point].read == "$2" && device.options.Flag("checksum")) {
      truth = ToText(truth).replace(4, 2, "40");
    }
    seen[reading.point] = true;
    EXPECT_EQ(reading.quality, Quality::good) << device.points[reading.point].name;
    if (std::holds_alternative<std::string>(truth)) {
      EXPECT_EQ(reading.value, truth);
    } else {
      EXPECT_NEAR(ToDouble(reading.value), ToDouble(truth), 0.051)
          << device.points[reading.point].name;
    }
  }
};

TEST_P(DconProfile, IsReadBackAsShipped) { RoundTripAll(""); }
TEST_P(DconProfile, IsReadBackWithChecksum) { RoundTripAll(", checksum: true"); }
TEST_P(DconProfile, IsReadBackWithoutChecksum) { RoundTripAll(", checksum: false"); }

std::vector<std::string> Names() {
  std::vector<std::string> names;
  for (const auto& file : Installed().Profiles("dcon")) names.push_back(file.name);
  return names;
}

INSTANTIATE_TEST_SUITE_P(Shipped, DconProfile, ::testing::ValuesIn(Names()),
                         [](const ::testing::TestParamInfo<std::string>& info) {
                           std::string name = info.param;
                           std::erase(name, '-');
                           return name;
                         });

TEST(DconProfiles, TheReferenceDeviceIsShipped) {
  const std::vector<std::string> names = Names();
  EXPECT_NE(std::find(names.begin(), names.end(), "owen-mv110-8a"), names.end());
  const config::Loaded loaded = Load("owen-mv110-8a", "");
  ASSERT_TRUE(loaded.ok());
  const config::Device& device = loaded.config.lines[0].devices[0];
  ASSERT_EQ(device.points.size(), 8U);
  for (std::size_t i = 0; i < 8; ++i) EXPECT_EQ(device.points[i].modbus, 2 * i);
  EXPECT_TRUE(device.options.Flag("checksum"));
  EXPECT_EQ(device.timing.reply, std::optional<Duration>(1s));
}

TEST(DconProfiles, AnUnquotedHashIsExplained) {
  const config::Loaded loaded = config::LoadText(
      "lines:\n  - name: io\n    port: /dev/null\n    protocol: dcon\n    devices:\n"
      "      - name: module\n        address: 1\n        points:\n"
      "          - name: a\n            read: #[0]\n            type: float32\n",
      "test.yaml", Installed());
  EXPECT_FALSE(loaded.ok());
  const bool told = std::any_of(
      loaded.problems.begin(), loaded.problems.end(),
      [](const auto& problem) { return problem.message.find("quote") != std::string::npos; });
  EXPECT_TRUE(told) << (loaded.problems.empty() ? "" : config::ToString(loaded.problems[0]));
}

}  // namespace
}  // namespace baudgate::protocols::dcon
