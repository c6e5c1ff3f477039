// Ports that are absent, cables that are pulled and devices that fall silent: what clients see of
// them, and that everything comes back by itself.
// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>
#include <signal.h>

#include "tests/system/three_devices.h"

namespace baudgate::system_test {
namespace {

using ::testing::HasSubstr;

constexpr int kCommunicationFailure = 0x18;
constexpr std::uint16_t kOffline = 3;
constexpr std::uint16_t kLineDown = 9;

class Outage : public ThreeDevices {
 protected:
  bool EventuallyUnanswered(int unit) {
    return Eventually([&] { return client.Input(unit, 0, 2).exception == kNotAnswering; });
  }
  /// Until `done`: whatever is served is the value, or an exception.
  template <typename Condition>
  bool TrueValuesUntil(int unit, float value, Condition done) {
    return Eventually([&] {
      const auto served = client.Float(unit, 0);
      EXPECT_TRUE(!served || *served == value) << *served;
      return done();
    });
  }
};

TEST_F(Outage, APortThatIsAbsentAtTheStartIsWaitedFor) {
  daemon = StartDaemon(Yaml());
  EXPECT_TRUE(EventuallyUnanswered(kRelayUnit));
  EXPECT_TRUE(EventuallyQuality(client, kRelayUnit, 0, kNotConnected));
  EXPECT_EQ(client.Register(kRelayUnit, 40000), 0xFFFF) << "never read: no age";
  EXPECT_TRUE(EventuallyLogged(*daemon, "line relay: down: "));
  EXPECT_THAT(daemon->Errors(), HasSubstr(LinkOf("relay")));

  relay = StartTwin("relay", "relay", "7");
  EXPECT_TRUE(EventuallyFloat(client, kRelayUnit, 0, 1.25F));
  EXPECT_TRUE(EventuallyQuality(client, kRelayUnit, 0, kGood));
  EXPECT_EQ(client.Input(kModuleUnit, 0, 2).exception, kNotAnswering) << "its port is still absent";
}

TEST_F(Outage, OfOneLineLeavesTheOthersAlone) {
  StartAll();
  io->Signal(SIGKILL);
  EXPECT_TRUE(TrueValuesUntil(
      kModuleUnit, 100.25F, [&] { return client.Register(kModuleUnit, 20000) == kNotConnected; }));
  EXPECT_TRUE(EventuallyUnanswered(kModuleUnit));
  EXPECT_THAT(daemon->Errors(), HasSubstr("line io: device io-1: online"));
  EXPECT_TRUE(EventuallyLogged(*daemon, "line io: down: "));
  EXPECT_EQ(client.Register(kModuleUnit, 9001), kLineDown) << "last outcome";
  EXPECT_EQ(client.Float(kRelayUnit, 0), 1.25F);
  EXPECT_TRUE(EventuallyQuality(client, kMeterUnit, 0, kGood));
  EXPECT_EQ(client.Register(0, 9007), 2) << "lines up";
  EXPECT_EQ(client.Register(0, 9005), 2) << "devices online";

  io = StartTwin("io", "module", "1");
  EXPECT_TRUE(EventuallyFloat(client, kModuleUnit, 0, 100.25F));
  EXPECT_TRUE(EventuallyQuality(client, kModuleUnit, 0, kGood));
  EXPECT_TRUE(Eventually([&] { return client.Register(0, 9007) == 3; }));
}

class SilentDevice : public Outage, public testing::WithParamInterface<int> {};

TEST_P(SilentDevice, IsOfflineUntilItAnswersAgain) {
  StartAll();
  const int unit = GetParam();
  const float value = unit == kRelayUnit ? 1.25F : unit == kModuleUnit ? 100.25F : -61234.5F;
  const Child& twin = unit == kRelayUnit ? *relay : unit == kModuleUnit ? *io : *meter;
  twin.Signal(SIGSTOP);
  EXPECT_TRUE(TrueValuesUntil(
      unit, value, [&] { return client.Register(unit, 20000) == kCommunicationFailure; }));
  EXPECT_TRUE(EventuallyUnanswered(unit));
  EXPECT_TRUE(Eventually([&] { return client.Register(unit, 9000) == kOffline; }));
  EXPECT_TRUE(EventuallyLogged(*daemon, "offline"));

  // The requests of all that time lie in the pty: the answers to them are late, and of any of them.
  twin.Signal(SIGCONT);
  EXPECT_TRUE(TrueValuesUntil(unit, value, [&] { return client.Register(unit, 20000) == kGood; }));
  EXPECT_TRUE(EventuallyFloat(client, unit, 0, value));
  EXPECT_EQ(client.Float(kRelayUnit, 2), 2.5F);
}

INSTANTIATE_TEST_SUITE_P(OfEachProtocol, SilentDevice,
                         testing::Values(kRelayUnit, kModuleUnit, kMeterUnit));

TEST_F(Outage, ADeviceThatHoldsItsValuesSaysSoByTheirQuality) {
  relay = StartTwin("relay", "relay", "7");
  daemon =
      StartDaemon(Head() + Line("relay", "spabus",
                                "address: 7, profile: relay, unit: 1, poll: 200ms, on_bad: hold"));
  ASSERT_TRUE(EventuallyFloat(client, kRelayUnit, 0, 1.25F));
  relay->Signal(SIGKILL);
  EXPECT_TRUE(EventuallyQuality(client, kRelayUnit, 0, kNotConnected));
  EXPECT_EQ(client.Float(kRelayUnit, 0), 1.25F);
}

}  // namespace
}  // namespace baudgate::system_test
