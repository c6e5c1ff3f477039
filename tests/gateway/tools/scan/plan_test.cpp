// What a scan plans, as values.
// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "protocols/all_protocols.h"
#include "tests/gateway/tools/scan/bench.h"

namespace baudgate::scan {
namespace {

using ::testing::IsEmpty;
using ::testing::SizeIs;

TEST(Plan, BeginsWithTheUsualSettingOfEachProtocol) {
  const Wish wish = WishFor();
  const auto sweeps = LikelySweeps(wish);
  ASSERT_GE(sweeps.size(), wish.tongues.size());
  for (std::size_t i = 0; i < wish.tongues.size(); ++i) {
    EXPECT_EQ(sweeps[i].tongue, i);
    EXPECT_TRUE(SameWire(sweeps[i].serial, wish.tongues[i].rule().serials.front()));
    EXPECT_EQ(sweeps[i].addresses, (Addresses{1, 32}));
  }
}

TEST(Plan, AQuickOneFitsIntoAMinute) {
  for (const char* protocol : {"", "spabus", "dcon", "set4tm", "modbus_rtu", "modbus_ascii"}) {
    Wish wish = WishFor(protocol);
    wish.quick = true;
    Duration time = TimeOf(LikelySweeps(wish), wish);
    for (const Listening& listen : ListenFirst(wish)) time += listen.time;
    EXPECT_LT(time, 50s) << protocol;
    EXPECT_GT(time, 20s) << protocol;
    EXPECT_THAT(ThoroughSweeps(wish, {}), IsEmpty());
  }
}

TEST(Plan, WhereSomethingHasAnsweredAllIsAskedFirst) {
  const Wish wish = WishFor("dcon");
  const config::SerialSettings fast{.baud = 115200};
  const auto sweeps = ThoroughSweeps(wish, std::span(&fast, 1));
  ASSERT_THAT(sweeps, SizeIs(2));
  EXPECT_EQ(sweeps[0].serial.baud, 115200);
  EXPECT_EQ(sweeps[0].addresses, (Addresses{0, 255}));
  EXPECT_EQ(sweeps[0].finds, 0b11U);
  EXPECT_EQ(sweeps[1].serial.baud, 9600);
}

TEST(Plan, ASerialServerHasOneSetting) {
  Wish wish = WishFor();
  wish.network = true;
  EXPECT_THAT(LikelySweeps(wish), SizeIs(wish.tongues.size()));
  EXPECT_THAT(ListenFirst(wish), SizeIs(1));
}

TEST(Plan, AddressesAreReadAsARange) {
  EXPECT_EQ(*ParseAddresses("7"), (Addresses{7, 7}));
  EXPECT_EQ(*ParseAddresses("1-32"), (Addresses{1, 32}));
  for (const char* wrong : {"", "-", "3-1", "1-", "a", "1-1000", "1 - 3"}) {
    EXPECT_FALSE(ParseAddresses(wrong)) << wrong;
  }
}

TEST(Plan, OtherFormatsHoldTheCharactersOfTheProtocol) {
  EXPECT_THAT(OtherFormats({}, *FindProtocol("modbus_rtu")), SizeIs(2));
  EXPECT_THAT(OtherFormats({}, *FindProtocol("spabus")), SizeIs(4));
  EXPECT_EQ(OtherFormats({}, *FindProtocol("dcon")).front().ToString(), "9600 8E1")
      << "no module has seven bits";
}

TEST(Plan, EveryRuleOfAProtocolIsWhole) {
  for (const Protocol* protocol : AllProtocols()) {
    if (protocol->scan == nullptr) continue;
    const ScanRule& rule = *protocol->scan;
    EXPECT_FALSE(rule.serials.empty()) << protocol->name;
    EXPECT_GE(rule.modes.size(), rule.quick_modes) << protocol->name;
    EXPECT_EQ(rule.quick_finds & ~rule.finds, 0U) << protocol->name;
    EXPECT_GT(rule.usual, Duration::zero()) << protocol->name;
    for (const ScanMode& mode : rule.modes) {
      const auto named = [&](const OptionSpec& spec) { return spec.name == mode.key; };
      EXPECT_TRUE(mode.key.empty() || std::ranges::any_of(protocol->options, named));
    }
    EXPECT_NE(protocol->telegram, nullptr) << protocol->name;
    for (std::size_t mode = 0; mode < rule.modes.size(); ++mode) {
      for (std::size_t question = 0; question < rule.questions; ++question) {
        const Bytes asked = rule.ask(rule.last_address, mode, question);
        EXPECT_TRUE(protocol->telegram->is_read(asked, TongueOf(*protocol).options[mode]))
            << protocol->name << " question " << question;
      }
    }
  }
}

}  // namespace
}  // namespace baudgate::scan
