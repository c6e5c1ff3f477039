// Tests the grammar of the configuration, and numbers in a text.
// SPDX-License-Identifier: Apache-2.0
#include "protocols/reader/points.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "config/loader.h"
#include "gateway/bus/points/point_store.h"
#include "protocols/reader/codec.h"
#include "protocols/reader/twin.h"
#include "tests/protocols/reader/support.h"
#include "tests/support/fixed_values.h"
#include "tests/support/toy_protocol.h"

namespace baudgate::protocols {
namespace {

namespace reader = protocols::reader;
using config::Type;

std::string ErrorOf(const std::string& read, Type type) {
  const Status status = reader::CheckPoint(ReaderPoint(read, type));
  return status ? "" : status.error();
}

TEST(ReaderPoints, ValidPlacesAreAccepted) {
  EXPECT_EQ(ErrorOf("tag", Type::string), "");
  EXPECT_EQ(ErrorOf("tag@15", Type::string), "");
  EXPECT_EQ(ErrorOf("low@3", Type::uint16), "");
  EXPECT_EQ(ErrorOf("present", Type::boolean), "");
  EXPECT_EQ(ErrorOf("number", Type::float32), "");
  EXPECT_EQ(ErrorOf("number 4-11", Type::float32), "");
  EXPECT_EQ(ErrorOf("identity", Type::string), "");
}

TEST(ReaderPoints, InvalidPlacesAreRefused) {
  for (const char* read : {"", "tags", "tag@16", "tag@", "tag 3", "present@1", "number 0-3",
                           "number 4-3", "number 4", "number 4-121", "b", "identity@1"}) {
    EXPECT_NE(ErrorOf(read, Type::uint16), "") << read;
  }
  EXPECT_NE(ErrorOf("tag", Type::uint64), "");
  EXPECT_NE(ErrorOf("low", Type::string), "");
  EXPECT_NE(ErrorOf("present", Type::uint16), "");
  EXPECT_NE(ErrorOf("counter", Type::boolean), "");
  config::Point written = ReaderPoint("counter");
  written.access = config::Access::read_write;
  EXPECT_FALSE(reader::CheckPoint(written));
}

TEST(ReaderOptions, MustBeConsistent) {
  using Texts = std::vector<std::pair<std::string, std::string>>;
  const auto error = [](const Texts& texts) {
    config::Device device = Reader(texts);
    if (texts.size() > 1) device.points.clear();
    const Status status = reader::CheckDevice(device);
    return status ? "" : status.error();
  };
  EXPECT_EQ(error({}), "");
  EXPECT_EQ(error({{"form", "text"}, {"start", "0x02"}, {"end", ":"}}), "");
  EXPECT_NE(error({{"form", "text"}, {"start", "STX"}}), "");
  EXPECT_NE(error({{"form", "text"}, {"end", "0x100"}}), "");
  EXPECT_NE(error({{"start", ":"}, {"end", ":"}}), "");
  EXPECT_NE(error({{"length", "100"}, {"most", "80"}}), "");
  EXPECT_NE(error({{"idle", "0s"}, {"whole", "1s"}}), "");
  EXPECT_NE(error({{"idle", "3s"}, {"whole", "2s"}}), "");
  EXPECT_NE(error({{"form", "text"}}), "") << "high, middle and low of a text";
  EXPECT_EQ(error({{"commands", "ask"}}), "");
  EXPECT_NE(error({{"commands", "ask"}, {"form", "text"}}), "");
  EXPECT_NE(error({{"commands", "ask"}, {"same_tag", "0s"}}), "");
  EXPECT_NE(error({{"commands", "ask"}, {"answer", "1001ms"}}), "");
  EXPECT_NE(error({{"commands", "ask"}, {"answer", "0s"}}), "");
  EXPECT_EQ(error({{"commands", "ask"}, {"answer", "5s"}, {"same_tag", "10s"}}), "");
}

TEST(ReaderOptions, PolledPointsNeedCommands) {
  config::Device device = Reader();
  device.points.push_back(ReaderPoint("message", Type::string));
  device.points.push_back(ReaderPoint("identity", Type::string));
  const auto error = [&] {
    const Status status = reader::CheckDevice(device);
    return status ? std::string() : status.error();
  };
  EXPECT_EQ(error(), "point 'identity': 'identity' needs commands: ask");
  device.points.pop_back();
  device.records = {{"transponder", {7}}};
  EXPECT_THAT(error(), ::testing::HasSubstr("record 'transponder' needs commands: ask"));
  device.options.Set("commands", std::string("ask"));
  EXPECT_EQ(error(), "");
  device.records[0].points.push_back(0);
  EXPECT_EQ(error(),
            "record 'transponder': 'tag' cannot be read again after an event; use present, "
            "repeats, message or number");
}

TEST(ReaderTwins, AnswerCommandsIfConfigured) {
  FixedValues values;
  const config::Device silent = Reader();
  const config::Device asked = Reader({{"commands", "ask"}});
  reader::ReaderTwin twin(asked, values);
  const auto said = [&](const char* command) {
    return std::string(AsText(twin.Answer(ToBytes(command), Instant())));
  };
  EXPECT_EQ(said("i\r"), "\r\nMOD-RFID125-BOX\r\n>");
  EXPECT_EQ(said("r\r"), "\r\n-0000000000\r\n>");
  EXPECT_EQ(said("b\r"), "");
  twin.Raise({.code = 1, .text = "255"}, {});
  twin.Say(Instant());
  EXPECT_EQ(said("r\r"), "\r\n-00000000FF\r\n>");
  EXPECT_TRUE(reader::ReaderTwin(silent, values).Answer(ToBytes("r\r"), Instant()).empty());
}

TEST(ReaderNumbers, ATextMustContainExactlyOneNumber) {
  const auto shown = [](const std::string& text, const std::string& read = "number",
                        const char* unit = "") {
    const auto item = reader::ParseItem(ReaderPoint(read, Type::float32));
    const Decoded decoded = reader::NumberIn(*item, text, unit);
    return IsGood(decoded.quality) ? ToText(decoded.value) : "bad";
  };
  EXPECT_EQ(shown("12.35"), "12.35");
  EXPECT_EQ(shown("ST,GS,+  12.35kg"), "12.35");
  EXPECT_EQ(shown("-  0.05 kg"), "-0.05");
  EXPECT_EQ(shown("W=-7;"), "-7");
  EXPECT_EQ(shown("1 12.35"), "bad") << "which one?";
  EXPECT_EQ(shown("1.2.3"), "bad");
  EXPECT_EQ(shown(".5kg"), "0.5");
  EXPECT_EQ(shown("-.5kg"), "-0.5");
  EXPECT_EQ(shown("ST,GS,+ .35kg"), "0.35");
  EXPECT_EQ(shown("ST,GS, -  .75kg"), "-0.75");
  EXPECT_EQ(shown("$.99"), "0.99");
  EXPECT_EQ(shown("..5"), "bad");
  EXPECT_EQ(shown("No.5"), "bad") << "5, or 0.5?";
  EXPECT_EQ(shown("No. 5"), "5");
  EXPECT_EQ(shown("+ - 5"), "bad");
  EXPECT_EQ(shown(""), "bad");
  EXPECT_EQ(shown("overload"), "bad");
  EXPECT_EQ(shown("1 12.35", "number 2-7"), "12.35");
  EXPECT_EQ(shown("1", "number 2-7"), "bad");
  for (const char* text :
       {"12.35-", "12.35kg-", "(12.35) kg", "-12.35-", "12.35 -", "#12.35", "12.35*", "Lot-A 12.35",
        "\x02"
        "12.35",
        "1.2E3", "12.35."}) {
    EXPECT_EQ(shown(text), "bad") << text;
  }
  EXPECT_EQ(shown("12.35 l/h"), "12.35");
}

TEST(ReaderNumbers, AWeightMustHaveItsOwnUnitOrNone) {
  const auto weight = [](const std::string& text, const std::string& read = "number") {
    const auto item = reader::ParseItem(ReaderPoint(read, Type::float32));
    const Decoded decoded = reader::NumberIn(*item, text, "kg");
    return IsGood(decoded.quality) ? ToText(decoded.value) : "bad";
  };
  for (const char* text : {"12.35", "+12.35", "ST,GS,+  12.35kg", "wn12.35kg", "12.35 KG"}) {
    EXPECT_EQ(weight(text), "12.35") << text;
  }
  for (const char* text : {"Err 03", "INDICATOR XK3190 READY", "TICKET 0042", "SN:00217A",
                           "W=12.35", "ST,GS,+  27.22lb", "12.35 g", "12.35t", "12.35 l/h"}) {
    EXPECT_EQ(weight(text), "bad") << text;
  }
  EXPECT_EQ(weight("W=12.35;", "number 3-7"), "12.35");
  EXPECT_EQ(weight("ST,GS,+  27.22lb", "number 7-14"), "bad") << "its unit stands behind";
}

TEST(ReaderNumbers, AnotherUnitOfTheSameQuantityIsBad) {
  const std::tuple<const char*, const char*, bool> kRows[] = {
      {"12.35mm", "mm", true},     {"12.35 MM", "mm", true}, {"0.486in", "mm", false},
      {"12.35", "mm", true},       {"12.35 OK", "mm", true}, {"12.35 cm", "mm", false},
      {"14.5 psi", "bar", false},  {"1.0 BAR", "bar", true}, {"23.5 C", "\u00B0C", true},
      {"74.3F", "\u00B0C", false}, {"5.0 MV", "mV", false},  {"5.0 mV", "mV", true},
      {"5.0 V", "mV", false},      {"12.35 l/h", "", true},  {"12.35 G", "g", true},
      {"1.2 kN", "N", false},      {"12.35 pcs", "%", true}};
  for (const auto& [text, unit, good] : kRows) {
    const auto item = reader::ParseItem(ReaderPoint("number", Type::float32));
    EXPECT_EQ(IsGood(reader::NumberIn(*item, text, unit).quality), good) << text << " " << unit;
  }
}

TEST(ReaderNumbers, ARangeMustNotCutANumber) {
  const auto shown = [](const std::string& text, const std::string& read) {
    const auto item = reader::ParseItem(ReaderPoint(read, Type::float32));
    const Decoded decoded = reader::NumberIn(*item, text, "");
    return IsGood(decoded.quality) ? ToText(decoded.value) : "bad";
  };
  const std::string text = "A 160.3 kg";
  for (const char* right : {"number 2-7", "number 3-7", "number 1-10", "number 3-8"})
    EXPECT_EQ(shown(text, right), "160.3") << right;
  for (const char* wrong : {"number 4-7", "number 5-7", "number 6-7", "number 7-9", "number 3-6",
                            "number 3-5", "number 2-4"})
    EXPECT_EQ(shown(text, wrong), "bad") << wrong;
  EXPECT_EQ(shown("A-160.3", "number 3-7"), "bad") << "the sign is outside";
  EXPECT_EQ(shown("A- 160.3", "number 3-8"), "bad");
  EXPECT_EQ(shown("(160.3)", "number 2-6"), "bad");
  EXPECT_EQ(shown("160.3- kg", "number 1-5"), "bad");
  EXPECT_EQ(shown("160.3 - kg", "number 1-6"), "bad");
  EXPECT_EQ(shown("+12.30-45.60", "number 1-6"), "12.3") << "the next number's sign";
  EXPECT_EQ(shown("+12.30-45.60", "number 7-12"), "-45.6");
}

TEST(ReaderTwins, SendRaisedTags) {
  const config::Device device = Reader();
  FixedValues values;
  reader::ReaderTwin twin(device, values);
  EXPECT_TRUE(twin.Say(Instant()).empty());
  EXPECT_TRUE(twin.Raise({.code = 1}, {}));
  EXPECT_TRUE(twin.Raise({.code = 1, .text = "255"}, {}));
  EXPECT_EQ(twin.Say(Instant()), TagFrame("06001259E3"));
  EXPECT_EQ(twin.Say(Instant()), TagFrame("00000000FF"));
  EXPECT_TRUE(twin.Say(Instant()).empty());
  int raised = 0;
  while (raised < 1000 && twin.Raise({.code = 1}, {})) ++raised;
  EXPECT_EQ(raised, 100) << "a twin that nobody reads keeps so many";
}

using ::testing::HasSubstr;

config::Loaded Load(const std::string& devices, const std::string& line = {}) {
  const config::Catalog catalog{
      {{"reader", &ReaderProtocol()}, {"toy", &ToyProtocol()}}, {}, {"config/profiles"}};
  return config::LoadText(
      "events: {}\nlines:\n  - { name: gate, port: /dev/ttyACM0, protocol: reader" + line +
          ",\n      devices: [" + devices + "] }\n",
      "test.yaml", catalog);
}

std::string ProblemsOf(const std::string& devices, const std::string& line = {}) {
  std::string text;
  for (const config::Problem& problem : Load(devices, line).problems)
    text += ToString(problem) + "\n";
  return text;
}

TEST(ReaderConfig, TheProfilesLoad) {
  for (const char* profile :
       {"olimex-mod-rfid125", "olimex-mod-rfid125-asked", "bar-code", "weighing"}) {
    const std::string rest = "profile: " + std::string(profile) + " }";
    EXPECT_EQ(ProblemsOf("{ name: gate-1, " + rest), "") << "readers have no address";
    EXPECT_EQ(ProblemsOf("{ name: gate-1, address: 1, " + rest), "");
  }
}

TEST(ReaderConfig, TagsAreEventsAndWeightsAreNot) {
  const auto has_events = [](const std::string& profile) {
    return Load("{ name: g, address: 1, profile: " + profile + " }")
        .config.lines[0]
        .devices[0]
        .events;
  };
  EXPECT_TRUE(has_events("olimex-mod-rfid125"));
  EXPECT_TRUE(has_events("bar-code"));
  EXPECT_FALSE(has_events("weighing"));
}

TEST(ReaderConfig, PointsDoNotAgeUnlessConfigured) {
  const auto limits = [](const std::string& more) {
    const auto loaded = Load("{ name: g, address: 1, profile: weighing" + more + " }");
    return bus::LimitsOf(loaded.config.lines[0].devices[0],
                         {})[static_cast<std::size_t>(config::Group::fast)];
  };
  EXPECT_FALSE(limits("").ages());
  EXPECT_EQ(limits(", max_age: 5s").uncertain_after, 5s);
  EXPECT_EQ(limits(", max_age: 5s").bad_after, 15s);
  EXPECT_EQ(limits(", max_age: 200ms").uncertain_after, 200ms) << "it is not polled every second";
  EXPECT_THAT(ProblemsOf("{ name: g, address: 1, profile: weighing, dead_age: 5s }"),
              HasSubstr("error: dead_age: has no effect without max_age"));
}

TEST(ReaderConfig, TheEightTagsHaveAdjacentRegisters) {
  const auto loaded = Load("{ name: g, address: 1, profile: olimex-mod-rfid125, unit: 40 }");
  std::vector<int> owners(63);
  for (const config::Point& point : loaded.config.lines[0].devices[0].points) {
    if (!point.modbus || point.table != config::Table::registers) continue;
    for (std::size_t i = 0; i < config::RegisterCount(point); ++i) ++owners.at(*point.modbus + i);
  }
  EXPECT_THAT(owners, ::testing::Each(1)) << "one request reads all, without a hole";
}

TEST(ReaderConfig, ReadsAfterATagAreOneRecord) {
  const auto loaded = Load("{ name: g, address: 1, profile: olimex-mod-rfid125-asked }");
  const config::Device& device = loaded.config.lines[0].devices[0];
  ASSERT_EQ(device.records.size(), 1U);
  EXPECT_EQ(device.event_texts[0].record, device.records[0].name);
  EXPECT_THAT(
      ProblemsOf("{ name: g, address: 1, profile: olimex-mod-rfid125-asked, commands: none }"),
      HasSubstr("needs commands: ask"));
}

TEST(ReaderConfig, AReaderNeedsALineOfItsOwn) {
  const std::string reader = "{ name: g, address: 1, profile: bar-code }";
  EXPECT_THAT(ProblemsOf(reader + ", { name: h, address: 2, profile: bar-code }"),
              HasSubstr("device 'g' sends without requests and needs a line of its own, but line "
                        "'gate' has 2 devices"));
  EXPECT_THAT(ProblemsOf(reader + ", { name: h, address: A, protocol: toy, points: [] }"),
              HasSubstr("needs a line of its own"));
}

TEST(ReaderConfig, ErrorsInOptionsAreReportedWithTheirPlace) {
  EXPECT_THAT(ProblemsOf("{ name: g, address: 1, profile: bar-code, start: STX }"),
              HasSubstr("test.yaml:4:17: error: device 'g': 'STX' is not a character; write "
                        "one character, as ':', or its code"));
  EXPECT_THAT(ProblemsOf("{ name: g, address: 1, profile: bar-code, idle: 3s, whole: 1s }"),
              HasSubstr("whole must not be shorter than idle; raise whole, or lower idle"));
  EXPECT_THAT(ProblemsOf("{ name: g, address: 1, profile: olimex-mod-rfid125, form: text }"),
              HasSubstr("'high' needs form: tag"));
  EXPECT_THAT(
      ProblemsOf("{ name: g, address: gate, profile: bar-code }"),
      HasSubstr("a reader needs no address, so remove the key, or write a number from 1 to 255"));
}

}  // namespace
}  // namespace baudgate::protocols
