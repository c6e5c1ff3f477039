// `baudgate simulate --fault` as a user meets it: a twin that misbehaves, the daemon that reads it,
// and what the twin says about it at its end.
// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>
#include <signal.h>

#include "tests/system/station.h"

namespace baudgate::system_test {
namespace {

using ::testing::ContainsRegex;
using ::testing::HasSubstr;
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
  /// A 32-bit counter of the status block.
  std::uint32_t Counter(int address) {
    const Registers answer = client_.Input(kFaultyUnit, address, 2);
    return answer.ok() ? static_cast<std::uint32_t>(answer.values[0] << 16 | answer.values[1]) : 0;
  }

  ModbusClient client_;
};

TEST_F(SimulateFault, WhatIsNoFaultIsWrongUsage) {
  const auto simulate = [&](const std::string& fault) {
    const Finished wrong = Command({"simulate", "--profile", "module", "--address", "1", "--pty",
                                    LinkOf("io"), "--fault", "loss", "--fault", fault});
    EXPECT_EQ(wrong.code, kUsage) << fault;
    return wrong.errors;
  };
  EXPECT_THAT(simulate("los"), HasSubstr("no fault 'los'; did you mean 'loss'?"));
  EXPECT_THAT(simulate("bits:rate=2"), HasSubstr("fault bits: rate=2: write a number from 0"));
  EXPECT_THAT(simulate("late:dealy=1s"), HasSubstr("did you mean 'delay'?"));
}

TEST_F(SimulateFault, DamagedRepliesAreCorruptUntilTheTwinIsWell) {
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

TEST_F(SimulateFault, ADeadTwinReturnsWhenItsTimeHasCome) {
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
