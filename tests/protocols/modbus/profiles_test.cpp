// The shipped Modbus profiles: they load in both framings, every point is answered by a twin of the
// device, and what can be written is.
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
  catalog.profile_dirs = {"config/profiles"};  // tests run at the root of the source tree
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
  // The frames of the installation: faults by name, a set frequency, start and stop.
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

TEST(ModbusProfiles, TheMeterIsAdaptedByOptions) {
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

TEST(ModbusProfiles, AsciiUsesThoseOfRtu) {
  const config::Catalog catalog = Installed();
  EXPECT_TRUE(catalog.FindProfile("modbus_ascii", "generic-meter").has_value());
  EXPECT_FALSE(catalog.FindProfile("modbus_ascii", "spaj140c").has_value());
  EXPECT_EQ(catalog.Profiles("modbus_ascii").size(), catalog.Profiles("modbus_rtu").size());
  const config::Loaded wrong = Load("generic-metre", Framing::ascii);
  ASSERT_FALSE(wrong.ok());
  EXPECT_NE(wrong.problems[0].message.find("generic-meter"), std::string::npos);
  EXPECT_NE(wrong.problems[0].message.find("modbus_rtu"), std::string::npos) << "where was looked";
}

}  // namespace
}  // namespace baudgate::protocols::modbus
