// What the gateway has changed in a device is outdated at every point that shows it, until that is
// read again: after writes to points, of routes and by hand.
// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <set>

#include "gateway/base/bytes.h"
#include "gateway/base/text.h"
#include "gateway/bus/poller/poller.h"
#include "tests/gateway/bus/poller/routed_line.h"

namespace baudgate {
namespace {

config::Point Once(std::string name, std::string read, config::Type type) {
  config::Point point;
  point.name = std::move(name);
  point.read = std::move(read);
  point.type = type;
  point.group = config::Group::once;
  point.access = config::Access::read_write;
  return point;
}

config::Device Entry(const std::string& name, const std::string& address) {
  config::Device device = Slave(address);
  device.name = name;
  device.points = {Once("whole", "holding 5", config::Type::uint16),
                   Once("bit", "holding 5[b1]", config::Type::boolean),
                   Once("next", "holding 6", config::Type::uint16),
                   Once("coil", "coil 3", config::Type::boolean)};
  config::Point pair = Once("pair", "holding 6", config::Type::uint32);
  pair.access = config::Access::read;
  config::Point input = Once("input", "input 5", config::Type::uint16);
  input.access = config::Access::read;
  config::Point apart = Once("apart", "input 7", config::Type::uint16);
  apart.write = "holding 5";
  device.points.insert(device.points.end(), {pair, input, apart});
  return device;
}

/// Two entries of slave 20, one of 21. The slaves themselves have 120 registers and eight coils.
struct OutdatedLine : RoutedLine {
  enum : std::uint32_t { whole, bit, next, coil, pair, input, apart };

  static config::Device Wire(const std::string& address) {
    config::Device device = Slave(address);
    for (int i = 0; i < 8; ++i) {
      for (const char* const table : {"coil ", "input "}) {
        config::Point point;
        point.name = table[0] + std::to_string(i);
        point.read = table + std::to_string(i);
        point.type = table[0] == 'c' ? config::Type::boolean : config::Type::uint16;
        if (table[0] == 'c') point.access = config::Access::read_write;
        device.points.push_back(std::move(point));
      }
    }
    return device;
  }

  OutdatedLine()
      : RoutedLine({Wire("20"), Wire("21")},
                   DriveLine({Entry("a", "20"), Entry("b", "20"), Entry("c", "21")})) {
    for (std::size_t i = 0; i < 3; ++i) twin(i).manner.dead = true;
    RunFor(3s);
    EXPECT_EQ(Doubtful(), Places());
  }

