// Tests modules whose inputs have separate type codes: requests for the codes, and inputs that
// measure something else than their points require. Bytes: dcon reference, chapters 5 and 7.3.
// SPDX-License-Identifier: Apache-2.0
#include "protocols/dcon/identification.h"
#include "tests/protocols/dcon/support.h"

namespace baudgate::protocols::dcon {
namespace {

using config::Group;
using config::Type;

const Quality kNotThis{Quality::bad_configuration, Reason::other_module};

config::Device Inputs(std::size_t count, const std::string& unit = "V",
                      const Settable& options = {}) {
  std::vector<config::Point> points;
  for (std::size_t i = 0; i < count; ++i) {
    points.push_back(ReadPoint("input_" + std::to_string(i), "#[" + std::to_string(i) + "]"));
    points.back().unit = unit;
  }
  points.push_back(ReadPoint("configuration", "$2", Type::string, Group::slow));
  points.back().text_length = 6;
  Settable all = {
      {"identify", true}, {"channel_types", true}, {"channels", static_cast<std::int64_t>(count)}};
  all.insert(all.end(), options.begin(), options.end());
  return MakeDevice(std::move(points), all);
}

/// A module that replies to the requests in `replies`, ignores all other requests, and records all
/// requests.
struct Module {
  std::map<std::string, std::string> replies = {{"$01M", "!014017P"}, {"$012", "!01080600"}};
  std::vector<std::string> asked;

