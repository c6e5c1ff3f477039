// Tests the grammar of `read` and the decoders of SET-4TM with the examples of the reference.
// SPDX-License-Identifier: Apache-2.0
#include "protocols/set4tm/meter/points.h"

#include <gmock/gmock.h>

#include <bit>
#include <cmath>

#include "protocols/set4tm/conversation.h"
#include "protocols/set4tm/meter/plan.h"
#include "protocols/set4tm/meter/status.h"
#include "protocols/set4tm/meter/values.h"
#include "tests/protocols/set4tm/support.h"

namespace baudgate::protocols::set4tm {
namespace {

const Scale kPlain = {5000, 1, 1, 1, 1};

Decoded Read(const std::string& read, std::string_view data, const Scale& scale = kPlain) {
  const auto field = ParseField(read);
  EXPECT_TRUE(field) << read;
  return field ? DecodeField(*field, Hex(data), scale) : Decoded{};
}

double NumberOf(const std::string& read, std::string_view data, const Scale& scale = kPlain) {
  const Decoded decoded = Read(read, data, scale);
  EXPECT_EQ(decoded.quality, Quality::good) << read;
  return ToDouble(decoded.value);
}

std::string TextOf(const std::string& read, std::string_view data) {
  return ToText(Read(read, data).value);
}

TEST(Set4tmFields, AreParsedAndPrinted) {
  for (const char* read : {"08 1B 00 11 float_le@0", "05 00 00 energy@12", "08 0A flag@40",
                           "08 0B text_cp1251(16)@0", "08 06 01 bcd(2)@0"}) {
    const auto field = ParseField(read);
    ASSERT_TRUE(field) << read;
    EXPECT_EQ(FieldText(*field), read);
  }
  EXPECT_EQ(ParseField("081B0011 float_le@0")->pdu, Hex("08 1B 00 11"));
}

TEST(Set4tmFields, ErrorsNameTheFaultyPart) {
  const std::pair<const char*, const char*> kWrong[] = {
      {"08 1B 00 11", "decoder"},
      {"float_le@0", "request in hex"},
      {"08 1G float_le@0", "hex bytes"},
      {"08 1B 00 11 double@0", "no decoder \"double\""},
      {"08 1B 00 11 float_le@x", "offset"},
      {"08 1B 00 11 float_le@1", "beyond the 4 data bytes"},
      {"08 1B 00 11 float_le(4)@0", "takes no length"},
      {"08 0B text_cp1251@0", "needs its length"},
      {"08 0B text_cp1251(17)@0", "beyond the 16"},
      {"08 06 bcd(9)@0", "1 to 8"},
      {"08 0A flag@0", "E-01"},
      {"08 0A flag@41", "E-01"},
      {"03 0B 00 0A u8@0", "only read requests"},
      {"01 u8@0", "only read requests"},
      {"08 7F u8@0", "documented"},
      {"08 23 00 00 00 00 00 00 00 00 00 01 float_le@1", "by itself"},
      {"08 00 u8@99999999999999999999", "offset"},
  };
  for (const auto& [read, part] : kWrong) {
    const auto field = ParseField(read);
    ASSERT_FALSE(field) << read;
    EXPECT_NE(field.error().find(part), std::string::npos) << field.error();
  }
}

TEST(Set4tmFields, NeedATypeThatFitsTheDecoder) {
  const auto check = [](const char* read, config::Type type) {
    config::Point point = MakePoint(read, config::Group::fast, type);
    return static_cast<bool>(Set4tmProtocol().check_point(point));
  };
  EXPECT_TRUE(check("08 1B 00 11 float_le@0", config::Type::float32));
  EXPECT_TRUE(check("05 00 00 energy@0", config::Type::float64));
  EXPECT_TRUE(check("08 0A alarm@0", config::Type::boolean));
  EXPECT_TRUE(check("04 00 time@0", config::Type::string));
  EXPECT_FALSE(check("04 00 time@0", config::Type::uint32));
  EXPECT_FALSE(check("08 0A flag@1", config::Type::uint16));
  EXPECT_FALSE(check("08 1B 00 11 float_le@0", config::Type::boolean));
  config::Point writable = MakePoint("08 05 u8@1");
  writable.access = config::Access::read_write;
  EXPECT_FALSE(Set4tmProtocol().check_point(writable));
}

TEST(Set4tmFields, MatchTheWorkedExamples) {
  EXPECT_FLOAT_EQ(static_cast<float>(NumberOf("08 1B 00 11 float_le@0", "00 80 66 43")), 230.5F);
  EXPECT_NEAR(NumberOf("08 1B 00 00 float_le@0", "08 FF 47 44"), 799.98, 0.01);
  EXPECT_EQ(NumberOf("08 00 u32_be@0", "00 89 A2 61 06 09 02"), 9020001);
  EXPECT_EQ(TextOf("08 00 date@4", "00 89 A2 61 06 09 02"), "2002-09-06");
  EXPECT_EQ(TextOf("04 00 time@0", "31 30 15 01 02 09 02 00"), "2002-09-02T15:30:31");
  EXPECT_EQ(TextOf("08 0E time_min@0", "30 15 01 02 09 02 03"), "2002-09-02T15:30");
  EXPECT_EQ(TextOf("08 03 version@0", "03 09 30"), "03.09.30");
  const std::string_view energy = "00 00 27 11 00 00 00 00 00 00 13 89 00 00 00 65";
  EXPECT_EQ(NumberOf("05 00 02 energy@0", energy), 1.0001);
  EXPECT_EQ(NumberOf("05 00 02 energy@8", energy), 0.5001);
  EXPECT_EQ(NumberOf("05 00 02 energy@12", energy), 0.0101);
  EXPECT_EQ(NumberOf("05 00 02 counts@0", energy), 10001);
  EXPECT_EQ(NumberOf("08 01 i8@1", "00 F6"), -10);
  EXPECT_EQ(NumberOf("08 04 u16_be@5", "35 11 08 09 99 06 58"), 0x0658);
  EXPECT_EQ(NumberOf("08 04 bcd(2)@0", "35 11 08 09 99 06 58"), 3511);
}

TEST(Set4tmFields, IntegerValuesMaskTheDirectionBits) {
  // Quadrant 4: active forward, reactive reverse.
  EXPECT_DOUBLE_EQ(NumberOf("08 11 00 power_be@0", "44 2F 47"), 274.247);
  EXPECT_DOUBLE_EQ(NumberOf("08 11 04 reactive_be@0", "44 2F 47"), -274.247);
  EXPECT_DOUBLE_EQ(NumberOf("08 11 00 power_be@0", "84 2F 47"), -274.247);
  EXPECT_DOUBLE_EQ(NumberOf("08 11 08 apparent_be@0", "C4 2F 47"), 274.247);
  EXPECT_DOUBLE_EQ(NumberOf("08 11 30 factor_be@0", "80 00 5F"), -0.95);
  EXPECT_DOUBLE_EQ(NumberOf("08 11 40 hundredths_be@0", "C0 13 88"), 50.0);
  EXPECT_DOUBLE_EQ(NumberOf("08 11 19 voltage_be@0", "00 01 37"), 3.11);
  const Scale ratios = {5000, 2, 1, 100, 20};
  EXPECT_DOUBLE_EQ(NumberOf("08 11 11 voltage_be@0", "00 16 8A", ratios), 5770);
  EXPECT_DOUBLE_EQ(NumberOf("08 11 21 current_be@0", "00 C3 50", ratios), 100);
  EXPECT_DOUBLE_EQ(NumberOf("08 11 00 power_be@0", "00 03 E8", ratios), 4000);
}

TEST(Set4tmFields, ErrorCodesAreNeverNumbers) {
  const std::pair<const char*, Quality> kFloats[] = {
      {"07 00 80 7F", {Quality::uncertain_last_usable, Reason::not_ready}},
      {"01 00 80 7F", {Quality::bad_configuration, Reason::not_fitted}},
      {"02 00 80 7F", Quality::bad_sensor_failure},
      {"00 00 C0 7F", Quality::bad_sensor_failure},
      {"00 00 80 7F", Quality::bad_sensor_failure},
      {"FF FF FF FF", Quality::bad_sensor_failure},
      {"43 66", Quality::bad_device_failure}};
  for (const auto& [data, quality] : kFloats) {
    const Decoded decoded = Read("08 1B 00 11 float_le@0", data);
    EXPECT_FALSE(HasValue(decoded.value)) << data;
    EXPECT_EQ(decoded.quality, quality) << data;
  }
  EXPECT_FALSE(HasValue(Read("05 00 00 counts@0", "FF FF FF FF").value));
  EXPECT_FALSE(HasValue(Read("05 00 00 energy@0", "FF FF FF FF").value));
  EXPECT_FALSE(HasValue(Read("08 03 version@0", "03 0A 30").value));
  EXPECT_FALSE(HasValue(Read("04 00 time@0", "31 30 25 01 02 09 02 00").value));
  EXPECT_FALSE(HasValue(Read("04 00 time@0", "31 30 15 01 02 13 02 00").value));
  // An open journal record has no end time yet, so the value of its end is an empty text.
  const Decoded open = Read("09 01 09 time@7", "31 30 15 01 02 09 02 00 00 00 00 00 00 00");
  EXPECT_EQ(std::get<std::string>(open.value), "");
}

TEST(Set4tmFields, WithoutConstantsThereIsNoEnergy) {
  const Decoded decoded = Read("05 00 00 energy@0", "00 00 27 11", Scale{5000, 1, 1, {}, 1});
  EXPECT_FALSE(HasValue(decoded.value));
  EXPECT_EQ(decoded.quality, Quality::bad_configuration);
  EXPECT_FALSE(HasValue(Read("08 11 00 power_be@0", "00 03 E8", Scale{5000, {}, 1, 1, 1}).value));
}

TEST(Set4tmFields, StatusWordFlagsAreDecoded) {
  // E-01 is bit 0 of the first byte, E-40 bit 7 of the fifth.
  EXPECT_TRUE(std::get<bool>(Read("08 0A flag@1", "01 00 00 00 00").value));
  EXPECT_FALSE(std::get<bool>(Read("08 0A flag@2", "01 00 00 00 00").value));
  EXPECT_TRUE(std::get<bool>(Read("08 0A flag@9", "00 01 00 00 00").value));
  EXPECT_TRUE(std::get<bool>(Read("08 0A flag@40", "00 00 00 00 80").value));
  EXPECT_FALSE(std::get<bool>(Read("08 0A alarm@0", "00 00 00 00 E0").value));
  EXPECT_TRUE(std::get<bool>(Read("08 0A alarm@0", "00 00 00 00 10").value));
  EXPECT_TRUE(std::get<bool>(Read("08 0A alarm@0", "00 80 00 00 80").value));
}

TEST(Set4tmConstants, TheVariantGivesMeterConstantAndCoefficients) {
  const double kConstants[] = {5000, 25000, 1250, 6250, 500, 250, 6400};
  for (unsigned code = 0; code < 7; ++code) {
    const Bytes variant = {0x10, static_cast<std::uint8_t>(0x40 | code), 0x80};
    EXPECT_EQ(ParseVariant(variant).meter_constant, kConstants[code]);
  }
  EXPECT_FALSE(ParseVariant(Hex("10 47 80")).meter_constant);
  EXPECT_EQ(ParseVariant(Hex("10 40 80")).power_coefficient, 1);
  EXPECT_EQ(ParseVariant(Hex("14 40 80")).power_coefficient, 2);
  EXPECT_EQ(ParseVariant(Hex("15 40 80")).power_coefficient, 1);   // 120-230 V, 1 A
  EXPECT_EQ(ParseVariant(Hex("14 40 70")).power_coefficient, 20);  // PSCH-3TM.05M
  EXPECT_EQ(ParseVariant(Hex("14 50 90")).current_coefficient, 10);
  EXPECT_FALSE(ParseVariant(Hex("15 40 10")).power_coefficient);  // the reference is not certain
  EXPECT_FALSE(ParseVariant(Hex("14 40 B0")).power_coefficient);
  EXPECT_FALSE(ParseVariant(Hex("14 40")).meter_constant);
}

TEST(Set4tmConstants, ARatioOfZeroIsIgnored) {
  const Scale ratios = ParseRatios(Hex("00 64 00 14 00 00 00 00 00 00"));
  EXPECT_EQ(ratios.voltage_ratio, 100);
  EXPECT_EQ(ratios.current_ratio, 20);
  EXPECT_FALSE(ParseRatios(Hex("00 00 00 14 00 00 00 00 00 00")).voltage_ratio);
}

TEST(Set4tmText, IsConvertedFromWindows1251) {
  EXPECT_EQ(FromCp1251(Hex("C2 E2 EE E4 20 B9 31 20 20 00 41")), "Ввод №1");
  EXPECT_EQ(FromCp1251(Hex("A8 B8 01 7F")), "Ёё??");
  EXPECT_EQ(ToCp1251("Ввод №1"), Hex("C2 E2 EE E4 20 B9 31"));
  EXPECT_EQ(ToCp1251("Ёё漢"), Hex("A8 B8 3F"));
}

TEST(Set4tmSnapshot, MaskBitsMatchTheReference) {
  const std::vector<unsigned> bits = MaskBits(Hex("08 23 15 00 00 00 00 00 02 00 00 03"));
  EXPECT_EQ(bits, (std::vector<unsigned>{0, 1, 25}));
  EXPECT_EQ(MaskBit(0x00), 0U);
  EXPECT_EQ(MaskBit(0x01), 1U);
  EXPECT_EQ(MaskBit(0x21), 25U);
  EXPECT_EQ(MaskRequest(0x15, bits), Hex("08 23 15 00 00 00 00 00 02 00 00 03"));
  EXPECT_EQ(MaskBit(0x40), 44U);
  EXPECT_FALSE(MaskBit(0x34));
  EXPECT_FALSE(MaskBit(0xFF));
  EXPECT_FALSE(MaskedParameter(46));
}

TEST(Set4tmSnapshot, SlotsOfGroupReadsMatchTheReference) {
  EXPECT_EQ(ParameterAt(Hex("08 1B 02 00"), 0), 0x00);
  EXPECT_EQ(ParameterAt(Hex("08 1B 02 30"), 12), 0x33);
  EXPECT_EQ(ParameterAt(Hex("08 1B 02 10"), 0), 0x11);  // there is no sum, so phase 1 is first
  EXPECT_EQ(ParameterAt(Hex("08 1B 02 14"), 12), 0x17);
  EXPECT_EQ(ParameterAt(Hex("08 1B 00 41"), 0), 0x40);
  EXPECT_EQ(ParameterAt(Hex("08 1B 00 19"), 0), 0x18);
  EXPECT_FALSE(ParameterAt(Hex("08 1B 01 00"), 0));  // latched values have no such parameter
  EXPECT_FALSE(ParameterAt(Hex("08 1B 02 00"), 2));
  EXPECT_FALSE(ParameterAt(Hex("08 1B 00 00"), 4));
}

using ::testing::ElementsAre;

/// The ratios in the meter, the configured ratios (0: not configured) and the kind of floats.
struct Site {
  const char* name;
  int kn_in_meter;
  int kt_in_meter;
  double kn_option;
  double kt_option;
  const char* floats;
};

/// At its terminals each meter measures 57.7 V and 2.5 A: 144.25 W per phase.
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

TEST_P(Set4tmRatios, VoltagesUseTheVoltageRatio) {
  for (const char* rr : {"11", "15", "18", "A1", "A5", "A8"}) {
    const std::string read = std::string("08 1B 00 ") + rr + " float_le@0";
    EXPECT_NEAR(Read(read, Float(kVolts, true, false)), kVolts * Kn(), kVolts * Kn() * 1e-6) << rr;
  }
  EXPECT_NEAR(Read("08 11 11 voltage_be@0", "00 16 8A"), kVolts * Kn(), 1e-6) << "5770 / 100";
}

TEST_P(Set4tmRatios, CurrentsUseTheCurrentRatio) {
  EXPECT_NEAR(Read("08 1B 00 21 float_le@0", Float(kAmperes, false, true)), kAmperes * Kt(),
              kAmperes * Kt() * 1e-6);
  EXPECT_NEAR(Read("08 11 21 current_be@0", "00 61 A8"), kAmperes * Kt(), 1e-6) << "25000 / 10 mA";
}

TEST_P(Set4tmRatios, PowersUseBothRatios) {
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

TEST_P(Set4tmRatios, AnglesAndFrequencyUseNoRatio) {
  // Ubat, KI, K2i, K0i, cos, sin, tg, f, T, KU, K2u, K0u, averaged f, averaged KU, averaged K2u
  for (const char* rr :
       {"1C", "25", "28", "2C", "31", "35", "39", "40", "70", "81", "88", "8C", "90", "B1", "B8"}) {
    const std::string read = std::string("08 1B 00 ") + rr + " float_le@0";
    EXPECT_EQ(Read(read, "00 00 40 3F"), 0.75) << rr;
  }
}

INSTANTIATE_TEST_SUITE_P(Sites, Set4tmRatios, ::testing::ValuesIn(kSites),
                         [](const auto& site) { return "Site" + std::to_string(site.index); });

TEST(Set4tmRatiosAsked, AreReadOnlyWhereNeeded) {
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

TEST(Set4tmRatiosAsked, AScaleInAdditionIsWarnedAbout) {
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

/// Without the ratios of the meter it is unknown which factors its floats already contain.
TEST(Set4tmRatiosAsked, AMeterWithoutRatiosHasNoGoodFloats) {
  config::Device device = MakeDevice("5", {MakePoint("08 1B 00 11 float_le@0")});
  device.options.Set("voltage_ratio", 100.0);
  Talk talk = OpenTalk(device);
  const Answer answer = talk.Run(Poll(0), Script({"01", "00 80 66 43"}));
  EXPECT_EQ(answer.readings.at(0).quality, Quality::bad_configuration);
  EXPECT_FALSE(HasValue(answer.readings.at(0).value));
}

/// A refused float can mean that the meter has no floats, so its type is read next.
TEST(Set4tmStatus, AnUnsupportedPointIsNotReadAgain) {
  Talk talk =
      OpenTalk(MakeDevice("1", {MakePoint("08 1B 02 E0 float_le@0"), MakePoint(kOneFloat)}));
  const Answer answer = talk.Run(Poll(0), Script({"01", "10 40 80", "01"}));
  EXPECT_EQ(answer.outcome, Outcome::unsupported);
  EXPECT_EQ(answer.then, Then::replan);
  ASSERT_EQ(answer.readings.size(), 1U);
  EXPECT_EQ(answer.readings[0].point, 0U);
  EXPECT_EQ(answer.readings[0].quality, Quality::bad_configuration);
  ASSERT_EQ(talk->Queries().size(), 1U);
  EXPECT_THAT(talk->Queries()[0].points, ElementsAre(1));
  talk->OnReconnect();
  EXPECT_EQ(talk->Queries().size(), 2U);
}

TEST(Set4tmStatus, EachCodeHasItsOutcomeAndWait) {
  struct Row {
    const char* body;
    Outcome outcome;
    Duration wait;
  };
  const Row kRows[] = {{"02", Outcome::refused, 10s},  {"04", Outcome::refused, 0s},
                       {"07", Outcome::busy, 0s},      {"08", Outcome::busy, 1s},
                       {"58", Outcome::busy, 5s},      {"0A", Outcome::refused, 0s},
                       {"0F", Outcome::no_reply, 0s},  {"0C", Outcome::refused, 10s},
                       {"00", Outcome::unexpected, 0s}};
  for (const Row& row : kRows) {
    Talk talk = OpenTalk(OneFloat());
    const Answer answer = talk.Run(Poll(0), Script({row.body}));
    EXPECT_EQ(answer.outcome, row.outcome) << row.body;
    EXPECT_EQ(answer.wait, row.wait) << row.body;
    EXPECT_EQ(answer.then, Then::done) << row.body;
    EXPECT_FALSE(answer.reason.empty()) << row.body;
    for (const Reading& reading : answer.readings) EXPECT_FALSE(HasValue(reading.value));
  }
}

constexpr const char* kSerialPoint = "08 00 u32_be@0";

TEST(Set4tmStatus, ARefusedSerialNumberIsReadOnce) {
  for (const char* status : {"01", "03"}) {
    Talk talk = OpenTalk(MakeDevice("5", {MakePoint(kSerialPoint, config::Group::once)}));
    const Answer answer = talk.Run(Poll(0), Script(std::vector<std::string>(10, status)));
    EXPECT_THAT(TakeAsked(talk), ElementsAre("08 00")) << status;
    EXPECT_EQ(answer.then, Then::replan) << status;
    ASSERT_EQ(answer.readings.size(), 1U) << status;
    EXPECT_FALSE(HasValue(answer.readings[0].value)) << status;
    EXPECT_TRUE(talk->Queries().empty()) << status;
  }
}

TEST(Set4tmStatus, AMeterWithoutSerialNumberIsNoContradiction) {
  for (const char* status : {"01", "02", "03", "04", "0A"}) {
    Talk talk(Set4tmProtocol(), MakeDevice("5", {MakePoint(kOneFloat),
                                                 MakePoint(kSerialPoint, config::Group::once)}));
    talk->Recall("", {talk.now, WallTime(1'790'000'000s)});
    talk.Run(Probe(), Script({"00"}));
    TakeAsked(talk);
    for (int poll = 0; poll < 3; ++poll) {
      talk.Run(Poll(0), [status](View request) {
        return Script({Is(SplitFrame(request)->body, kAskSerial) ? status : "00 80 66 43"})(
            request);
      });
    }
    EXPECT_THAT(TakeAsked(talk), ElementsAre("08 00", "08 1B 00 11", "08 1B 00 11", "08 1B 00 11"))
        << status;
  }
}

TEST(Set4tmStatus, AMissingRequiredSerialNumberIsReadRarely) {
  for (const char* status : {"01", "02", "0A"}) {
    config::Device device = OneFloat();
    device.options.Set("serial_number", std::int64_t{kMeter});
    Talk talk = OpenTalk(device);
    const Answer answer = talk.Run(Poll(0), Script({status, status, status}));
    EXPECT_EQ(answer.outcome, Outcome::refused) << status;
    EXPECT_TRUE(answer.readings.empty()) << status;
    EXPECT_EQ(answer.wait, 1min) << status;
    EXPECT_THAT(TakeAsked(talk), ElementsAre("08 00")) << status;
  }
}

TEST(Set4tmStatus, NotReadyKeepsTheLastValueAsUncertain) {
  Talk talk = OpenTalk(OneFloat());
  const Answer answer = talk.Run(Poll(0), Script({"07"}));
  ASSERT_EQ(answer.readings.size(), 1U);
  EXPECT_EQ(answer.readings[0].quality, Quality::uncertain_last_usable);
}

TEST(Set4tmStatus, ARequestIsRepeatedOnceOnDemand) {
  Talk talk = OpenTalk(OneFloat());
  EXPECT_EQ(talk.Run(Poll(0), Script({"06", "00 80 66 43"})).outcome, Outcome::ok);
  EXPECT_EQ(TakeAsked(talk).size(), 2U);
  EXPECT_EQ(talk.Run(Poll(0), Script({"06", "06"})).outcome, Outcome::busy);
  EXPECT_EQ(TakeAsked(talk).size(), 2U);
}

}  // namespace
}  // namespace baudgate::protocols::set4tm
