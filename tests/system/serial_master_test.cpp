// Tests a serial master (mbpoll or pymodbus) that reads cached devices, slaves and servers.
// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>

#include "tests/system/libmodbus_slave.h"
#include "tests/system/null_modem.h"
#include "tests/system/route_station.h"

namespace baudgate::system_test {
namespace {

using ::testing::HasSubstr;

constexpr int kCachedUnit = 30;
constexpr int kRoutedUnit = 20;
constexpr int kServerUnit = 50;

class SerialMaster : public RouteStation {
 protected:
  SerialMaster() {
    PinProfile("modbus_rtu", "mitsubishi-fr-d700", "inverter",
               {{"status_word", "77"}, {"fault_code", "49"}});
    twin_ =
        Start({"simulate", "--profile", "inverter", "--address", "2", "--pty", LinkOf("inverter")});
  }

  std::string PanelYaml() const {
    return Yaml({"{ units: 20-21, line: drive }",
                 "{ units: 50, server: \"127.0.0.1:" + std::to_string(elsewhere_) + "\" }"},
                Line("inverter", "modbus_rtu",
                     "address: 2, profile: inverter, unit: 30, poll: 100ms, write: allow") +
                    BareLine("drive", "timing: { reply: 100ms }"),
                {"{ at: " + LinkOf("panel") + ", serial: 19200 8E1 }"});
  }
  void StartAll() {
    ASSERT_TRUE(panel_.connected() && cable_.connected());
    ASSERT_TRUE(slave_->connected() && server_->connected());
    daemon_ = StartGateway(PanelYaml(), {"inverter", "drive"});
    ModbusClient client(port());
    ASSERT_TRUE(EventuallyQuality(client, kCachedUnit, 5, kGood)) << twin_->Errors();
    ASSERT_TRUE(EventuallyLogged(*daemon_, "listening for a master")) << daemon_->Errors();
  }
  Finished MbpollRtu(int unit, std::vector<std::string> words,
                     std::vector<std::string> values = {}) const {
    words.insert(words.begin(),
                 {"-m", "rtu", "-b", "19200", "-P", "none", "-a", std::to_string(unit)});
    words.push_back(FarEnd("panel"));
    words.insert(words.end(), values.begin(), values.end());
    return Mbpoll(words);
  }

 private:
  std::uint16_t elsewhere_ = FreePort();
  NullModem panel_{LinkOf("panel"), FarEnd("panel")};
  NullModem cable_{LinkOf("drive"), FarEnd("drive")};
  std::unique_ptr<LibmodbusSlave> slave_ = LibmodbusSlave::OnTty(FarEnd("drive"), kRoutedUnit);
  std::unique_ptr<LibmodbusSlave> server_ = LibmodbusSlave::OnTcp(elsewhere_);
  std::unique_ptr<Child> twin_;
  std::unique_ptr<Child> daemon_;
};

TEST_F(SerialMaster, MbpollReadsCachedAndRoutedUnits) {
  StartAll();
  const Finished cached = MbpollRtu(kCachedUnit, {"-r", "4", "-c", "2"});
  EXPECT_EQ(cached.code, 0) << cached.errors;
  EXPECT_THAT(cached.output, HasSubstr(MbpollLine(4, 77) + "\n" + MbpollLine(5, 49)));
  const Finished routed = MbpollRtu(kRoutedUnit, {"-r", "800", "-c", "125"});
  EXPECT_EQ(routed.code, 0) << routed.errors;
  EXPECT_THAT(routed.output, HasSubstr(MbpollLine(924, 1924)));
  EXPECT_EQ(MbpollRtu(kRoutedUnit, {"-r", "5"}, {"4711"}).code, 0);
  EXPECT_THAT(MbpollRtu(kRoutedUnit, {"-r", "5"}).output, HasSubstr(MbpollLine(5, 4711)));
  EXPECT_THAT(MbpollRtu(kServerUnit, {"-r", "9"}).output, HasSubstr(MbpollLine(9, 1009)));
  EXPECT_THAT(MbpollRtu(kRoutedUnit, {"-r", "1000"}).errors, HasSubstr("Illegal data address"));
  const Finished unmapped = MbpollRtu(99, {"-r", "0", "-o", "0.3"});
  EXPECT_EQ(unmapped.code, 1);
  EXPECT_THAT(unmapped.errors, HasSubstr("Connection timed out"))
      << "who is not here stays silent on a bus";
}

TEST_F(SerialMaster, PymodbusReadsCachedAndRoutedUnits) {
  StartAll();
  EXPECT_EQ(Pymodbus("rtu", FarEnd("panel"), kCachedUnit,
                     {"holding:4:2", "input:4:1", "discrete:0:3", "register:5:0"}),
            Json::array({{77, 49}, {77}, {1, 0, 1}, true}));
  const Json routed =
      Pymodbus("rtu", FarEnd("panel"), kRoutedUnit,
               {"holding:100:120", "write_registers:100:1:2:3", "holding:99:5", "coils:0:4",
                "mask:103:65280:7", "holding:103:1", "holding:1000:1"});
  ASSERT_EQ(routed.size(), 7U) << routed;
  ASSERT_EQ(routed[0].size(), 120U) << routed[0];
  EXPECT_EQ(routed[0][119], 1219);
  EXPECT_EQ(routed[1], true);
  EXPECT_EQ(routed[2], Json({1099, 1, 2, 3, 1103}));
  EXPECT_EQ(routed[3], Json({1, 0, 0, 1}));
  EXPECT_EQ(routed[4], true);
  EXPECT_EQ(routed[5], Json({(1103 & 0xFF00) | 7}));
  EXPECT_EQ(routed[6], Json({{"exception", kIllegalAddress}}));
  const Json clients = Status()["modbus"]["clients"];
  Json panel;
  for (const Json& client : clients) {
    if (client["peer"] == LinkOf("panel")) panel = client;
  }
  ASSERT_TRUE(panel.is_object()) << clients;
  EXPECT_EQ(panel["requests"], 11);
  EXPECT_EQ(panel["exceptions"], 1);
}

}  // namespace
}  // namespace baudgate::system_test