  Wire wire() {
    return [this](View request) {
      std::string text(AsText(request));
      text.pop_back();
      asked.push_back(text);
      const auto found = replies.find(text);
      return found == replies.end() ? Bytes() : ToBytes(found->second + "\r");
    };
  }
  std::size_t Count(std::string_view begin) const {
    return static_cast<std::size_t>(std::ranges::count_if(
        asked, [&](const std::string& request) { return request.starts_with(begin); }));
  }
};

TEST(DconChannelTypes, AreReadOnceAndGiveTheUnit) {
  Talk talk(DconProtocol(), Inputs(3));
  Module module;
  module.replies.insert({{"$016", "!0107"},
                         {"$018C0", "!01C0R08"},
                         {"$018C1", "!01C1R0C"},
                         {"$018C2", "!01C2R0D"},
                         {"#01", ">+05.000+150.00+04.000"}});
  Answer answer = talk.Run(Poll(0), module.wire());
  EXPECT_EQ(answer.then, Then::replan) << "a task has few exchanges";
  EXPECT_TRUE(answer.readings.empty());
  answer = talk.Run(Poll(0), module.wire());
  ASSERT_EQ(answer.readings.size(), 3U);
  EXPECT_EQ(answer.readings[0].value, Value{5.0});
  EXPECT_DOUBLE_EQ(ToDouble(answer.readings[1].value), 0.15) << "mV";
  EXPECT_EQ(answer.readings[2].quality, kNotThis);
  EXPECT_EQ(talk->trouble().reason, Reason::none) << "the others are good";
  EXPECT_NE(
      talk->trouble().text.find("input 2 has type 0D and measures in mA, but the profile has V "
                                "for input_2"),
      std::string::npos)
      << talk->trouble().text;
  EXPECT_EQ(module.Count("$018C"), 3U);
  talk.Run(Poll(0), module.wire());
  EXPECT_EQ(module.Count("$018C"), 3U) << "once";
  talk->OnReconnect();
  talk.Run(Poll(0), module.wire());
  talk.Run(Poll(0), module.wire());
  EXPECT_EQ(module.Count("$018C"), 6U) << "another module may be there";
}

TEST(DconChannelTypes, AreReadAgainWithinASlowPeriod) {
  Talk talk(DconProtocol(), Inputs(2));
  Module module;
  module.replies.insert({{"$016", "!0103"},
                         {"$018C0", "!01C0R08"},
                         {"$018C1", "!01C1R09"},
                         {"#01", ">+05.000+1.5000"}});
  EXPECT_EQ(talk.Run(Poll(0), module.wire()).readings.size(), 2U);
  module.replies["$018C1"] = "!01C1R07";
  const auto later = [&](Duration time) {
    talk.now += time;
    module.asked.clear();
    return talk.Run(Poll(0), module.wire());
  };
  later(29s);
  EXPECT_EQ(module.asked, (std::vector<std::string>{"#01"}));
  later(1s);
  EXPECT_EQ(module.asked, (std::vector<std::string>{"#01", "$018C0"}));
  EXPECT_TRUE(talk->trouble().text.empty());
  later(30s);
  EXPECT_EQ(module.asked, (std::vector<std::string>{"#01", "$018C1"}));
  EXPECT_NE(talk->trouble().text.find("input 1 has type 07"), std::string::npos);
  const Answer answer = later(1s);
  EXPECT_TRUE(IsGood(answer.readings[0].quality));
  EXPECT_EQ(answer.readings[1].quality, kNotThis);
  module.replies["$018C1"] = "!01C1R0A";
  later(1min);
  EXPECT_EQ(module.asked, (std::vector<std::string>{"#01", "$018C0", "$018C1"}))
      << "polled rarely: several in one task";
  EXPECT_TRUE(talk->trouble().text.empty()) << talk->trouble().text;
}

TEST(DconChannelTypes, AreReadOnceAfterALongPauseWithinTheTaskLimit) {
  Talk talk(DconProtocol(), Inputs(8));
  Module module;
  module.replies.insert(
      {{"$016", "!01FF"}, {"#01", ">+05.000+01.000+01.000+01.000+01.000+01.000+01.000+01.000"}});
  for (int i = 0; i < 8; ++i) {
    const std::string input = std::to_string(i);
    module.replies["$018C" + input] = "!01C" + input + "R08";
  }
  for (int i = 0; i < 3; ++i) talk.Run(Poll(0), module.wire());
  talk.now += 24h;
  module.asked.clear();
  talk.Run(Poll(0), module.wire());
  EXPECT_EQ(module.asked.front(), "#01");
  EXPECT_EQ(module.Count("$018C"), 5U);
  talk.Run(Poll(0), module.wire());
  talk.Run(Poll(0), module.wire());
  EXPECT_EQ(module.Count("$018C"), 8U);
}

TEST(DconChannelTypes, AModuleWithoutThemIsReadUnchanged) {
  for (const char* reply : {"?01", ""}) {
    Talk talk(DconProtocol(), Inputs(8, "V", {{"checksum", false}}));
    Module module;
    module.replies.insert(
        {{"$016", "!01FF"}, {"#01", ">+05.000+01.000+01.000+01.000+01.000+01.000+01.000+01.000"}});
    if (*reply != 0) module.replies["$018C0"] = reply;
    Answer answer = talk.Run(Poll(0), module.wire());
    if (answer.then == Then::replan) answer = talk.Run(Poll(0), module.wire());
    EXPECT_EQ(answer.readings.size(), 8U);
    EXPECT_EQ(module.Count("$018C"), *reply != 0 ? 1U : 2U);
    EXPECT_TRUE(talk->trouble().text.empty());
  }
}

TEST(DconChannelTypes, AReplyOfAnotherInputIsIgnored) {
  Talk talk(DconProtocol(), Inputs(2));
  Module module;
  module.replies.insert({{"$016", "!0103"}, {"$018C0", "!01C1R0D"}, {"#01", ">+05.000+1.5000"}});
  Answer answer = talk.Run(Poll(0), module.wire());
  EXPECT_TRUE(talk->trouble().text.empty());
  EXPECT_EQ(answer.readings.size(), 2U);
}

TEST(DconChannelTypes, AreNotReadWhereTheyCannotBeChecked) {
  for (const auto& [unit, options] :
       std::vector<std::pair<std::string, Settable>>{{"bar", {}},
                                                     {"V", {{"channel_types", false}}},
                                                     {"V", {{"format", std::string("percent")}}}}) {
    Talk talk(DconProtocol(), Inputs(2, unit, options));
    Module module;
    const bool percent = options.size() == 1 && options[0].first == "format";
    module.replies["$012"] = percent ? "!01080601" : "!01080600";
    module.replies.insert({{"$016", "!0103"}, {"#01", ">+05.000+01.500"}});
    EXPECT_EQ(talk.Run(Poll(0), module.wire()).readings.size(), 2U);
    EXPECT_EQ(module.Count("$018C"), 0U);
  }
}

TEST(DconChannelTypes, ASingleInputNeedsOnlyItsOwnType) {
  config::Point point = ReadPoint("a", "#5");
  point.unit = "mA";
  Talk talk(DconProtocol(), MakeDevice({point}, {{"identify", true}, {"channel_types", true}}));
  Module module;
  module.replies.insert({{"$018C5", "!01C5R07"}, {"#015", ">+12.000"}});
  EXPECT_EQ(talk.Run(Poll(0), module.wire()).readings.size(), 1U);
  EXPECT_EQ(module.asked, (std::vector<std::string>{"$01M", "$012", "$018C5", "#015"}));
}

TEST(DconChannelTypes, ADisabledInputGivesNoRemark) {
  Talk talk(DconProtocol(), Inputs(2));
  Module module;
  module.replies.insert(
      {{"$016", "!0101"}, {"$018C0", "!01C0R08"}, {"$018C1", "!01C1R0D"}, {"#01", ">+05.000"}});
  const Answer answer = talk.Run(Poll(0), module.wire());
  ASSERT_EQ(answer.readings.size(), 2U);
  EXPECT_EQ(answer.readings[1].quality,
            Quality(Quality::bad_out_of_service, Reason::channel_disabled));
  EXPECT_TRUE(talk->trouble().text.empty());
}

TEST(DconChannelTypes, TheTwinReturnsAndAcceptsTypes) {
  const config::Device device = Inputs(2);
  FixedValues values;
  values.values[0] = values.values[1] = Value{1.5};
  values.values[2] = std::string("080600");
  const auto twin = DconProtocol().make_twin(device, values);
  Talk talk(DconProtocol(), device);
  Answer answer = talk.Run(Poll(0), *twin);
  ASSERT_EQ(answer.readings.size(), 2U);
  EXPECT_EQ(answer.readings[1].value, Value{1.5});
  const auto say = [&](const std::string& request) {
    return std::string(AsText(twin->Answer(ToBytes(request + "\r"), {})));
  };
  EXPECT_EQ(say("$018C1"), "!01C1R08\r");
  EXPECT_EQ(say("$017C1R0D"), "!01\r");
  EXPECT_EQ(say("$018C1"), "!01C1R0D\r");
  EXPECT_EQ(say("$018C7"), "?01\r");
  talk.now += 1min;
  talk.Run(Poll(0), *twin);
  answer = talk.Run(Poll(0), *twin);
  EXPECT_TRUE(IsGood(answer.readings[0].quality));
  EXPECT_EQ(answer.readings[1].quality, kNotThis);
}

TEST(DconTypes, UnitsAreRecognisedInOtherSpellings) {
  struct Row {
    const char* unit;
    /// Factor from the values of type code 0C to the unit; empty: the type does not measure this
    /// unit.
    std::optional<double> of_millivolts;
    std::optional<double> of_volts;      ///< the factor of type code 08
    std::optional<double> of_milliamps;  ///< the factor of type code 0D
    std::optional<double> of_degrees;    ///< the factor of type code 0E
  };
  constexpr std::nullopt_t kNone = std::nullopt;
  const Row kRows[] = {
      {"V", 0.001, 1, kNone, kNone},
      {"v", 0.001, 1, kNone, kNone},
      {"volt", 0.001, 1, kNone, kNone},
      {"Volts", 0.001, 1, kNone, kNone},
      {"mV", 1, 1000, kNone, kNone},
      {"mv", 1, 1000, kNone, kNone},
      {"MV", 1, 1000, kNone, kNone},
      {"ma", kNone, kNone, 1, kNone},
      {"mA ", kNone, kNone, 1, kNone},
      {"°C", kNone, kNone, kNone, 1},
      {"°c", kNone, kNone, kNone, 1},
      {"degC", kNone, kNone, kNone, 1},
      {"deg C", kNone, kNone, kNone, 1},
      {"C", kNone, kNone, kNone, 1},
      {"celsius", kNone, kNone, kNone, 1},
      {"bar", 1, 1, 1, 1},
      {"uV", 1, 1, 1, 1},
      {"", 1, 1, 1, 1},
  };
  for (const Row& row : kRows) {
    EXPECT_EQ(FactorOfType(0x0C, row.unit), row.of_millivolts) << row.unit;
    EXPECT_EQ(FactorOfType(0x08, row.unit), row.of_volts) << row.unit;
    EXPECT_EQ(FactorOfType(0x0D, row.unit), row.of_milliamps) << row.unit;
    EXPECT_EQ(FactorOfType(0x0E, row.unit), row.of_degrees) << row.unit;
  }
}

TEST(DconChannelTypes, AUnitInAnotherSpellingIsConvertedOrContradicted) {
  Talk talk(DconProtocol(), Inputs(2, "volt"));
  Module module;
  module.replies.insert({{"$016", "!0103"},
                         {"$018C0", "!01C0R0C"},
                         {"$018C1", "!01C1R0D"},
                         {"#01", ">+150.00+04.805"}});
  const Answer answer = talk.Run(Poll(0), module.wire());
  ASSERT_EQ(answer.readings.size(), 2U);
  EXPECT_DOUBLE_EQ(ToDouble(answer.readings[0].value), 0.15) << "mV";
  EXPECT_EQ(answer.readings[1].quality, kNotThis);
}

TEST(DconTypes, AUnitOfNoListedTypeIsWarnedAbout) {
  const auto doubts = [](const std::string& read, const std::string& unit,
                         std::vector<std::string> types, Settable options = {}) {
    config::Point point =
        ReadPoint("a", read, read.ends_with("total") ? Type::uint64 : Type::float32);
    point.unit = unit;
    options.emplace_back("types", std::move(types));
    return DconProtocol().doubts(MakeDevice({point}, options));
  };
  EXPECT_TRUE(doubts("#[0]", "V", {"08", "0D"}).empty());
  EXPECT_TRUE(doubts("#[0]", "V", {"0C"}).empty()) << "mV can be converted";
  EXPECT_TRUE(doubts("#[0]", "bar", {"08"}).empty());
  EXPECT_TRUE(doubts("#[0]", "mA", {}).empty());
  EXPECT_TRUE(doubts("$3", "degC", {"08"}).empty());
  EXPECT_TRUE(doubts("#[0]", "mA", {"08"}, {{"format", std::string("percent")}}).empty());
  EXPECT_EQ(doubts("#[0]", "ma", {"08"}).size(), 1U);
  EXPECT_EQ(doubts("#0 counter", "Hz", {"50"}).size(), 1U);
  EXPECT_EQ(doubts("#0 counter", "hz", {"50"}).size(), 1U);
  EXPECT_EQ(doubts("#0 total", "", {"51"}).size(), 1U);
  const auto found = doubts("#[0]", "mA", {"08", "09"});
  ASSERT_EQ(found.size(), 1U);
  EXPECT_EQ(found[0].point, 0U);
  EXPECT_NE(found[0].text.find("(08, 09) measures 'mA'"), std::string::npos) << found[0].text;
}

}  // namespace
}  // namespace baudgate::protocols::dcon
