// The `read` grammar and the decoders of SET-4TM, with the values of the reference's examples.
// SPDX-License-Identifier: Apache-2.0
#include "protocols/set4tm/meter/points.h"

#include <cmath>

#include "protocols/set4tm/meter/plan.h"
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

TEST(Set4tmFields, ParseAndPrint) {
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
      {"03 0B 00 0A u8@0", "only reads"},
      {"01 u8@0", "only reads"},
      {"08 7F u8@0", "documented"},
      {"08 23 00 00 00 00 00 00 00 00 00 01 float_le@1", "planner"},
      {"08 00 u8@99999999999999999999", "offset"},
  };
  for (const auto& [read, part] : kWrong) {
    const auto field = ParseField(read);
    ASSERT_FALSE(field) << read;
    EXPECT_NE(field.error().find(part), std::string::npos) << field.error();
  }
}

TEST(Set4tmFields, TypeMustFitTheDecoder) {
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

TEST(Set4tmFields, WorkedExamples) {
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

TEST(Set4tmFields, TroubleIsNeverANumber) {
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
  // An open journal record has no end yet: that is a text, an empty one.
  const Decoded open = Read("09 01 09 time@7", "31 30 15 01 02 09 02 00 00 00 00 00 00 00");
  EXPECT_EQ(std::get<std::string>(open.value), "");
}

TEST(Set4tmFields, WithoutConstantsThereIsNoEnergy) {
  const Decoded decoded = Read("05 00 00 energy@0", "00 00 27 11", Scale{5000, 1, 1, {}, 1});
  EXPECT_FALSE(HasValue(decoded.value));
  EXPECT_EQ(decoded.quality, Quality::bad_configuration);
  EXPECT_FALSE(HasValue(Read("08 11 00 power_be@0", "00 03 E8", Scale{5000, {}, 1, 1, 1}).value));
}

TEST(Set4tmFields, StatusWordFlags) {
  // E-01 is bit 0 of the first byte, E-40 bit 7 of the fifth.
  EXPECT_TRUE(std::get<bool>(Read("08 0A flag@1", "01 00 00 00 00").value));
  EXPECT_FALSE(std::get<bool>(Read("08 0A flag@2", "01 00 00 00 00").value));
  EXPECT_TRUE(std::get<bool>(Read("08 0A flag@9", "00 01 00 00 00").value));
  EXPECT_TRUE(std::get<bool>(Read("08 0A flag@40", "00 00 00 00 80").value));
  EXPECT_FALSE(std::get<bool>(Read("08 0A alarm@0", "00 00 00 00 E0").value));
  EXPECT_TRUE(std::get<bool>(Read("08 0A alarm@0", "00 00 00 00 10").value));
  EXPECT_TRUE(std::get<bool>(Read("08 0A alarm@0", "00 80 00 00 80").value));
}

TEST(Set4tmConstants, VariantGivesMeterConstantAndCoefficients) {
  const double kConstants[] = {5000, 25000, 1250, 6250, 500, 250, 6400};
  for (unsigned code = 0; code < 7; ++code) {
    const Bytes variant = {0x10, static_cast<std::uint8_t>(0x40 | code), 0x80};
    EXPECT_EQ(ParseVariant(variant).meter_constant, kConstants[code]);
  }
  EXPECT_FALSE(ParseVariant(Hex("10 47 80")).meter_constant);
  EXPECT_EQ(ParseVariant(Hex("10 40 80")).power_coefficient, 1);
  EXPECT_EQ(ParseVariant(Hex("14 40 80")).power_coefficient, 2);   // 120-230 V, 5 A
  EXPECT_EQ(ParseVariant(Hex("15 40 80")).power_coefficient, 1);   // 120-230 V, 1 A
  EXPECT_EQ(ParseVariant(Hex("14 40 70")).power_coefficient, 20);  // PSCH-3TM.05M
  EXPECT_EQ(ParseVariant(Hex("14 50 90")).current_coefficient, 10);
  EXPECT_FALSE(ParseVariant(Hex("15 40 10")).power_coefficient);  // .03 1(10) A: not certain
  EXPECT_FALSE(ParseVariant(Hex("14 40 B0")).power_coefficient);  // not documented
  EXPECT_FALSE(ParseVariant(Hex("14 40")).meter_constant);
}

TEST(Set4tmConstants, ARatioOfZeroIsNone) {
  const Scale ratios = ParseRatios(Hex("00 64 00 14 00 00 00 00 00 00"));
  EXPECT_EQ(ratios.voltage_ratio, 100);
  EXPECT_EQ(ratios.current_ratio, 20);
  EXPECT_FALSE(ParseRatios(Hex("00 00 00 14 00 00 00 00 00 00")).voltage_ratio);
}

TEST(Set4tmText, Windows1251) {
  EXPECT_EQ(FromCp1251(Hex("C2 E2 EE E4 20 B9 31 20 20 00 41")), "Ввод №1");
  EXPECT_EQ(FromCp1251(Hex("A8 B8 01 7F")), "Ёё??");
  EXPECT_EQ(ToCp1251("Ввод №1"), Hex("C2 E2 EE E4 20 B9 31"));
  EXPECT_EQ(ToCp1251("Ёё漢"), Hex("A8 B8 3F"));
}

TEST(Set4tmSnapshot, MaskBitsAsTheReferenceLists) {
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

TEST(Set4tmSnapshot, SlotsOfGroupReads) {
  EXPECT_EQ(ParameterAt(Hex("08 1B 02 00"), 0), 0x00);
  EXPECT_EQ(ParameterAt(Hex("08 1B 02 30"), 12), 0x33);
  EXPECT_EQ(ParameterAt(Hex("08 1B 02 10"), 0), 0x11);  // no sum: phase 1 stands in its place
  EXPECT_EQ(ParameterAt(Hex("08 1B 02 14"), 12), 0x17);
  EXPECT_EQ(ParameterAt(Hex("08 1B 00 41"), 0), 0x40);
  EXPECT_EQ(ParameterAt(Hex("08 1B 00 19"), 0), 0x18);
  EXPECT_FALSE(ParameterAt(Hex("08 1B 01 00"), 0));  // latched
  EXPECT_FALSE(ParameterAt(Hex("08 1B 02 00"), 2));
  EXPECT_FALSE(ParameterAt(Hex("08 1B 00 00"), 4));
}

}  // namespace
}  // namespace baudgate::protocols::set4tm
