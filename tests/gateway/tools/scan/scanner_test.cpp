// Scans of whole buses under virtual time: who is found, what is suspected, and that nothing but
// the listed reads was sent.
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
using ::testing::Not;
using ::testing::SizeIs;

constexpr config::SerialSettings k7E1{.data_bits = 7, .parity = config::Parity::even};
constexpr config::SerialSettings k7O1{.data_bits = 7, .parity = config::Parity::odd};
constexpr config::SerialSettings k8N1{};
constexpr config::SerialSettings k8E1{.parity = config::Parity::even};
constexpr config::SerialSettings k8O1{.parity = config::Parity::odd};

/// Written once more, and not taken from the rules: what may be on the wire.
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
  // A meter of the old kind has a check value of one byte.
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
  /// Twelve devices of three protocols; two of them have one address, one has another parity.
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

TEST_F(Scan, ABusOfTwelveDevicesOfThreeProtocols) {
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
  EXPECT_THAT(odd->remarks, Contains(HasSubstr("a wrong parity?")));
  EXPECT_TRUE(report.ended);
  EXPECT_FALSE(report.echo);
  ExpectReadsOnly(bench);
}

TEST_F(Scan, AForeignMasterIsHeardFirstAndNothingIsSent) {
  AddTwelve();
  bench.master = {ToBytes(">2RI1:02\r"), k7E1};
  bench.master->request = ToBytes(">2RI1:" + HexByte(Xor8(ToBytes(">2RI1:"))) + "\r");
  Run(WishFor());
  EXPECT_THAT(seen.told, ElementsAre(AllOf(HasSubstr("another master speaks"), HasSubstr("slave 2"),
                                           HasSubstr("spabus, 9600 7E1"))));
  EXPECT_THAT(bench.sent, IsEmpty());
  EXPECT_FALSE(report.ended);
}

TEST_F(Scan, OverTrafficFindsTheSame) {
  AddTwelve();
  bench.master = {ToBytes(">2RI1:" + HexByte(Xor8(ToBytes(">2RI1:"))) + "\r"), k7E1, 700ms};
  seen.may_talk = true;
  Run(WishFor());
  std::vector<std::string> lines = Lines(report);
  std::erase_if(lines,
                [](const std::string& line) { return line.starts_with("dcon 9600 8N1 9 "); });
  EXPECT_EQ(lines, TheTwelve());
  EXPECT_THAT(report.remarks, Contains(HasSubstr("another master speaks")));
  ExpectReadsOnly(bench);
}

TEST_F(Scan, TwoRepliesInTurnAreTwoDevices) {
  bench.two = TwinBus::Two::in_turn;
  bench.bus.Add({"spabus", "spaj140c", "1", k7E1});
  bench.bus.Add({"spabus", "spau130c", "1", k7E1});
  Run(WishFor("spabus"));
  ASSERT_THAT(report.found, SizeIs(1));
  EXPECT_TRUE(report.found[0].suspect);
  EXPECT_THAT(report.found[0].remarks, Contains(HasSubstr("two devices")));
}

