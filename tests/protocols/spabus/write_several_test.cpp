// Tests several values in one write request: which values are joined, and the meaning of a refusal.
// SPDX-License-Identifier: Apache-2.0
#include <cmath>

#include "tests/protocols/spabus/support.h"
#include "tests/support/virtual_line.h"

namespace baudgate::protocols::spabus {
namespace {

config::Device SeveralSettings(std::int64_t write_items, std::int64_t password = 0) {
  std::vector<config::Point> points;
  for (const char* item : {"S21", "S22", "S23", "S25", "2S26", "V24"}) {
    points.push_back(MakePoint(item, Type::float32, Group::slow, Access::read_write));
  }
  points.push_back(MakePoint("V25", Type::uint16, Group::slow, Access::write));
  config::Device device = MakeDevice(std::move(points));
  device.options.Set("write_items", write_items);
  device.options.Set("password", password);
  return device;
}

Task ThreeSettings() {
  Task task = Write(0, Value(0.5));
  task.also = {{1, Value(1.2)}, {2, Value(3.0)}};
  return task;
}

TEST(SpaWriteSeveral, IsOneRequestWithTheRange) {
  Talk talk(SpabusProtocol(), SeveralSettings(8));
  EXPECT_EQ(Asked(talk, ThreeSettings()), ">1WS21/23:0.5/1.2/3:13");
  EXPECT_EQ(Hear(talk, ThreeSettings(), "<1A:").outcome, Outcome::ok);
}

TEST(SpaWriteSeveral, OnlyReadableNeighboursAreWrittenTogether) {
  const auto count = [](std::int64_t most, std::vector<PointValue> writes) {
    Talk talk(SpabusProtocol(), SeveralSettings(most));
    return talk->WritesTogether(writes);
  };
  const Value one(1.0);
  EXPECT_EQ(count(8, {{0, one}, {1, one}, {2, one}, {3, one}}), 3U) << "S24 is missing";
  EXPECT_EQ(count(2, {{0, one}, {1, one}, {2, one}}), 2U);
  EXPECT_EQ(count(1, {{0, one}, {1, one}}), 1U) << "as long as nobody has allowed it";
  EXPECT_EQ(count(8, {{1, one}, {0, one}}), 1U) << "another order";
  EXPECT_EQ(count(8, {{3, one}, {4, one}}), 1U) << "another channel";
  EXPECT_EQ(count(8, {{2, one}, {5, one}}), 1U) << "another category";
  EXPECT_EQ(count(8, {{5, one}, {6, one}}), 1U) << "a command shows nothing";
  EXPECT_EQ(count(8, {{0, one}, {1, Value(std::nan(""))}}), 1U);
  EXPECT_EQ(count(8, {{0, Value(std::nan(""))}}), 1U);
  EXPECT_EQ(count(8, {}), 0U);
}

TEST(SpaWriteSeveral, FitsIntoALine) {
  std::vector<config::Point> points;
  std::vector<PointValue> writes;
  for (int i = 1; i <= 64; ++i) {
    points.push_back(
        MakePoint("S" + std::to_string(i), Type::float64, Group::slow, Access::read_write));
    writes.push_back({writes.size(), Value(123456.789)});
  }
  config::Device device = MakeDevice(std::move(points));
  device.options.Set("write_items", std::int64_t{64});
  Talk talk(SpabusProtocol(), std::move(device));
  const std::size_t count = talk->WritesTogether(writes);
  EXPECT_GT(count, 15U);
  Task task = Write(0, writes.front().value);
  task.also.assign(writes.begin() + 1, writes.begin() + static_cast<std::ptrdiff_t>(count));
  EXPECT_LE(talk.Ask(task)->bytes.size(), 256U);
}

TEST(SpaWriteSeveral, ARefusalLeavesTheOutcomeUnknown) {
  for (const char* refusal : {"<1N:4:", "<1N:6:", "<1N:7:", "<1N:8:", "<1N:9:"}) {
    Talk talk(SpabusProtocol(), SeveralSettings(8, 345));
    Asked(talk, ThreeSettings());
    Hear(talk, ThreeSettings(), "<1A:");
    EXPECT_EQ(Body(Asked(talk, ThreeSettings())), ">1WS21/23:0.5/1.2/3");
    EXPECT_EQ(Hear(talk, ThreeSettings(), refusal).then, Then::ask_again);
    EXPECT_TRUE(Asked(talk, ThreeSettings()).starts_with(">1WV161:345"));
    const Answer answer = Hear(talk, ThreeSettings(), "<1A:");
    EXPECT_EQ(answer.outcome, Outcome::unexpected) << refusal << " proves nothing";
    EXPECT_NE(answer.reason.find("it is not known which"), std::string::npos) << answer.reason;
  }
}

TEST(SpaWriteSeveral, ABusyDeviceHasAcceptedNoValue) {
  for (const char* refusal : {"<1N:1:", "<1N:2:"}) {
    Talk talk(SpabusProtocol(), SeveralSettings(8));
    Asked(talk, ThreeSettings());
    EXPECT_EQ(Hear(talk, ThreeSettings(), refusal).outcome, Outcome::busy);
  }
}

TEST(SpaWriteSeveral, ADeviceThatRefusesARangeGetsSingleWrites) {
  for (const char* refusal : {"<1N:3:", "<1N:5:"}) {
    Talk talk(SpabusProtocol(), SeveralSettings(8));
    const std::vector<PointValue> writes = {{0, Value(1.0)}, {1, Value(1.0)}};
    ASSERT_EQ(talk->WritesTogether(writes), 2U);
    Asked(talk, ThreeSettings());
    EXPECT_EQ(Hear(talk, ThreeSettings(), refusal).outcome, Outcome::unexpected);
    EXPECT_EQ(talk->WritesTogether(writes), 1U);
    EXPECT_EQ(talk->WhatIsLearned(), "it accepts only one value in one write");
    talk->OnReconnect();
    EXPECT_EQ(talk->WritesTogether(writes), 2U) << "another device may be there now";
  }
}

TEST(SpaWriteSeveral, AReadOnlyOrBadValueSendsNothing) {
  config::Device device = SeveralSettings(8);
  device.points[1].access = Access::read;
  Talk talk(SpabusProtocol(), std::move(device));
  EXPECT_TRUE(Asked(talk, ThreeSettings()).starts_with("error: 'p_S22' is read-only"));
  Talk other(SpabusProtocol(), SeveralSettings(8, 345));
  Task task = ThreeSettings();
  task.also[1].value = Value(std::nan(""));
  EXPECT_TRUE(Asked(other, task).starts_with("error: 'p_S23'")) << "not even the password";
}

TEST(SpaWriteSeveral, TheTwinAcceptsValuesUpToTheFirstRefusal) {
  config::Device device = SeveralSettings(8, 345);
  device.points[1].writing.decimals = 1;
  FixedValues values;
  const auto twin = SpabusProtocol().make_twin(device, values);
  Talk talk(SpabusProtocol(), device);
  EXPECT_EQ(talk.Run(ThreeSettings(), *twin).outcome, Outcome::ok);
  EXPECT_EQ(values.Get(0, {}), Value(0.5));
  EXPECT_EQ(values.Get(1, {}), Value(1.2));
  EXPECT_EQ(values.Get(2, {}), Value(3.0));
  config::Device free = SeveralSettings(8, 345);
  Talk careless(SpabusProtocol(), free);
  Task task = ThreeSettings();
  task.value = Value(0.7);
  task.also[0].value = Value(1.25);
  task.also[1].value = Value(9.0);
  EXPECT_EQ(careless.Run(task, *twin).outcome, Outcome::unexpected);
  EXPECT_EQ(values.Get(0, {}), Value(0.7)) << "taken";
  EXPECT_EQ(values.Get(1, {}), Value(1.2)) << "refused";
  EXPECT_EQ(values.Get(2, {}), Value(3.0)) << "not looked at";
}

config::Line Relay(std::int64_t password, std::int64_t write_items = 1) {
  std::vector<config::Point> points;
  for (const char* item : {"S21", "S22", "S23"}) {
    points.push_back(MakePoint(item, Type::float32, Group::slow, Access::read_write));
  }
  config::Line line;
  line.name = "bay-1";
  line.protocol = "spabus";
  line.serial = SpabusProtocol().serial;
  line.devices = {MakeDevice(std::move(points))};
  line.devices[0].name = "feeder-1";
  line.devices[0].protocol = "spabus";
  line.devices[0].options.Set("password", password);
  line.devices[0].options.Set("write_items", write_items);
  return line;
}

class SpaWriteLine : public ::testing::Test {
 protected:
  void Says(const std::string& start, const std::string& reply) {
    replies_[start] = reply.empty() ? Bytes() : ReplyText(reply);
  }
  /// Runs the write on a new line. Sets sent_ (write requests without checksum) and first_ (S21).
  WriteResult Write(config::Line relay, std::vector<bus::PointWrite> writes) {
    VirtualLine line(std::move(relay), {&SpabusProtocol()});
    for (std::size_t point = 0; point < 3; ++point) line.twin(0).values.Set(point, 1.0);
    line.Open();
    line.RunFor(3s);
    line.sent.clear();
    line.twin(0).manner.instead = [this](View request) -> std::optional<Bytes> {
      for (const auto& [start, reply] : replies_) {
        if (AsText(request).starts_with(start)) return reply;
      }
      return std::nullopt;
    };
    std::optional<WriteResult> result;
    bus::WriteCommand command;
    command.kind = std::move(writes);
    command.deadline = line.now().instant + 20s;
    command.done = [&](const WriteResult& told) { result = told; };
    EXPECT_TRUE(line.Submit(std::move(command)));
    EXPECT_TRUE(line.RunUntil([&] { return result.has_value(); }, 30s));
    for (const Sent& sent : line.sent) {
      if (sent.text.starts_with(">1W")) sent_.push_back(sent.text.substr(0, sent.text.size() - 3));
    }
    first_ = line.twin(0).values.Get(0, {});
    return result.value_or(WriteResult{});
  }

