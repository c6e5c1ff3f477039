// What the plugin tells the configuration: addresses, points, options and times.
// SPDX-License-Identifier: Apache-2.0
#include "protocols/spabus/protocol.h"

#include "protocols/spabus/clock.h"
#include "tests/protocols/spabus/support.h"

namespace baudgate::protocols::spabus {
namespace {

const Protocol& Spa() { return SpabusProtocol(); }

TEST(SpaProtocol, TakesSlaveNumbers) {
  for (const char* address : {"1", "30", "254", "899", "901", "999"}) {
    EXPECT_TRUE(Spa().canonical_address(address)) << address;
  }
  for (const char* address : {"0", "900", "1000", "-1", "", "x", "1 ", "0x10", "00001"}) {
    const auto status = Spa().canonical_address(address);
    ASSERT_FALSE(status) << address;
    EXPECT_NE(status.error().find("1 to 899"), std::string::npos) << status.error();
  }
  EXPECT_NE(Spa().canonical_address("900").error().find("broadcast"), std::string::npos);
}

Status Check(const std::string& read, Type type, Access access = Access::read,
             const std::string& write = {}) {
  config::Point point = MakePoint(read, type, Group::fast, access);
  point.write = write;
  if (type == Type::boolean) point.table = config::Table::bits;
  return Spa().check_point(point);
}

TEST(SpaProtocol, TakesPoints) {
  EXPECT_TRUE(Check("I1", Type::float32));
  EXPECT_TRUE(Check("O1", Type::boolean));
  EXPECT_TRUE(Check("F", Type::string));
  EXPECT_TRUE(Check("V150", Type::uint16, Access::read_write));
  EXPECT_TRUE(Check("C", Type::uint16, Access::read_write));
  EXPECT_TRUE(Check("V200", Type::uint16));
  EXPECT_TRUE(Check("", Type::uint16, Access::write, "V101"));
  EXPECT_TRUE(Check("V101", Type::uint16, Access::write));
  EXPECT_TRUE(Check("", Type::uint16, Access::write, "V165"));
}

TEST(SpaProtocol, RefusesPointsThatCanNotWork) {
  EXPECT_FALSE(Check("I1/5", Type::float32));
  EXPECT_FALSE(Check("F", Type::float32));
  EXPECT_FALSE(Check("3A", Type::uint16));
  EXPECT_FALSE(Check("I1", Type::float32, Access::read_write)) << "inputs cannot be written";
  EXPECT_FALSE(Check("F", Type::string, Access::read_write));
  EXPECT_FALSE(Check("", Type::uint16));
  config::Point number = MakePoint("I1");
  number.table = config::Table::bits;
  EXPECT_FALSE(Spa().check_point(number));
}

TEST(SpaProtocol, EventsAreNoPoints) {
  for (const char* read : {"L", "B"}) {
    const Status status = Check(read, Type::string);
    ASSERT_FALSE(status);
    EXPECT_NE(status.error().find("events"), std::string::npos);
  }
}

TEST(SpaProtocol, DangerousItemsAreNotWritten) {
  for (const char* item : {"V160", "V161", "V167", "V200", "V201"}) {
    for (const Access access : {Access::write, Access::read_write}) {
      EXPECT_FALSE(Check(item, Type::uint16, access)) << item;
    }
    EXPECT_FALSE(Check("V1", Type::uint16, Access::read_write, item)) << item;
  }
  EXPECT_FALSE(Check("V160", Type::uint16)) << "nobody reads the password either";
}

TEST(SpaProtocol, DefaultsToThePortOfTheRelays) {
  EXPECT_EQ(Spa().serial.baud, 9600);
  EXPECT_EQ(Spa().serial.data_bits, 7);
  EXPECT_EQ(Spa().serial.parity, config::Parity::even);
  EXPECT_EQ(Spa().serial.stop_bits, 1);
}

TEST(SpaProtocol, TimesFollowTheBitRateWithinBounds) {
  config::SerialSettings serial = Spa().serial;
  const config::Timing at9600 = Spa().timing(serial);
  EXPECT_EQ(at9600.quiet, serial.CharacterTime() * 5);
  EXPECT_EQ(at9600.reply, Duration(500ms));
  EXPECT_EQ(at9600.gap, Duration(50ms));
  EXPECT_EQ(at9600.drain, Duration(100ms));
  EXPECT_GT(*at9600.ceiling, 4s);
  EXPECT_LT(*at9600.ceiling, 6s);
  serial.baud = 300;
  const config::Timing at300 = Spa().timing(serial);
  EXPECT_EQ(at300.gap, serial.CharacterTime() * 20);
  EXPECT_GT(*at300.ceiling, serial.CharacterTime() * 510) << "two whole lines";
  EXPECT_LT(*at300.ceiling, 30s);
  EXPECT_GT(*at300.drain, 1s);
}

TEST(SpaProtocol, ThePasswordOptionIsSecret) {
  for (const OptionSpec& option : Spa().options) {
    EXPECT_EQ(option.secret, option.name == "password") << option.name;
  }
}

TEST(SpaProtocol, DecodersAreAddressesThatParse) {
  for (const DecoderSpec& decoder : Spa().decoders) {
    const std::string form(decoder.form);
    const bool number = form == kOffsetItem;
    EXPECT_TRUE(Check(form, number ? Type::float32 : Type::string)) << form;
  }
}

}  // namespace
}  // namespace baudgate::protocols::spabus
