// The fixture with the three reference devices, each on a separate line with known values.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <string>

#include "tests/system/station.h"

namespace baudgate::system_test {

constexpr int kRelayUnit = 1;
constexpr int kModuleUnit = 11;
constexpr int kMeterUnit = 21;

/// Lines relay (SPAJ 140 C), io (MV110-8A) and meter (SET-4TM.03M). All values differ.
class ThreeDevices : public Station {
 protected:
  ThreeDevices() {
    PinProfile("spabus", "spaj140c", "relay",
               {{"current_l1", "1.25"},
                {"current_l2", "2.5"},
                {"current_l3", "63"},
                {"neutral_current", "0.75"},
                {"phase_low_start", "1"},
                {"output_trip", "1"},
                {"active_phase_low_current", "0.5"},
                {"type_designation", "\"SPCJ 4D29\""}});
    PinProfile("dcon", "owen-mv110-8a", "module",
               {{"input_1", "100.25"},
                {"input_2", "-34.5"},
                {"input_3", "0.125"},
                {"input_4", "7.125"},
                {"input_5", "-101.5"},
                {"input_6", "1024.5"},
                {"input_7", "0"},
                {"input_8", "5.75"}});
    PinProfile("set4tm", "set-4tm.03m", "meter",
               {{"active_power_sum", "-61234.5"},
                {"active_power_l1", "20001"},
                {"voltage_l1", "6000.25"},
                {"current_l3", "3.625"},
                {"frequency", "50.03125"},
                {"energy_yesterday_active_import", "12345.6"},
                {"serial_number", "9020001"}});
  }

  std::string Yaml(bool dds = false) const {
    return Head(dds) +
           Line("relay", "spabus", "address: 7, profile: relay, unit: 1, poll: 200ms, slow: 1s",
                "serial: 38400 7E1") +
           Line("io", "dcon", "address: 1, profile: module, unit: 11, poll: 200ms",
                "serial: 115200 8N1") +
           Line("meter", "set4tm",
                "address: 200, profile: meter, unit: 21, poll: 300ms, max_age: 30s",
                "serial: 115200 8O1");
  }

  void StartTwins() {
    relay = StartTwin("relay", "relay", "7");
    io = StartTwin("io", "module", "1");
    meter = StartTwin("meter", "meter", "200");
  }

  void StartAll(bool dds = false) { StartAll(Yaml(dds)); }
  void StartAll(const std::string& yaml) {
    StartTwins();
    daemon = StartDaemon(yaml);
    ASSERT_TRUE(EventuallyFloat(client, kRelayUnit, 0, 1.25F));
    ASSERT_TRUE(EventuallyFloat(client, kRelayUnit, 200, 0.5F));
    ASSERT_TRUE(EventuallyFloat(client, kModuleUnit, 0, 100.25F));
    ASSERT_TRUE(EventuallyFloat(client, kMeterUnit, 0, -61234.5F));
    ASSERT_TRUE(Eventually([this] { return client.Double(kMeterUnit, 260).has_value(); }));
    ASSERT_TRUE(Eventually([this] { return client.Input(kRelayUnit, 900, 8).ok(); }));
  }

  std::unique_ptr<Child> relay;
  std::unique_ptr<Child> io;
  std::unique_ptr<Child> meter;
  std::unique_ptr<Child> daemon;
  ModbusClient client{port()};
};

}  // namespace baudgate::system_test
