// What may stand in `read` and `write`, what is refused and why, and what may be repeated.
// SPDX-License-Identifier: Apache-2.0
#include "protocols/dcon/points.h"

#include <limits>

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

TEST(DconRead, Addresses) {
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

TEST(DconRead, EmptyTellsAboutQuotes) {
  EXPECT_NE(ReadFailure("").find("quotes"), std::string::npos);
  EXPECT_NE(ReadFailure("  ").find("quotes"), std::string::npos);
}

TEST(DconRead, RefusesWhatChangesTheModule) {
  for (const std::string_view bad :
       {"%01400640", "%", "~**", "#**", "~1", "~3164", "~5P", "~E1", "$0", "$1", "$9", "$90", "$40",
        "$5", "$5FF", "$7C0R08", "$C", "$C0"}) {
    EXPECT_NE(ReadFailure(bad).find("cannot be polled"), std::string::npos) << ReadFailure(bad);
  }
  EXPECT_NE(ReadFailure("$60").find("resets the counter"), std::string::npos);
  EXPECT_NE(ReadFailure("$4").find("stores the output"), std::string::npos);
  EXPECT_NE(ReadFailure("$4 commanded").find("it has: value status"), std::string::npos);
  EXPECT_NE(ReadFailure("$70").find("clears the overflow flag"), std::string::npos);
}

TEST(DconRead, RefusesWhatItDoesNotKnow) {
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

TEST(DconRepeat, ReadsAndAbsoluteWritesOnly) {
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

TEST(DconRepeat, NoSettingTwice) {
  for (const std::string_view no :
       {"$501", "@P00001E240", "$31FFFFFFFF", "~1", "~3164", "~50FF0", "$X0100", "$43", "~53"}) {
    EXPECT_FALSE(IsRepeatable(no)) << no;
  }
}

struct WriteCase {
  std::string_view text;
  Value value;
  std::string_view command;  ///< empty: refused
};

TEST(DconWrite, Values) {
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

TEST(DconWrite, RefusesWhatIsNoOutput) {
  for (const std::string_view bad : {"",
                                     "#13",
                                     "{bit}",
                                     "#1{bit}",
                                     "$13{bit}",
                                     "~5{hex2}",
                                     "%{hex2}",
                                     "$5{hex2}",
                                     "@1{hex2}",
                                     "#{hex2}",
                                     "#1{hex1}",
                                     "@{hex5}",
                                     "@{hex}",
                                     "@{+00.000}",
                                     "#2{+00}",
                                     "#2{00.}",
                                     "#2{+.00}",
                                     "#2{+0x.00}",
                                     "#2{+00.000 10..0}",
                                     "#2{+00.000 0-10}",
                                     "#2{+00.000 0..100}",
                                     "#123{bit}",
                                     "$60{store}",
                                     "~1{flag}",
                                     "~3{hex2}",
                                     "~5P{store}",
                                     "$0{clear}",
                                     "$1{clear}",
                                     "%{hex8}",
                                     "$6{clear}",
                                     "@P{hex8}",
                                     "$X{dec}"}) {
    EXPECT_FALSE(ParseWrite(bad)) << bad;
  }
}

TEST(DconWrite, WhatTheModuleWouldRefuseIsKnownAsSuch) {
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

TEST(DconRead, AWriteToAnOutputChangesNoOther) {
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

}  // namespace
}  // namespace baudgate::protocols::dcon
