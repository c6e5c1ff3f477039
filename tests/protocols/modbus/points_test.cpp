// The `read` and `write` grammar of points, and the values of registers in every form and order.
// SPDX-License-Identifier: Apache-2.0
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

TEST(ModbusPlace, TablesAddressesAndTypes) {
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

TEST(ModbusPlace, FormsAndOrders) {
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

TEST(ModbusPlace, ErrorsSayWhatWouldBeRight) {
  const std::pair<config::Point, const char*> cases[] = {
      {PointOf("40201", Type::uint16), "names no table"},
      {PointOf("", Type::uint16), "names no table"},
      {PointOf("register 3", Type::uint16), "coil, discrete, holding or input"},
      {PointOf("holding", Type::uint16), "has no address"},
      {PointOf("holding 65536", Type::uint16), "has no address 0...65535"},
      {PointOf("holding 65535", Type::float32), "ends beyond address 65535"},
      {PointOf("holding 5 uint7", Type::uint16), "'uint7'"},
      {PointOf("holding 5 ABCD uint16", Type::uint16), "and then an order"},
      {PointOf("holding 5 uint16 int16", Type::uint16), "'int16'"},
      {PointOf("holding 5 CDAB", Type::uint16), "BADC to swap them"},
      {PointOf("holding 5", Type::boolean), "a bool needs one"},
      {PointOf("holding 5[b3]", Type::uint16), "its type is bool"},
      {PointOf("holding 5[b16]", Type::boolean), "[b0] (lowest) to [b15]"},
      {PointOf("holding 5[3]", Type::boolean), "[b0] (lowest) to [b15]"},
      {PointOf("holding 5[b3] CDAB", Type::boolean), "no order"},
      {PointOf("coil 5[b3]", Type::boolean), "one bit already"},
      {PointOf("coil 5", Type::uint16), "its type is bool"},
      {PointOf("coil 5 uint16", Type::boolean), "'uint16'"},
      {PointOf("holding 5 uint16", Type::string, 8), "write string(n)"},
      {PointOf("holding 5 string(8)", Type::uint16), "its type is string(n)"},
      {PointOf("holding 5 string(0)", Type::string, 8), "string(16)"},
      {PointOf("holding 5 text()", Type::string, 8), "text(NAME)"},
      {WritePoint("p", "input 5"), "only coil and holding"},
      {WritePoint("p", "", "input 5"), "only coil and holding"},
      {WritePoint("p", "discrete 5", {}, Type::boolean), "only coil and holding"},
      {WritePoint("p", "holding 5[b1]", "holding 6", Type::boolean), "a bool needs one"},
      {WritePoint("p", "", "holding"), "has no address"},
  };
  for (const auto& [point, part] : cases) {
    EXPECT_NE(ErrorOf(point).find(part), std::string::npos)
        << point.read << " / " << point.write << ": '" << ErrorOf(point) << "'";
  }
  config::Point meaning = WritePoint("p", "holding 5 text(fault)", {}, Type::string);
  EXPECT_NE(ErrorOf(meaning).find("cannot be written"), std::string::npos);
}

TEST(ModbusPlace, AWritePlaceHasTheFormOfTheRead) {
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
  EXPECT_NE(check({"fault 1=a", "fault 0x01=b"}).find("second time"), std::string::npos);
}

// ---------------------------------------------------------------- values

Value Decoded16(const std::string& read, Type type, const Registers& registers,
                const Settings& settings = {}) {
  const auto place = ReadLocation(PointOf(read, type, 16));
  EXPECT_TRUE(place) << read;
  return Decode(*place, registers, settings).value;
}

TEST(ModbusValues, NumbersInEveryForm) {
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

TEST(ModbusValues, OrdersOfBytes) {
  // 230.5 = 43 66 80 00
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

TEST(ModbusValues, WhatIsNoNumberHasAQuality) {
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

TEST(ModbusValues, ACodeHasItsMeaning) {
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

TEST(ModbusValues, WhatDoesNotFitIsRefused) {
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

}  // namespace
}  // namespace baudgate::protocols::modbus
