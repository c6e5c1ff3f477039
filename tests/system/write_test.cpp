// Writes of a Modbus client go through the daemon to the device, and come back as its values.
// SPDX-License-Identifier: Apache-2.0
#include <bit>

#include "tests/system/station.h"

namespace baudgate::system_test {
namespace {

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

TEST_F(Writes, SettingGroupOfARelay) {
  const auto twin = StartTwin("relay", "spaj140c", "2");
  const auto daemon =
      StartDaemon(Head() + Line("relay", "spabus",
                                "address: 2, profile: spaj140c, unit: 1, poll: 200ms, slow: 1h, "
                                "write: [setting_group], points: [{ name: setting_group, select: "
                                "false }]"));
  const auto group = [&] { return client.Register(kRelay, 100); };
  ASSERT_TRUE(Eventually([&] { return group() == 0; }));

  EXPECT_EQ(client.WriteRegister(kRelay, 100, 1), kNoException);
  // The period of its group is an hour: it is read back because it was written.
  EXPECT_TRUE(Eventually([&] { return group() == 1; }));
  EXPECT_EQ(client.WriteRegisters(kRelay, 100, {0}), kNoException);
  EXPECT_TRUE(Eventually([&] { return group() == 0; }));

  EXPECT_EQ(client.WriteRegisters(kRelay, 0, AsRegisters(1)), kIllegalAddress) << "a measurement";
}

TEST_F(Writes, OutputsOfAnAnalogModule) {
  const auto twin = StartTwin("io", "icpdas-i-7024", "0x1F");
  const auto daemon =
      StartDaemon(Head() + Line("io", "dcon",
                                "address: 0x1F, profile: icpdas-i-7024, unit: 1, poll: 100ms, "
                                "write: allow"));
  ASSERT_TRUE(EventuallyFloat(client, kRelay, 2, 2.5F));
  EXPECT_EQ(client.WriteRegisters(kRelay, 2, AsRegisters(7.125F)), kNoException);
  EXPECT_TRUE(EventuallyFloat(client, kRelay, 2, 7.125F));
  EXPECT_EQ(client.Float(kRelay, 0), 1.5F) << "the output beside it stays";
  // Two outputs at once.
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

TEST_F(Writes, RelaysOfADigitalModule) {
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

TEST_F(Writes, AreOffUntilTheDeviceAllowsThem) {
  const auto twin = StartTwin("io", "icpdas-i-7060", "1");
  const auto daemon = StartDaemon(
      Head() + Line("io", "dcon",
                    "address: 1, profile: icpdas-i-7060, unit: 1, poll: 100ms, write: [relay_2]"));
  ASSERT_TRUE(Eventually([&] { return client.Coils(kRelay, 0, 4).ok(); }));
  EXPECT_EQ(client.WriteCoil(kRelay, 0, true), kIllegalAddress);
  EXPECT_EQ(client.WriteCoil(kRelay, 2, true), kNoException);
  EXPECT_EQ(client.Coils(kRelay, 0, 4).values, (std::vector<std::uint8_t>{0, 1, 1, 1}));
}

TEST_F(Writes, OfWhatHasToBeSelectedTakeTwoSteps) {
  constexpr int kSelect = 60000 + 100;
  const auto twin = StartTwin("relay", "spaj140c", "2");
  const auto daemon = StartDaemon(
      Head() + Line("relay", "spabus",
                    "address: 2, profile: spaj140c, unit: 1, poll: 200ms, slow: 1h, write: allow, "
                    "points: [{ name: setting_group, select: true, max: 1 }]"));
  ASSERT_TRUE(Eventually([&] { return client.Register(kRelay, 100) == 0; }));
  EXPECT_EQ(client.WriteRegister(kRelay, 100, 1), kDeviceFailure);
  EXPECT_EQ(client.WriteRegister(kRelay, kSelect, 0xC0DE), kNoException);
  EXPECT_EQ(client.WriteRegister(kRelay, 100, 2), kIllegalValue) << "beyond its limit";
  EXPECT_EQ(client.WriteRegister(kRelay, 100, 1), kDeviceFailure) << "the selection was used up";
  EXPECT_EQ(client.WriteRegister(kRelay, kSelect, 0xC0DE), kNoException);
  ModbusClient other(port());
  EXPECT_EQ(other.WriteRegister(kRelay, 100, 1), kDeviceFailure) << "it is this client's";
  EXPECT_EQ(client.WriteRegister(kRelay, 100, 1), kNoException);
  EXPECT_EQ(client.Register(kRelay, 100), 1);
}

TEST_F(Writes, ToADeviceThatIsSilentAreNotConfirmed) {
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
