// Tests the descriptor of the protocol: addresses, points, options and times.
// SPDX-License-Identifier: Apache-2.0
#include "protocols/spabus/protocol.h"

#include <algorithm>
#include <set>

#include "config/loader.h"
#include "protocols/spabus/clock.h"
#include "protocols/spabus/conversation.h"
#include "tests/protocols/spabus/support.h"
#include "tests/support/times.h"

namespace baudgate::protocols::spabus {
namespace {

const Protocol& Spa() { return SpabusProtocol(); }

TEST(SpaProtocol, AcceptsSlaveNumbers) {
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

TEST(SpaProtocol, AcceptsValidPoints) {
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

TEST(SpaProtocol, RefusesInvalidPoints) {
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

TEST(SpaProtocol, RefusesEventItemsAsPoints) {
  for (const char* read : {"L", "B"}) {
    const Status status = Check(read, Type::string);
    ASSERT_FALSE(status);
    EXPECT_NE(status.error().find("events"), std::string::npos);
  }
}

TEST(SpaProtocol, RefusesWritesToDangerousItems) {
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

TEST(SpaProtocol, DecodersAreValidAddresses) {
  for (const DecoderSpec& decoder : Spa().decoders) {
    const std::string form(decoder.form);
    const bool number = form == kOffsetItem;
    EXPECT_TRUE(Check(form, number ? Type::float32 : Type::string)) << form;
  }
}

std::string Shown(const Block<Row>& block) {
  const Command command = ReadOf(1, block);
  const auto number = command.numbers ? std::optional(command.numbers->first) : std::nullopt;
  std::string text = FormatAddress({command.channels.first, command.category, number});
  if (command.channels.Count() > 1) {
    return std::to_string(command.channels.first) + "/" + std::to_string(command.channels.last) +
           FormatAddress({0, command.category, number});
  }
  if (command.ItemCount() > 1) text += "/" + std::to_string(command.numbers->last);
  return text;
}

std::vector<std::string> TextsOf(const ItemPlan& plan) {
  std::vector<std::string> asked;
  for (std::size_t i = 0; i < plan.queries().size(); ++i) asked.push_back(Shown(plan.block(i)));
  return asked;
}

std::vector<std::string> TextsOf(const std::vector<config::Point>& points,
                                 std::size_t most_items = 8) {
  const RequestLimits limits{most_items, true};
  return TextsOf(MakePlan(ReadablePoints(points), limits));
}

TEST(SpaPlan, NeighboursShareARequest) {
  EXPECT_EQ(TextsOf({MakePoint("I2"), MakePoint("I1"), MakePoint("I3")}), (Texts{"I1/3"}));
  EXPECT_EQ(TextsOf({MakePoint("I1"), MakePoint("I3")}), (Texts{"I1", "I3"})) << "no gap is filled";
  EXPECT_EQ(TextsOf({MakePoint("I1"), MakePoint("O2")}), (Texts{"I1", "O2"}));
  EXPECT_EQ(TextsOf({MakePoint("I1"), MakePoint("1I2")}), (Texts{"I1", "1I2"}));
  EXPECT_EQ(TextsOf({MakePoint("F"), MakePoint("C")}), (Texts{"F", "C"}));
}

TEST(SpaPlan, AnItemOfConsecutiveChannelsIsOneRequest) {
  std::vector<config::Point> points;
  for (int i = 1; i <= 16; ++i) points.push_back(MakePoint(std::to_string(i) + "I1"));
  EXPECT_EQ(TextsOf(points, 16), (Texts{"1/16I1"}));
  EXPECT_EQ(TextsOf(points), (Texts{"1/8I1", "9/16I1"}));
  EXPECT_EQ(TextsOf({MakePoint("2V5"), MakePoint("1V5"), MakePoint("4V5")}),
            (Texts{"1/2V5", "4V5"}));
  EXPECT_EQ(TextsOf({MakePoint("I1"), MakePoint("1I1")}), (Texts{"I1", "1I1"}))
      << "channel 0 is common to all";
  EXPECT_EQ(TextsOf({MakePoint("1I1"), MakePoint("1I2"), MakePoint("2I1"), MakePoint("2I2")}),
            (Texts{"1I1/2", "2I1/2"}))
      << "never both ranges at once";
  EXPECT_EQ(TextsOf({MakePoint("1F", Type::string), MakePoint("2F", Type::string)}),
            (Texts{"1F", "2F"}));
}

TEST(SpaPlan, ChannelsAreReadOneByOneIfTheDeviceRefusesARange) {
  const std::vector<config::Point> points = {MakePoint("1I1"), MakePoint("2I1"), MakePoint("S1"),
                                             MakePoint("S2")};
  RequestLimits limits;
  ItemPlan plan = MakePlan(ReadablePoints(points), limits);
  EXPECT_EQ(TextsOf(plan), (Texts{"1/2I1", "S1/2"}));
  limits.channels = false;
  plan.Make();
  EXPECT_EQ(TextsOf(plan), (Texts{"1I1", "2I1", "S1/2"}));
}

TEST(SpaPlan, GroupsAreSeparateAndFastGroupsComeFirst) {
  EXPECT_EQ(TextsOf({MakePoint("I1", Type::float32, Group::slow), MakePoint("I2"),
                     MakePoint("F", Type::string, Group::once)}),
            (Texts{"I2", "I1", "F"}));
}

TEST(SpaPlan, AnItemUsedTwiceIsReadOnce) {
  const std::vector<config::Point> points = {MakePoint("V6"), MakePoint("V6"), MakePoint("V7"),
                                             MakePoint("C"), MakePoint("C")};
  const RequestLimits most;
  const ItemPlan plan = MakePlan(ReadablePoints(points), most);
  EXPECT_EQ(TextsOf(plan), (Texts{"V6/7", "C"}));
  EXPECT_EQ(plan.queries()[0].points, (std::vector<std::size_t>{0, 1, 2}));
  EXPECT_EQ(plan.queries()[1].points, (std::vector<std::size_t>{3, 4}));
}

TEST(SpaPlan, KeepsWithinTheMaximumNumberOfItems) {
  std::vector<config::Point> points;
  for (int i = 1; i <= 13; ++i) points.push_back(MakePoint("O" + std::to_string(i)));
  EXPECT_EQ(TextsOf(points), (Texts{"O1/8", "O9/13"}));
  EXPECT_EQ(TextsOf(points, 5), (Texts{"O1/5", "O6/10", "O11/13"}));
}

TEST(SpaPlan, SplitsAndMissingItemsDivideABlock) {
  std::vector<config::Point> points;
  for (int i = 1; i <= 6; ++i) points.push_back(MakePoint("O" + std::to_string(i)));
  const RequestLimits most;
  ItemPlan plan = MakePlan(ReadablePoints(points), most);
  EXPECT_EQ(plan.OnRefused(0, kStart), PlanChange::split);
  EXPECT_EQ(TextsOf(plan), (Texts{"O1/3", "O4/6"}));
  EXPECT_EQ(plan.OnRefused(0, kStart), PlanChange::split);
  EXPECT_EQ(TextsOf(plan), (Texts{"O1", "O2/3", "O4/6"}));
  EXPECT_EQ(plan.OnRefused(0, kStart), PlanChange::set_apart);
  EXPECT_EQ(TextsOf(plan), (Texts{"O2/3", "O4/6", "O1"})) << "what may be missing is asked rarely";
  plan.OnReconnect();
  EXPECT_EQ(TextsOf(plan), (Texts{"O1/6"})) << "it may be another relay now";
}

TEST(SpaPlan, WriteOnlyPointsAreNotRead) {
  EXPECT_TRUE(TextsOf({MakePoint("V101", Type::uint16, Group::fast, Access::write)}).empty());
}

constexpr char kProfiles[] = "config/profiles";

class SpaProfile : public ::testing::TestWithParam<std::string> {
 protected:
  config::Profile Load() {
    config::Catalog catalog;
    catalog.protocols["spabus"] = &SpabusProtocol();
    catalog.profile_dirs = {kProfiles};
    const auto loaded = config::LoadProfile(GetParam(), SpabusProtocol(), catalog);
    for (const config::Problem& problem : loaded.problems)
      ADD_FAILURE() << config::ToString(problem);
    return loaded.profile;
  }
};

TEST_P(SpaProfile, LoadsAndIsComplete) {
  const config::Profile profile = Load();
  EXPECT_FALSE(profile.title.empty());
  EXPECT_GT(profile.points.size(), 40U);
  for (const config::Point& point : profile.points) {
    EXPECT_FALSE(point.description->empty()) << point.name;
    EXPECT_TRUE(point.simulate) << point.name;
    EXPECT_TRUE(point.modbus) << point.name;
  }
}

TEST_P(SpaProfile, FastValuesHaveTheFirstAdjacentRegisters) {
  std::map<config::Table, std::size_t> next;
  for (const config::Point& point : Load().points) {
    if (point.group != Group::fast || point.table == config::Table::bits) continue;
    EXPECT_EQ(*point.modbus, next[point.table]) << point.name;
    next[point.table] += config::RegisterCount(point);
  }
}

Value Simulated(const config::Point& point) {
  if (point.simulate->text) return *point.simulate->text;
  if (point.type == Type::boolean) return point.simulate->low != 0;
  return point.simulate->low;
}

TEST_P(SpaProfile, EveryPointIsReadBackFromItsTwin) {
  const config::Profile profile = Load();
  config::Device device = MakeDevice(profile.points);
  FixedValues values;
  for (std::size_t i = 0; i < device.points.size(); ++i) values.Set(i, Simulated(device.points[i]));
  const auto twin = SpabusProtocol().make_twin(device, values);
  Talk talk(SpabusProtocol(), device);
  std::set<std::size_t> seen;
  for (std::size_t query = 0; query < talk->Queries().size(); ++query) {
    const Answer answer = talk.Exchange(Poll(query), *twin);
    EXPECT_EQ(answer.outcome, Outcome::ok) << answer.reason;
    for (const Reading& reading : answer.readings) {
      ASSERT_LT(reading.point, device.points.size());
      const config::Point& point = device.points[reading.point];
      EXPECT_EQ(reading.quality, Quality::good) << point.name;
      if (point.simulate->text) {
        EXPECT_EQ(ToText(reading.value), *point.simulate->text) << point.name;
      } else {
        EXPECT_DOUBLE_EQ(ToDouble(reading.value), point.simulate->low) << point.name;
      }
      seen.insert(reading.point);
    }
  }
  const auto is_read = [](const config::Point& point) { return point.access != Access::write; };
  EXPECT_EQ(seen.size(), std::ranges::count_if(device.points, is_read));
}

TEST_P(SpaProfile, WritablePointsAcceptTheirSimulatedValue) {
  const config::Profile profile = Load();
  config::Device device = MakeDevice(profile.points);
  FixedValues values;
  const auto twin = SpabusProtocol().make_twin(device, values);
  Talk talk(SpabusProtocol(), device);
  std::size_t written = 0;
  for (std::size_t i = 0; i < device.points.size(); ++i) {
    const config::Point& point = device.points[i];
    if (point.access == Access::read) continue;
    const Answer answer = talk.Run(Write(i, Simulated(point)), *twin);
    EXPECT_EQ(answer.outcome, Outcome::ok) << point.name << ": " << answer.reason;
    EXPECT_DOUBLE_EQ(ToDouble(values.Get(i, {})), point.simulate->low) << point.name;
    ++written;
  }
  EXPECT_GT(written, 0U);
}

/// Chapters 15.1 and 15.2 of the SPA reference. An item without decimals allows whole numbers only.
struct Allowed {
  std::string item;
  std::optional<double> min;
  std::optional<double> max;
  std::optional<int> decimals;
  bool select = false;
};

std::vector<Allowed> RangeOf(int first, int last, const Allowed& each) {
  std::vector<Allowed> all;
  for (int number = first; number <= last; ++number) {
    all.push_back(each);
    all.back().item = "S" + std::to_string(number);
  }
  return all;
}

std::vector<Allowed> AllowedOf(const std::string& profile) {
  const bool is_spaj = profile == "spaj140c";
  std::vector<Allowed> all = {
      {"C", 0, 0, {}, false},
      {"V101", 1, 1, {}, true},
      {"V102", 1, 1, {}, true},
      {"V165", 1, 1, {}, true},
      {"V150", 0, 1, {}, true},
      {"V155", 0, 255, {}, false},
      {"V156", 0, is_spaj ? 255 : 15, {}, false},
      {"V157", 0, is_spaj ? 1023 : 1, {}, false},
  };
  const auto add = [&all](const std::vector<Allowed>& more) {
    all.insert(all.end(), more.begin(), more.end());
  };
  if (!is_spaj) {
    add(RangeOf(21, 25, {{}, 0, 999, 2, false}));
    return all;
  }
  for (const char* output : {"O9", "O10", "O11", "O12", "O13", "O41"}) {
    all.push_back({output, {}, {}, {}, true});
  }
  for (const int first : {21, 41}) {
    add(RangeOf(first, first + 7, {{}, {}, {}, 2, false}));
    add(RangeOf(first + 8, first + 13, {{}, 0, 255, {}, false}));
  }
  all.push_back({"S61", 0.1, 1.0, 2, false});
  return all;
}

TEST_P(SpaProfile, LimitsMatchTheReference) {
  std::map<std::string, Allowed> expected;
  for (const Allowed& one : AllowedOf(GetParam())) expected[one.item] = one;
  for (const config::Point& point : Load().points) {
    if (point.access == Access::read) continue;
    const std::string& item = point.write.empty() ? point.read : point.write;
    ASSERT_TRUE(expected.contains(item)) << item << " can be written";
    const Allowed& allowed = expected[item];
    EXPECT_EQ(point.writing.min, allowed.min) << item;
    EXPECT_EQ(point.writing.max, allowed.max) << item;
    EXPECT_EQ(point.writing.decimals, allowed.decimals) << item;
    EXPECT_EQ(point.writing.select, allowed.select) << item;
    expected.erase(item);
  }
  for (const auto& [item, allowed] : expected) ADD_FAILURE() << item << " cannot be written";
}

INSTANTIATE_TEST_SUITE_P(Shipped, SpaProfile, ::testing::Values("spaj140c", "spau130c"),
                         [](const auto& info) { return info.param; });

}  // namespace
}  // namespace baudgate::protocols::spabus
