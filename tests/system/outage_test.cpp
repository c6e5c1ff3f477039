// Tests absent ports, pulled cables and silent devices, and that all values come back afterwards.
// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>
#include <signal.h>

#include <deque>
#include <random>

#include "gateway/base/text.h"
#include "tests/support/long_run.h"
#include "tests/support/raw_client.h"
#include "tests/system/bad_cable.h"
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
  template <typename Condition>
  bool TrueValuesUntil(int unit, float value, Condition done) {
    return Eventually([&] {
      const auto served = client.Float(unit, 0);
      EXPECT_TRUE(!served || *served == value) << *served;
      return done();
    });
  }
};

TEST_F(Outage, APortThatIsAbsentAtTheStartIsOpenedWhenItAppears) {
  daemon = StartDaemon(Yaml());
  EXPECT_TRUE(EventuallyUnanswered(kRelayUnit));
  EXPECT_TRUE(EventuallyQuality(client, kRelayUnit, 0, kNotConnected));
  EXPECT_EQ(client.Register(kRelayUnit, 40000), 0xFFFF) << "never read: no age";
  EXPECT_TRUE(EventuallyLogged(*daemon, "line relay: port down: "));
  EXPECT_THAT(daemon->Errors(), HasSubstr(LinkOf("relay")));

  relay = StartTwin("relay", "relay", "7");
  EXPECT_TRUE(EventuallyFloat(client, kRelayUnit, 0, 1.25F));
  EXPECT_TRUE(EventuallyQuality(client, kRelayUnit, 0, kGood));
  EXPECT_EQ(client.Input(kModuleUnit, 0, 2).exception, kNotAnswering) << "its port is still absent";
}

TEST_F(Outage, OfOneLineDoesNotDisturbTheOtherLines) {
  StartAll();
  io->Signal(SIGKILL);
  EXPECT_TRUE(TrueValuesUntil(
      kModuleUnit, 100.25F, [&] { return client.Register(kModuleUnit, 20000) == kNotConnected; }));
  EXPECT_TRUE(EventuallyUnanswered(kModuleUnit));
  EXPECT_THAT(daemon->Errors(), HasSubstr("line io: device io-1: online"));
  EXPECT_TRUE(EventuallyLogged(*daemon, "line io: port down: "));
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

  // While the simulated device was stopped, its pty stored all requests. Now the simulated device
  // answers all of them late.
  twin.Signal(SIGCONT);
  EXPECT_TRUE(TrueValuesUntil(unit, value, [&] { return client.Register(unit, 20000) == kGood; }));
  EXPECT_TRUE(EventuallyFloat(client, unit, 0, value));
  EXPECT_EQ(client.Float(kRelayUnit, 2), 2.5F);
}

INSTANTIATE_TEST_SUITE_P(OfEachProtocol, SilentDevice,
                         testing::Values(kRelayUnit, kModuleUnit, kMeterUnit));

TEST_F(Outage, ValuesHeldDuringAnOutageHaveABadQuality) {
  relay = StartTwin("relay", "relay", "7");
  daemon =
      StartDaemon(Head() + Line("relay", "spabus",
                                "address: 7, profile: relay, unit: 1, poll: 200ms, on_bad: hold"));
  ASSERT_TRUE(EventuallyFloat(client, kRelayUnit, 0, 1.25F));
  relay->Signal(SIGKILL);
  EXPECT_TRUE(EventuallyQuality(client, kRelayUnit, 0, kNotConnected));
  EXPECT_EQ(client.Float(kRelayUnit, 0), 1.25F);
}

constexpr int kUnits[] = {kRelayUnit, kModuleUnit, kMeterUnit};
/// Short times, so that a noisy line recovers many times within the test.
constexpr const char* kTightTiming =
    "timing: { reply: 300ms, gap: 80ms, ceiling: 1s, drain: 50ms }";

class Damage : public ThreeDevices {
 protected:
  std::string YamlOverBadCables() const {
    return Head() +
           Line("relay-bad", "spabus", "address: 7, profile: relay, unit: 1, poll: 100ms, slow: 1h",
                kTightTiming) +
           Line("io-bad", "dcon", "address: 1, profile: module, unit: 11, poll: 100ms",
                kTightTiming) +
           Line("meter-bad", "set4tm",
                "address: 200, profile: meter, unit: 21, poll: 100ms, slow: 1h", kTightTiming);
  }

  /// Checks that every value that is served is the simulated device's. Returns the number of
  /// values.
  int ExpectTrueValues() {
    int served = 0;
    const auto check = [&](int unit, int address, float value) {
      const auto got = client.Float(unit, address);
      if (!got) return;
      ++served;
      EXPECT_EQ(*got, value) << "unit " << unit << " register " << address;
    };
    check(kRelayUnit, 0, 1.25F);
    check(kRelayUnit, 2, 2.5F);
    check(kRelayUnit, 4, 63);
    check(kModuleUnit, 0, 100.25F);
    check(kModuleUnit, 8, -101.5F);
    check(kModuleUnit, 14, 5.75F);
    check(kMeterUnit, 0, -61234.5F);
    check(kMeterUnit, 24, 6000.25F);
    check(kMeterUnit, 50, 50.03125F);
    return served;
  }

