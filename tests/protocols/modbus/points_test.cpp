// Tests the grammar of `read` and `write` of points, and register values in every form and order.
// For the form TI081, the test bytes are composed from the tables in the manuals of Schneider's
// IM400 and EM3000.
// SPDX-License-Identifier: Apache-2.0
#include "protocols/modbus/values.h"
#include "tests/protocols/modbus/support.h"

namespace baudgate::protocols::modbus {
namespace {

using config::Type;
using config::WordOrder;

config::Point PointOf(const std::string& read, Type type, std::size_t length = 0) {
  config::Point point = ReadPoint("p", read, type);
  point.text_length = length;
  return point;
}

std::string ErrorOf(const config::Point& point) {
  const Status status = ModbusRtuProtocol().check_point(point);
  return status ? "" : status.error();
}

TEST(ModbusPlace, ParsesTablesAddressesAndTypes) {
  const auto holding = ReadLocation(PointOf("holding 200", Type::uint16));
  ASSERT_TRUE(holding);
  EXPECT_EQ(holding->table, Table::holding);
  EXPECT_EQ(holding->address, 200);
  EXPECT_EQ(holding->count, 1U);
  EXPECT_EQ(ReadLocation(PointOf("input 0x1F4", Type::float32))->address, 500);
  EXPECT_EQ(ReadLocation(PointOf("input 3", Type::float32))->count, 2U);
  EXPECT_EQ(ReadLocation(PointOf("input 3", Type::uint64))->count, 4U);
  EXPECT_EQ(ReadLocation(PointOf("holding 9", Type::string, 15))->count, 8U);
  EXPECT_EQ(ReadLocation(PointOf("coil 0", Type::boolean))->form, Form::flag);
  EXPECT_EQ(ReadLocation(PointOf("discrete 5", Type::boolean))->table, Table::discretes);
  const auto bit = ReadLocation(PointOf("holding 8[b15]", Type::boolean));
  ASSERT_TRUE(bit);
  EXPECT_EQ(bit->form, Form::bit);
  EXPECT_EQ(bit->bit, 15U);
}

TEST(ModbusPlace, ParsesFormsAndOrders) {
  EXPECT_EQ(ReadLocation(PointOf("holding 200 uint16", Type::float32))->count, 1U);
  const auto swapped = ReadLocation(PointOf("holding 200 float32 CDAB", Type::float64));
  ASSERT_TRUE(swapped);
  EXPECT_EQ(swapped->form, Form::float32);
  EXPECT_EQ(swapped->order, WordOrder::cdab);
  EXPECT_EQ(ReadLocation(PointOf("input 2  DCBA", Type::int32))->order, WordOrder::dcba);
  EXPECT_EQ(ReadLocation(PointOf("holding 5 uint16 BADC", Type::uint16))->order, WordOrder::badc);
  const auto text = ReadLocation(PointOf("holding 300 string(16)", Type::string, 24));
  ASSERT_TRUE(text);
  EXPECT_EQ(text->length, 16U);
  EXPECT_EQ(text->count, 8U);
  EXPECT_EQ(ReadLocation(PointOf("holding 500 text(fault)", Type::string, 24))->texts, "fault");
}

TEST(ModbusPlace, ErrorsSuggestValidPlaces) {
  const std::pair<config::Point, const char*> cases[] = {
      {PointOf("40201", Type::uint16), "does not begin with a table"},
      {PointOf("", Type::uint16), "does not begin with a table"},
      {PointOf("register 3", Type::uint16), "coil, discrete, holding or input"},
      {PointOf("holding", Type::uint16), "needs an address"},
      {PointOf("holding 65536", Type::uint16), "needs an address 0...65535"},
      {PointOf("holding 65535", Type::float32), "ends beyond address 65535"},
      {PointOf("holding 5 uint7", Type::uint16), "'uint7'"},
      {PointOf("holding 5 ABCD uint16", Type::uint16), "and then an order"},
      {PointOf("holding 5 uint16 int16", Type::uint16), "'int16'"},
      {PointOf("holding 5 CDAB", Type::uint16), "BADC to swap the bytes"},
      {PointOf("holding 5", Type::boolean), "a bool point needs a bit"},
      {PointOf("holding 5[b3]", Type::uint16), "write type: bool"},
      {PointOf("holding 5[b16]", Type::boolean), "[b0] (lowest) to [b15]"},
      {PointOf("holding 5[3]", Type::boolean), "[b0] (lowest) to [b15]"},
      {PointOf("holding 5[b3] CDAB", Type::boolean), "cannot have a byte order"},
      {PointOf("coil 5[b3]", Type::boolean), "already one bit"},
      {PointOf("coil 5", Type::uint16), "write type: bool"},
      {PointOf("coil 5 uint16", Type::boolean), "'uint16'"},
      {PointOf("holding 5 uint16", Type::string, 8), "write string(n)"},
      {PointOf("holding 5 string(8)", Type::uint16), "write type: string(n)"},
      {PointOf("holding 5 string(0)", Type::string, 8), "string(16)"},
      {PointOf("holding 5 text()", Type::string, 8), "text(NAME)"},
      {WritePoint("p", "input 5"), "only coil and holding"},
      {WritePoint("p", "", "input 5"), "only coil and holding"},
      {WritePoint("p", "discrete 5", {}, Type::boolean), "only coil and holding"},
      {WritePoint("p", "holding 5[b1]", "holding 6", Type::boolean), "a bool point needs a bit"},
      {WritePoint("p", "", "holding"), "needs an address"},
  };
  for (const auto& [point, part] : cases) {
    EXPECT_NE(ErrorOf(point).find(part), std::string::npos)
        << point.read << " / " << point.write << ": '" << ErrorOf(point) << "'";
  }
  config::Point meaning = WritePoint("p", "holding 5 text(fault)", {}, Type::string);
  EXPECT_NE(ErrorOf(meaning).find("cannot be written"), std::string::npos);
}

TEST(ModbusPlace, AWritePlaceInheritsTheFormOfItsReadPlace) {
  const config::Point scaled =
      WritePoint("p", "holding 13 uint16", "holding 14", config::Type::float32);
  const auto write = WriteLocation(scaled);
  ASSERT_TRUE(write);
  EXPECT_EQ(write->address, 14);
  EXPECT_EQ(write->form, Form::uint16);
  EXPECT_EQ(WriteLocation(WritePoint("p", "input 3[b2]", "coil 7", Type::boolean))->form,
            Form::flag);
  EXPECT_EQ(WriteLocation(WritePoint("p", "holding 3", "holding 9 int32"))->form, Form::int32);
  EXPECT_EQ(WriteLocation(WritePoint("p", "", "holding 9", Type::float32))->count, 2U);
}

TEST(ModbusPlace, DevicesNeedTheTextsOfTheirPoints) {
  config::Device device;
  device.points = {PointOf("holding 500 text(fault)", Type::string, 24)};
  device.points[0].name = "fault_text";
  const auto check = [&](std::vector<std::string> texts) {
    device.options = MakeOptions({{"texts", std::move(texts)}});
    const Status status = ModbusRtuProtocol().check_device(device);
    return status ? std::string() : status.error();
  };
  EXPECT_EQ(check({"fault 16=E.OC1 overcurrent", "fault 0x11=E.OC2", "mode 1=auto = on"}), "");
  EXPECT_NE(check({"mode 1=auto"}).find("'texts' has no \"fault CODE=TEXT\""), std::string::npos);
  EXPECT_NE(check({"fault16=x"}).find("NAME CODE=TEXT"), std::string::npos);
  EXPECT_NE(check({"fault 70000=x"}).find("0...65535"), std::string::npos);
  EXPECT_NE(check({"fault 1="}).find("has no text"), std::string::npos);
  EXPECT_NE(check({"fault 1=a", "fault 0x01=b"}).find("repeats a code"), std::string::npos);
}

Value Decoded16(const std::string& read, Type type, const Registers& registers,
                const Settings& settings = {}) {
  const auto place = ReadLocation(PointOf(read, type, 16));
  EXPECT_TRUE(place) << read;
  return Decode(*place, registers, settings).value;
}

TEST(ModbusValues, DecodesNumbersInEveryForm) {
  EXPECT_EQ(Decoded16("holding 0 int16", Type::int32, {0xFFFE}), Value(std::int64_t{-2}));
  EXPECT_EQ(Decoded16("holding 0 uint16", Type::int32, {0xFFFE}), Value(std::uint64_t{65534}));
  EXPECT_EQ(Decoded16("holding 0", Type::int32, {0xFFFF, 0xFFFE}), Value(std::int64_t{-2}));
  EXPECT_EQ(Decoded16("holding 0", Type::uint32, {0x0001, 0x0002}), Value(std::uint64_t{65538}));
  EXPECT_EQ(Decoded16("holding 0", Type::uint64, {0xFFFF, 0xFFFF, 0xFFFF, 0xFFFF}),
            Value(std::uint64_t{0xFFFF'FFFF'FFFF'FFFF}));
  EXPECT_EQ(Decoded16("holding 0", Type::int64, {0xFFFF, 0xFFFF, 0xFFFF, 0xFFFF}),
            Value(std::int64_t{-1}));
  EXPECT_EQ(Decoded16("holding 0", Type::float32, {0x4366, 0x8000}), Value(230.5));
  EXPECT_EQ(Decoded16("holding 0", Type::float64, {0x406C, 0xD000, 0, 0}), Value(230.5));
  EXPECT_EQ(Decoded16("holding 0 bcd16", Type::uint16, {0x0042}), Value(std::uint64_t{42}));
  EXPECT_EQ(Decoded16("holding 0 bcd32", Type::uint32, {0x1234, 0x5678}),
            Value(std::uint64_t{12345678}));
  EXPECT_EQ(Decoded16("holding 0[b3]", Type::boolean, {0x0008}), Value(true));
  EXPECT_EQ(Decoded16("holding 0[b3]", Type::boolean, {0xFFF7}), Value(false));
}

TEST(ModbusValues, DecodesEveryByteOrder) {
  const auto value = [](const char* order, const Registers& registers) {
    return Decoded16(std::string("holding 0 ") + order, Type::float32, registers);
  };
  EXPECT_EQ(value("ABCD", {0x4366, 0x8000}), Value(230.5));
  EXPECT_EQ(value("CDAB", {0x8000, 0x4366}), Value(230.5));
  EXPECT_EQ(value("BADC", {0x6643, 0x0080}), Value(230.5));
  EXPECT_EQ(value("DCBA", {0x0080, 0x6643}), Value(230.5));
  Settings device;
  device.order = WordOrder::cdab;
  EXPECT_EQ(Decoded16("holding 0", Type::float32, {0x8000, 0x4366}, device), Value(230.5));
  EXPECT_EQ(Decoded16("holding 0", Type::uint64, {0x0004, 0x0003, 0x0002, 0x0001}, device),
            Value(std::uint64_t{0x0001'0002'0003'0004}));
  EXPECT_EQ(Decoded16("holding 0 ABCD", Type::float32, {0x4366, 0x8000}, device), Value(230.5))
      << "the point's own";
  device.order = WordOrder::dcba;
  EXPECT_EQ(Decoded16("holding 0", Type::uint16, {0x1234}, device), Value(std::uint64_t{0x1234}))
      << "one register is high byte first";
  EXPECT_EQ(Decoded16("holding 0 BADC", Type::uint16, {0x1234}), Value(std::uint64_t{0x3412}));
  EXPECT_EQ(Decoded16("holding 0", Type::string, {0x4142, 0, 0, 0, 0, 0, 0, 0}, device),
            Value(std::string("AB")));
}

TEST(ModbusValues, StringsEndAtTheirPadding) {
  const auto text = [](const Registers& registers) {
    return Decoded16("holding 0 string(5)", Type::string, registers);
  };
  EXPECT_EQ(text({0x4142, 0x4344, 0x4546}), Value(std::string("ABCDE")));
  EXPECT_EQ(text({0x4142, 0x2020, 0x2020}), Value(std::string("AB")));
  EXPECT_EQ(text({0x4142, 0x0043, 0x4400}), Value(std::string("AB")));
  EXPECT_EQ(text({0x2020, 0x2020, 0x2020}), Value(std::string()));
}

TEST(ModbusValues, AnInvalidNumberHasABadQuality) {
  const auto quality = [](const std::string& read, Type type, const Registers& registers) {
    const auto place = ReadLocation(PointOf(read, type));
    const Decoded decoded = Decode(*place, registers, {});
    EXPECT_FALSE(HasValue(decoded.value)) << read;
    return decoded.quality;
  };
  EXPECT_EQ(quality("holding 0", Type::float32, {0x7FC0, 0}), Quality::bad_sensor_failure);
  EXPECT_EQ(quality("holding 0", Type::float32, {0x7F80, 0}), Quality::bad_sensor_failure);
  EXPECT_EQ(quality("holding 0 bcd16", Type::uint16, {0x00A0}), Quality::bad_device_failure);
}

TEST(ModbusValues, ACodeIsShownAsItsText) {
  Settings settings;
  settings.texts["fault"] = {{0, "none"}, {49, "E.THM"}};
  const auto text = [&](std::uint16_t code) {
    return Decoded16("holding 500 text(fault)", Type::string, {code}, settings);
  };
  EXPECT_EQ(text(49), Value(std::string("E.THM")));
  EXPECT_EQ(text(0), Value(std::string("none")));
  EXPECT_EQ(text(7), Value(std::string("code 7")));
}

TEST(ModbusValues, EncodingIsTheInverse) {
  const std::pair<config::Point, Value> cases[] = {
      {PointOf("holding 0 int16", Type::int32), std::int64_t{-32768}},
      {PointOf("holding 0", Type::uint16), std::uint64_t{65535}},
      {PointOf("holding 0 DCBA", Type::int32), std::int64_t{-123456}},
      {PointOf("holding 0 CDAB", Type::uint64), std::uint64_t{0xFEDC'BA98'7654'3210}},
      {PointOf("holding 0 BADC", Type::float32), 230.5},
      {PointOf("holding 0", Type::float64), -1e-9},
      {PointOf("holding 0 bcd32", Type::uint32), std::uint64_t{99999999}},
      {PointOf("holding 0", Type::string, 5), std::string("ABCDE")},
  };
  for (const auto& [point, value] : cases) {
    const auto place = ReadLocation(point);
    ASSERT_TRUE(place);
    const auto registers = Encode(*place, value, {});
    ASSERT_TRUE(registers) << point.read << registers.error();
    EXPECT_EQ(Decode(*place, *registers, {}).value, value) << point.read;
  }
}

TEST(ModbusValues, AValueThatDoesNotFitIsRefused) {
  const auto refused = [](const config::Point& point, const Value& value) {
    return !Encode(*ReadLocation(point), value, {}).ok();
  };
  EXPECT_TRUE(refused(PointOf("holding 0", Type::uint16), std::int64_t{-1}));
  EXPECT_TRUE(refused(PointOf("holding 0", Type::uint16), 65536.0));
  EXPECT_TRUE(refused(PointOf("holding 0", Type::uint16), 65535.6));
  EXPECT_FALSE(refused(PointOf("holding 0", Type::uint16), 2499.9999999));
  EXPECT_TRUE(refused(PointOf("holding 0", Type::int16), std::uint64_t{32768}));
  EXPECT_TRUE(refused(PointOf("holding 0 int16", Type::float32), -32769.0));
  EXPECT_TRUE(refused(PointOf("holding 0 bcd16", Type::uint16), std::uint64_t{10000}));
  EXPECT_TRUE(refused(PointOf("holding 0 float32", Type::float64), 1e39));
  EXPECT_TRUE(refused(PointOf("holding 0", Type::int64), 1e19));
  EXPECT_TRUE(refused(PointOf("holding 0", Type::float32), std::string("x")));
  EXPECT_TRUE(refused(PointOf("holding 0", Type::float32), Value{}));
  EXPECT_TRUE(refused(PointOf("holding 0", Type::string, 3), std::string("ABCD")));
}

Location LocationOf(const std::string& read, Type type) {
  const auto place = ReadLocation(baudgate::ReadPoint("p", read, type));
  EXPECT_TRUE(place) << (place ? "" : place.error());
  return place ? *place : Location();
}

std::string Shown(const Decoded& decoded) {
  const std::string quality = std::to_string(decoded.quality.word());
  if (!HasValue(decoded.value)) return "bad " + quality;
  return ToText(decoded.value) + (IsGood(decoded.quality) ? "" : " " + quality);
}

std::string Read(const std::string& read, Type type, const Registers& words) {
  return Shown(DecodeBlock(LocationOf(read, type), words, {}, {}));
}

std::string ErrorOf(const std::string& read, Type type) {
  const auto place = ReadLocation(baudgate::ReadPoint("p", read, type));
  return place ? "" : place.error();
}

TEST(ModbusForms, BitsOfARegisterAreANumber) {
  EXPECT_EQ(Read("holding 8[b3-b5]", Type::uint16, {0xFFD7}), "2");
  EXPECT_EQ(Read("holding 8[b0-b15]", Type::uint16, {0xFFD7}), "65495");
  EXPECT_EQ(Read("input 8[b15-b15]", Type::uint16, {0x8000}), "1");
  for (const char* const wrong : {"holding 8[b5-b3]", "holding 8[b3-b16]", "holding 8[3-5]",
                                  "coil 8[b3-b5]", "holding 8[b3-5]", "holding 8[b3-b5] uint16"}) {
    EXPECT_NE(ErrorOf(wrong, Type::uint16), "") << wrong;
  }
  EXPECT_NE(ErrorOf("holding 8[b3-b5]", Type::boolean), "");
}

TEST(ModbusForms, BitsAreWrittenByMask) {
  Talk talk(ModbusRtuProtocol(), MakeDevice({WritePoint("mode", "holding 8[b3-b5]")}));
  EXPECT_EQ(Asked(talk, Write(0, std::uint64_t{5})), "16 00 08 FF C7 00 28");
  EXPECT_EQ(Asked(talk, Write(0, std::uint64_t{8})), "error: point mode: 8 is not 0...7");
  EXPECT_EQ(Asked(talk, Write(0, 1.5)), "error: point mode: 1.5 is not 0...7");
}

TEST(ModbusForms, ThreeAndSixBytesAreNumbers) {
  EXPECT_EQ(Read("holding 8 uint24", Type::uint32, {0xAB12, 0x3456}), "1193046");
  EXPECT_EQ(Read("holding 8 int24", Type::int32, {0x00FF, 0xFFFE}), "-2");
  EXPECT_EQ(Read("holding 8 int24", Type::int32, {0x007F, 0xFFFF}), "8388607");
  EXPECT_EQ(Read("holding 8 uint24 CDAB", Type::uint32, {0x3456, 0x0012}), "1193046");
  EXPECT_EQ(Read("holding 8 uint48", Type::uint64, {0x0001, 0x0000, 0x0002}), "4294967298");
  EXPECT_EQ(Read("holding 8 int48", Type::int64, {0xFFFF, 0xFFFF, 0xFFFE}), "-2");
  EXPECT_EQ(Read("holding 8 uint48 CDAB", Type::uint64, {2, 0, 1}), "4294967298");
  EXPECT_EQ(Encode(LocationOf("holding 8 int48", Type::int64), Value(std::int64_t{-2}), {}).value(),
            (Registers{0xFFFF, 0xFFFF, 0xFFFE}));
  EXPECT_FALSE(
      Encode(LocationOf("holding 8 uint48", Type::uint64), Value(std::uint64_t{1} << 48U), {}));
  EXPECT_NE(CheckPoint(baudgate::WritePoint("p", "holding 8 uint24", {}, Type::uint32)).error(), "")
      << "the fourth byte is not its own";
}

TEST(ModbusForms, AByteOfARegisterIsANumber) {
  EXPECT_EQ(Read("holding 8 uint8", Type::uint16, {0xAB12}), "18");
  EXPECT_EQ(Read("holding 8 uint8 BADC", Type::uint16, {0xAB12}), "171");
  EXPECT_EQ(Read("holding 8 int8", Type::int16, {0x7FFE}), "-2");
  EXPECT_EQ(Read("holding 8 int8 BADC", Type::int16, {0x80FE}), "-128");
  EXPECT_EQ(Encode(LocationOf("holding 8 int8", Type::int16), Value(std::int64_t{-2}), {}).value(),
            Registers{0x00FE});
  EXPECT_FALSE(Encode(LocationOf("holding 8 uint8", Type::uint16), Value(std::uint64_t{256}), {}));
  EXPECT_NE(CheckPoint(baudgate::WritePoint("p", "holding 8 int8", {}, Type::int16)).error(), "")
      << "the other byte is not its own";
}

TEST(ModbusForms, WordsMayBeSwappedInPairs) {
  EXPECT_EQ(Read("holding 8 uint64 CDABGHEF", Type::uint64, {0x0002, 0x0001, 0x0004, 0x0003}),
            "281483566841860");
  const Location place = LocationOf("holding 8 float64 CDABGHEF", Type::float64);
  EXPECT_EQ(Encode(place, Value(1.5), {}).value(), (Registers{0x0000, 0x3FF8, 0x0000, 0x0000}));
  for (const char* wrong :
       {"holding 8 float32 CDABGHEF", "holding 8 uint48 CDABGHEF", "holding 8 uint16 CDABGHEF"}) {
    EXPECT_NE(ErrorOf(wrong, Type::uint32), "") << wrong;
  }
  Settings settings;
  settings.order = config::WordOrder::cdabghef;
  const std::vector<std::uint16_t> two = {0x3456, 0x0012};
  EXPECT_EQ(ToText(Decode(LocationOf("holding 8", Type::uint32), two, settings).value), "1193046")
      << "of a device: numbers of two registers as CDAB";
}

TEST(ModbusForms, DecimalDigitsMayUseThreeOrFourRegisters) {
  EXPECT_EQ(Read("holding 8 bcd48", Type::uint64, {0x1234, 0x5678, 0x9012}), "123456789012");
  EXPECT_EQ(Read("holding 8 bcd64", Type::uint64, {0x1234, 0x5678, 0x9012, 0x3456}),
            "1234567890123456");
  EXPECT_EQ(Read("holding 8 bcd64", Type::uint64, {0x1234, 0x567A, 0x9012, 0x3456}), "bad 12");
  const auto encoded = Encode(LocationOf("holding 8 bcd64", Type::uint64),
                              Value(std::uint64_t{1234567890123456}), {});
  ASSERT_TRUE(encoded);
  EXPECT_EQ(*encoded, (Registers{0x1234, 0x5678, 0x9012, 0x3456}));
  EXPECT_FALSE(Encode(LocationOf("holding 8 bcd64", Type::uint64),
                      Value(std::uint64_t{10'000'000'000'000'000}), {}));
}

TEST(ModbusScale, MultipliesByThePowerOfTenInTheSameReply) {
  const std::string read = "holding 200 int16 scale(203)";
  EXPECT_EQ(Read(read, Type::float64, {2345, 0, 0, 0xFFFE}), "23.45");
  EXPECT_EQ(Read(read, Type::float64, {0xFFFF, 0, 0, 2}), "-100");
  EXPECT_EQ(Read(read, Type::float64, {2345, 0, 0, 0}), "2345");
  EXPECT_EQ(Read("holding 200 uint32 scale(198)", Type::float64, {0xFFFF, 7, 1, 0}), "6553.6");
  EXPECT_EQ(Read("holding 200[b0-b7] scale(201)", Type::float64, {0xAA05, 1}), "50");
  for (const std::uint16_t no_power : Registers{11, 0x8000, 0xFFF5}) {
    EXPECT_EQ(Read(read, Type::float64, {2345, 0, 0, no_power}), "bad 12") << no_power;
  }
}

TEST(ModbusScale, IsReadTogetherWithItsPoint) {
  Talk talk(ModbusRtuProtocol(),
            MakeDevice({ReadPoint("a", "holding 200 int16 scale(220)", Type::float32),
                        ReadPoint("b", "holding 205")},
                       {{"hole", std::int64_t{0}}}));
  ASSERT_EQ(talk->Queries().size(), 1U);
  EXPECT_EQ(Asked(talk, Poll(0)), "03 00 C8 00 15");
  Exchange(talk, Poll(0), "83 02");
  for (std::size_t query = 0; query < talk->Queries().size(); ++query) {
    const std::string asked = Asked(talk, Poll(query));
    EXPECT_TRUE(asked == "03 00 C8 00 15" || asked == "03 00 CD 00 01") << asked;
  }
}

TEST(ModbusScale, DoesNotScaleSentinels) {
  const Location place = LocationOf("holding 200 int16 scale(201)", Type::float32);
  const config::Sentinel none{-32768, Quality::bad_sensor_failure};
  EXPECT_EQ(Shown(DecodeBlock(place, Registers{0x8000, 0xFFFE}, {}, {{none}})), "-32768");
}

TEST(ModbusScale, RefusesInvalidPlaces) {
  EXPECT_NE(ErrorOf("holding 200 int16 scale(400)", Type::float32).find("one request"),
            std::string::npos);
  EXPECT_NE(ErrorOf("holding 200 int16 scale(203)", Type::int16).find("float32 or float64"),
            std::string::npos);
  EXPECT_NE(ErrorOf("holding 200 float32 scale(203)", Type::float32).find("whole numbers"),
            std::string::npos);
  EXPECT_NE(ErrorOf("holding 200 int16 scale(x)", Type::float32), "");
  EXPECT_NE(ErrorOf("coil 200 scale(203)", Type::boolean), "");
  const Status status =
      CheckPoint(baudgate::WritePoint("p", "holding 200 int16 scale(203)", {}, Type::float32));
  ASSERT_FALSE(status);
  EXPECT_NE(status.error().find("cannot be written"), std::string::npos) << status.error();
}

TEST(ModbusDates, OfMetersAreText) {
  const Type text = Type::string;
  EXPECT_EQ(Read("holding 9 date(ti081)", text, {26, 0x0B37, 0x042D, 30'500}),
            "2026-11-23 04:45:30");
  EXPECT_EQ(Read("holding 9 date(ti081)", text, {26, 0x0B37, 0x84AD, 30'500}),
            "2026-11-23 04:45:30 64")
      << "summer time, and not synchronised";
  EXPECT_EQ(Read("holding 9 date(unix)", text, {0x6923, 0x6A2C}), "2025-11-23 20:10:20");
  EXPECT_EQ(Read("holding 9 date(unix) CDAB", text, {0x6A2C, 0x6923}), "2025-11-23 20:10:20");
  EXPECT_EQ(Read("holding 9 date(registers)", text, {2026, 2, 28, 23, 59, 59}),
            "2026-02-28 23:59:59");
  EXPECT_EQ(Read("holding 9 date(bytes)", text, {0x1A0B, 0x1704, 0x2D1E}), "2026-11-23 04:45:30");
  EXPECT_EQ(Read("holding 9 date(bcd)", text, {0x2611, 0x2304, 0x4530}), "2026-11-23 04:45:30");
}

TEST(ModbusDates, ImpossibleDatesAreBad) {
  const Type text = Type::string;
  EXPECT_EQ(Read("holding 9 date(ti081)", text, {0xFFFF, 0xFFFF, 0xFFFF, 0xFFFF}), "bad 12");
  EXPECT_EQ(Read("holding 9 date(ti081)", text, {0, 0, 0, 0}), "bad 12");
  EXPECT_EQ(Read("holding 9 date(registers)", text, {2026, 2, 29, 0, 0, 0}), "bad 12");
  EXPECT_EQ(Read("holding 9 date(bytes)", text, {0x1A0B, 0x1718, 0x0000}), "bad 12") << "hour 24";
  EXPECT_EQ(Read("holding 9 date(bcd)", text, {0x2A11, 0x2304, 0x4530}), "bad 12");
  EXPECT_NE(ErrorOf("holding 9 date(moon)", text), "");
  EXPECT_NE(ErrorOf("holding 9 date(ti081) CDAB", text), "");
  EXPECT_NE(ErrorOf("holding 9 date(unix)", Type::uint32), "");
}

TEST(ModbusDates, AreReadBackFromTheTwin) {
  std::vector<config::Point> points;
  for (const char* const form : {"unix", "ti081", "registers", "bytes", "bcd"}) {
    points.push_back(
        ReadPoint(form, "holding " + std::to_string(10 * points.size()) + " date(" + form + ")",
                  Type::string));
  }
  points.push_back(ReadPoint("scaled", "holding 60 int16 scale(61)", Type::float64));
  points.push_back(ReadPoint("bits", "holding 70[b4-b7]"));
  points.push_back(ReadPoint("bit", "holding 70[b3]", Type::boolean));
  const config::Device device = MakeDevice(points, {{"missing", std::string("zero")}});
  FixedValues values;
  values.fallback = std::string("2026-11-23 04:45:30");
  values.values[5] = -23.4;
  values.values[6] = std::uint64_t{11};
  values.values[7] = true;
  ModbusTwin twin(Framing::rtu, device, values);
  Talk talk(ModbusRtuProtocol(), device);
  std::size_t seen = 0;
  for (std::size_t query = 0; query < talk->Queries().size(); ++query) {
    for (const Reading& reading : talk.Run(Poll(query), twin).readings) {
      ++seen;
      EXPECT_EQ(ToText(reading.value), ToText(values.Get(reading.point, {})))
          << device.points[reading.point].name;
    }
  }
  EXPECT_EQ(seen, points.size());
}

TEST(ModbusReplyTimes, ApplyToTheirFunctions) {
  const std::vector<std::string> times = {"16=5s", "0x16=2s"};
  Talk talk(ModbusRtuProtocol(), MakeDevice({WritePoint("block", "holding 8", {}, Type::uint32)},
                                            {{"reply_times", times}}));
  EXPECT_EQ(talk.Ask(Poll(0))->reply, Duration::zero());
  EXPECT_EQ(talk.Ask(Write(0, std::uint64_t{1}))->reply, 5s);
}

TEST(ModbusReplyTimes, ReportErrors) {
  const auto error = [](const std::string& entry) {
    const auto times = ParseReplyTimes({"22=2s", entry});
    return times ? "" : times.error();
  };
  EXPECT_EQ(error("16=5s"), "");
  EXPECT_EQ(error("16"), "reply_times: '16' has no time; write \"FUNCTION=TIME\", as in \"16=5s\"");
  EXPECT_EQ(error("200=5s"),
            "reply_times: '200=5s' has no function code 1...127; write "
            "\"FUNCTION=TIME\", as in \"16=5s\"");
  EXPECT_EQ(
      error("16=5"),
      "reply_times: '16=5' needs a time of 20ms to 1min; write \"FUNCTION=TIME\", as in \"16=5s\"");
  EXPECT_EQ(error("22=3s"),
            "reply_times: '22=3s' repeats a function; write \"FUNCTION=TIME\", as in \"16=5s\"");
}

}  // namespace
}  // namespace baudgate::protocols::modbus
