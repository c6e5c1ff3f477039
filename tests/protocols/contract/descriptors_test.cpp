// What every protocol of the list in protocols/CMakeLists.txt keeps, whatever it speaks.
// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <set>

#include "config/catalog/option_values.h"
#include "protocols/all_protocols.h"

namespace baudgate {
namespace {

class Descriptor : public ::testing::TestWithParam<const Protocol*> {};

TEST_P(Descriptor, IsWhole) {
  const Protocol& protocol = *GetParam();
  EXPECT_FALSE(protocol.name.empty());
  EXPECT_FALSE(protocol.title.empty());
  EXPECT_FALSE(protocol.decoders.empty());
  EXPECT_NE(protocol.canonical_address, nullptr);
  EXPECT_NE(protocol.check_point, nullptr);
  EXPECT_NE(protocol.request_rule, nullptr);
  EXPECT_NE(protocol.reply_rule, nullptr);
  EXPECT_NE(protocol.expect, nullptr);
  EXPECT_NE(protocol.make_conversation, nullptr);
  EXPECT_NE(protocol.make_twin, nullptr);
  EXPECT_EQ(protocol.parse == nullptr, protocol.options.empty()) << "who has options parses them";
  EXPECT_GE(protocol.serial.data_bits, protocol.data_bits);
  EXPECT_EQ(FindProtocol(protocol.name), &protocol);
  EXPECT_EQ(protocol.tcp, !protocol.traits.service.empty()) << "the status names what it speaks";
  const std::string_view other = protocol.traits.counterpart;
  EXPECT_TRUE(other.empty() || FindProtocol(other)->tcp != protocol.tcp) << other;
}

TEST_P(Descriptor, HasOptionsWhoseFallbacksAreAllowed) {
  std::set<std::string_view> names;
  for (const OptionSpec& spec : GetParam()->options) {
    EXPECT_TRUE(names.insert(spec.name).second) << spec.name << " stands twice";
    const auto value = config::ParseOption(spec, spec.fallback);
    EXPECT_TRUE(value) << spec.name << ": " << (value ? "" : value.error());
    EXPECT_TRUE(spec.help.ends_with(".")) << spec.name;
  }
}

TEST_P(Descriptor, HasOneSpellingForEveryAddress) {
  int valid = 0;
  for (const char* text : {"1", "2", "15", "0x0F", "200", "9020001", "sn:9020001", "sn:5"}) {
    const auto canonical = GetParam()->canonical_address(text);
    if (!canonical) {
      EXPECT_FALSE(canonical.error().empty());
      continue;
    }
    ++valid;
    const auto again = GetParam()->canonical_address(*canonical);
    ASSERT_TRUE(again) << *canonical;
    EXPECT_EQ(*again, *canonical);
  }
  EXPECT_GE(valid, 2);
  EXPECT_FALSE(GetParam()->canonical_address("no address"));
}

TEST_P(Descriptor, HasTimesThatFitTogether) {
  for (const int baud : {300, 9600, 115200}) {
    config::SerialSettings serial = GetParam()->serial;
    serial.baud = baud;
    const config::Timing timing = GetParam()->timing(serial);
    EXPECT_GT(*timing.quiet, Duration::zero());
    EXPECT_GE(*timing.ceiling, *timing.reply + *timing.gap);
    EXPECT_GE(*timing.drain, *timing.gap);
  }
}

INSTANTIATE_TEST_SUITE_P(Every, Descriptor, ::testing::ValuesIn(AllProtocols()),
                         [](const auto& info) { return std::string(info.param->name); });

TEST(Descriptors, OneSpellingTellsDevicesApart) {
  const auto same = [](std::string_view protocol, const char* first, const char* second) {
    const auto canonical = FindProtocol(protocol)->canonical_address;
    return *canonical(first) == *canonical(second);
  };
  EXPECT_TRUE(same("dcon", "0x4A", "74"));
  EXPECT_TRUE(same("modbus_rtu", "0x14", "20"));
  EXPECT_TRUE(same("set4tm", "9020001", "sn:9020001"));
  EXPECT_FALSE(same("set4tm", "5", "sn:5"));
  EXPECT_TRUE(same("spabus", "007", "7"));
}

TEST(Descriptors, OneHasTheFramesOfMastersOfEachFraming) {
  for (const auto framing : {modbus::Framing::rtu, modbus::Framing::ascii}) {
    const auto serves = [framing](const Protocol* protocol) {
      return protocol->carrier != nullptr && protocol->carrier->framing == framing;
    };
    EXPECT_EQ(std::ranges::count_if(AllProtocols(), serves), 1) << Title(framing);
  }
}

}  // namespace
}  // namespace baudgate
