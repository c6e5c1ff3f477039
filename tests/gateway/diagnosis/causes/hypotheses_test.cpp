// Tests of each cause that `baudgate status` can name.
// SPDX-License-Identifier: Apache-2.0
#include <fstream>
#include <iterator>
#include <string>

#include "protocols/dcon/protocol.h"
#include "protocols/set4tm/protocol.h"
#include "tests/gateway/outputs/status/hypotheses_fixture.h"
#include "tests/support/file_cases.h"

namespace baudgate::diagnosis {
namespace {

using status::HypothesesTest;
using enum Symptom;

TEST_F(HypothesesTest, FewerRegistersThanRequestedSuggestASmallerBlock) {
  const Finding few = {
      .bytes = 25, .expected = 85, .cause = "22 bytes came where 82 answer the request"};
  const struct {
    const protocols::Protocol& protocol;
    std::size_t good;
    std::string block;
  } rows[] = {{protocols::ModbusRtuProtocol(), 21, "8"},
              {protocols::ModbusTcpProtocol(), 25, "8"},
              {protocols::ModbusAsciiProtocol(), 43, "8"},
              {protocols::ModbusRtuProtocol(), 0, "1"}};
  for (const auto& row : rows) {
    config_.lines[0].devices[1].traits = &row.protocol.traits;
    std::vector<status::Seen> seen = {{odd, 9, few}};
    if (row.good > 0) seen.push_back({clean, 2, {.bytes = row.good, .expected = row.good}});
    EXPECT_EQ(SayOf({.seen = seen, .says = {}, .state = status::kHere}),
              "it gives fewer registers than requested (22 bytes came where 82 answer the "
              "request). Set block: " +
                  row.block + " in the configuration" +
                  (row.block == "1" ? ", or update its firmware" : ""));
  }
}

/// A reply without a register is no shorter block: the function was refused without the exception
/// bit.
TEST_F(HypothesesTest, AReplyWithoutARegisterSuggestsNoBlock) {
  config_.lines[0].devices[1].traits = &protocols::ModbusRtuProtocol().traits;
  const Finding none = {.bytes = 5, .expected = 11, .cause = "2 bytes came instead of 8"};
  EXPECT_EQ(
      SayOf({.seen = {{odd, 9, none}}, .says = {}, .state = status::kHere}),
      "its replies do not fit the requests (2 bytes came instead of 8). Check that the profile "
      "fits the device and its options");
}

/// One failing request with a flow-control byte can be chance, so the converter is not named.
TEST_F(HypothesesTest, RequestsFailingAtFlowControlBytesNameTheConverter) {
  constexpr std::uint8_t kXon = 0b00100;
  const bus::QueryCount good = {.first_point = 0, .points = 1};
  const bus::QueryCount dead = {
      .first_point = 1, .points = 1, .in_vain = 8, .symptom = silence, .asked = kXon};
  bus::QueryCount other = dead;
  other.asked = 0;
  bus::QueryCount cut = other;
  cut.symptom = tail_lost;
  const std::string says =
      "only requests that contain 11 fail. Switch XON/XOFF off at the converter or serial server";
  const status::Seen silent = {silence, 16};
  EXPECT_EQ(
      SayOf({{{clean, 16}, silent}, {}, status::kAnswered | status::kHere, {good, dead, dead}}),
      says);
  EXPECT_THAT(Say(), ::testing::ElementsAre(says));
  EXPECT_EQ(
      SayOf(
          {{{clean, 16}, silent}, {}, status::kAnswered | status::kHere, {good, dead, dead, cut}}),
      says);
  const struct {
    std::vector<status::Seen> seen;
    std::vector<bus::QueryCount> queries;
  } others[] = {{{{clean, 16}, silent}, {good, dead}},
                {{{clean, 16}, silent}, {good, dead, dead, other}},
                {{{clean, 16, {.asked = kXon}}, silent}, {good, dead, dead}}};
  for (const auto& row : others) {
    EXPECT_NE(SayOf({row.seen, {}, status::kAnswered | status::kHere, row.queries}), says);
  }
}

TEST_F(HypothesesTest, DamagedNeighboursSuggestNoiseOnTheLine) {
  const auto mixed = [this](bus::DeviceStatus& status) {
    Looked(status, clean, 25);
    for (const Symptom symptom : {damaged, noise, end_lost, bad_check}) Looked(status, symptom, 1);
  };
  const std::string own = "Check wire and plug at its end";
  mixed(device());
  Looked(device(), damaged, 2);
  EXPECT_THAT(Say()[0], ::testing::HasSubstr(own));
  mixed(neighbour_.status);
  EXPECT_THAT(Say()[0], ::testing::HasSubstr("come damaged. Check termination"));
  Looked(neighbour_.status, clean, 32);
  Looked(neighbour_.status, silence, 4);
  EXPECT_THAT(Say()[0], ::testing::HasSubstr(own)) << "something else is wrong with it";
}

TEST_F(HypothesesTest, ANeighbourThatNeverAnswersMayShareTheAddress) {
  Looked(device(), damaged, 12);
  neighbour_.status.last_ok.reset();
  neighbour_.status.state = bus::DeviceState::never_seen;
  Looked(neighbour_.status, silence, 32);
  EXPECT_THAT(Say()[0], ::testing::HasSubstr("its replies come damaged. Check whether feeder-1, "
                                             "which never answers, has address 2 as well"));
}

TEST_F(HypothesesTest, EndlessBytesAreReported) {
  device().state = bus::DeviceState::offline;
  device().last_ok = status::kNow.instant - 30s;
  Looked(device(), noise, 20);
  line_.babble = 3000;
  line_.babble_since = status::kNow.instant - 30s;
  EXPECT_THAT(Say()[0], ::testing::HasSubstr("bytes come without an end"));
  line_.babble_since = status::kNow.instant - 10min;
  EXPECT_THAT(Say()[0], ::testing::HasSubstr("its replies come damaged"));
}

/// The other master sometimes sends the same requests as the gateway. They look like late echoes.
TEST_F(HypothesesTest, AnotherMasterSeenBesideANeighbourIsReported) {
  Looked(device(), late_echo, 5);
  EXPECT_THAT(Say()[0], ::testing::HasSubstr("the gateway's own requests come back late"));
  Looked(neighbour_.status, master_beside, 2, {.cause = "another master", .remedy = "one"});
  EXPECT_THAT(Say()[0], ::testing::HasSubstr("another master. One"));
}

/// If two meters answer at the same time, their replies damage each other and break off.
TEST_F(HypothesesTest, ACommonAddressIsReportedWhenRepliesAreDoubled) {
  config_.lines[0].devices[1].traits = &protocols::Set4tmProtocol().traits;
  Looked(device(), tail_lost, 12, {.bytes = 8, .expected = 16});
  EXPECT_THAT(Say()[0], ::testing::HasSubstr("its replies break off"));
  config_.lines[0].devices[1].address = "0";
  EXPECT_THAT(Say()[0], ::testing::HasSubstr("its replies break off"));
  device().doubled = 1;
  EXPECT_THAT(Say()[0], ::testing::HasSubstr("every device answers to address 0"));
}

Symptom SymptomNamed(std::string_view name) {
  std::uint8_t number = 0;
  while (Name(static_cast<Symptom>(number)) != name) ++number;
  return static_cast<Symptom>(number);
}

status::Seen SeenOf(const std::string& line) {
  const std::string between = " | ";
  std::size_t at = line.find(between);
  const std::size_t space = line.find(' ');
  status::Seen seen{SymptomNamed(line.substr(0, space)),
                    static_cast<std::uint32_t>(std::stoul(line.substr(space)))};
  while (at != std::string::npos) {
    at += between.size();
    const std::size_t equals = line.find('=', at);
    const std::string key = line.substr(at, equals - at);
    at = line.find(between, at);
    const std::string value = line.substr(equals + 1, at - std::min(at, equals + 1));
    Finding& finding = seen.finding;
    if (key == "cause") {
      finding.cause = value;
    } else if (key == "remedy") {
      finding.remedy = value;
    } else if (value == "unknown") {
      finding.idle = kLongIdle;
    } else {
      const auto number = std::stoul(value);
      if (key == "time") finding.time = std::chrono::milliseconds(number);
      if (key == "idle") finding.idle = std::chrono::milliseconds(number);
      if (key == "bytes") finding.bytes = number;
      if (key == "expected") finding.expected = number;
      if (key == "specials") finding.specials = static_cast<std::uint8_t>(number);
      if (key == "ended") finding.ended = number > 0;
    }
  }
  return seen;
}

TEST_F(HypothesesTest, TheBestSupportedCauseIsReported) {
  const auto cases = ReadFileCases("tests/gateway/diagnosis/causes/causes.txt");
  EXPECT_GT(cases.size(), 80U);
  for (const FileCase& one : cases) {
    SCOPED_TRACE(one.place);
    status::Row row;
    for (const auto& [word, flag] : {std::pair("answered", status::kAnswered),
                                     {"here", status::kHere},
                                     {"neighbour", status::kNeighbour},
                                     {"server", status::kServer}}) {
      if (one.given[0].find(word) != std::string::npos) row.state |= flag;
    }
    for (std::size_t i = 1; i < one.given.size(); ++i) row.seen.push_back(SeenOf(one.given[i]));
    std::vector<std::pair<char, std::string>> said;
    for (const auto& [cause, sentence] : CausesOf(row)) {
      said.emplace_back('*', cause);
      said.emplace_back('=', sentence);
    }
    EXPECT_EQ(said, one.results);
  }
}

TEST_F(HypothesesTest, TheCauseDoesNotChangeWithEachLook) {
  Looked(device(), damaged, 12);
  Looked(device(), clean, 30);
  Looked(device(), silence, 2);
  EXPECT_THAT(Say()[0],
              ::testing::StartsWith("2 of 32 exchanges failed: its replies come damaged"));
  Looked(device(), silence, 20);
  EXPECT_THAT(Say()[0], ::testing::HasSubstr("a request gets no answer"))
      << "now there are more of these";
  device().findings = {};
  device().findings.Add({.symptom = damaged}, status::kNow.instant - 5min);
  device().findings.Add({.symptom = damaged}, status::kNow.instant - 5min);
  for (int i = 0; i < 2; ++i) {
    device().findings.Add({.symptom = clean}, status::kNow.instant);
    device().findings.Add({.symptom = silence}, status::kNow.instant);
  }
  EXPECT_THAT(Say()[0], ::testing::HasSubstr("a request gets no answer"))
      << "those of two minutes count";
}

TEST_F(HypothesesTest, TheReportedCauseStaysUntilAnotherIsClearlyStronger) {
  const auto say = [this](std::uint32_t damages, std::uint32_t silences) {
    Looked(device(), damaged, damages);
    Looked(device(), silence, silences);
    Looked(device(), clean, 8);
    const bool damage = Say()[0].find("come damaged") != std::string::npos;
    return std::string(damage ? "damage" : "losses");
  };
  EXPECT_EQ(say(18, 14), "damage");
  EXPECT_EQ(say(15, 17), "damage");
  EXPECT_EQ(say(10, 22), "losses");
  EXPECT_EQ(say(17, 15), "losses");
  EXPECT_EQ(say(28, 4), "damage");
}

TEST_F(HypothesesTest, TheTableOfTheDocsContainsEveryCause) {
  std::ifstream file("docs/status.md");
  const std::string docs{std::istreambuf_iterator<char>(file), {}};
  const auto begin = docs.find("### Causes");
  const std::string table = docs.substr(begin, docs.find("\n## ", begin) - begin);
  for (const Hypothesis& hypothesis : Hypotheses()) {
    EXPECT_NE(table.find("*" + std::string(hypothesis.cause)), std::string::npos)
        << hypothesis.cause;
  }
  std::size_t rows = 0;
  for (auto at = table.find("\n| *"); at != std::string::npos; at = table.find("\n| *", at + 1))
    ++rows;
  EXPECT_EQ(rows, Hypotheses().size()) << "a row is a cause";
}

/// At other times the same requests are answered well, so damage on the line explains the odd
/// replies.
TEST_F(HypothesesTest, OccasionalMisfitsAreReportedAsDamageOnceValuesWereRead) {
  Finding wide = {.cause = "number '+02.51' is 6 characters wide, not 7", .remedy = "set width"};
  status::Row row = {{{clean, 20}, {odd, 5, wide}}, "", status::kAnswered | status::kHere};
  const std::string said = "number '+02.51' is 6 characters wide, not 7. Set width";
  EXPECT_EQ(SayOf(row), said);
  config::Device& meant = config_.lines[0].devices[1];
  meant.traits = &protocols::DconProtocol().traits;
  meant.options.Set("checksum", false);
  EXPECT_EQ(SayOf(row), said) << "no value was ever read";
  row.queries = {{.points = 1}};
  record_.points[0].value = 2.5;
  EXPECT_EQ(
      SayOf(row),
      "some replies are damaged ('+02.51') by noise or by a converter that loses characters. Check "
      "termination and ground, and switch a checksum on at the device and in the configuration");
  row.seen.push_back({other_device, 3, {.cause = "module 17 answers where 01 was asked"}});
  EXPECT_THAT(SayOf(row), ::testing::StartsWith("some replies are damaged ('+02.51') by"))
      << "an address that lacks a character";
  row.seen.pop_back();
  meant.options.Set("checksum", true);
  EXPECT_EQ(SayOf(row), said);
  meant.traits = &protocols::ModbusRtuProtocol().traits;
  row.seen[1].finding = {.cause = "14 bytes came where 4 answer the request"};
  EXPECT_EQ(SayOf(row),
            "some replies belong to other requests (14 bytes came where 4 answer the request). "
            "Look for another client of the server, or another master");
}

TEST_F(HypothesesTest, MisfitsAmongMostlyGoodMessagesAreReportedAsDamage) {
  const Finding other = {.cause = "its messages do not end with 0x0D", .remedy = "set end"};
  const auto say = [&](std::uint32_t good) {
    NeverAnswered();
    device().unasked = true;
    device().last_ok = status::kNow.instant;
    Looked(device(), clean, good);
    Looked(device(), other_setting, 10, other);
    const bus::DeviceRecord both[] = {neighbour_, record_};
    const Evidence evidence = Gather(line_, record_, both, status::kNow);
    return Judge(evidence).front()->say(evidence);
  };
  EXPECT_EQ(say(5), "its messages do not end with 0x0D. Set end");
  EXPECT_THAT(say(22), ::testing::StartsWith("they come damaged. Check for noise"));
}

TEST_F(HypothesesTest, UnaskedMessagesThatDoNotFitNameTheirCause) {
  const Finding length = {.cause = "its messages have 11 characters", .remedy = "set length"};
  const Finding fits = {.cause = "its check value is computed in another way (xor8 fits)",
                        .remedy = "write checksum: xor8"};
  const Finding differs = {.cause = "a text", .remedy = "it differs always by 24"};
  const struct {
    Symptom symptom;
    Finding finding;
    bool answered;
    std::string says;
  } rows[] = {
      {bytes_lost, length, true,
       "characters are missing in some of its messages. Check for a bad wire"},
      {bytes_lost, length, false, "its messages have 11 characters. Set length"},
      {bad_check, fits, false,
       "its check value is computed in another way (xor8 fits). Write checksum: xor8"},
      {bad_check, fits, true, "its check value is computed in another way (xor8 fits)"},
      {bad_check, differs, false,
       "its check value is computed in another way. It differs always by 24"},
      {bad_check, differs, true, "they come damaged"},
      {text, {.cause = "'login:'"}, false, "text comes in place of messages ('login:')"},
  };
  for (const auto& row : rows) {
    NeverAnswered();
    device().unasked = true;
    if (row.answered) device().last_ok = status::kNow.instant;
    if (row.answered) Looked(device(), clean, 8);
    Looked(device(), row.symptom, 10, row.finding);
    const bus::DeviceRecord both[] = {neighbour_, record_};
    const Evidence evidence = Gather(line_, record_, both, status::kNow);
    EXPECT_THAT(Judge(evidence).front()->say(evidence), ::testing::StartsWith(row.says));
  }
}

TEST_F(HypothesesTest, VaryingWrongCheckValuesAreReportedAsDamage) {
  NeverAnswered();
  for (const char* const by : {"01", "20", "08", "01", "80", "04", "20", "10"}) {
    Looked(device(), bad_check, 1, {.cause = "a text", .remedy = by});
  }
  const bus::DeviceRecord both[] = {neighbour_, record_};
  const Evidence evidence = Gather(line_, record_, both, status::kNow);
  EXPECT_THAT(Judge(evidence).front()->say(evidence),
              ::testing::StartsWith("its replies have a wrong check value"));
}

TEST_F(HypothesesTest, SettingsNameTheCheckValue) {
  EXPECT_EQ(Settings(record_), "bit rate, parity and protocol (9600 7E1, spabus)");
  config_.lines[0].devices[1].options.Set("checksum", true);
  const std::string settings = "bit rate, parity and protocol (9600 7E1, checksum: on, spabus)";
  EXPECT_EQ(Settings(record_), settings);
  for (const unsigned state : {0U, 0U + status::kNeighbour}) {
    EXPECT_THAT(SayOf({{{silence, 20}}, {}, state}), ::testing::HasSubstr(settings));
    EXPECT_THAT(SayOf({{{noise, 20}}, {}, state}), ::testing::HasSubstr(settings));
  }
  config_.lines[0].devices[1].options.Set("checksum", std::string("crc"));
  EXPECT_THAT(Settings(record_), ::testing::HasSubstr("checksum: crc"));
}

}  // namespace
}  // namespace baudgate::diagnosis
