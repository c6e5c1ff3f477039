// Tests of scans of whole buses under virtual time.
// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <regex>

#include "config/loader.h"
#include "gateway/base/bytes.h"
#include "gateway/base/text.h"
#include "protocols/all_protocols.h"
#include "tests/gateway/tools/scan/bench.h"

namespace baudgate::scan {
namespace {

using ::testing::AllOf;
using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::SizeIs;

constexpr config::SerialSettings k7E1{.data_bits = 7, .parity = config::Parity::even};
constexpr config::SerialSettings k7O1{.data_bits = 7, .parity = config::Parity::odd};
constexpr config::SerialSettings k8N1{};
constexpr config::SerialSettings k8E1{.parity = config::Parity::even};
constexpr config::SerialSettings k8O1{.parity = config::Parity::odd};

/// True if a scan is allowed to send the request. Independent of the rules in the code of the scan.
bool IsListedRead(const Bytes& frame) {
  const std::string text(AsText(frame));
  static const std::regex kSpa("^>[1-9][0-9]{0,2}RF:([0-9A-F]{2}|XX)\r$");
  static const std::regex kDcon("^\\$[0-9A-F]{2}[M2]([0-9A-F]{2})?\r$");
  static const std::regex kAscii(
      "^:[0-9A-F]{2}(11|2B0E0100|080000A537|0[34]00000001)[0-9A-F]{2}\r\n$");
  if (text.starts_with(">900")) return false;
  if (std::regex_match(text, kSpa) || std::regex_match(text, kDcon) ||
      std::regex_match(text, kAscii)) {
    return true;
  }
  static const std::vector<Bytes> kPdus = {{0x11},
                                           {0x2B, 0x0E, 0x01, 0x00},
                                           {0x08, 0x00, 0x00, 0xA5, 0x37},
                                           {0x03, 0x00, 0x00, 0x00, 0x01},
                                           {0x04, 0x00, 0x00, 0x00, 0x01},
                                           {0x00},
                                           {0x08, 0x00}};
  const auto is_pdu = [&](std::size_t tail) {
    if (frame.size() < 2 + tail || frame[0] == 0 || frame[0] > 247) return false;
    const Bytes pdu(frame.begin() + 1, frame.end() - static_cast<std::ptrdiff_t>(tail));
    return std::ranges::find(kPdus, pdu) != kPdus.end();
  };
  const auto ks = [&frame] {
    std::uint8_t sum = 0xFF;
    for (const std::uint8_t byte : frame) sum ^= byte;
    return sum == 0;
  };
  return (EndsInCrc16(frame) && is_pdu(2)) || (ks() && is_pdu(1));
}

void ExpectReadsOnly(const Bench& bench) {
  EXPECT_FALSE(bench.sent.empty());
  for (const auto& [frame, serial] : bench.sent) {
    EXPECT_TRUE(IsListedRead(frame)) << ToHex(frame) << " at " << serial.ToString();
  }
}

std::string Line(const Found& one) {
  return one.protocol + " " + one.serial.ToString() + " " + std::to_string(one.address) + " '" +
         one.identity + "' " + one.profile + (one.suspect ? " suspect" : "");
}
std::vector<std::string> Lines(const Report& report) {
  std::vector<std::string> lines;
  for (const Found& one : report.found) lines.push_back(Line(one));
  std::ranges::sort(lines);
  return lines;
}

class Scan : public ::testing::Test {
 protected:
  void Run(const Wish& wish) {
    names_ = ShippedNames(wish);
    Scanner scanner(wish, names_, bench, seen);
    const Status end = scanner.Run();
    EXPECT_TRUE(end) << end.error();
    report = scanner.report();
  }
  void AddTwelve() {
    bench.bus.Add({"spabus", "spaj140c", "1", k7E1});
    bench.bus.Add({"spabus", "spau130c", "2", k7E1});
    bench.bus.Add({"spabus", "spaj140c", "3", k7E1});
    bench.bus.Add({"spabus", "spaj140c", "7", k7O1});
    bench.bus.Add({"dcon", "icpdas-i-7017", "1", k8N1, {{"checksum", "false"}}});
    bench.bus.Add({"dcon", "icpdas-i-7060", "4", k8N1, {{"checksum", "true"}}});
    bench.bus.Add({"dcon", "icpdas-i-7080", "5", k8N1, {{"checksum", "false"}}});
    bench.bus.Add({"dcon", "icpdas-i-7017", "9", k8N1, {{"checksum", "false"}}});
    bench.bus.Add({"dcon", "icpdas-i-7024", "9", k8N1, {{"checksum", "false"}}});
    bench.bus.Add({"set4tm", "set-4tm.03m", "20", k8O1});
    bench.bus.Add({"set4tm", "set-4tm.03m", "21", k8O1});
    bench.bus.Add({"set4tm", "set-4tm.03m", "22", k8O1});
  }
  static std::vector<std::string> TheTwelve() {
    return {"dcon 9600 8N1 1 '7017' icpdas-i-7017",   "dcon 9600 8N1 4 '7060' icpdas-i-7060",
            "dcon 9600 8N1 5 '7080' icpdas-i-7080",   "set4tm 9600 8O1 20 '' set-4tm.03m",
            "set4tm 9600 8O1 21 '' set-4tm.03m",      "set4tm 9600 8O1 22 '' set-4tm.03m",
            "spabus 9600 7E1 1 'SPCJ 4D29' spaj140c", "spabus 9600 7E1 2 'SPAU 130 C' spau130c",
            "spabus 9600 7E1 3 'SPCJ 4D29' spaj140c", "spabus 9600 7O1 7 'SPCJ 4D29' spaj140c"};
  }

