// Tests `baudgate simulate -c`: the configuration of a plant is tried on one machine.
// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>
#include <signal.h>

#include "tests/system/station.h"

namespace baudgate::system_test {
namespace {

using ::testing::HasSubstr;

class SimulateConfig : public Station {
 protected:
  std::string Plant() const {
    return Write("plant.yaml",
                 "gateway: { name: plant }\n"
                 "modbus: { listen: \"0.0.0.0:" +
                     std::to_string(port()) +
                     "\" }\n"
                     "dds: { enabled: false }\n"
                     "lines:\n"
                     "  - name: bay\n"
                     "    port: /dev/serial/by-id/usb-bay\n"
                     "    protocol: spabus\n"
                     "    serial: 9600 7E1\n"
                     "    devices:\n"
                     "      - { name: f1, address: 1, profile: spaj140c, unit: 1, poll: 200ms }\n"
                     "      - { name: f2, address: 2, profile: spaj140c, unit: 2, poll: 200ms }\n"
                     "      - { name: drive, address: 20, protocol: modbus_rtu, unit: 3,\n"
                     "          serial: 19200 8E1, profile: mitsubishi-fr-d700, poll: 200ms }\n"
                     "  - name: io\n"
                     "    port: tcp://10.0.0.5:4001\n"
                     "    protocol: dcon\n"
                     "    devices:\n"
                     "      - { name: ai, address: 1, profile: owen-mv110-8a, unit: 4 }\n"
                     "  - name: panel\n"
                     "    port: tcp://10.0.0.6:502\n"
                     "    protocol: modbus_tcp\n"
                     "    devices:\n"
                     "      - { name: m, address: 1, profile: generic-meter, unit: 5 }\n"
                     "  - { name: spare, port: /dev/ttyS9, protocol: modbus_rtu }\n")
        .string();
  }
  std::string Trial() const { return (directory() / "trial.yaml").string(); }

  std::unique_ptr<Child> StartTwins() const {
    auto twins = Start({"simulate", "-c", Plant(), "--write", Trial()});
    EXPECT_TRUE(Eventually([&] {
      return twins->Output().find("baudgate run -c") != std::string::npos || !twins->Running();
    })) << twins->Errors();
    return twins;
  }
};

TEST_F(SimulateConfig, EveryDeviceOfAPlantIsReadFromItsTrialConfiguration) {
  const auto twins = StartTwins();
  ASSERT_TRUE(twins->Running()) << twins->Errors();
  const auto gateway = Start({"run", "-c", Trial()});
  ModbusClient client(port());
  for (const int unit : {1, 2, 3, 4, 5}) {
    EXPECT_TRUE(Eventually([&] { return client.Register(unit, 9000) == 1; }))
        << "unit " << unit << " is not online\n"
        << twins->Output() << gateway->Errors();
  }
  gateway->Signal(SIGTERM);
  EXPECT_EQ(gateway->WaitForEnd(), 0);
  twins->Signal(SIGTERM);
  EXPECT_EQ(twins->WaitForEnd(), 0);
  EXPECT_THAT(twins->Output(), HasSubstr("line bay: answered "));
}

TEST_F(SimulateConfig, AWrongBitRateFailsOnlyOnItsLine) {
  const auto twins = StartTwins();
  std::string trial = ReadWholeFile(Trial());
  const auto at = trial.find("9600 7E1");
  ASSERT_NE(at, std::string::npos) << trial;
  const auto gateway = Start({"run", "-c", Write("wrong.yaml", trial.replace(at, 8, "4800 7E1"))});
  ModbusClient client(port());
  EXPECT_TRUE(Eventually([&] { return client.Register(3, 9000) == 1; }))
      << "the drive has settings of its own";
  EXPECT_TRUE(Eventually([&] { return client.Register(1, 9001) > 1; }));
  EXPECT_NE(client.Register(1, 9000), 1);
}

TEST_F(SimulateConfig, AnImpossibleSimulationIsRefusedWithAdvice) {
  const Finished device = Command({"simulate", "-c", Plant()});
  EXPECT_EQ(device.code, kCannotOpen);
  EXPECT_THAT(device.errors, HasSubstr("line bay: "));
  EXPECT_THAT(device.errors, HasSubstr("--write TRIAL.yaml"));
  const std::string mine = Write("mine.yaml", "a file of somebody").string();
  EXPECT_EQ(Command({"simulate", "-c", Plant(), "--write", mine}).code, kCannotOpen);
  EXPECT_EQ(ReadWholeFile(mine), "a file of somebody");
  EXPECT_EQ(Command({"simulate"}).code, kUsage);
  EXPECT_EQ(Command({"simulate", "-c", Plant(), "--pty", LinkOf("x")}).code, kUsage);
  EXPECT_EQ(Command({"simulate", "-c", Write("bad.yaml", "lines: 5\n").string()}).code,
            kBadConfiguration);
}

using ::testing::ContainsRegex;
using ::testing::Not;

constexpr int kFaultyUnit = 11;

class SimulateFault : public Station {
 protected:
  SimulateFault() : client_(port()) {
    PinProfile("dcon", "owen-mv110-8a", "module", {{"input_1", "100.25"}});
  }

