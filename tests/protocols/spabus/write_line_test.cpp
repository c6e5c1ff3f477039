// Writes to a relay on a line under virtual time: what the client is told, whatever is lost on the
// way.
// SPDX-License-Identifier: Apache-2.0
#include "tests/protocols/spabus/support.h"
#include "tests/support/virtual_line.h"

namespace baudgate::protocols::spabus {
namespace {

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
  /// The relay says `reply` to requests that begin so, as long as the test likes; empty: silence.
  void Says(const std::string& start, const std::string& reply) {
    replies_[start] = reply.empty() ? Bytes() : ReplyText(reply);
  }
  /// Requests that cannot be sent are written nowhere.
  WriteResult Write(config::Line relay, std::vector<PointWrite> writes) {
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
    WriteCommand command;
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
  std::vector<std::string> sent_;  ///< write requests without checksum
  Value first_;                    ///< of S21, in the relay
};

TEST_F(SpaWriteLine, ConfirmedAndReadBack) {
  const WriteResult result = Write(Relay(345), {{0, Value(static_cast<double>(30.3F))}});
  EXPECT_EQ(result.end, WriteEnd::ok) << result.reason;
  EXPECT_TRUE(result.read_back);
  EXPECT_EQ(sent_, (Texts{">1WV160:345:", ">1WS21:30.3:", ">1WV161:345:"}));
}

TEST_F(SpaWriteLine, AClosingThatNobodyAnswersTakesNothingBack) {
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

TEST_F(SpaWriteLine, WithoutAnAnswerToThePasswordNothingWasSent) {
  Says(">1WV160:", "");
  EXPECT_EQ(Write(Relay(345), {{0, Value(0.9)}}).end, WriteEnd::not_sent);
  // The first reply to a closing may be the late one to the opening.
  EXPECT_EQ(sent_, (Texts{">1WV160:345:", ">1WV161:345:", ">1WV161:345:"}));
  EXPECT_EQ(first_, Value(1.0));
}

TEST_F(SpaWriteLine, SilenceToTheWriteLeavesItOpen) {
  Says(">1WS21:", "");
  EXPECT_EQ(Write(Relay(0), {{0, Value(0.9)}}).end, WriteEnd::unknown);
  EXPECT_EQ(sent_, (Texts{">1WS21:0.9:"})) << "it is not repeated";
}

TEST_F(SpaWriteLine, RefusedOrBusy) {
  for (const auto& [nack, end] : {std::pair("<1N:8:", WriteEnd::refused),
                                  {"<1N:6:", WriteEnd::refused},
                                  {"<1N:1:", WriteEnd::busy},
                                  {"<1N:9:", WriteEnd::busy}}) {
    Says(">1WS21:", nack);
    EXPECT_EQ(Write(Relay(0), {{0, Value(0.9)}}).end, end) << nack;
  }
}

TEST_F(SpaWriteLine, SeveralGoInOneRequestWhereTheyMay) {
  const WriteResult result =
      Write(Relay(345, 8), {{0, Value(0.9)}, {1, Value(1.2)}, {2, Value(3.0)}});
  EXPECT_EQ(result.end, WriteEnd::ok) << result.reason;
  EXPECT_EQ(sent_, (Texts{">1WV160:345:", ">1WS21/23:0.9/1.2/3:", ">1WV161:345:"}));
}

TEST_F(SpaWriteLine, SeveralThatAreRefusedAreInDoubt) {
  Says(">1WS21/23:", "<1N:8:");
  const WriteResult result =
      Write(Relay(0, 8), {{0, Value(0.9)}, {1, Value(1.2)}, {2, Value(3.0)}});
  EXPECT_EQ(result.end, WriteEnd::unknown);
  EXPECT_EQ(result.written, 0U);
  EXPECT_NE(result.reason.find("nobody knows which"), std::string::npos) << result.reason;
}

TEST_F(SpaWriteLine, OneByOneTheFirstRefusalEndsThem) {
  Says(">1WS22:", "<1N:8:");
  const WriteResult result = Write(Relay(0), {{0, Value(0.9)}, {1, Value(1.2)}, {2, Value(3.0)}});
  EXPECT_EQ(result.end, WriteEnd::refused);
  EXPECT_EQ(result.written, 1U);
  EXPECT_EQ(sent_, (Texts{">1WS21:0.9:", ">1WS22:1.2:"}));
}

}  // namespace
}  // namespace baudgate::protocols::spabus
