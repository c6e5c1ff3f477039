// Causes that depend on how the device is configured, and of messages that come unasked.
// SPDX-License-Identifier: Apache-2.0
#include <string>

#include "protocols/dcon/protocol.h"
#include "tests/gateway/outputs/status/hypotheses_fixture.h"

namespace baudgate::control {
namespace {

/// What it says now and then of requests that are answered well at other times.
TEST_F(HypothesesTest, MisfitsNowAndThen) {
  Finding wide = {.cause = "number '+02.51' is 6 characters wide, not 7", .remedy = "set width"};
  Row row = {{{clean, 20}, {odd, 5, wide}}, "", kAnswered | kHere};
  const std::string said = "number '+02.51' is 6 characters wide, not 7: ";
  EXPECT_EQ(SayOf(row), said + "set width");
  config::Device& meant = config_.lines[0].devices[1];
  meant.traits = &DconProtocol().traits;
  meant.options.Set("checksum", false);
  EXPECT_EQ(SayOf(row), said + "set width") << "no value was ever read";
  row.queries = {{.points = 1}};
  record_.points[0].value = 2.5;
  EXPECT_EQ(SayOf(row),
            "some replies are damaged ('+02.51'): noise on the line, or a converter loses "
            "characters: check termination and ground, and switch its checksum on");
  row.seen.push_back({other_device, 3, {.cause = "module 17 answers where 01 was asked"}});
  EXPECT_THAT(SayOf(row), ::testing::StartsWith("some replies are damaged ('+02.51'): "))
      << "an address that lacks a character";
  row.seen.pop_back();
  meant.options.Set("checksum", true);
  EXPECT_EQ(SayOf(row), said + "set width");
  meant.traits = &ModbusRtuProtocol().traits;
  row.seen[1].finding = {.cause = "14 bytes came where 4 answer the request"};
  EXPECT_EQ(SayOf(row),
            "some replies belong to other requests (14 bytes came where 4 answer the request): "
            "another client of the server, or another master");
}

TEST_F(HypothesesTest, OfMessagesThatMostlyAreRightTheOthersAreDamaged) {
  const Finding other = {.cause = "its messages do not end with 0x0D", .remedy = "set end"};
  const auto say = [&](std::uint32_t good) {
    NeverAnswered();
    device().unasked = true;
    device().last_ok = kNow.instant;
    Looked(device(), clean, good);
    Looked(device(), other_setting, 10, other);
    const DeviceRecord both[] = {neighbour_, record_};
    const Evidence evidence = Gather(line_, record_, both, kNow);
    return Judge(evidence).front()->say(evidence);
  };
  EXPECT_EQ(say(5), "its messages do not end with 0x0D: set end");
  EXPECT_THAT(say(22), ::testing::StartsWith("they come damaged: noise or a bad wire"));
}

TEST_F(HypothesesTest, OfMessagesThatComeByThemselves) {
  const Finding length = {.cause = "its messages have 11 characters", .remedy = "set length"};
  const Finding fits = {.cause = "its check value is computed otherwise (xor8 fits)",
                        .remedy = "write checksum: xor8"};
  const Finding differs = {.cause = "a text", .remedy = "it differs always by 24"};
  const struct {
    Symptom symptom;
    Finding finding;
    bool answered;
    std::string says;
  } rows[] = {
      {bytes_lost, length, true, "characters are missing in some of its messages: a bad wire"},
      {bytes_lost, length, false, "its messages have 11 characters: set length"},
      {bad_check, fits, false,
       "its check value is computed otherwise (xor8 fits): write checksum: xor8"},
      {bad_check, fits, true, "its check value is computed otherwise (xor8 fits)"},
      {bad_check, differs, false, "its check value is computed otherwise: it differs always by 24"},
      {bad_check, differs, true, "they come damaged"},
      {text, {.cause = "'login:'"}, false, "text comes in place of messages ('login:')"},
  };
  for (const auto& row : rows) {
    NeverAnswered();
    device().unasked = true;
    if (row.answered) device().last_ok = kNow.instant;
    if (row.answered) Looked(device(), clean, 8);
    Looked(device(), row.symptom, 10, row.finding);
    const DeviceRecord both[] = {neighbour_, record_};
    const Evidence evidence = Gather(line_, record_, both, kNow);
    EXPECT_THAT(Judge(evidence).front()->say(evidence), ::testing::StartsWith(row.says));
  }
}

TEST_F(HypothesesTest, CheckValuesThatAreWrongInAnyWayAreDamaged) {
  NeverAnswered();
  for (const char* const by : {"01", "20", "08", "01", "80", "04", "20", "10"}) {
    Looked(device(), bad_check, 1, {.cause = "a text", .remedy = by});
  }
  const DeviceRecord both[] = {neighbour_, record_};
  const Evidence evidence = Gather(line_, record_, both, kNow);
  EXPECT_THAT(Judge(evidence).front()->say(evidence),
              ::testing::StartsWith("its replies have a wrong check value"));
}

TEST_F(HypothesesTest, SettingsNameTheCheckValue) {
  EXPECT_EQ(Settings(record_), "bit rate, parity and protocol (9600 7E1, spabus)");
  config_.lines[0].devices[1].options.Set("checksum", true);
  const std::string settings =
      "bit rate, parity, checksum and protocol (9600 7E1, checksum on here, spabus)";
  EXPECT_EQ(Settings(record_), settings);
  for (const unsigned state : {0U, 0U + kNeighbour}) {
    EXPECT_THAT(SayOf({{{silence, 20}}, {}, state}), ::testing::HasSubstr(settings));
    EXPECT_THAT(SayOf({{{noise, 20}}, {}, state}), ::testing::HasSubstr(settings));
  }
  config_.lines[0].devices[1].options.Set("checksum", std::string("crc"));
  EXPECT_THAT(Settings(record_), ::testing::HasSubstr("checksum crc here"));
}

}  // namespace
}  // namespace baudgate::control