  std::unique_ptr<Child> StartTwinWith(const std::vector<std::string>& faults) const {
    std::vector<std::string> words{"simulate", "--profile",  "module", "--address", "1",
                                   "--pty",    LinkOf("io"), "--baud", "115200 8N1"};
    for (const std::string& fault : faults) words.insert(words.end(), {"--fault", fault});
    auto twin = Start(words);
    EXPECT_TRUE(Eventually([&] { return !twin->Output().empty(); })) << twin->Errors();
    return twin;
  }
  std::unique_ptr<Child> StartGateway() const {
    return StartDaemon(Head() + Line("io", "dcon",
                                     "address: 1, profile: module, unit: 11, poll: 100ms",
                                     "serial: 115200 8N1"));
  }
  std::uint32_t Counter(int address) {
    const Registers answer = client_.Input(kFaultyUnit, address, 2);
    return answer.ok() ? static_cast<std::uint32_t>(answer.values[0] << 16 | answer.values[1]) : 0;
  }

  ModbusClient client_;
};

TEST_F(SimulateFault, AnUnknownFaultIsWrongUsage) {
  const auto simulate = [&](const std::string& fault) {
    const Finished wrong = Command({"simulate", "--profile", "module", "--address", "1", "--pty",
                                    LinkOf("io"), "--fault", "loss", "--fault", fault});
    EXPECT_EQ(wrong.code, kUsage) << fault;
    return wrong.errors;
  };
  EXPECT_THAT(simulate("los"), HasSubstr("did you mean 'loss'?"));
  EXPECT_THAT(simulate("bits:rate=2"), HasSubstr("fault bits: rate=2: write a number from 0"));
  EXPECT_THAT(simulate("late:dealy=1s"), HasSubstr("did you mean 'delay'?"));
}

TEST_F(SimulateFault, DamagedRepliesAreCorruptUntilTheFaultEnds) {
  auto twin = StartTwinWith({"bits:count=2,seed=5", "echo:rate=0"});
  const auto daemon = StartGateway();
  EXPECT_TRUE(Eventually([&] { return Counter(9010) > 3; })) << "corrupt replies are counted";
  EXPECT_NE(client_.Register(kFaultyUnit, 20000), kGood);
  twin->Signal(SIGTERM);
  EXPECT_EQ(twin->WaitForEnd(10s), 0);
  EXPECT_THAT(twin->Output(), ContainsRegex("fault bits:count=2,seed=5 struck [1-9][0-9]* of "
                                            "[1-9][0-9]* exchanges\n"
                                            "fault echo:rate=0 struck 0 of [1-9]"));
  twin = StartTwinWith({});
  EXPECT_TRUE(EventuallyQuality(client_, kFaultyUnit, 0, kGood));
  EXPECT_EQ(client_.Float(kFaultyUnit, 0), 100.25F);
  twin->Signal(SIGTERM);
  EXPECT_EQ(twin->WaitForEnd(10s), 0);
  EXPECT_THAT(twin->Output(), Not(HasSubstr("struck")));
}

TEST_F(SimulateFault, ADeadTwinReturnsAfterItsTime) {
  const auto twin = StartTwinWith({"death:for=3s", "garbage_before", "dribble:pause=1ms"});
  const auto daemon = StartGateway();
  EXPECT_TRUE(Eventually([&] { return Counter(9008) > 0; })) << "no_reply is counted";
  EXPECT_TRUE(EventuallyQuality(client_, kFaultyUnit, 0, kGood));
  EXPECT_EQ(client_.Float(kFaultyUnit, 0), 100.25F);
  twin->Signal(SIGINT);
  EXPECT_EQ(twin->WaitForEnd(10s), 0);
  EXPECT_THAT(twin->Output(), ContainsRegex("fault death:for=3s struck [1-9]"));
  EXPECT_THAT(twin->Output(), ContainsRegex("fault garbage_before struck [1-9]"));
}

}  // namespace
}  // namespace baudgate::system_test
