// Tests `baudgate scan` and `baudgate ask` on ptys, on a gateway's line, and beside another master.
// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>
#include <signal.h>

#include "tests/system/pty_bus.h"
#include "tests/system/station.h"

namespace baudgate::system_test {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::UnorderedElementsAre;

constexpr config::SerialSettings k7E1{.data_bits = 7, .parity = config::Parity::even};
constexpr config::SerialSettings k7O1{.data_bits = 7, .parity = config::Parity::odd};
constexpr config::SerialSettings k8O1{.parity = config::Parity::odd};

class ScanSystem : public Station {
 protected:
  ScanSystem() : bus(LinkOf("bus")) {}

  void AddSix() {
    bus.Add({"spabus", "spaj140c", "1", k7E1});
    bus.Add({"spabus", "spau130c", "2", k7E1});
    bus.Add({"dcon", "icpdas-i-7017", "1", {}, {{"checksum", "false"}}});
    bus.Add({"dcon", "icpdas-i-7060", "3", {}, {{"checksum", "true"}}});
    bus.Add({"set4tm", "set-4tm.03m", "2", k8O1});
    bus.Add({"set4tm", "set-4tm.03m", "3", k8O1});
  }
  void AddTwelve() {
    AddSix();
    bus.Add({"spabus", "spaj140c", "3", k7E1});
    bus.Add({"spabus", "spaj140c", "4", k7O1});
    bus.Add({"dcon", "icpdas-i-7080", "2", {}, {{"checksum", "false"}}});
    bus.Add({"dcon", "icpdas-i-7017", "4", {}, {{"checksum", "false"}}});
    bus.Add({"dcon", "icpdas-i-7024", "4", {}, {{"checksum", "false"}}});
    bus.Add({"set4tm", "set-4tm.03m", "4", k8O1});
  }
  std::string File() const { return (directory() / "found.yaml").string(); }
  static std::vector<std::string> Devices(const std::string& lines) {
    std::vector<std::string> devices;
    for (const Json& json : JsonLines(lines)) {
      if (json["suspect"].get<bool>()) {
        devices.push_back("two at " + json["protocol"].get<std::string>() + " " +
                          std::to_string(json["address"].get<int>()));
        continue;
      }
      devices.push_back(
          json["protocol"].get<std::string>() + " " + json["serial"].get<std::string>() + " " +
          std::to_string(json["address"].get<int>()) + " " + json["profile"].get<std::string>());
    }
    return devices;
  }

