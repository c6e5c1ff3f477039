// Times, retries and periods: the protocol's default < gateway < line < profile < device, each key
// by itself.
// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "config/devices.h"
#include "config/loader.h"
#include "tests/config/fake_protocol.h"

namespace baudgate::testing {
namespace {

using config::Timing;

/// The fake's profile `relay` says reply 700ms, gap 30ms, retries 5, poll 2s, slow 2min.
config::Line LineOf(const std::string& gateway, const std::string& line,
                    const std::string& device) {
  const config::Loaded loaded = Load("lines:\n- { name: l, port: /dev/l, protocol: fake, " + line +
                                     " devices: [{ name: d, address: 1, " + device +
                                     " }] }\n"
                                     "gateway: { name: g" +
                                     gateway + " }\n");
  EXPECT_TRUE(loaded.ok()) << Shown(loaded.problems);  // warnings are of other tests
  return loaded.config.lines.empty() ? config::Line() : loaded.config.lines[0];
}

constexpr const char* kPlain = "points: [{ name: p, read: A1, type: int16 }]";
constexpr const char* kProfiled = "profile: relay";

TEST(Pace, DefaultWhereNobodySaysAnything) {
  const config::Line line = LineOf("", "", kPlain);
  EXPECT_EQ(line.retries, 2);
  EXPECT_FALSE(line.devices[0].retries);
  EXPECT_EQ(line.devices[0].poll, 1s);
  EXPECT_EQ(line.devices[0].slow, 1min);
  EXPECT_EQ(line.devices[0].daily, 24h);
  EXPECT_FALSE(line.timing.reply);
}

TEST(Pace, EachLevelGivesWayToTheNext) {
  const std::string gateway = ", poll: 11s, slow: 12min, daily: 6h, retries: 7";
  const std::string line = "poll: 13s, slow: 14min, retries: 8,";
  const std::string device = ", poll: 15s, slow: 16min, daily: 7h, retries: 9";

  const config::Line by_gateway = LineOf(gateway, "", kPlain);
  EXPECT_EQ(by_gateway.devices[0].poll, 11s);
  EXPECT_EQ(by_gateway.devices[0].slow, 12min);
  EXPECT_EQ(by_gateway.devices[0].daily, 6h);
  EXPECT_EQ(by_gateway.retries, 7);

  const config::Line by_line = LineOf(gateway, line, kPlain);
  EXPECT_EQ(by_line.devices[0].poll, 13s);
  EXPECT_EQ(by_line.devices[0].slow, 14min);
  EXPECT_EQ(by_line.retries, 8);
  EXPECT_FALSE(by_line.devices[0].retries) << "the line's";

  const config::Line by_profile = LineOf(gateway, line, kProfiled);
  EXPECT_EQ(by_profile.devices[0].poll, 2s);
  EXPECT_EQ(by_profile.devices[0].slow, 2min);
  EXPECT_EQ(by_profile.devices[0].retries, 5);

  const config::Line by_device = LineOf(gateway, line, kProfiled + device);
  EXPECT_EQ(by_device.devices[0].poll, 15s);
  EXPECT_EQ(by_device.devices[0].slow, 16min);
  EXPECT_EQ(by_device.devices[0].daily, 7h);
  EXPECT_EQ(by_device.devices[0].retries, 9);
}

TEST(Pace, EachTimeByItself) {
  const config::Line line =
      LineOf(", timing: { quiet: 1ms, reply: 2s, gap: 31ms, drain: 41ms, ceiling: 9s }",
             "timing: { gap: 32ms, drain: 42ms, reply: 3s },",
             std::string(kProfiled) + ", timing: { drain: 43ms }");
  EXPECT_EQ(line.timing.quiet, 1ms) << "gateway";
  EXPECT_EQ(line.timing.gap, 32ms) << "line before gateway";
  const Timing used = Merge(line.devices[0].timing, line.timing);
  EXPECT_EQ(used.quiet, 1ms) << "gateway";
  EXPECT_EQ(used.ceiling, 9s) << "gateway";
  EXPECT_EQ(used.reply, 3s) << "the line's, longer than the profile's";
  EXPECT_EQ(used.gap, 32ms) << "likewise";
  EXPECT_EQ(used.drain, 43ms) << "device before line";
}

TEST(Pace, EachLevelChecksItsKeys) {
  for (const char* const keys : {"poll: 1ms", "slow: 25h", "retries: 11", "timing: { reply: 0s }",
                                 "timing: { replay: 1s }", "timing: { ceiling: 1s, reply: 2s }"}) {
    EXPECT_FALSE(Load("gateway: { " + std::string(keys) + " }\nlines: []\n").ok()) << keys;
    EXPECT_FALSE(Load("lines: [{ name: l, port: /dev/l, protocol: fake, devices: [], " +
                      std::string(keys) + " }]\n")
                     .ok())
        << keys;
  }
}

Duration CeilingUsed(std::optional<Duration> reply, std::optional<Duration> ceiling) {
  const Timing fallback = {
      .quiet = 5ms, .reply = 500ms, .gap = 25ms, .ceiling = 2s, .drain = 100ms};
  Timing given;
  given.reply = reply;
  given.ceiling = ceiling;
  return *config::Resolve(given, fallback).ceiling;
}

TEST(Resolve, MoreTimeForTheReplyIsMoreTimeForTheExchange) {
  EXPECT_EQ(CeilingUsed({}, {}), 2s);
  EXPECT_EQ(CeilingUsed(1500ms, {}), 3s);
  EXPECT_EQ(CeilingUsed(300ms, {}), 1800ms);
  EXPECT_EQ(CeilingUsed(1500ms, 4s), 4s);
  EXPECT_EQ(CeilingUsed(1500ms, 1s), 1525ms) << "never shorter than reply and gap";
}

TEST(Resolve, MoreTimeForPausesIsMoreTimeForTheExchange) {
  Timing fallback;
  fallback.reply = 500ms;
  fallback.gap = 50ms;
  fallback.ceiling = 750ms;
  const auto ceiling = [&](Duration gap, std::optional<Duration> own = {}) {
    Timing given;
    given.gap = gap;
    given.ceiling = own;
    return *config::Resolve(given, fallback).ceiling;
  };
  EXPECT_EQ(ceiling(200ms), 750ms + 16 * 150ms);
  EXPECT_EQ(ceiling(2s), 5750ms) << "at most 5 s more";
  EXPECT_EQ(ceiling(20ms), 750ms);
  EXPECT_EQ(ceiling(200ms, 900ms), 900ms);
}

TEST(Pace, OfReplyGapAndCeilingTheLongerOneOfLineAndProfileCounts) {
  // The profile says reply 700ms, gap 30ms.
  const auto timing = [](const std::string& line, const std::string& device) {
    return LineOf("", "timing: { " + line + " },", kProfiled + device).devices[0].timing;
  };
  const Timing longer = timing("reply: 2s, gap: 10ms, quiet: 9ms", "");
  EXPECT_EQ(longer.reply, 2s) << "the line's: its user knows what is between";
  EXPECT_EQ(longer.from[1], config::Level::line);
  EXPECT_EQ(longer.gap, 30ms) << "the profile's: the device needs it";
  EXPECT_EQ(longer.from[2], config::Level::profile);
  EXPECT_EQ(timing("reply: 2s", ", timing: { reply: 100ms }").reply, 100ms) << "the device's own";
}

TEST(Pace, WhatAProfileOverrulesIsSaid) {
  const auto loaded = Load(
      "lines: [{ name: l, port: /dev/l, protocol: fake, poll: 5s, timing: { reply: 500ms, quiet: "
      "1ms }, devices: [{ name: d, address: 1, profile: relay }] }]\n");
  EXPECT_EQ(Shown(loaded.problems),
            "t.yaml:1:108: warning: device 'd': poll 5s of the line or gateway does not count: its "
            "profile says 2s; write it at the device to use it\n"
            "t.yaml:1:108: warning: device 'd': timing.reply 500ms of the line does not count: its "
            "profile says 700ms, which is longer; write it at the device to use it\n");
}

TEST(Pace, Recheck) {
  const auto recheck = [](const std::string& gateway, const std::string& line,
                          const std::string& device, const std::string& point) {
    return LineOf(gateway, line,
                  "points: [{ name: p, read: A1, type: int16" + point + " }]" + device)
        .devices[0]
        .points[0]
        .recheck;
  };
  using config::Recheck;
  EXPECT_EQ(recheck("", "", "", ""), Recheck::off) << "the fake's check value is strong";
  EXPECT_EQ(recheck(", recheck: jump", "", "", ""), Recheck::jump);
  EXPECT_EQ(recheck(", recheck: jump", "recheck: always,", "", ""), Recheck::always);
  EXPECT_EQ(recheck("", "recheck: always,", ", recheck: off", ""), Recheck::off);
  EXPECT_EQ(recheck("", "", ", recheck: off", ", recheck: jump"), Recheck::jump);
}

TEST(Pace, RecheckWhereNeitherParityNorAStrongSumGuardsReplies) {
  Protocol weak;
  weak.weak_check = true;
  EXPECT_EQ(config::DefaultRecheck(weak, {.parity = config::Parity::none}), config::Recheck::jump);
  EXPECT_EQ(config::DefaultRecheck(weak, {.parity = config::Parity::even}), config::Recheck::off);
  EXPECT_EQ(config::DefaultRecheck({}, {.parity = config::Parity::none}), config::Recheck::off);
}

}  // namespace
}  // namespace baudgate::testing
