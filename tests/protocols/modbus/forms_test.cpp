// What registers hold beyond plain integers: bits of them, three and six bytes, decimal digits, a
// power of ten in another register, dates. TI081: the tables of Schneider's IM400 and EM3000
// manuals; its bytes here are put together by them.
// SPDX-License-Identifier: Apache-2.0
#include "protocols/modbus/values.h"
#include "tests/protocols/modbus/support.h"

namespace baudgate::protocols::modbus {
namespace {

using config::Type;

Location LocationOf(const std::string& read, Type type) {
  const auto place = ReadLocation(baudgate::ReadPoint("p", read, type));
  EXPECT_TRUE(place) << (place ? "" : place.error());
  return place ? *place : Location();
}

/// "2500", or the quality where there is no value.
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

TEST(ModbusForms, ThreeAndSixBytes) {
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

TEST(ModbusForms, OneByteOfARegister) {
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

TEST(ModbusForms, WordsSwappedInPairs) {
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

TEST(ModbusForms, DecimalDigitsOfThreeAndFourRegisters) {
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

// ---------------------------------------------------------------- a power of ten beside it

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

TEST(ModbusScale, IsReadInOneRequestAndNeverParted) {
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

/// 8000 stands for no measurement whatever the power of ten.
TEST(ModbusScale, LeavesSentinelsAsTheyAre) {
  const Location place = LocationOf("holding 200 int16 scale(201)", Type::float32);
  const config::Sentinel none{-32768, Quality::bad_sensor_failure};
  EXPECT_EQ(Shown(DecodeBlock(place, Registers{0x8000, 0xFFFE}, {}, {{none}})), "-32768");
}

TEST(ModbusScale, SaysWhereItCanNotBe) {
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

// ---------------------------------------------------------------- dates

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

TEST(ModbusDates, ThatCanNotBeAreBad) {
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

TEST(ModbusDates, ComeBackFromTheTwin) {
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

// ---------------------------------------------------------------- times of functions

TEST(ModbusReplyTimes, AreThoseOfTheirFunctions) {
  const std::vector<std::string> times = {"16=5s", "0x16=2s"};
  Talk talk(ModbusRtuProtocol(), MakeDevice({WritePoint("block", "holding 8", {}, Type::uint32)},
                                            {{"reply_times", times}}));
  EXPECT_EQ(talk.Ask(Poll(0))->reply, Duration::zero());
  EXPECT_EQ(talk.Ask(Write(0, std::uint64_t{1}))->reply, 5s);
}

TEST(ModbusReplyTimes, SayWhatIsWrong) {
  const auto error = [](const std::string& entry) {
    const auto times = ParseReplyTimes({"22=2s", entry});
    return times ? "" : times.error();
  };
  EXPECT_EQ(error("16=5s"), "");
  EXPECT_EQ(error("16"), "reply_times: '16' has no time; write \"FUNCTION=TIME\", as in \"16=5s\"");
  EXPECT_EQ(error("200=5s"),
            "reply_times: '200=5s' has no function code 1...127; write "
            "\"FUNCTION=TIME\", as in \"16=5s\"");
  EXPECT_EQ(error("16=5"),
            "reply_times: '16=5' has no time of 20ms to 1min; write "
            "\"FUNCTION=TIME\", as in \"16=5s\"");
  EXPECT_EQ(error("22=3s"),
            "reply_times: '22=3s' gives its function a second time; write "
            "\"FUNCTION=TIME\", as in \"16=5s\"");
}

}  // namespace
}  // namespace baudgate::protocols::modbus