TEST_F(Scan, AnEchoIsToldAndFindsNobody) {
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

TEST_F(Scan, ADeviceThatIgnoresParityIsAskedInItsOwnFormat) {
  bench.bus.Add({"modbus_rtu", "mitsubishi-fr-d700", "5", k8E1, {}, false});
  bench.bus.Add({"spabus", "spaj140c", "2", k7E1, {}, false});
  Wish wish = WishFor();
  Run(wish);
  EXPECT_THAT(Lines(report),
              ElementsAre("modbus_rtu 9600 8E1 5 'baudgate Mitsubishi FR-D700' mitsubishi-fr-d700",
                          "spabus 9600 7E1 2 'SPCJ 4D29' spaj140c"));
  ExpectReadsOnly(bench);
}

TEST_F(Scan, ASlowDeviceIsAskedOnceMoreWithPatience) {
  bench.think = 300ms;
  bench.bus.Add({"spabus", "spaj140c", "4", k7E1});
  Run(WishFor("spabus"));
  EXPECT_THAT(Lines(report), ElementsAre("spabus 9600 7E1 4 'SPCJ 4D29' spaj140c"));
}

TEST_F(Scan, CtrlCKeepsWhatWasFound) {
  bench.bus.Add({"spabus", "spaj140c", "1", k7E1});
  bench.stop_after = 20;
  Run(WishFor("spabus"));
  EXPECT_THAT(report.found, SizeIs(1));
  EXPECT_FALSE(report.ended);
  EXPECT_THAT(bench.sent, SizeIs(20));
  EXPECT_TRUE(report.asked);
}

TEST_F(Scan, CtrlCWhileItListensSendsNothing) {
  bench.stops_listening = true;
  Run(WishFor("spabus"));
  EXPECT_FALSE(report.ended);
  EXPECT_FALSE(report.asked);
  EXPECT_THAT(bench.sent, IsEmpty());
}

TEST_F(Scan, AQuickScanIsOverWithinAMinute) {
  AddTwelve();
  Wish wish = WishFor();
  wish.quick = true;
  Run(wish);
  EXPECT_LT(bench.Now() - kStart, 60s);
  EXPECT_GE(report.found.size(), 10U);
  ExpectReadsOnly(bench);
}

TEST_F(Scan, TheTimeLeftFallsToNothing) {
  Wish wish = WishFor("dcon");
  wish.addresses = Addresses{1, 4};
  Run(wish);
  EXPECT_TRUE(std::ranges::is_sorted(seen.left, std::greater<>()));
  EXPECT_LT(seen.left.back(), 1s);
  EXPECT_THAT(report.found, IsEmpty());
}

TEST_F(Scan, NoAddressBeyondThoseWantedIsAsked) {
  Wish wish = WishFor("spabus");
  wish.addresses = Addresses{5, 6};
  Run(wish);
  for (const auto& [frame, serial] : bench.sent) {
    EXPECT_THAT(std::string(AsText(frame)), ::testing::MatchesRegex(">[56]RF:..\r"));
  }
}

TEST_F(Scan, ItsConfigurationIsOne) {
  AddTwelve();
  bench.echoes = true;
  Run(WishFor());
  const std::string yaml = Configuration(report, {.written = "what was found",
                                                  .gateway = GatewayName("gate-7.plant"),
                                                  .line = "bus",
                                                  .port = "/dev/ttyUSB0"});
  config::Catalog catalog;
  for (const Protocol* protocol : AllProtocols()) {
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

TEST(ScanNames, AreThoseOfTheMachineAsFarAsTheyAreNames) {
  EXPECT_EQ(GatewayName("gate-7.plant.example"), "gate-7");
  EXPECT_EQ(GatewayName("_a--b_"), "a-b");
  EXPECT_EQ(GatewayName("2026"), "2026");
  EXPECT_EQ(GatewayName(""), "gateway");
  EXPECT_EQ(GatewayName("..."), "gateway");
}

TEST(ScanUnits, AreTheAddressesWhereTheyAreFree) {
  std::vector<Found> found(2);
  found[0].unit = UnitFor(found, 5);
  EXPECT_EQ(found[0].unit, 5U);
  EXPECT_EQ(UnitFor(found, 5), 1U);
  EXPECT_EQ(UnitFor(found, 600), 1U);
}

/// Its garbage in the first format leads to its own, in which it is found; the questions that were
/// left find it no second time.
TEST_F(Scan, ADeviceWhoseFormatIsFoundOutIsFoundOnce) {
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

/// Function 3 is a write to a meter: who has not answered as a slave is not asked that, also where
/// nobody looked for meters.
TEST_F(Scan, AMeterIsNeverAskedForHoldingRegisters) {
  bench.bus.Add({"set4tm", "set-4tm.03m", "20", k8O1});
  Wish wish = WishFor("modbus_rtu");
  wish.addresses = Addresses{20, 20};
  Run(wish);
  EXPECT_FALSE(bench.sent.empty());
  for (const auto& [frame, serial] : bench.sent) EXPECT_NE(frame[1], 3) << ToHex(frame);
}

}  // namespace
}  // namespace baudgate::scan
