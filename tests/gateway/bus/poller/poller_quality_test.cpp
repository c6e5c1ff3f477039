// Tests of the qualities and ages of a device's values, under virtual time.
// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <set>

#include "gateway/base/bytes.h"
#include "gateway/base/text.h"
#include "gateway/bus/poller/poller.h"
#include "tests/gateway/bus/poller/poller_fixture.h"
#include "tests/gateway/bus/poller/routed_line.h"

namespace baudgate::bus {
namespace {

TEST(Poller, AnOutageDoesNotMakeOldValuesLookYounger) {
  VirtualLine line(ToyLine({Polled(ToyDevice("a", "A", {"1", "2", "3"}), 1s)}), {&ToyProtocol()});
  line.Open();
  line.RunFor(5s);
  Quality best_when_old = Quality::bad;
  line.always = [&] {
    const auto age = line.AgeOf(0, 0);
    if (age && *age > 9s && best_when_old < line.QualityOf(0, 0)) {
      best_when_old = line.QualityOf(0, 0);
    }
  };
  line.twin(0).manner.dead = true;
  line.RunFor(15s);
  line.twin(0).manner.dead = false;
  line.RunFor(10s);
  EXPECT_TRUE(IsBad(best_when_old)) << "beyond dead_age of 9 s";
  EXPECT_EQ(line.QualityOf(0, 0), Quality::good);
}

TEST(Poller, QualityFollowsThePortAndTheDevice) {
  VirtualLine line(ToyLine({ToyDevice("a", "A", {"1"})}), {&ToyProtocol()});
  EXPECT_EQ(line.QualityOf(0, 0), Quality::bad_not_connected) << "the port is not open yet";
  line.twin(0).manner.dead = true;
  line.Open();
  EXPECT_EQ(line.QualityOf(0, 0), Quality::bad_waiting);
  line.RunFor(100ms);
  EXPECT_EQ(line.QualityOf(0, 0), Quality::bad_waiting);
  line.RunFor(10s);
  EXPECT_EQ(line.QualityOf(0, 0), Quality::bad_communication) << "offline stands before never read";
  line.twin(0).manner.dead = false;
  line.RunFor(3s);
  EXPECT_EQ(line.QualityOf(0, 0), Quality::good);
  line.twin(0).manner.dead = true;
  EXPECT_TRUE(line.RunUntil([&] { return line.QualityOf(0, 0) != Quality::good; }, 10s));
  line.RunFor(10s);
  EXPECT_EQ(line.QualityOf(0, 0), Quality::bad_communication);
  line.Close();
  EXPECT_EQ(line.QualityOf(0, 0), Quality::bad_not_connected);
  EXPECT_EQ(line.StatusOf(0).last_outcome, Outcome::line_down);
  line.twin(0).manner.dead = false;
  line.Open();
  EXPECT_NE(line.QualityOf(0, 0), Quality::good) << "not before it has been read again";
  line.RunFor(3s);
  EXPECT_EQ(line.QualityOf(0, 0), Quality::good);
}

TEST(Poller, AFaultReportedByTheDeviceIsNeverShownAsANumber) {
  VirtualLine line(ToyLine({ToyDevice("a", "A", {"1"})}), {&ToyProtocol()});
  line.twin(0).values.Set(0, 3.0);
  line.Open();
  line.RunFor(1500ms);
  ASSERT_EQ(line.QualityOf(0, 0), Quality::good);
  Say(line.twin(0), "fault");
  line.RunFor(1s);
  EXPECT_EQ(line.QualityOf(0, 0), Quality::bad_sensor_failure);
  Say(line.twin(0), "nan");
  line.RunFor(1s);
  EXPECT_TRUE(IsBad(line.QualityOf(0, 0)));
  EXPECT_EQ(line.ValueOf(0, 0), Value(3.0)) << "the last good one";
  EXPECT_EQ(line.StatusOf(0).state, DeviceState::online) << "a bad channel is no bad device";
}

std::uint64_t SeqOf(VirtualLine& line, std::uint32_t point) {
  std::uint64_t seq = 0;
  line.store().Read(0, [&](const DeviceRecord& record) { seq = record.points[point].seq; });
  return seq;
}

TEST(Poller, AForeignDeviceHasNoGoodValue) {
  config::Device device = Polled(ToyDevice("a", "A", {"1", "2", "3"}), 1s);
  device.points[2].group = config::Group::once;
  VirtualLine line(ToyLine({device}), {&ToyProtocol()});
  line.Open();
  line.RunFor(3s);
  ASSERT_TRUE(IsGood(line.QualityOf(0, 2)));
  bool foreign = true;
  line.twin(0).manner.instead = [&](View request) -> std::optional<Bytes> {
    if (!foreign) return std::nullopt;
    return ToyReply(std::string(AsText(request).substr(1, 2)) + "~foreign");
  };
  line.RunFor(1s);
  bool good = false;
  line.always = [&] {
    good = good || IsGood(line.QualityOf(0, 0)) || IsGood(line.QualityOf(0, 2));
  };
  line.RunFor(3s);
  EXPECT_FALSE(good);
  for (std::uint32_t point = 0; point < 3; ++point) {
    EXPECT_EQ(line.QualityOf(0, point), Quality(Quality::bad_configuration, Reason::other_module));
  }
  EXPECT_EQ(line.StatusOf(0).trouble, "it is not A");
  EXPECT_EQ(std::count(line.warnings.begin(), line.warnings.end(), "it is not A"), 1);

  const std::uint64_t read_before = SeqOf(line, 2);
  line.always = [&] {
    const bool again = SeqOf(line, 2) > read_before;
    EXPECT_TRUE(again || !IsGood(line.QualityOf(0, 2)));
  };
  foreign = false;
  line.RunFor(3s);
  for (std::uint32_t point = 0; point < 3; ++point) EXPECT_TRUE(IsGood(line.QualityOf(0, point)));
  EXPECT_EQ(line.StatusOf(0).trouble, "");
}

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

/// Devices 0 and 1 have the address of slave 20, device 2 that of slave 21. Each slave has 120
/// registers and eight coils.
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

TEST(PollerOutdated, PointsWrittenByARouteAreReadAgain) {
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
      {"06 03 E7 00 02", {}},
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

TEST(PollerOutdated, ABroadcastMakesThePointsOfAllSlavesBeReadAgain) {
  OutdatedLine line;
  line.Ask("all", "06 00 05 00 02", 0);
  ASSERT_TRUE(line.RunUntil([&] { return line.replies.size() == 1; }, 1s));
  EXPECT_EQ(line.Doubtful().size(), 9U);
  line.ExpectReadAgain();
  EXPECT_EQ(line.ValueOf(2, OutdatedLine::whole), Value(std::int64_t{2}));
}

TEST(PollerOutdated, PointsOfAnUnansweredWriteAreReadAgain) {
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

TEST(PollerOutdated, AWriteToAPointDoubtsTheOtherPointsOfItsRegister) {
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

TEST(PollerOutdated, AfterAnUnknownFunctionAllPointsAreReadAgain) {
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

TEST(PollerOutdated, AManualWriteTelegramMakesItsPointsBeReadAgain) {
  OutdatedLine line;
  Bytes telegram = {20, 6, 0, 6, 0, 9};
  AppendCrc16(telegram);
  ASSERT_TRUE(line.poller().Pause(line.now()));
  line.poller().OnWritingTelegram(2, telegram, line.now());
  EXPECT_EQ(line.Doubtful(), (OutdatedLine::Places{{0, 2}, {0, 4}, {1, 2}, {1, 4}}));
  line.poller().GoOn(line.now());
  line.ExpectReadAgain();
}

config::Device Rechecked(std::vector<std::string> reads, config::Recheck recheck) {
  config::Device device = Polled(ToyDevice("a", "A", std::move(reads)), 1s);
  for (config::Point& point : device.points) point.recheck = recheck;
  return device;
}

class RecheckTest : public ::testing::Test {
 protected:
  void Use(config::Recheck recheck, std::vector<std::string> reads = {"1"}) {
    line_.emplace(ToyLine({Rechecked(std::move(reads), recheck)}),
                  std::vector<const protocols::Protocol*>{&ToyProtocol()});
    line_->twin(0).values.Set(0, std::int64_t{20});
    line_->Open();
    line_->RunFor(500ms);
  }
  void Damage(const std::string& word) {
    line_->twin(0).manner.instead = [word,
                                     once = true](View request) mutable -> std::optional<Bytes> {
      const std::string_view text = AsText(request);
      if (text[0] != '?' || !std::exchange(once, false)) return std::nullopt;
      return ToyReply(std::string(text.substr(1, text.size() - 2)) + "=" + word);
    };
  }

  std::optional<VirtualLine> line_;
};

TEST_F(RecheckTest, AStableValueIsRecheckedOnlyOnce) {
  Use(config::Recheck::jump);
  EXPECT_EQ(line_->QualityOf(0, 0), Quality::good);
  EXPECT_EQ(line_->StatusOf(0).rechecks, 1U);
  line_->RunFor(1min);
  EXPECT_EQ(line_->StatusOf(0).rechecks, 1U);
  EXPECT_EQ(line_->StatusOf(0).unconfirmed, 0U);
}

TEST_F(RecheckTest, ADamagedReadingIsNeverShown) {
  Use(config::Recheck::jump);
  bool shown = false;
  bool uncertain = false;
  line_->always = [&] {
    shown = shown || line_->ValueOf(0, 0) != Value(20.0);
    uncertain = uncertain || line_->QualityOf(0, 0) == Quality::uncertain;
  };
  Damage("84");
  line_->RunFor(900ms);
  EXPECT_FALSE(shown);
  EXPECT_TRUE(uncertain);
  EXPECT_EQ(line_->QualityOf(0, 0), Quality::good) << "within the same poll";
  EXPECT_EQ(line_->StatusOf(0).unconfirmed, 1U);
}

TEST_F(RecheckTest, UnconfirmedReadingsDoNotMakeTheOldValueYounger) {
  Use(config::Recheck::jump);
  line_->RunFor(600ms);
  line_->twin(0).manner.instead = [turn = 0](View request) mutable -> std::optional<Bytes> {
    const std::string_view text = AsText(request);
    return ToyReply(std::string(text.substr(1, text.size() - 2)) + "=" +
                    (++turn % 2 != 0 ? "500" : "900"));
  };
  const auto before = *line_->AgeOf(0, 0);
  const auto began = line_->now().instant;
  line_->RunUntil([&] { return line_->QualityOf(0, 0) == Quality::uncertain; }, 3s);
  EXPECT_EQ(line_->ValueOf(0, 0), Value(20.0));
  EXPECT_EQ(*line_->AgeOf(0, 0), before + (line_->now().instant - began));
}

TEST_F(RecheckTest, AWrittenValueIsShownAtItsReadBack) {
  Use(config::Recheck::jump);
  line_->Write(0, 0, std::int64_t{70});
  EXPECT_TRUE(line_->RunUntil([&] { return !line_->ends.empty(); }, 500ms));
  EXPECT_EQ(line_->ValueOf(0, 0), Value(70.0));
  EXPECT_EQ(line_->QualityOf(0, 0), Quality::good);
}

TEST_F(RecheckTest, WithRecheckOffNoValueIsRequestedTwice) {
  Use(config::Recheck::off);
  line_->twin(0).values.Set(0, std::int64_t{90});
  line_->RunFor(10s);
  EXPECT_EQ(line_->StatusOf(0).rechecks, 0U);
}

}  // namespace
}  // namespace baudgate::bus