  std::uint32_t Counter(int unit, int address) {
    const Registers answer = client.Input(unit, address, 2);
    return answer.ok() ? static_cast<std::uint32_t>(answer.values[0] << 16 | answer.values[1]) : 0;
  }
  std::uint32_t Exchanges(int unit) { return Counter(unit, 9004); }
  std::uint32_t Ok(int unit) { return Counter(unit, 9006); }
};

TEST_F(Damage, OfALineNeverGivesAWrongValue) {
  StartTwins();
  BadCable relay_cable(LinkOf("relay-bad"), LinkOf("relay"), 1);
  BadCable io_cable(LinkOf("io-bad"), LinkOf("io"), 2);
  BadCable meter_cable(LinkOf("meter-bad"), LinkOf("meter"), 3);
  BadCable* const cables[] = {&relay_cable, &io_cable, &meter_cable};
  for (const BadCable* cable : cables) ASSERT_TRUE(cable->connected());
  daemon = StartDaemon(YamlOverBadCables());
  ASSERT_TRUE(Eventually([&] { return ExpectTrueValues() == 9; }));

  std::map<int, std::uint32_t> ok_before;
  std::map<int, std::uint32_t> failed_before;
  for (const int unit : kUnits) {
    ok_before[unit] = Ok(unit);
    failed_before[unit] = Exchanges(unit) - ok_before[unit];
  }
  for (BadCable* cable : cables) cable->SetNoisy(true);
  std::string progress;
  const bool enough = Eventually(
      [&] {
        ExpectTrueValues();
        bool each = true;
        progress.clear();
        for (const int unit : kUnits) {
          const std::uint32_t ok = Ok(unit) - ok_before[unit];
          const std::uint32_t failed = Exchanges(unit) - Ok(unit) - failed_before[unit];
          each = each && ok >= 20 && failed >= 2;
          progress += "unit " + std::to_string(unit) + ": " + std::to_string(ok) + " good, " +
                      std::to_string(failed) + " damaged exchanges\n";
        }
        return each;
      },
      40s);
  EXPECT_TRUE(enough) << progress;
  for (BadCable* cable : cables) {
    EXPECT_GT(cable->noise_bytes(), 0U);
    cable->SetNoisy(false);
  }
  for (const int unit : kUnits) EXPECT_TRUE(EventuallyQuality(client, unit, 0, kGood));
  EXPECT_TRUE(Eventually([&] { return ExpectTrueValues() == 9; }));
}

std::vector<Bytes> HostileFrames() {
  std::vector<Bytes> frames;
  for (const char* hex : {
           "00 01 00 01 00 06 0B 04 00 00 00 02",
           "00 01 00 00 FF FF 0B 04 00 00 00 02",
           "00 01 00 00 00 00",
           "00 01 00 00 00 01 0B",
           "00 01 00 00 00 03 0B 04 00",
           "00 01 00 00 00 06 0B 04 00",
           "00 01 00 00 00 06 0B 63 00 00 00 02",
           "00 01 00 00 00 06 0B 04 00 00 FF FF",
           "00 01 00 00 00 06 0B 04 00 00 00 00",
           "00 01 00 00 00 07 0B 10 00 00 00 10 FF",  // announces data that never arrives
           "00 01 00 00 00 09 0B 10 00 00 00 02 04 00 00",
           "00 01 00 00 00 06 0B 16 00 00 00 00",
           "00 01 00 00 00 02 0B 07",
           "00 01 00 00 00 06 0B 04 00 00 00 10",
       }) {
    frames.push_back(*ParseHex(hex));
  }
  return frames;
}

TEST_F(Damage, ByHostileClientsDoesNotReachAGoodClient) {
  io = StartTwin("io", "module", "1");
  daemon = StartDaemon(Head() + Line("io", "dcon", "address: 1, profile: module, unit: 11"));
  ASSERT_TRUE(EventuallyFloat(client, kModuleUnit, 0, 100.25F));

  std::mt19937 random(4);
  const std::vector<Bytes> frames = HostileFrames();
  std::deque<RawClient> crowd;
  std::size_t sent = 0;
  std::size_t thrown_out = 0;
  for (std::size_t round = 0; round < LongRun(300); ++round) {
    crowd.emplace_back(port());
    if (crowd.size() > 50) crowd.pop_front();
    for (const RawClient& hostile : crowd) {
      if (!hostile.connected()) continue;
      Bytes bytes = frames[random() % frames.size()];
      if (random() % 4 == 0) {
        bytes.resize(1 + random() % 300);
        for (std::uint8_t& byte : bytes) byte = static_cast<std::uint8_t>(random());
      }
      hostile.SendSome(bytes) ? ++sent : ++thrown_out;
    }
    // One client sends correct requests on one connection. All its answers must be whole and
    // correct.
    const Registers answer = client.Input(kModuleUnit, 0, 16);
    ASSERT_TRUE(answer.ok()) << "round " << round << ": " << answer.exception;
    ASSERT_EQ(client.Float(kModuleUnit, 8), -101.5F);
  }
  EXPECT_GT(sent, 0U);
  EXPECT_GT(thrown_out, 0U) << "a client without frame boundaries is let go";
  EXPECT_TRUE(daemon->Running());
}

}  // namespace
}  // namespace baudgate::system_test