  Bench bench;
  Seen seen;
  Report report;

 private:
  ProfileNames names_;
};

TEST_F(Scan, FindsTwelveDevicesOfThreeProtocols) {
  AddTwelve();
  Run(WishFor());
  std::vector<std::string> lines = Lines(report);
  ASSERT_THAT(lines, SizeIs(11));
  const auto shared = std::ranges::find_if(
      report.found, [](const Found& one) { return one.protocol == "dcon" && one.address == 9; });
  ASSERT_NE(shared, report.found.end());
  EXPECT_TRUE(shared->suspect);
  std::erase(lines, Line(*shared));
  EXPECT_EQ(lines, TheTwelve());
  const auto odd = std::ranges::find_if(
      report.found, [](const Found& one) { return one.serial.ToString() == "9600 7O1"; });
  ASSERT_NE(odd, report.found.end());
  EXPECT_THAT(odd->remarks, Contains(HasSubstr("check the character format")));
  EXPECT_TRUE(report.ended);
  EXPECT_FALSE(report.echo);
  ExpectReadsOnly(bench);
}

TEST_F(Scan, AForeignMasterIsDetectedAndNothingIsSent) {
  AddTwelve();
  bench.master = {ToBytes(">2RI1:02\r"), k7E1};
  bench.master->request = ToBytes(">2RI1:" + HexByte(Xor8(ToBytes(">2RI1:"))) + "\r");
  Run(WishFor());
  EXPECT_THAT(seen.told, ElementsAre(AllOf(HasSubstr("another master sends"), HasSubstr("slave 2"),
                                           HasSubstr("spabus, 9600 7E1"))));
  EXPECT_THAT(bench.sent, IsEmpty());
  EXPECT_FALSE(report.ended);
}

TEST_F(Scan, ScanningOverTrafficFindsTheSameDevices) {
  AddTwelve();
  bench.master = {ToBytes(">2RI1:" + HexByte(Xor8(ToBytes(">2RI1:"))) + "\r"), k7E1, 700ms};
  seen.may_talk = true;
  Run(WishFor());
  std::vector<std::string> lines = Lines(report);
  std::erase_if(lines,
                [](const std::string& line) { return line.starts_with("dcon 9600 8N1 9 "); });
  EXPECT_EQ(lines, TheTwelve());
  EXPECT_THAT(report.remarks, Contains(HasSubstr("another master sends")));
  ExpectReadsOnly(bench);
}

TEST_F(Scan, AlternatingRepliesAreReportedAsTwoDevices) {
  bench.two = TwinBus::Two::in_turn;
  bench.bus.Add({"spabus", "spaj140c", "1", k7E1});
  bench.bus.Add({"spabus", "spau130c", "1", k7E1});
  Run(WishFor("spabus"));
  ASSERT_THAT(report.found, SizeIs(1));
  EXPECT_TRUE(report.found[0].suspect);
  EXPECT_THAT(report.found[0].remarks, Contains(HasSubstr("two devices")));
}

TEST_F(Scan, AnEchoIsReportedAndIsNoDevice) {
  bench.echoes = true;
  bench.bus.Add({"set4tm", "set-4tm.03m", "3", k8O1});
  bench.bus.Add({"modbus_rtu", "mitsubishi-fr-d700", "5", k8N1});
  Run(WishFor());
  EXPECT_THAT(Lines(report),
              ElementsAre("modbus_rtu 9600 8N1 5 'baudgate Mitsubishi FR-D700' mitsubishi-fr-d700",
                          "set4tm 9600 8O1 3 '' set-4tm.03m"));
  EXPECT_TRUE(report.echo);
  ExpectReadsOnly(bench);
}

TEST_F(Scan, ADeviceThatIgnoresParityIsFoundInItsOwnFormat) {
  bench.bus.Add({"modbus_rtu", "mitsubishi-fr-d700", "5", k8E1, {}, false});
  bench.bus.Add({"spabus", "spaj140c", "2", k7E1, {}, false});
  Wish wish = WishFor();
  Run(wish);
  EXPECT_THAT(Lines(report),
              ElementsAre("modbus_rtu 9600 8E1 5 'baudgate Mitsubishi FR-D700' mitsubishi-fr-d700",
                          "spabus 9600 7E1 2 'SPCJ 4D29' spaj140c"));
  ExpectReadsOnly(bench);
}

TEST_F(Scan, ASlowDeviceIsAskedAgainWithALongerTimeout) {
  bench.think = 300ms;
  bench.bus.Add({"spabus", "spaj140c", "4", k7E1});
  Run(WishFor("spabus"));
  EXPECT_THAT(Lines(report), ElementsAre("spabus 9600 7E1 4 'SPCJ 4D29' spaj140c"));
}

TEST_F(Scan, CtrlCKeepsTheFoundDevices) {
  bench.bus.Add({"spabus", "spaj140c", "1", k7E1});
  bench.stop_after = 20;
  Run(WishFor("spabus"));
  EXPECT_THAT(report.found, SizeIs(1));
  EXPECT_FALSE(report.ended);
  EXPECT_THAT(bench.sent, SizeIs(20));
  EXPECT_TRUE(report.asked);
}

TEST_F(Scan, CtrlCWhileListeningSendsNothing) {
  bench.stops_listening = true;
  Run(WishFor("spabus"));
  EXPECT_FALSE(report.ended);
  EXPECT_FALSE(report.asked);
  EXPECT_THAT(bench.sent, IsEmpty());
}

TEST_F(Scan, AQuickScanEndsWithinAMinute) {
  AddTwelve();
  Wish wish = WishFor();
  wish.quick = true;
  Run(wish);
  EXPECT_LT(bench.Now() - kStart, 60s);
  EXPECT_GE(report.found.size(), 10U);
  ExpectReadsOnly(bench);
}

TEST_F(Scan, TheRemainingTimeFallsToZero) {
  Wish wish = WishFor("dcon");
  wish.addresses = Addresses{1, 4};
  Run(wish);
  EXPECT_TRUE(std::ranges::is_sorted(seen.left, std::greater<>()));
  EXPECT_LT(seen.left.back(), 1s);
  EXPECT_THAT(report.found, IsEmpty());
}

TEST_F(Scan, OnlyRequestedAddressesAreAsked) {
  Wish wish = WishFor("spabus");
  wish.addresses = Addresses{5, 6};
  Run(wish);
  for (const auto& [frame, serial] : bench.sent) {
    EXPECT_THAT(std::string(AsText(frame)), ::testing::MatchesRegex(">[56]RF:..\r"));
  }
}

TEST_F(Scan, TheSuggestedConfigurationLoads) {
  AddTwelve();
  bench.echoes = true;
  Run(WishFor());
  const std::string yaml = Configuration(report, {.written = "what was found",
                                                  .gateway = GatewayName("gate-7.plant"),
                                                  .line = "bus",
                                                  .port = "/dev/ttyUSB0"});
  config::Catalog catalog;
  for (const protocols::Protocol* protocol : protocols::AllProtocols()) {
    catalog.protocols[std::string(protocol->name)] = protocol;
  }
  catalog.profile_dirs = {"config/profiles"};
  const config::Loaded loaded = config::LoadText(yaml, "scan.yaml", catalog);
  for (const config::Problem& problem : loaded.problems) {
    EXPECT_TRUE(problem.warning) << problem.mark.ToString() << ": " << problem.message << "\n"
                                 << yaml;
  }
  ASSERT_TRUE(loaded.ok());
  const config::Line& line = loaded.config.lines.at(0);
  EXPECT_EQ(line.echo, config::Echo::strip);
  EXPECT_EQ(loaded.config.name + " " + line.name, "gate-7 bus");
  EXPECT_TRUE(loaded.config.web.on);
  EXPECT_EQ(line.protocol + " " + line.serial.ToString(), "dcon 9600 8N1");
  EXPECT_THAT(line.devices, SizeIs(report.found.size()));
}

TEST(ScanNames, AreDerivedFromTheHostName) {
  EXPECT_EQ(GatewayName("gate-7.plant.example"), "gate-7");
  EXPECT_EQ(GatewayName("_a--b_"), "a-b");
  EXPECT_EQ(GatewayName("2026"), "2026");
  EXPECT_EQ(GatewayName(""), "gateway");
  EXPECT_EQ(GatewayName("..."), "gateway");
}

TEST(ScanUnits, AreTheFreeAddresses) {
  std::vector<Found> found(2);
  found[0].unit = UnitFor(found, 5);
  EXPECT_EQ(found[0].unit, 5U);
  EXPECT_EQ(UnitFor(found, 5), 1U);
  EXPECT_EQ(UnitFor(found, 600), 1U);
}

/// Garbage in the first serial format reveals the format that the device uses.
TEST_F(Scan, ADeviceWithADetectedFormatIsFoundOnce) {
  for (const config::SerialSettings& format : {k8E1, k8O1, k8N1}) {
    SCOPED_TRACE(format.ToString());
    bench = Bench();
    bench.bus.Add({"modbus_rtu", "generic-meter", "17", format});
    Wish wish = WishFor("modbus_rtu");
    wish.addresses = Addresses{17, 17};
    Run(wish);
    EXPECT_THAT(report.found, SizeIs(1));
  }
}

/// For this meter function 3 is a write, so the scan sends function 3 only to a device that has
/// answered as a Modbus slave.
TEST_F(Scan, AMeterIsNeverAskedForHoldingRegisters) {
  bench.bus.Add({"set4tm", "set-4tm.03m", "20", k8O1});
  Wish wish = WishFor("modbus_rtu");
  wish.addresses = Addresses{20, 20};
  Run(wish);
  EXPECT_FALSE(bench.sent.empty());
  for (const auto& [frame, serial] : bench.sent) EXPECT_NE(frame[1], 3) << ToHex(frame);
}

using What = Verdict::What;

constexpr config::SerialSettings kEven{.data_bits = 7, .parity = config::Parity::even};
constexpr config::SerialSettings kOdd{.data_bits = 7, .parity = config::Parity::odd};

Verdict JudgeText(const std::string& protocol, std::size_t mode, const std::string& asked,
                  const Bytes& heard, std::uint32_t damaged = 0) {
  const Tongue tongue = TongueOf(*protocols::FindProtocol(protocol));
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
    {"Silence", "spabus", 0, ">1RF:21\r", "", What::silence},
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

TEST_P(JudgeTest, JudgesAnExchange) {
  const Case& one = GetParam();
  EXPECT_EQ(JudgeText(one.protocol, one.mode, one.asked, ToBytes(one.heard)).what, one.what);
}

INSTANTIATE_TEST_SUITE_P(Table, JudgeTest, ::testing::ValuesIn(kCases),
                         [](const auto& info) { return std::string(info.param.name); });

TEST(JudgeParity, SevenBitsReadAsEightAreRecognised) {
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

TEST(JudgeParity, DamagedCharactersMeanAWrongParity) {
  const FromWire heard = FromWireBits(ToWire(ToBytes("\n<1D:SPCJ 4D29:18\r\n"), kOdd), kEven);
  EXPECT_GT(heard.damaged, 0U);
  EXPECT_EQ(JudgeText("spabus", 0, ">1RF:21\r", heard.bytes, heard.damaged).what, What::damaged);
}

TEST(JudgeTwo, ConsecutiveRepliesAreTwoDevices) {
  const std::string reply = "\n<1D:SPCJ 4D29:18\r\n";
  EXPECT_TRUE(JudgeText("spabus", 0, ">1RF:21\r", ToBytes(reply + reply)).doubled);
  EXPECT_FALSE(JudgeText("spabus", 0, ">1RF:21\r", ToBytes(reply)).doubled);
}

TEST(JudgeEcho, ALinkTestProvesNoDevice) {
  const protocols::ScanRule& rule = *protocols::FindProtocol("set4tm")->scan;
  const Tongue tongue = TongueOf(*protocols::FindProtocol("set4tm"));
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
              HasSubstr("another device sends on this line: 5 characters came at 9600 bit/s"));
}

TEST(Plan, BeginsWithTheUsualSettingOfEachProtocol) {
  const Wish wish = WishFor();
  const auto sweeps = LikelySweeps(wish);
  ASSERT_GE(sweeps.size(), wish.tongues.size());
  for (std::size_t i = 0; i < wish.tongues.size(); ++i) {
    EXPECT_EQ(sweeps[i].tongue, i);
    EXPECT_TRUE(SameWire(sweeps[i].serial, wish.tongues[i].rule().serials.front()));
    EXPECT_EQ(sweeps[i].addresses, (Addresses{1, 32}));
  }
}

TEST(Plan, AQuickPlanFitsIntoAMinute) {
  for (const char* protocol : {"", "spabus", "dcon", "set4tm", "modbus_rtu", "modbus_ascii"}) {
    Wish wish = WishFor(protocol);
    wish.quick = true;
    Duration time = TimeOf(LikelySweeps(wish), wish);
    for (const Listening& listen : ListenFirst(wish)) time += listen.time;
    EXPECT_LT(time, 50s) << protocol;
    EXPECT_GT(time, 20s) << protocol;
    EXPECT_THAT(ThoroughSweeps(wish, {}), IsEmpty());
  }
}

TEST(Plan, SettingsWithAnAnswerAreScannedFirst) {
  const Wish wish = WishFor("dcon");
  const config::SerialSettings fast{.baud = 115200};
  const auto sweeps = ThoroughSweeps(wish, std::span(&fast, 1));
  ASSERT_THAT(sweeps, SizeIs(2));
  EXPECT_EQ(sweeps[0].serial.baud, 115200);
  EXPECT_EQ(sweeps[0].addresses, (Addresses{0, 255}));
  EXPECT_EQ(sweeps[0].finds, 0b11U);
  EXPECT_EQ(sweeps[1].serial.baud, 9600);
}

TEST(Plan, ASerialServerHasOneSetting) {
  Wish wish = WishFor();
  wish.network = true;
  EXPECT_THAT(LikelySweeps(wish), SizeIs(wish.tongues.size()));
  EXPECT_THAT(ListenFirst(wish), SizeIs(1));
}

TEST(Plan, AddressesAreReadAsARange) {
  EXPECT_EQ(*ParseAddresses("7"), (Addresses{7, 7}));
  EXPECT_EQ(*ParseAddresses("1-32"), (Addresses{1, 32}));
  for (const char* wrong : {"", "-", "3-1", "1-", "a", "1-1000", "1 - 3"}) {
    EXPECT_FALSE(ParseAddresses(wrong)) << wrong;
  }
}

TEST(Plan, OtherFormatsFitTheCharactersOfTheProtocol) {
  EXPECT_THAT(OtherFormats({}, *protocols::FindProtocol("modbus_rtu")), SizeIs(2));
  EXPECT_THAT(OtherFormats({}, *protocols::FindProtocol("spabus")), SizeIs(4));
  EXPECT_EQ(OtherFormats({}, *protocols::FindProtocol("dcon")).front().ToString(), "9600 8E1")
      << "no module has seven bits";
}

TEST(Plan, EveryScanRuleIsComplete) {
  for (const protocols::Protocol* protocol : protocols::AllProtocols()) {
    if (protocol->scan == nullptr) continue;
    const protocols::ScanRule& rule = *protocol->scan;
    EXPECT_FALSE(rule.serials.empty()) << protocol->name;
    EXPECT_GE(rule.modes.size(), rule.quick_modes) << protocol->name;
    EXPECT_EQ(rule.quick_finds & ~rule.finds, 0U) << protocol->name;
    EXPECT_GT(rule.usual, Duration::zero()) << protocol->name;
    for (const protocols::ScanMode& mode : rule.modes) {
      const auto named = [&](const protocols::OptionSpec& spec) { return spec.name == mode.key; };
      EXPECT_TRUE(mode.key.empty() || std::ranges::any_of(protocol->options, named));
    }
    EXPECT_NE(protocol->telegram, nullptr) << protocol->name;
    for (std::size_t mode = 0; mode < rule.modes.size(); ++mode) {
      for (std::size_t question = 0; question < rule.questions; ++question) {
        const Bytes asked = rule.ask(rule.last_address, mode, question);
        EXPECT_TRUE(protocol->telegram->is_read(asked, TongueOf(*protocol).options[mode]))
            << protocol->name << " question " << question;
      }
    }
  }
}

}  // namespace
}  // namespace baudgate::scan