  using Places = std::set<std::pair<std::uint32_t, std::uint32_t>>;
  Places Doubtful() const {
    Places doubtful;
    for (std::uint32_t device = 0; device < 3; ++device) {
      for (std::uint32_t point = 0; point <= apart; ++point) {
        if (!IsGood(QualityOf(device, point))) doubtful.emplace(device, point);
      }
    }
    return doubtful;
  }
  void ExpectReadAgain() {
    RunFor(1s);
    EXPECT_EQ(Doubtful(), Places());
  }
};

TEST(PollerOutdated, WhatARouteHasWrittenIsReadAgain) {
  using L = OutdatedLine;
  struct Case {
    const char* pdu;
    std::set<std::uint32_t> touched;
  };
  const Case cases[] = {
      {"06 00 05 00 02", {L::whole, L::bit, L::apart}},
      {"10 00 05 00 02 04 00 02 00 07", {L::whole, L::bit, L::next, L::pair, L::apart}},
      {"10 00 07 00 01 02 00 07", {L::pair}},
      {"16 00 05 FF FD 00 02", {L::whole, L::bit, L::apart}},
      {"05 00 03 FF 00", {L::coil}},
      {"0F 00 00 00 08 01 FF", {L::coil}},
      {"06 00 32 00 02", {}},
      {"03 00 05 00 02", {}},
      {"06 03 E7 00 02", {}},  // refused: 02
  };
  for (const Case& one : cases) {
    L line;
    line.Ask("write", one.pdu);
    ASSERT_TRUE(line.RunUntil([&] { return line.replies.size() == 1; }, 1s));
    L::Places wanted;
    for (const std::uint32_t device : {0U, 1U}) {
      for (const std::uint32_t point : one.touched) wanted.emplace(device, point);
    }
    EXPECT_EQ(line.Doubtful(), wanted) << one.pdu;
    line.ExpectReadAgain();
    if (!one.touched.contains(L::bit)) continue;
    EXPECT_EQ(line.ValueOf(1, L::whole), Value(std::int64_t{2})) << one.pdu;
    EXPECT_EQ(line.ValueOf(1, L::bit), Value(true)) << one.pdu;
  }
}

TEST(PollerOutdated, ABroadcastTouchesAllSlaves) {
  OutdatedLine line;
  line.Ask("all", "06 00 05 00 02", 0);
  ASSERT_TRUE(line.RunUntil([&] { return line.replies.size() == 1; }, 1s));
  EXPECT_EQ(line.Doubtful().size(), 9U);
  line.ExpectReadAgain();
  EXPECT_EQ(line.ValueOf(2, OutdatedLine::whole), Value(std::int64_t{2}));
}

TEST(PollerOutdated, AWriteThatGotNoReplyMayHaveBeenCarriedOut) {
  OutdatedLine line;
  line.twin(3).manner.distort = [](Bytes) { return Bytes(); };
  line.Ask("write", "06 00 05 00 02");
  ASSERT_TRUE(line.RunUntil([&] { return line.replies.size() == 1; }, 3s));
  line.twin(3).manner.distort = nullptr;
  EXPECT_EQ(line.Doubtful().count({1, OutdatedLine::whole}), 1U);
  line.RunFor(10s);
  EXPECT_EQ(line.ValueOf(1, OutdatedLine::whole), Value(std::int64_t{2}));
  line.ExpectReadAgain();
}

TEST(PollerOutdated, AWriteToAPointTouchesTheOthersOfItsRegister) {
  using L = OutdatedLine;
  for (const std::uint32_t written : {L::whole, L::bit}) {
    L line;
    std::set<std::uint32_t> ever;
    line.always = [&] {
      if (!IsGood(line.QualityOf(1, L::whole))) ever.insert(L::whole);
      if (!IsGood(line.QualityOf(1, L::next))) ever.insert(L::next);
    };
    line.Write(0, written, written == L::bit ? Value(true) : Value(std::int64_t{2}));
    line.RunFor(1s);
    EXPECT_EQ(line.ends, std::vector{WriteEnd::ok});
    EXPECT_EQ(ever, std::set<std::uint32_t>{L::whole});
    EXPECT_EQ(line.ValueOf(1, L::whole), Value(std::int64_t{2}));
    EXPECT_EQ(line.ValueOf(0, L::bit), Value(true));
    line.ExpectReadAgain();
  }
}

TEST(PollerOutdated, AfterAnUnknownFunctionAllIsReadAgain) {
  OutdatedLine line;
  line.twin(3).manner.instead = [](View request) {
    Bytes reply = {20, 0x41, 0};
    AppendCrc16(reply);
    return request[1] == 0x41 ? std::optional(reply) : std::nullopt;
  };
  line.RunFor(60s);
  line.Ask("unknown", "41 00");
  line.RunFor(2s);
  EXPECT_EQ(line.Of("unknown").outcome, Outcome::ok);
  for (std::uint32_t point = 0; point <= OutdatedLine::apart; ++point) {
    EXPECT_LT(*line.AgeOf(0, point), 2s) << point;
    EXPECT_LT(*line.AgeOf(1, point), 2s) << point;
  }
}

TEST(PollerOutdated, ATelegramByHandTouchesWhatItNames) {
  OutdatedLine line;
  Bytes telegram = {20, 6, 0, 6, 0, 9};
  AppendCrc16(telegram);
  ASSERT_TRUE(line.poller().Pause(line.now()));
  line.poller().OnWritingTelegram(2, telegram, line.now());
  EXPECT_EQ(line.Doubtful(), (OutdatedLine::Places{{0, 2}, {0, 4}, {1, 2}, {1, 4}}));
  line.poller().GoOn(line.now());
  line.ExpectReadAgain();
}

}  // namespace
}  // namespace baudgate
