// Tests that the values of the three simulated reference devices arrive at Modbus clients
// unchanged.
// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>
#include <modbus/modbus.h>

#include <bit>

#include "tests/system/station.h"
#include "tests/system/three_devices.h"

namespace baudgate::system_test {
namespace {

using ::testing::Each;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Le;

using Values = ThreeDevices;

std::vector<float> Floats(const Registers& answer) {
  std::vector<float> floats;
  for (std::size_t i = 0; i + 1 < answer.values.size(); i += 2) {
    floats.push_back(modbus_get_float_abcd(&answer.values[i]));
  }
  return floats;
}

TEST_F(Values, OfAllThreeProtocolsReachLibmodbus) {
  StartAll();
  EXPECT_THAT(Floats(client.Input(kRelayUnit, 0, 8)), ElementsAre(1.25F, 2.5F, 63, 0.75F));
  EXPECT_THAT(client.DiscreteInputs(kRelayUnit, 0, 15).values,
              ElementsAre(0, 1, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 1, 0));
  const Registers type = client.Input(kRelayUnit, 900, 8);
  EXPECT_EQ(type.values[0], 'S' << 8 | 'P');
  EXPECT_EQ(type.values[1], 'C' << 8 | 'J');

  EXPECT_THAT(Floats(client.Input(kModuleUnit, 0, 16)),
              ElementsAre(100.25F, -34.5F, 0.125F, 7.125F, -101.5F, 1024.5F, 0, 5.75F));

  EXPECT_EQ(client.Float(kMeterUnit, 0), -61234.5F);
  EXPECT_EQ(client.Float(kMeterUnit, 2), 20001.0F);
  EXPECT_EQ(client.Float(kMeterUnit, 24), 6000.25F);
  EXPECT_EQ(client.Float(kMeterUnit, 40), 3.625F);
  EXPECT_EQ(client.Float(kMeterUnit, 50), 50.03125F);
  const auto energy = client.Double(kMeterUnit, 260);
  ASSERT_TRUE(energy);
  EXPECT_DOUBLE_EQ(*energy, 12345.6);
}

TEST_F(Values, AreInBothTablesWithQualityAndAge) {
  StartAll();
  EXPECT_EQ(client.Holding(kModuleUnit, 0, 16).values, client.Input(kModuleUnit, 0, 16).values);
  EXPECT_EQ(client.Coils(kRelayUnit, 0, 15).values,
            client.DiscreteInputs(kRelayUnit, 0, 15).values);
  EXPECT_THAT(client.Input(kModuleUnit, 20000, 16).values, Each(kGood));
  EXPECT_THAT(client.Holding(kModuleUnit, 20000, 16).values, Each(kGood));
  // A value is good for at most three polls of 200 ms, or two cycles of a slow machine.
  EXPECT_THAT(client.Input(kModuleUnit, 40000, 16).values, Each(Le(100)));
  EXPECT_THAT(client.DiscreteInputs(kRelayUnit, 20000, 15).values, Each(1));
}

TEST_F(Values, OfADeviceAreAccompaniedByItsStatusBlock) {
  StartAll();
  const Registers first = client.Input(kMeterUnit, 9000, 16);
  ASSERT_TRUE(first.ok());
  EXPECT_EQ(first.values[0], 1) << "online";
  EXPECT_EQ(first.values[1], 1) << "last outcome ok";
  EXPECT_EQ(first.values[2], 0) << "age in ms, high word: less than 65 s";
  const auto exchanges = [](const Registers& r) { return r.values[4] << 16 | r.values[5]; };
  const auto good = [](const Registers& r) { return r.values[6] << 16 | r.values[7]; };
  EXPECT_GT(good(first), 0);
  EXPECT_TRUE(Eventually([&] {
    const Registers later = client.Input(kMeterUnit, 9000, 16);
    return later.ok() && exchanges(later) > exchanges(first) && good(later) > good(first);
  }));
}

TEST_F(Values, ReachMbpoll) {
  StartAll();
  const auto mbpoll = [&](int unit, int address, const std::string& type, int count) {
    return RunToEnd({"mbpoll", "-1", "-q", "-0", "-m", "tcp", "-p", std::to_string(port()), "-a",
                     std::to_string(unit), "-r", std::to_string(address), "-c",
                     std::to_string(count), "-t", type, "-B", "127.0.0.1"},
                    directory());
  };
  const Finished currents = mbpoll(kRelayUnit, 0, "3:float", 4);
  EXPECT_EQ(currents.code, 0) << currents.errors;
  EXPECT_THAT(currents.output, HasSubstr("[0]: \t1.25\n"));
  EXPECT_THAT(currents.output, HasSubstr("[2]: \t2.5\n"));
  EXPECT_THAT(currents.output, HasSubstr("[4]: \t63\n"));
  const Finished inputs = mbpoll(kModuleUnit, 0, "4:float", 8);
  EXPECT_EQ(inputs.code, 0) << inputs.errors;
  EXPECT_THAT(inputs.output, HasSubstr("[8]: \t-101.5\n"));
  EXPECT_THAT(inputs.output, HasSubstr("[10]: \t1024.5\n"));
  const Finished frequency = mbpoll(kMeterUnit, 50, "3:float", 1);
  EXPECT_THAT(frequency.output, HasSubstr("[50]: \t50.0312\n"));
  const Finished outputs = mbpoll(kRelayUnit, 12, "1", 2);
  EXPECT_THAT(outputs.output, HasSubstr("[13]: \t1\n"));
  const Finished missing = mbpoll(kModuleUnit, 16, "3", 1);
  EXPECT_EQ(missing.code, 1);
  EXPECT_THAT(missing.errors, HasSubstr("Illegal data address"));
}

constexpr int kDeviceFailure = 4;
constexpr int kRelay = 1;

class Writes : public Station {
 protected:
  std::vector<std::uint16_t> AsRegisters(float value) const {
    const auto bits = std::bit_cast<std::uint32_t>(value);
    return {static_cast<std::uint16_t>(bits >> 16U), static_cast<std::uint16_t>(bits)};
  }