  PtyBus bus;
};

TEST_F(ScanSystem, TheConfigurationOfAScannedBusRuns) {
  AddTwelve();
  bus.Start();
  const Finished scan =
      Command({"scan", bus.path(), "--quick", "--addresses", "1-4", "--json", "--config", File()});
  ASSERT_EQ(scan.code, 0) << scan.errors;
  EXPECT_THAT(Devices(scan.output),
              UnorderedElementsAre("spabus 9600 7E1 1 spaj140c", "spabus 9600 7E1 2 spau130c",
                                   "dcon 9600 8N1 1 icpdas-i-7017", "dcon 9600 8N1 3 icpdas-i-7060",
                                   "set4tm 9600 8O1 2 set-4tm.03m", "set4tm 9600 8O1 3 set-4tm.03m",
                                   "spabus 9600 7E1 3 spaj140c", "spabus 9600 7O1 4 spaj140c",
                                   "dcon 9600 8N1 2 icpdas-i-7080", "two at dcon 4",
                                   "set4tm 9600 8O1 4 set-4tm.03m"));
  const Finished check = Command({"check", "-c", File()});
  EXPECT_EQ(check.code, 0) << check.output << check.errors;
  EXPECT_NE(Command({"scan", bus.path(), "--config", File()}).code, 0) << "the file is there";

  // Replaces the port of Modbus TCP, because other tests run at the same time.
  std::string yaml = ReadWholeFile(File());
  const std::string fixed = "127.0.0.1:1502";
  ASSERT_NE(yaml.find(fixed), std::string::npos);
  yaml.replace(yaml.find(fixed), fixed.size(), "127.0.0.1:" + std::to_string(port()));
  const std::string page = "web:\n  listen: 127.0.0.1:8502\n";
  ASSERT_NE(yaml.find(page), std::string::npos);
  yaml.erase(yaml.find(page), page.size());
  const auto gateway = StartDaemon(yaml);
  ModbusClient client(port());
  for (const Json& device : JsonLines(scan.output)) {
    const bool relay = device["profile"] == "icpdas-i-7060";
    if (relay || device["suspect"]) continue;
    EXPECT_TRUE(EventuallyQuality(client, device["unit"].get<int>(), 0, kGood)) << device;
  }
}

TEST_F(ScanSystem, AScanRefusesALineWithAnotherMaster) {
  AddSix();
  bus.Talk(">2RI1/5:06\r");
  bus.Start();
  const Finished scan = Command({"scan", bus.path(), "--quick", "--protocol", "spabus"});
  EXPECT_EQ(scan.code, kCannotOpen);
  EXPECT_THAT(scan.errors,
              AllOf(HasSubstr("another master sends on the line"), HasSubstr("--over-traffic")));
  EXPECT_THAT(scan.output, IsEmpty());
}

TEST_F(ScanSystem, AScanOverTrafficFindsTheSameDevices) {
  AddSix();
  bus.Talk(">2RI1/5:06\r");
  bus.Start();
  const Finished scan =
      Command({"scan", bus.path(), "--quick", "--addresses", "1-3", "--json", "--over-traffic"});
  EXPECT_EQ(scan.code, 0) << scan.errors;
  EXPECT_THAT(scan.errors, HasSubstr("another master sends on the line"));
  EXPECT_THAT(
      Devices(scan.output),
      UnorderedElementsAre("spabus 9600 7E1 1 spaj140c", "spabus 9600 7E1 2 spau130c",
                           "dcon 9600 8N1 1 icpdas-i-7017", "dcon 9600 8N1 3 icpdas-i-7060",
                           "set4tm 9600 8O1 2 set-4tm.03m", "set4tm 9600 8O1 3 set-4tm.03m"));
}

TEST_F(ScanSystem, CtrlCPrintsTheDevicesFoundSoFar) {
  AddSix();
  bus.Start();
  const auto scan = Start({"scan", bus.path(), "--protocol", "spabus", "--json"});
  EXPECT_TRUE(Eventually([&] { return !scan->Output().empty(); })) << scan->Errors();
  scan->Signal(SIGINT);
  EXPECT_EQ(scan->WaitForEnd(), 0);
  EXPECT_THAT(scan->Output(), HasSubstr("SPCJ 4D29"));
  EXPECT_THAT(scan->Errors(), HasSubstr("ended before all addresses were asked"));
}

class ScanGateway : public ScanSystem {
 protected:
  ScanGateway() {
    AddSix();
    bus.Start();
  }
  std::unique_ptr<Child> StartBay(const std::string& keys = {}) const {
    return StartDaemon(WithSocket(Head()) + "  - name: bay\n    port: " + bus.path() +
                       "\n    protocol: spabus\n    serial: 9600 7E1\n" + keys +
                       "    devices:\n      - { name: feeder, address: 1, profile: spaj140c, "
                       "unit: 1, poll: 100ms }\n");
  }
  Finished Ask(const std::string& telegram, std::vector<std::string> more = {}) const {
    more.insert(more.begin(), {"ask", "bay", telegram, "--json"});
    return Station::Ask(more);
  }
};

TEST_F(ScanGateway, AScannedLineIsReleasedAndReturned) {
  const auto gateway = StartBay();
  ModbusClient client(port());
  ASSERT_TRUE(EventuallyQuality(client, 1, 0, kGood));
  const Finished scan = Station::Ask(
      {"scan", "bay", "--quick", "--protocol", "spabus", "--addresses", "1-2", "--json"});
  EXPECT_EQ(scan.code, 0) << scan.errors;
  EXPECT_THAT(Devices(scan.output),
              UnorderedElementsAre("spabus 9600 7E1 1 spaj140c", "spabus 9600 7E1 2 spau130c"));
  EXPECT_TRUE(EventuallyQuality(client, 1, 0, kGood)) << "it has the port again";
}

TEST_F(ScanGateway, AHangUpWritesTheFoundDevicesAndReturnsTheLine) {
  const auto gateway = StartBay();
  ModbusClient client(port());
  ASSERT_TRUE(EventuallyQuality(client, 1, 0, kGood));
  const auto scan = Start(
      {"scan", "bay", "--protocol", "spabus", "--json", "--config", File(), "--socket", socket()});
  ASSERT_TRUE(Eventually([&] { return !scan->Output().empty(); })) << scan->Errors();
  const Finished lent = Ask(">1RF:XX");
  EXPECT_EQ(lent.code, kCannotOpen) << "nobody was asked: " << lent.output << lent.errors;
  EXPECT_EQ(Json::parse(lent.output)["sent"], "");
  EXPECT_THAT(lent.errors, HasSubstr("nothing was sent: the port of the line is not open"));
  scan->Signal(SIGHUP);
  EXPECT_EQ(scan->WaitForEnd(), 0);
  EXPECT_THAT(ReadWholeFile(File()), HasSubstr("- name: \"bay\""));
  EXPECT_TRUE(EventuallyQuality(client, 1, 0, kGood)) << "it has the port again";
}

TEST_F(ScanGateway, AManualTelegramIsSentBetweenTwoPolls) {
  const auto gateway = StartBay();
  ModbusClient client(port());
  ASSERT_TRUE(EventuallyQuality(client, 1, 0, kGood));
  const Finished read = Ask(">1RF:XX");
  ASSERT_EQ(read.code, 0) << read.errors;
  const Json json = Json::parse(read.output);
  EXPECT_EQ(json["sent"], "3E 31 52 46 3A 32 31 0D");
  EXPECT_EQ(json["outcome"], "ok");
  EXPECT_THAT(read.output, HasSubstr("SPCJ 4D29"));
  EXPECT_THAT(Ask(">2RF:XX").output, HasSubstr("SPAU 130 C"));
  EXPECT_TRUE(EventuallyQuality(client, 1, 0, kGood));
}

TEST_F(ScanGateway, AManualWriteTelegramNeedsThePermissionOfTheLine) {
  const auto gateway = StartBay();
  const Finished denied = Ask(">1WV150:1:XX", {"--write"});
  EXPECT_NE(denied.code, 0);
  EXPECT_THAT(denied.errors, AllOf(HasSubstr("may write"), HasSubstr("ask: write")));
}

TEST_F(ScanGateway, AManualWriteTelegramIsRecorded) {
  const auto gateway = StartBay("    ask: write\n");
  ModbusClient client(port());
  ASSERT_TRUE(EventuallyQuality(client, 1, 0, kGood));
  EXPECT_THAT(Ask(">1WV160:124:XX").errors, HasSubstr("--write"));
  const Finished open = Ask(">1WV160:123:XX", {"--write"});
  EXPECT_EQ(open.code, 0) << open.errors;
  EXPECT_THAT(open.output, HasSubstr("3E 31 57 56 31 36 30 3A ** ** ** 3A ** ** 0D"));
  const Finished writes = Station::Ask({"writes", "--json"});
  EXPECT_THAT(writes.output, AllOf(HasSubstr("\"point\":\"telegram\""), HasSubstr("\"denied\""),
                                   HasSubstr("3E 31 57 56 31 36 30 3A ** ** ** 3A ** ** 0D")));
  for (const auto& [option, value] : {std::pair{"--protocol", "dcon"}, {"--serial", "9600 8N1"}}) {
    const Finished refused = Ask(">1RF:XX", {option, value});
    EXPECT_EQ(refused.code, kUsage);
    EXPECT_THAT(refused.errors, AllOf(HasSubstr(option), HasSubstr("free port")));
  }
}

TEST_F(ScanSystem, AManualTelegramIsSentOnAFreePort) {
  AddSix();
  bus.Start();
  const Finished answered = Command({"ask", bus.path(), ">1RF:XX"});
  EXPECT_EQ(answered.code, 0) << answered.errors;
  EXPECT_THAT(answered.output, AllOf(HasSubstr("> 3E 31 52 46 3A 32 31 0D"),
                                     HasSubstr("<1D:SPCJ 4D29:18"), HasSubstr("ok")));
  EXPECT_EQ(Command({"ask", bus.path(), ">9RF:XX"}).code, 1) << "nobody is there";
  const Finished write = Command({"ask", bus.path(), ">1WV150:1:XX"});
  EXPECT_EQ(write.code, kUsage);
  EXPECT_THAT(write.errors, HasSubstr("add --write"));
  EXPECT_EQ(Command({"ask", bus.path(), "02 08 00"}).code, kUsage) << "hex needs a protocol";
  const Finished meter = Command({"ask", bus.path(), "02 08 00", "--protocol", "set4tm"});
  EXPECT_EQ(meter.code, 0) << meter.errors;
}

}  // namespace
}  // namespace baudgate::system_test
