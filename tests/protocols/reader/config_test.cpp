// Readers in a configuration, and their profiles.
// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "config/loader.h"
#include "gateway/bus/points/point_store.h"
#include "tests/protocols/reader/support.h"
#include "tests/support/toy_protocol.h"

namespace baudgate {
namespace {

using ::testing::HasSubstr;
using ::testing::IsEmpty;

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

TEST(ReaderConfig, NothingGrowsOldUnlessItIsSaid) {
  const auto limits = [](const std::string& more) {
    const auto loaded = Load("{ name: g, address: 1, profile: weighing" + more + " }");
    return LimitsOf(loaded.config.lines[0].devices[0],
                    {})[static_cast<std::size_t>(config::Group::fast)];
  };
  EXPECT_FALSE(limits("").ages());
  EXPECT_EQ(limits(", max_age: 5s").uncertain_after, 5s);
  EXPECT_EQ(limits(", max_age: 5s").bad_after, 15s);
  EXPECT_EQ(limits(", max_age: 200ms").uncertain_after, 200ms) << "it is not polled every second";
  EXPECT_THAT(ProblemsOf("{ name: g, address: 1, profile: weighing, dead_age: 5s }"),
              HasSubstr("error: dead_age: give max_age too"));
}

TEST(ReaderConfig, TheEightTagsStandInOneRow) {
  const auto loaded = Load("{ name: g, address: 1, profile: olimex-mod-rfid125, unit: 40 }");
  std::vector<int> owners(63);
  for (const config::Point& point : loaded.config.lines[0].devices[0].points) {
    if (!point.modbus || point.table != config::Table::registers) continue;
    for (std::size_t i = 0; i < config::RegisterCount(point); ++i) ++owners.at(*point.modbus + i);
  }
  EXPECT_THAT(owners, ::testing::Each(1)) << "one request reads all, without a hole";
}

TEST(ReaderConfig, WhatIsAskedBehindATagIsOneRecord) {
  const auto loaded = Load("{ name: g, address: 1, profile: olimex-mod-rfid125-asked }");
  const config::Device& device = loaded.config.lines[0].devices[0];
  ASSERT_EQ(device.records.size(), 1U);
  EXPECT_EQ(device.event_texts[0].record, device.records[0].name);
  EXPECT_THAT(
      ProblemsOf("{ name: g, address: 1, profile: olimex-mod-rfid125-asked, commands: none }"),
      HasSubstr("needs commands: ask"));
}

TEST(ReaderConfig, AReaderHasItsLineToItself) {
  const std::string reader = "{ name: g, address: 1, profile: bar-code }";
  EXPECT_THAT(
      ProblemsOf(reader + ", { name: h, address: 2, profile: bar-code }"),
      HasSubstr(
          "device 'g' speaks unasked and needs a line of its own; line 'gate' has 2 devices"));
  EXPECT_THAT(ProblemsOf(reader + ", { name: h, address: A, protocol: toy, points: [] }"),
              HasSubstr("needs a line of its own"));
}

TEST(ReaderConfig, WrongOptionsAreNamedWithTheirPlace) {
  EXPECT_THAT(ProblemsOf("{ name: g, address: 1, profile: bar-code, start: STX }"),
              HasSubstr("test.yaml:4:17: error: device 'g': 'STX' is no character; write it, as "
                        "':', or its number"));
  EXPECT_THAT(ProblemsOf("{ name: g, address: 1, profile: bar-code, idle: 3s, whole: 1s }"),
              HasSubstr("whole must not be shorter than idle"));
  EXPECT_THAT(ProblemsOf("{ name: g, address: 1, profile: olimex-mod-rfid125, form: text }"),
              HasSubstr("'high' needs form: tag"));
  EXPECT_THAT(ProblemsOf("{ name: g, address: gate, profile: bar-code }"),
              HasSubstr("a reader has none; leave it out, or give a number from 1 to 255"));
}

}  // namespace
}  // namespace baudgate
