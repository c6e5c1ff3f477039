// Tests devices that are only written to, such as relay cards, displays and set points. They answer
// writes, but no probe, so an answered write shows that the device is present.
// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <algorithm>

#include "gateway/base/text.h"
#include "protocols/dcon/protocol.h"
#include "protocols/modbus/protocol.h"
#include "protocols/spabus/protocol.h"
#include "tests/protocols/runs/rig.h"
#include "tests/support/talk.h"

namespace baudgate::protocols {
namespace {

struct Card {
  const char* name;
  const Protocol* protocol;
  const char* write;
  config::Type type;
  Value value;
  std::optional<Bytes> (*answers)(View request);
  Settable options{};
  const char* read_once = nullptr;
};

void PrintTo(const Card& card, std::ostream* out) { *out << card.name; }

std::optional<Bytes> AnswersModbusWrites(View request) {
  const bool writes = request.size() == 8 && (request[1] == 5 || request[1] == 6);
  return writes ? std::nullopt : std::optional(Bytes());
}

std::optional<Bytes> KnowsNoLoopback(View request) {
  return request.size() == 8 && request[1] == 8 ? std::optional(Bytes()) : std::nullopt;
}

std::optional<Bytes> AnswersDconWrites(View request) {
  return request[0] == '#' ? std::nullopt : std::optional(Bytes());
}

std::optional<Bytes> AnswersSpaWrites(View request) {
  return request[2] == 'W' ? std::nullopt : std::optional(Bytes());
}

class OutputsAlone : public ::testing::TestWithParam<Card> {
 protected:
  OutputsAlone() {
    config::Line line;
    line.name = "line";
    line.protocol = std::string(GetParam().protocol->name);
    line.serial = GetParam().protocol->serial;
    config::Point point;
    point.name = "output";
    point.write = GetParam().write;
    point.access = config::Access::write;
    point.type = GetParam().type;
    std::vector<config::Point> points = {std::move(point)};
    if (GetParam().read_once != nullptr) {
      config::Point& read = points.emplace_back();
      read.name = "version";
      read.read = GetParam().read_once;
      read.type = config::Type::uint16;
      read.group = config::Group::once;
    }
    config::Device device =
        DeviceOf(*GetParam().protocol, "1", std::move(points), GetParam().options);
    device.name = "card";
    device.protocol = line.protocol;
    line.options = device.options;
    line.devices.push_back(device);
    line_ = std::make_unique<VirtualLine>(line, std::vector{GetParam().protocol});
    line_->twin(0).manner.instead = GetParam().answers;
    line_->Open();
  }
  WriteEnd Write() {
    const std::size_t before = line_->ends.size();
    EXPECT_TRUE(line_->Write(0, 0, GetParam().value, 5s));
    line_->RunFor(6s);
    EXPECT_EQ(line_->ends.size(), before + 1);
    return line_->ends.empty() ? WriteEnd::not_sent : line_->ends.back();
  }

  std::unique_ptr<VirtualLine> line_;
};

TEST_P(OutputsAlone, AreWrittenToAtOnce) {
  line_->RunFor(10s);
  EXPECT_EQ(Write(), WriteEnd::ok);
  EXPECT_NE(line_->StatusOf(0).state, bus::DeviceState::offline);
  line_->RunFor(1h);
  EXPECT_EQ(Write(), WriteEnd::ok);
}

TEST_P(OutputsAlone, RecoverWithTheNextWrite) {
  line_->RunFor(10s);
  ASSERT_EQ(Write(), WriteEnd::ok);
  for (const int lost : {1, 5}) {
    line_->twin(0).manner.dead = true;
    for (int write = 0; write < lost; ++write) {
      const WriteEnd end = Write();
      if (GetParam().read_once != nullptr) {
        EXPECT_NE(end, WriteEnd::ok) << "a device with reads is looked for before it is written to";
      } else {
        EXPECT_EQ(end, WriteEnd::unknown) << "it was sent, and nobody knows what became of it";
      }
    }
    line_->RunFor(5min);
    line_->twin(0).manner.dead = false;
    if (GetParam().read_once != nullptr) line_->RunFor(10s);
    EXPECT_EQ(Write(), WriteEnd::ok) << "behind " << lost << " lost ones";
    EXPECT_NE(line_->StatusOf(0).state, bus::DeviceState::offline);
  }
}

INSTANTIATE_TEST_SUITE_P(
    Cards, OutputsAlone,
    ::testing::Values(Card{"ModbusCoil", &ModbusRtuProtocol(), "coil 3", config::Type::boolean,
                           Value(true), AnswersModbusWrites},
                      Card{"ModbusLoopback",
                           &ModbusRtuProtocol(),
                           "holding 7",
                           config::Type::uint16,
                           Value(std::int64_t{17}),
                           AnswersModbusWrites,
                           {{"probe", std::string("loopback")}}},
                      Card{"ModbusReadOnce",
                           &ModbusRtuProtocol(),
                           "holding 7",
                           config::Type::uint16,
                           Value(std::int64_t{17}),
                           KnowsNoLoopback,
                           {{"probe", std::string("loopback")}},
                           "holding 9"},
                      Card{"Spa", &SpabusProtocol(), "S1", config::Type::uint16,
                           Value(std::int64_t{2}), AnswersSpaWrites},
                      Card{"Dcon", &DconProtocol(), "#0{+00.000 0..10}", config::Type::float32,
                           Value(4.5), AnswersDconWrites}),
    [](const auto& info) { return std::string(info.param.name); });

std::unique_ptr<VirtualLine> DconRelay(bool checksum) {
  config::Line line;
  line.name = "line";
  line.protocol = "dcon";
  line.serial = DconProtocol().serial;
  config::Point relay = WritePoint("relay", "", "#10{bit}", config::Type::boolean);
  relay.access = config::Access::write;
  config::Device device = DeviceOf(DconProtocol(), "1", {relay}, {{"checksum", checksum}});
  device.name = "card";
  device.protocol = line.protocol;
  line.options = device.options;
  line.devices.push_back(device);
  auto made = std::make_unique<VirtualLine>(line, std::vector{&DconProtocol()});
  made->Open();
  return made;
}

bool WasWritten(const VirtualLine& line) {
  return std::ranges::any_of(line.sent,
                             [](const auto& sent) { return sent.text.starts_with("#"); });
}

TEST(OutputsOfDcon, AnUnsentWriteIsNotConfirmed) {
  const auto line = DconRelay(true);
  line->twin(0).manner.instead = [](View request) -> std::optional<Bytes> {
    return AsText(request) == "$01M\r" ? ToBytes("!017060\r") : Bytes();
  };
  for (int write = 0; write < 3; ++write) {
    ASSERT_TRUE(line->Write(0, 0, Value(true), 5s));
    line->RunFor(30s);
    EXPECT_EQ(line->ends.back(), WriteEnd::not_sent) << write;
  }
  EXPECT_FALSE(WasWritten(*line));
}

/// The module is silent, so its checksum mode is unknown. If the mode were wrong, the module could
/// take the command for another write.
TEST(OutputsOfDcon, AModuleOfUnknownChecksumModeIsNotWritten) {
  const auto line = DconRelay(true);
  line->twin(0).manner.instead = [](View) { return std::optional(Bytes()); };
  ASSERT_TRUE(line->Write(0, 0, Value(true), 5s));
  line->RunFor(30s);
  EXPECT_EQ(line->ends.back(), WriteEnd::not_sent);
  EXPECT_FALSE(WasWritten(*line));
}

}  // namespace
}  // namespace baudgate::protocols
