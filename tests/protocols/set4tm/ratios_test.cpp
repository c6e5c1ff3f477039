// Transformer ratios of a SET-4TM meter: those in the meter, and those of the configuration in
// their place, for floats, integers and energy alike.
// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>

#include <bit>

#include "protocols/set4tm/conversation.h"
#include "protocols/set4tm/meter/values.h"
#include "tests/protocols/set4tm/support.h"

namespace baudgate::protocols::set4tm {
namespace {

using ::testing::ElementsAre;

/// What the meter is programmed with, what the configuration says (0: nothing), what the floats
/// are.
struct Site {
  const char* name;
  int kn_in_meter;
  int kt_in_meter;
  double kn_option;
  double kt_option;
  const char* floats;
};

/// On its terminals each meter sees 57.7 V and 2.5 A: 144.25 W a phase.
constexpr double kVolts = 57.7;
constexpr double kAmperes = 2.5;

constexpr Site kSites[] = {
    {"1:1 and nothing outside", 1, 1, 0, 0, "primary"},
    {"its own ratios", 100, 20, 0, 0, "primary"},
    {"1:1, multiplied outside", 1, 1, 100, 20, "primary"},
    {"its own, and the same outside", 100, 20, 100, 20, "primary"},
    {"wrong ones, right outside", 60, 30, 100, 20, "primary"},
    {"only the voltage outside", 1, 20, 100, 0, "primary"},
    {"only the current outside", 100, 1, 0, 20, "primary"},
    {"wrong voltage inside", 60, 20, 100, 0, "primary"},
    {"secondary floats, its own ratios", 100, 20, 0, 0, "secondary"},
    {"secondary floats, multiplied outside", 1, 1, 100, 20, "secondary"},
    {"secondary floats, wrong ones inside", 60, 30, 100, 20, "secondary"},
    {"secondary floats, only the voltage outside", 60, 20, 100, 0, "secondary"},
};

class Set4tmRatios : public ::testing::TestWithParam<Site> {
 protected:
  double Kn() const {
    return GetParam().kn_option > 0 ? GetParam().kn_option : GetParam().kn_in_meter;
  }
  double Kt() const {
    return GetParam().kt_option > 0 ? GetParam().kt_option : GetParam().kt_in_meter;
  }

  config::Device Meter(std::vector<config::Point> points) const {
    config::Device device = MakeDevice("5", std::move(points));
    device.options.Set("voltage_ratio", GetParam().kn_option);
    device.options.Set("current_ratio", GetParam().kt_option);
    device.options.Set("floats", std::string(GetParam().floats));
    return device;
  }

  /// The meter's float of what is `secondary` on its terminals.
  std::string Float(double secondary, bool voltage, bool current) const {
    double value = secondary;
    if (std::string(GetParam().floats) == "primary") {
      if (voltage) value *= GetParam().kn_in_meter;
      if (current) value *= GetParam().kt_in_meter;
    }
    auto bits = std::bit_cast<std::uint32_t>(static_cast<float>(value));
    Bytes bytes;
    for (int i = 0; i < 4; ++i, bits >>= 8) bytes.push_back(static_cast<std::uint8_t>(bits));
    return ToHex(bytes);
  }

