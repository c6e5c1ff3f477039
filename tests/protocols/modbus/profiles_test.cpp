// Tests the shipped Modbus profiles: they load for RTU and ASCII, a simulated device answers every
// point, and every writable point is written.
// SPDX-License-Identifier: Apache-2.0
#include <algorithm>

#include "config/loader.h"
#include "tests/protocols/modbus/support.h"

namespace baudgate::protocols::modbus {
namespace {

config::Catalog Installed() {
  config::Catalog catalog;
  catalog.protocols["modbus_rtu"] = &ModbusRtuProtocol();
  catalog.protocols["modbus_ascii"] = &ModbusAsciiProtocol();
  catalog.protocols["modbus_tcp"] = &ModbusTcpProtocol();
  catalog.profile_dirs = {"config/profiles"};
  return catalog;
}

config::Loaded Load(const std::string& profile, Framing framing, const std::string& more = {}) {
  const std::string text =
      "lines:\n  - name: bus\n    port: " +
      std::string(framing == Framing::tcp ? "tcp://10.0.0.5:502" : "/dev/null") +
      "\n    protocol: " + std::string(ProtocolOf(framing).name) +
      "\n    devices:\n      - { name: slave, address: 20, unit: 1, profile: " + profile + more +
      " }\n";
  return config::LoadText(text, "test.yaml", Installed());
}

Value Simulated(const config::Point& point) {
  if (!point.simulate) return {};
  if (point.simulate->text && point.type == config::Type::string) return *point.simulate->text;
  if (point.type == config::Type::boolean) return point.simulate->low != 0;
  return point.simulate->low;
}

class ModbusProfile : public ::testing::TestWithParam<std::tuple<std::string, Framing>> {};

TEST_P(ModbusProfile, EveryPointIsGoodAgainstTheTwin) {
  const auto& [profile, framing] = GetParam();
  const config::Loaded loaded = Load(profile, framing);
  for (const auto& problem : loaded.problems) ADD_FAILURE() << config::ToString(problem);
  ASSERT_TRUE(loaded.ok());
  const config::Device& device = loaded.config.lines.at(0).devices.at(0);
  FixedValues values;
  for (std::size_t i = 0; i < device.points.size(); ++i) {
    values.values[i] = Simulated(device.points[i]);
    EXPECT_TRUE(HasValue(values.values[i])) << device.points[i].name << " has no simulate";
    EXPECT_FALSE(device.points[i].description->empty()) << device.points[i].name;
  }
  ModbusTwin twin(framing, device, values);
  Talk talk(ProtocolOf(framing), device);
  std::vector<bool> seen(device.points.size(), false);
  for (std::size_t query = 0; query < talk->Queries().size(); ++query) {
    const Answer answer = talk.Run(Poll(query), twin);
    EXPECT_EQ(answer.outcome, Outcome::ok) << answer.reason;
    for (const Reading& reading : answer.readings) {
      const config::Point& point = device.points[reading.point];
      seen[reading.point] = true;
      EXPECT_EQ(reading.quality, Quality::good) << point.name;
      const Value& truth = values.values.at(reading.point);
      if (point.type == config::Type::string) {
        EXPECT_EQ(reading.value, truth) << point.name;
      } else {
        EXPECT_NEAR(ToDouble(reading.value), ToDouble(truth), 0.01) << point.name;
      }
    }
  }
  for (std::size_t i = 0; i < device.points.size(); ++i) {
    const bool read = device.points[i].access != config::Access::write;
    EXPECT_EQ(seen[i], read) << device.points[i].name;
    if (device.points[i].access == config::Access::read) continue;
    const Answer answer = talk.Run(Write(i, 1.0), twin);
    EXPECT_EQ(answer.outcome, Outcome::ok) << device.points[i].name << ": " << answer.reason;
    EXPECT_EQ(ToDouble(values.values[i]), 1.0);
  }
}

std::vector<std::string> Names() {
  std::vector<std::string> names;
  for (const auto& file : Installed().Profiles("modbus_rtu")) names.push_back(file.name);
  return names;
}

std::string CaseName(const std::tuple<std::string, Framing>& which) {
  constexpr const char* kNames[] = {"Rtu", "Ascii", "Tcp"};
  std::string name = std::get<0>(which);
  std::erase(name, '-');
  return name + kNames[static_cast<int>(std::get<1>(which))];
}

INSTANTIATE_TEST_SUITE_P(Shipped, ModbusProfile,
                         ::testing::Combine(::testing::ValuesIn(Names()),
                                            ::testing::Values(Framing::rtu, Framing::ascii,
                                                              Framing::tcp)),
                         [](const auto& info) { return CaseName(info.param); });

TEST(ModbusProfiles, TheInverterIsReadInFewRequests) {
  const config::Loaded loaded = Load("mitsubishi-fr-d700", Framing::rtu);
  ASSERT_TRUE(loaded.ok());
  const config::Device& device = loaded.config.lines[0].devices[0];
  Talk talk(ModbusRtuProtocol(), device);
  std::vector<std::string> fast;
  for (std::size_t i = 0; i < talk->Queries().size(); ++i) {
    if (talk->Queries()[i].group == config::Group::fast) fast.push_back(Asked(talk, Poll(i)));
  }
  EXPECT_EQ(fast, (std::vector<std::string>{"03 00 08 00 06", "03 00 C8 00 02", "03 01 F4 00 01"}));
  const auto index = [&](std::string_view name) {
    const auto found = std::ranges::find(device.points, name, &config::Point::name);
    return static_cast<std::size_t>(found - device.points.begin());
  };
  const Answer fault = talk->Interpret(Hex("14 03 01 F4 00 01 C6 C1"), Hex("14 03 02 00 31 74 53"));
  ASSERT_EQ(fault.readings.size(), 2U);
  EXPECT_EQ(fault.readings[0].value, Value(std::uint64_t{49}));
  EXPECT_EQ(fault.readings[1].point, index("fault_text"));
  EXPECT_EQ(fault.readings[1].value, Value(std::string("E.THM motor overload, thermal")));
  const auto writing = [&](std::string_view name) { return device.points[index(name)].writing; };
  EXPECT_EQ(writing("status_word").max, 4) << "stop, forward, reverse, and nothing else";
  EXPECT_EQ(writing("status_word").step, 2);
  EXPECT_EQ(writing("fault_code").max, 0) << "it is only cleared";
  EXPECT_EQ(*writing("set_frequency").min_point, "pr2_minimum_frequency");
  EXPECT_EQ(*writing("set_frequency").max_point, "pr1_maximum_frequency");
  EXPECT_EQ(ToHex(talk->Ask(Write(index("set_frequency"), 2500.0), Instant{})->bytes),
            "14 06 00 0D 09 C4 1D 0F");
  EXPECT_EQ(ToHex(talk->Ask(Write(index("status_word"), std::uint64_t{2}), Instant{})->bytes),
            "14 06 00 08 00 02 8B 0C");
  EXPECT_EQ(ToHex(talk->Ask(Write(index("status_word"), std::uint64_t{0}), Instant{})->bytes),
            "14 06 00 08 00 00 0A CD");
  EXPECT_EQ(ToHex(talk->Ask(Write(index("fault_code"), std::uint64_t{0}), Instant{})->bytes),
            "14 06 01 F4 00 00 CB 01");
  const Answer status =
      talk->Interpret(Hex("14 03 00 08 00 01 07 0D"), Hex("14 03 02 00 4B F5 B0"));
  std::vector<std::string> set;
  for (const Reading& reading : status.readings) {
    if (reading.value == Value(true)) set.push_back(device.points[reading.point].name);
  }
  EXPECT_EQ(set, (std::vector<std::string>{"running", "forward", "up_to_frequency",
                                           "frequency_detected"}));
}

TEST(ModbusProfiles, OptionsAdaptTheMeter) {
  const config::Loaded loaded = Load("generic-meter", Framing::rtu, ", order: CDAB, hole: 0");
  ASSERT_TRUE(loaded.ok());
  const config::Device& device = loaded.config.lines[0].devices[0];
  Talk talk(ModbusRtuProtocol(), device);
  const Answer answer = talk->Interpret(Wrap(Framing::rtu, 20, Hex("0400000002")),
                                        Wrap(Framing::rtu, 20, Hex("0404 8000 4366")));
  ASSERT_EQ(answer.readings.size(), 1U);
  EXPECT_EQ(answer.readings[0].value, Value(230.5));
  for (std::size_t i = 0; i < talk->Queries().size(); ++i) {
    const auto request = talk->Ask(Poll(i), Instant{});
    EXPECT_LE(ByteReader(request->bytes).U16Be(4).value(), 80U);
  }
}

TEST(ModbusProfiles, AsciiUsesTheProfilesOfRtu) {
  const config::Catalog catalog = Installed();
  EXPECT_TRUE(catalog.FindProfile("modbus_ascii", "generic-meter").has_value());
  EXPECT_FALSE(catalog.FindProfile("modbus_ascii", "spaj140c").has_value());
  EXPECT_EQ(catalog.Profiles("modbus_ascii").size(), catalog.Profiles("modbus_rtu").size());
  const config::Loaded wrong = Load("generic-metre", Framing::ascii);
  ASSERT_FALSE(wrong.ok());
  EXPECT_NE(wrong.problems[0].message.find("generic-meter"), std::string::npos);
  EXPECT_NE(wrong.problems[0].message.find("modbus_rtu"), std::string::npos) << "where was looked";
}

using config::Type;

class ModbusTwinTest : public ::testing::Test {
 protected:
  void Make(const std::string& missing = "exception") {
    device_ = MakeDevice(
        {ReadPoint("frequency", "holding 200"), WritePoint("set", "holding 202"),
         WritePoint("limit", "holding 204", {}, Type::uint32),
         ReadPoint("running", "holding 8[b0]", Type::boolean),
         ReadPoint("fault", "holding 8[b15]", Type::boolean), WritePoint("run", "", "holding 8"),
         WritePoint("relay_0", "coil 0", {}, Type::boolean),
         WritePoint("relay_1", "coil 1", {}, Type::boolean),
         ReadPoint("door", "discrete 9", Type::boolean),
         ReadPoint("voltage", "input 0", Type::float32), WritePoint("mode", "holding 300"),
         ReadPoint("mode_on", "holding 300[b2]", Type::boolean)},
        {{"missing", missing}});
    values_.values = {{0, std::uint64_t{2500}},
                      {1, std::uint64_t{7}},
                      {2, std::uint64_t{65538}},
                      {3, true},
                      {4, true},
                      {6, false},
                      {7, true},
                      {8, true},
                      {9, 230.5},
                      {10, std::uint64_t{1}},
                      {11, false}};
    twin_ = std::make_unique<ModbusTwin>(Framing::rtu, device_, values_);
  }
  std::string Ask(const char* pdu) { return ToHex(AskTwin(*twin_, Hex(pdu))); }