  ModbusClient client{port()};
};

TEST_F(Writes, TheSettingGroupOfARelayIsWrittenAndReadBack) {
  const auto twin = StartTwin("relay", "spaj140c", "2");
  const auto daemon =
      StartDaemon(Head() + Line("relay", "spabus",
                                "address: 2, profile: spaj140c, unit: 1, poll: 200ms, slow: 1h, "
                                "write: [setting_group], points: [{ name: setting_group, select: "
                                "false }]"));
  const auto group = [&] { return client.Register(kRelay, 100); };
  ASSERT_TRUE(Eventually([&] { return group() == 0; }));

  EXPECT_EQ(client.WriteRegister(kRelay, 100, 1), kNoException);
  // The poll period of its group is an hour, so only the write can be the reason for the read-back.
  EXPECT_TRUE(Eventually([&] { return group() == 1; }));
  EXPECT_EQ(client.WriteRegisters(kRelay, 100, {0}), kNoException);
  EXPECT_TRUE(Eventually([&] { return group() == 0; }));

  EXPECT_EQ(client.WriteRegisters(kRelay, 0, AsRegisters(1)), kIllegalAddress) << "a measurement";
}

TEST_F(Writes, OutputsOfAnAnalogModuleAreWrittenAndReadBack) {
  const auto twin = StartTwin("io", "icpdas-i-7024", "0x1F");
  const auto daemon =
      StartDaemon(Head() + Line("io", "dcon",
                                "address: 0x1F, profile: icpdas-i-7024, unit: 1, poll: 100ms, "
                                "write: allow"));
  ASSERT_TRUE(EventuallyFloat(client, kRelay, 2, 2.5F));
  EXPECT_EQ(client.WriteRegisters(kRelay, 2, AsRegisters(7.125F)), kNoException);
  EXPECT_TRUE(EventuallyFloat(client, kRelay, 2, 7.125F));
  EXPECT_EQ(client.Float(kRelay, 0), 1.5F) << "the output beside it stays";
  std::vector<std::uint16_t> both = AsRegisters(0.5F);
  for (const std::uint16_t word : AsRegisters(9.5F)) both.push_back(word);
  EXPECT_EQ(client.WriteRegisters(kRelay, 4, both), kNoException);
  EXPECT_TRUE(EventuallyFloat(client, kRelay, 4, 0.5F));
  EXPECT_TRUE(EventuallyFloat(client, kRelay, 6, 9.5F));

  const int beyond = client.WriteRegisters(kRelay, 2, AsRegisters(10.5F));
  EXPECT_TRUE(beyond == kDeviceFailure || beyond == kIllegalValue) << beyond;
  EXPECT_EQ(client.WriteRegister(kRelay, 2, 0), kIllegalValue) << "half of a float";
  EXPECT_EQ(client.Float(kRelay, 2), 7.125F);
}

TEST_F(Writes, RelaysOfADigitalModuleAreWrittenAndReadBack) {
  const auto twin = StartTwin("io", "icpdas-i-7060", "1");
  const auto daemon =
      StartDaemon(Head() + Line("io", "dcon",
                                "address: 1, profile: icpdas-i-7060, unit: 1, poll: 100ms, "
                                "write: allow"));
  const auto relays = [&] { return client.Coils(kRelay, 0, 4).values; };
  ASSERT_TRUE(Eventually([&] { return relays() == std::vector<std::uint8_t>{0, 1, 0, 1}; }));
  EXPECT_EQ(client.WriteCoil(kRelay, 2, true), kNoException);
  EXPECT_EQ(client.WriteCoil(kRelay, 3, false), kNoException);
  EXPECT_TRUE(Eventually([&] { return relays() == std::vector<std::uint8_t>{0, 1, 1, 0}; }));
}

TEST_F(Writes, ToASilentDeviceAreNotConfirmed) {
  const auto twin = StartTwin("io", "icpdas-i-7024", "1");
  const auto daemon =
      StartDaemon(Head() + Line("io", "dcon",
                                "address: 1, profile: icpdas-i-7024, unit: 1, poll: 100ms, "
                                "write: allow"));
  ASSERT_TRUE(EventuallyFloat(client, kRelay, 2, 2.5F));
  twin->Signal(SIGSTOP);
  EXPECT_EQ(client.WriteRegisters(kRelay, 2, AsRegisters(3)), kNotAnswering);
  twin->Signal(SIGKILL);
  EXPECT_TRUE(EventuallyQuality(client, kRelay, 2, 0x08));
  EXPECT_EQ(client.WriteRegisters(kRelay, 2, AsRegisters(3)), kNotAnswering);
}

}  // namespace
}  // namespace baudgate::system_test