  /// What the point reads; the meter has answered 08 12 and 08 02 where it was asked.
  double Read(const std::string& read, const std::string& data) const {
    Talk talk = OpenTalk(Meter({MakePoint(read)}));
    const Site& site = GetParam();
    const Answer answer = talk.Run(Poll(0), [&](View request) {
      const auto parts = SplitFrame(request);
      const View pdu = parts->body;
      Bytes body = Hex(data);
      if (ToHex(pdu) == "08 12") body = Hex("10 40 80");  // Kc 1, Ci 1, A = 5000
      if (ToHex(pdu) == "08 02") {
        body = Bytes(10);
        body[1] = static_cast<std::uint8_t>(site.kn_in_meter);
        body[3] = static_cast<std::uint8_t>(site.kt_in_meter);
      }
      return MakeFrame(parts->address, body);
    });
    EXPECT_EQ(answer.outcome, Outcome::ok) << answer.reason;
    if (answer.readings.empty() || !IsGood(answer.readings[0].quality)) return -1;
    return ToDouble(answer.readings[0].value);
  }
};

TEST_P(Set4tmRatios, VoltagesTakeTheVoltageRatio) {
  for (const char* rr : {"11", "15", "18", "A1", "A5", "A8"}) {
    const std::string read = std::string("08 1B 00 ") + rr + " float_le@0";
    EXPECT_NEAR(Read(read, Float(kVolts, true, false)), kVolts * Kn(), kVolts * Kn() * 1e-6) << rr;
  }
  EXPECT_NEAR(Read("08 11 11 voltage_be@0", "00 16 8A"), kVolts * Kn(), 1e-6) << "5770 / 100";
}

TEST_P(Set4tmRatios, CurrentsTakeTheCurrentRatio) {
  EXPECT_NEAR(Read("08 1B 00 21 float_le@0", Float(kAmperes, false, true)), kAmperes * Kt(),
              kAmperes * Kt() * 1e-6);
  EXPECT_NEAR(Read("08 11 21 current_be@0", "00 61 A8"), kAmperes * Kt(), 1e-6) << "25000 / 10 mA";
}

TEST_P(Set4tmRatios, PowersTakeBoth) {
  const double watts = kVolts * kAmperes;
  const double primary = watts * Kn() * Kt();
  for (const char* rr : {"00", "01", "04", "08", "E0", "E4"}) {
    const std::string read = std::string("08 1B 00 ") + rr + " float_le@0";
    EXPECT_NEAR(Read(read, Float(watts, true, true)), primary, primary * 1e-6) << rr;
  }
  EXPECT_NEAR(Read("08 11 00 power_be@0", "02 33 7A"), primary, primary * 1e-6) << "144250 / 1000";
}

TEST_P(Set4tmRatios, PowerAndEnergyAgree) {
  const double watts = Read("08 1B 02 00 float_le@0", Float(kVolts * kAmperes, true, true) +
                                                          " 00 00 00 00 00 00 00 00 00 00 00 00");
  // 14425 counts of 1 / (2 * 5000) kWh: 144.25 W for 10 h.
  const double kwh = Read("05 00 00 energy@0", "00 00 38 59 00 00 00 00 00 00 00 00 00 00 00 00");
  EXPECT_NEAR(kwh, watts * 10 / 1000, kwh * 1e-6);
}

TEST_P(Set4tmRatios, AnglesAndFrequencyTakeNone) {
  // Ubat, KI, K2i, K0i, cos, sin, tg, f, T, KU, K2u, K0u, averaged f, averaged KU
  for (const char* rr :
       {"1C", "25", "28", "2C", "31", "35", "39", "40", "70", "81", "88", "8C", "90", "B1", "B8"}) {
    const std::string read = std::string("08 1B 00 ") + rr + " float_le@0";
    EXPECT_EQ(Read(read, "00 00 40 3F"), 0.75) << rr;
  }
}

INSTANTIATE_TEST_SUITE_P(Sites, Set4tmRatios, ::testing::ValuesIn(kSites),
                         [](const auto& site) { return "Site" + std::to_string(site.index); });

TEST(Set4tmRatiosAsked, OnlyWhereTheyAreNeeded) {
  config::Device device =
      MakeDevice("5", {MakePoint("08 1B 00 11 float_le@0"), MakePoint("08 1B 00 40 float_le@0")});
  Talk plain = OpenTalk(device);
  plain.Run(Poll(0), Script({"00 80 66 43"}));
  EXPECT_THAT(TakeAsked(plain), ElementsAre("08 1B 00 11")) << "primary as they come";
  device.options.Set("voltage_ratio", 100.0);
  Talk talk = OpenTalk(device);
  talk.Run(Poll(1), Script({"00 00 48 42"}));
  talk.Run(Poll(0), Script({"00 01 00 01 00 00 00 00 00 00", "00 80 66 43"}));
  talk.Run(Poll(0), Script({"00 80 66 43"}));
  EXPECT_THAT(TakeAsked(talk), ElementsAre("08 1B 00 40", "08 02", "08 1B 00 11", "08 1B 00 11"));
}

TEST(Set4tmRatiosAsked, AScaleBesideThemIsDoubted) {
  config::Device device =
      MakeDevice("5", {MakePoint("08 1B 00 11 float_le@0"), MakePoint("08 1B 00 21 float_le@0"),
                       MakePoint("08 1B 00 40 float_le@0")});
  for (config::Point& point : device.points) point.scale = 100;
  EXPECT_TRUE(Set4tmProtocol().doubts(device).empty());
  device.options.Set("voltage_ratio", 100.0);
  const auto doubts = Set4tmProtocol().doubts(device);
  ASSERT_EQ(doubts.size(), 1U);
  EXPECT_EQ(doubts[0].point, 0U);
}

/// What it has multiplied its floats with already, nobody knows then.
TEST(Set4tmRatiosAsked, AMeterThatDoesNotTellThemHasNoGoodFloatsThen) {
  config::Device device = MakeDevice("5", {MakePoint("08 1B 00 11 float_le@0")});
  device.options.Set("voltage_ratio", 100.0);
  Talk talk = OpenTalk(device);
  const Answer answer = talk.Run(Poll(0), Script({"01", "00 80 66 43"}));
  EXPECT_EQ(answer.readings.at(0).quality, Quality::bad_configuration);
  EXPECT_FALSE(HasValue(answer.readings.at(0).value));
}

}  // namespace
}  // namespace baudgate::protocols::set4tm