  config::Device device_;
  FixedValues values_;
  std::unique_ptr<ModbusTwin> twin_;
};

TEST_F(ModbusTwinTest, AnswersReads) {
  Make();
  EXPECT_EQ(Ask("0300C80001"), "03 02 09 C4");
  EXPECT_EQ(Ask("0300CC0002"), "03 04 00 01 00 02");
  EXPECT_EQ(Ask("0300CD0001"), "03 02 00 02") << "half of a value, as a real device gives it";
  EXPECT_EQ(Ask("0300080001"), "03 02 80 01") << "bits of one register";
  EXPECT_EQ(Ask("0100000002"), "01 01 02");
  EXPECT_EQ(Ask("0200090001"), "02 01 01");
  EXPECT_EQ(Ask("0400000002"), "04 04 43 66 80 00");
}

TEST_F(ModbusTwinTest, RepliesUnderAnotherSlaveIfConfigured) {
  Make();
  twin_->ReplyAs("0x15");
  const auto reply_to = [&](std::uint8_t slave) {
    return twin_->Answer(Wrap(Framing::rtu, slave, Hex("0300C80001")), {});
  };
  EXPECT_EQ(reply_to(20), Wrap(Framing::rtu, 21, Hex("030209C4")));
  EXPECT_TRUE(reply_to(21).empty()) << "it is still called 20";
  ModbusTwin ascii(Framing::ascii, device_, values_);
  ascii.ReplyAs("21");
  EXPECT_EQ(ascii.Answer(Wrap(Framing::ascii, 20, Hex("0300C80001")), {}),
            Wrap(Framing::ascii, 21, Hex("030209C4")));
}

TEST_F(ModbusTwinTest, RefusesByTheSpecification) {
  Make();
  EXPECT_EQ(Ask("0300C80002"), "83 02") << "201 is missing";
  EXPECT_EQ(Ask("0300000001"), "83 02");
  EXPECT_EQ(Ask("0300C80000"), "83 03");
  EXPECT_EQ(Ask("0300C8007E"), "83 03");
  EXPECT_EQ(Ask("01000007D1"), "81 03");
  EXPECT_EQ(Ask("03FFFF0002"), "83 02");
  EXPECT_EQ(Ask("0600C80001"), "86 02") << "read-only";
  EXPECT_EQ(Ask("050000FF01"), "85 03");
  EXPECT_EQ(Ask("64"), "E4 01");
  EXPECT_EQ(Ask("0800010000"), "88 01");
  EXPECT_EQ(Ask("2B0D0100"), "AB 01");
  EXPECT_EQ(Ask("1000CA0002020005"), "90 03") << "count and bytes contradict each other";
}

TEST_F(ModbusTwinTest, MissingRegistersReadZeroNextToExistingOnes) {
  Make("zero");
  EXPECT_EQ(Ask("0300C70003"), "03 06 00 00 09 C4 00 00");
  EXPECT_EQ(Ask("0301C80001"), "83 02") << "all of them are missing";
  EXPECT_EQ(Ask("1000C90002040001002A"), "10 00 C9 00 02");
  EXPECT_EQ(values_.values[1], Value(std::uint64_t{42}));
  EXPECT_EQ(Ask("0600C80005"), "06 00 C8 00 05") << "ignored";
  EXPECT_EQ(Ask("0300C80001"), "03 02 09 C4");
  EXPECT_EQ(Ask("0601C80005"), "86 02");
}

TEST_F(ModbusTwinTest, WrittenValuesAreReadBack) {
  Make();
  EXPECT_EQ(Ask("0600CA0055"), "06 00 CA 00 55");
  EXPECT_EQ(Ask("0300CA0001"), "03 02 00 55");
  EXPECT_EQ(Ask("1000CC0002040003 0004"), "10 00 CC 00 02");
  EXPECT_EQ(Ask("0300CC0002"), "03 04 00 03 00 04");
  EXPECT_EQ(Ask("0600CD0009"), "06 00 CD 00 09") << "half of a value";
  EXPECT_EQ(values_.values[2], Value(std::uint64_t{0x00030009}));
  EXPECT_EQ(Ask("1600CA00F00005"), "16 00 CA 00 F0 00 05");
  EXPECT_EQ(Ask("0300CA0001"), "03 02 00 55") << "55 & F0 | 05";
  EXPECT_EQ(Ask("050000FF00"), "05 00 00 FF 00");
  EXPECT_EQ(Ask("0F0000000201 01"), "0F 00 00 00 02");
  EXPECT_EQ(Ask("0100000002"), "01 01 01");
  EXPECT_EQ(Ask("1700CA0001 00CA0001020007"), "17 02 00 07") << "written first, then read";
  EXPECT_EQ(Ask("0600080002"), "06 00 08 00 02");
  EXPECT_EQ(values_.values[5], Value(std::uint64_t{2}));
  EXPECT_EQ(Ask("06012C0004"), "06 01 2C 00 04");
  EXPECT_EQ(values_.values[11], Value(true)) << "a view of the same register";
}

TEST_F(ModbusTwinTest, AnswersLoopbackAndIdentification) {
  Make();
  EXPECT_EQ(Ask("080000A55A"), "08 00 00 A5 5A");
  EXPECT_EQ(Ask("0800000102030405"), "08 00 00 01 02 03 04 05");
  const Bytes identity = AskTwin(*twin_, Hex("2B0E0100"));
  EXPECT_NE(AsText(identity).find("baudgate"), std::string_view::npos);
  EXPECT_NE(AsText(identity).find("Test Device"), std::string_view::npos);
  const auto length = ReplyLength(identity);
  EXPECT_EQ(length.kind, PduLength::Kind::exact);
  EXPECT_EQ(length.size, identity.size());
  EXPECT_EQ(Ask("2B0E0400"), "2B 0E 04 81 00 00 01 00 08 62 61 75 64 67 61 74 65");
  EXPECT_EQ(Ask("2B0E0409"), "AB 02");
}

TEST_F(ModbusTwinTest, IsSilentToDamageAndOtherAddresses) {
  Make();
  const Bytes good = Wrap(Framing::rtu, 20, Hex("0300C80001"));
  EXPECT_FALSE(twin_->Answer(good, Instant{}).empty());
  for (std::size_t i = 0; i < good.size(); ++i) {
    Bytes damaged = good;
    damaged[i] ^= 1;
    EXPECT_TRUE(twin_->Answer(damaged, Instant{}).empty());
  }
  EXPECT_TRUE(twin_->Answer(Wrap(Framing::rtu, 21, Hex("0300C80001")), Instant{}).empty());
  EXPECT_TRUE(twin_->Answer(Wrap(Framing::rtu, 20, Hex("8302")), Instant{}).empty());
}

TEST_F(ModbusTwinTest, ExecutesABroadcastWithoutReply) {
  Make();
  EXPECT_TRUE(twin_->Answer(Wrap(Framing::rtu, 0, Hex("0600CA0055")), Instant{}).empty());
  EXPECT_EQ(values_.values[1], Value(std::uint64_t{0x55}));
}

TEST_F(ModbusTwinTest, AnswersRandomRequestsWithAValidLength) {
  Make("zero");
  std::uint32_t state = 1;
  for (int round = 0; round < 20000; ++round) {
    Bytes pdu(1 + round % 20);
    for (std::uint8_t& byte : pdu) {
      state = state * 1664525U + 1013904223U;
      byte = static_cast<std::uint8_t>(state >> 24U);
    }
    constexpr std::uint8_t kKnown[] = {1, 2, 3, 4, 5, 6, 8, 15, 16, 22, 23, 43};
    pdu[0] = kKnown[static_cast<std::size_t>(round) % std::size(kKnown)];
    const Bytes reply = twin_->Answer(Wrap(Framing::rtu, 20, pdu), Instant{});
    EXPECT_GE(reply.size(), 5U);
    EXPECT_LE(reply.size(), kMaxRtu);
  }
}

}  // namespace
}  // namespace baudgate::protocols::modbus
