// What single exchanges of a scan are taken for.
// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "gateway/base/bytes.h"
#include "gateway/base/text.h"
#include "protocols/all_protocols.h"
#include "tests/gateway/tools/scan/bench.h"

namespace baudgate::scan {
namespace {

using ::testing::HasSubstr;
using What = Verdict::What;

constexpr config::SerialSettings kEven{.data_bits = 7, .parity = config::Parity::even};
constexpr config::SerialSettings kOdd{.data_bits = 7, .parity = config::Parity::odd};

Verdict JudgeText(const std::string& protocol, std::size_t mode, const std::string& asked,
                  const Bytes& heard, std::uint32_t damaged = 0) {
  const Tongue tongue = TongueOf(*FindProtocol(protocol));
  Gathered gathered;
  gathered.heard = heard;
  gathered.damaged = damaged;
  return Judge(tongue, mode, ToBytes(asked), gathered);
}

struct Case {
  const char* name;
  const char* protocol;
  std::size_t mode;
  const char* asked;
  const char* heard;
  What what;
};
constexpr Case kCases[] = {
    {"Nothing", "spabus", 0, ">1RF:21\r", "", What::silence},
    {"Echo", "spabus", 0, ">1RF:21\r", ">1RF:21\r", What::echo},
    {"Name", "spabus", 0, ">1RF:21\r", "\n<1D:SPCJ 4D29:18\r\n", What::device},
    {"EchoAndName", "spabus", 0, ">1RF:21\r", ">1RF:21\r\n<1D:SPCJ 4D29:18\r\n", What::device},
    {"Refusal", "spabus", 0, ">1RF:21\r", "\n<1N:5:76\r\n", What::device},
    {"OtherMaster", "spabus", 0, ">1RF:21\r", ">2RI1/5:06\r", What::foreign},
    {"Damage", "spabus", 0, ">1RF:21\r", "\n<1D:SPCJ 4D\x7F:18\r\n", What::garbled},
    {"NameOfModule", "dcon", 0, "$01M\r", "!017017\r", What::device},
    {"Invalid", "dcon", 0, "$01M\r", "?01\r", What::device},
    {"ChecksumOfModule", "dcon", 1, "$01MD2\r", "!01701751\r", What::device},
    {"NoChecksum", "dcon", 1, "$01MD2\r", "!017017\r", What::garbled},
    {"LateModule", "dcon", 0, "$02M\r", "!017017\r", What::other},
    {"Configuration", "dcon", 0, "$012\r", "!01080600\r", What::device},
    {"NoConfiguration", "dcon", 0, "$012\r", "!01XYZ\r", What::garbled},
};

class JudgeTest : public ::testing::TestWithParam<Case> {};

TEST_P(JudgeTest, Exchange) {
  const Case& one = GetParam();
  EXPECT_EQ(JudgeText(one.protocol, one.mode, one.asked, ToBytes(one.heard)).what, one.what);
}

INSTANTIATE_TEST_SUITE_P(Table, JudgeTest, ::testing::ValuesIn(kCases),
                         [](const auto& info) { return std::string(info.param.name); });

TEST(JudgeParity, SevenBitsHeardAsEightAreNamed) {
  const Bytes reply = ToBytes("\n<1D:SPCJ 4D29:18\r\n");
  for (const auto& [serial, parity] :
       {std::pair(kEven, config::Parity::even), std::pair(kOdd, config::Parity::odd)}) {
    const FromWire heard = FromWireBits(ToWire(reply, serial), config::SerialSettings{});
    EXPECT_EQ(heard.damaged, 0U);
    const Verdict verdict = JudgeText("spabus", 0, ">1RF:21\r", heard.bytes);
    EXPECT_EQ(verdict.what, What::device);
    EXPECT_EQ(verdict.parity, parity);
  }
}

TEST(JudgeParity, DamagedCharactersAreAWrongParity) {
  const FromWire heard = FromWireBits(ToWire(ToBytes("\n<1D:SPCJ 4D29:18\r\n"), kOdd), kEven);
  EXPECT_GT(heard.damaged, 0U);
  EXPECT_EQ(JudgeText("spabus", 0, ">1RF:21\r", heard.bytes, heard.damaged).what, What::damaged);
}

TEST(JudgeTwo, RepliesBehindEachOtherAreTwoDevices) {
  const std::string reply = "\n<1D:SPCJ 4D29:18\r\n";
  EXPECT_TRUE(JudgeText("spabus", 0, ">1RF:21\r", ToBytes(reply + reply)).doubled);
  EXPECT_FALSE(JudgeText("spabus", 0, ">1RF:21\r", ToBytes(reply)).doubled);
}

TEST(JudgeEcho, ALinkTestProvesNobody) {
  const ScanRule& rule = *FindProtocol("set4tm")->scan;
  const Tongue tongue = TongueOf(*FindProtocol("set4tm"));
  const Bytes link = rule.ask(20, 0, 0);
  Gathered gathered;
  gathered.heard = link;
  EXPECT_EQ(Judge(tongue, 0, link, gathered).what, What::maybe);
  Append(gathered.heard, std::string_view(">2RI1/5:06\r"));
  const Verdict before_others = Judge(tongue, 0, link, gathered);
  EXPECT_EQ(before_others.what, What::maybe);
  EXPECT_FALSE(before_others.echoed) << "somebody else has spoken behind the reply";
  const Bytes serial = rule.ask(20, 0, 1);
  gathered.heard = serial;
  EXPECT_EQ(Judge(tongue, 0, serial, gathered).what, What::echo);
  Bytes closed = {20, 5};
  AppendCrc16(closed);
  gathered.heard = closed;
  EXPECT_EQ(Judge(tongue, 0, serial, gathered).what, What::device) << "its channel is closed";
}

TEST(JudgeTalk, TheMasterAndItsFormatAreNamed) {
  const Wish wish = WishFor();
  const FromWire heard = FromWireBits(ToWire(ToBytes(">2RI1/5:06\r"), kEven), {});
  EXPECT_THAT(WhoTalks(wish.tongues, heard.bytes, {}).text,
              testing::AllOf(HasSubstr("it has asked slave 2"), HasSubstr("spabus, 9600 7E1")));
  EXPECT_THAT(WhoTalks(wish.tongues, ToBytes("hello"), {}).text,
              HasSubstr("somebody sends on this line, 5 characters were heard at 9600 bit/s"));
}

}  // namespace
}  // namespace baudgate::scan