  std::map<std::string, Bytes> replies_;
  std::vector<std::string> sent_;
  Value first_;
};

TEST_F(SpaWriteLine, AWriteIsConfirmedAndReadBack) {
  const WriteResult result = Write(Relay(345), {{0, Value(static_cast<double>(30.3F))}});
  EXPECT_EQ(result.end, WriteEnd::ok) << result.reason;
  EXPECT_TRUE(result.read_back);
  EXPECT_EQ(sent_, (Texts{">1WV160:345:", ">1WS21:30.3:", ">1WV161:345:"}));
}

TEST_F(SpaWriteLine, AnUnansweredClosingKeepsTheOutcome) {
  Says(">1WV161:", "");
  EXPECT_EQ(Write(Relay(345), {{0, Value(0.9)}}).end, WriteEnd::ok);
  EXPECT_EQ(first_, Value(0.9));
  Says(">1WS21:", "<1N:8:");
  const WriteResult refused = Write(Relay(345), {{0, Value(0.9)}});
  EXPECT_EQ(refused.end, WriteEnd::refused);
  EXPECT_NE(refused.reason.find("NACK 8"), std::string::npos) << refused.reason;
  EXPECT_NE(refused.reason.find("may still be open"), std::string::npos) << refused.reason;
  Says(">1WS21:", "<1N:1:");
  EXPECT_EQ(Write(Relay(345), {{0, Value(0.9)}}).end, WriteEnd::busy);
  Says(">1WS21:", "");
  EXPECT_EQ(Write(Relay(345), {{0, Value(0.9)}}).end, WriteEnd::unknown);
}

TEST_F(SpaWriteLine, WithoutAReplyToThePasswordNothingIsWritten) {
  Says(">1WV160:", "");
  EXPECT_EQ(Write(Relay(345), {{0, Value(0.9)}}).end, WriteEnd::not_sent);
  // The first reply to the closing request can be the late reply to the opening request.
  EXPECT_EQ(sent_, (Texts{">1WV160:345:", ">1WV161:345:", ">1WV161:345:"}));
  EXPECT_EQ(first_, Value(1.0));
}

TEST_F(SpaWriteLine, SilenceToAWriteIsAnUnknownOutcome) {
  Says(">1WS21:", "");
  EXPECT_EQ(Write(Relay(0), {{0, Value(0.9)}}).end, WriteEnd::unknown);
  EXPECT_EQ(sent_, (Texts{">1WS21:0.9:"})) << "it is not repeated";
}

TEST_F(SpaWriteLine, ANackEndsTheWriteAsRefusedOrBusy) {
  for (const auto& [nack, end] : {std::pair("<1N:8:", WriteEnd::refused),
                                  {"<1N:6:", WriteEnd::refused},
                                  {"<1N:1:", WriteEnd::busy},
                                  {"<1N:9:", WriteEnd::busy}}) {
    Says(">1WS21:", nack);
    EXPECT_EQ(Write(Relay(0), {{0, Value(0.9)}}).end, end) << nack;
  }
}

TEST_F(SpaWriteLine, SeveralValuesAreWrittenInOneRequestIfAllowed) {
  const WriteResult result =
      Write(Relay(345, 8), {{0, Value(0.9)}, {1, Value(1.2)}, {2, Value(3.0)}});
  EXPECT_EQ(result.end, WriteEnd::ok) << result.reason;
  EXPECT_EQ(sent_, (Texts{">1WV160:345:", ">1WS21/23:0.9/1.2/3:", ">1WV161:345:"}));
}

TEST_F(SpaWriteLine, ARefusalOfSeveralValuesIsAnUnknownOutcome) {
  Says(">1WS21/23:", "<1N:8:");
  const WriteResult result =
      Write(Relay(0, 8), {{0, Value(0.9)}, {1, Value(1.2)}, {2, Value(3.0)}});
  EXPECT_EQ(result.end, WriteEnd::unknown);
  EXPECT_EQ(result.written, 0U);
  EXPECT_NE(result.reason.find("it is not known which"), std::string::npos) << result.reason;
}

TEST_F(SpaWriteLine, TheFirstRefusalEndsSingleWrites) {
  Says(">1WS22:", "<1N:8:");
  const WriteResult result = Write(Relay(0), {{0, Value(0.9)}, {1, Value(1.2)}, {2, Value(3.0)}});
  EXPECT_EQ(result.end, WriteEnd::refused);
  EXPECT_EQ(result.written, 1U);
  EXPECT_EQ(sent_, (Texts{">1WS21:0.9:", ">1WS22:1.2:"}));
}

}  // namespace
}  // namespace baudgate::protocols::spabus
