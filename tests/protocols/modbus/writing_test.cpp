// Tests the requests of writes: several points in one request, and bits of slaves that do not know
// the mask write (function 22). Golden requests: MODBUS Application Protocol V1.1b3, 6.11, 6.12 and
// 6.16.
// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>

#include "gateway/bus/writes/write_gate.h"
#include "tests/protocols/modbus/support.h"
#include "tests/support/virtual_line.h"

namespace baudgate::protocols::modbus {
namespace {

using config::Type;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

const Settable kTogether = {{"write_together", true}};
const Settable kByRead = {{"bit_write", std::string("read_write")}};

config::Device Several(const Settable& options = {}) {
  std::vector<config::Point> points = {WritePoint("a", "holding 1"), WritePoint("b", "holding 2"),
                                       WritePoint("far", "holding 4"),
                                       WritePoint("wide", "holding 5", {}, Type::float32)};
  // Example of the MODBUS Application Protocol, 6.11: CD 01 are the values of coils 20 to 29. In a
  // PDU, coil 20 has the address 19.
  for (int i = 19; i < 29; ++i) {
    points.push_back(
        WritePoint("c" + std::to_string(i), "coil " + std::to_string(i), {}, Type::boolean));
  }
  return MakeDevice(std::move(points), options);
}

/// Returns a device with register 4: bits 0, 2 and 5, and bits 8 to 10 as a number.
config::Device Bits(const Settable& options = {}) {
  return MakeDevice(
      {WritePoint("b0", "holding 4[b0]", {}, Type::boolean),
       WritePoint("b2", "holding 4[b2]", {}, Type::boolean),
       WritePoint("b5", "holding 4[b5]", {}, Type::boolean), WritePoint("n", "holding 4[b8-b10]"),
       WritePoint("other", "holding 5[b0]", {}, Type::boolean)},
      options);
}

std::size_t Together(const config::Device& device, std::vector<std::size_t> points) {
  Talk talk(ModbusRtuProtocol(), device);
  std::vector<PointValue> writes;
  for (const std::size_t point : points) writes.push_back({point, std::uint64_t{1}});
  return talk->WritesTogether(writes);
}

Task WriteAll(std::vector<PointValue> writes) {
  Task task = Write(writes.front().point, writes.front().value);
  task.also.assign(writes.begin() + 1, writes.end());
  return task;
}

TEST(ModbusTogether, PointsAreWrittenTogetherOnlyWithTheOption) {
  EXPECT_EQ(Together(Several(), {0, 1}), 1U);
  EXPECT_EQ(Together(Several(kTogether), {0, 1}), 2U);
  EXPECT_EQ(Together(Several(kTogether), {0}), 1U);
}

TEST(ModbusTogether, OnlyAdjacentPointsInOrderAreWrittenTogether) {
  const config::Device device = Several(kTogether);
  EXPECT_EQ(Together(device, {1, 0}), 1U);
  EXPECT_EQ(Together(device, {0, 2}), 1U) << "holding 3 is nobody's";
  EXPECT_EQ(Together(device, {0, 1, 2, 3}), 2U);
  EXPECT_EQ(Together(device, {2, 3}), 2U) << "one register and two";
  EXPECT_EQ(Together(device, {0, 4}), 1U) << "a register and a coil";
  EXPECT_EQ(Together(device, {4, 5, 6}), 3U);
}

TEST(ModbusTogether, ARequestHoldsALimitedNumberOfPoints) {
  std::vector<config::Point> points;
  std::vector<std::size_t> all;
  for (std::size_t i = 0; i < 130; ++i) {
    points.push_back(WritePoint("p" + std::to_string(i), "holding " + std::to_string(i)));
    all.push_back(i);
  }
  EXPECT_EQ(Together(MakeDevice(std::move(points), kTogether), all), 123U);
}

TEST(ModbusTogether, RegistersOrCoilsAreWrittenInOneRequest) {
  Talk talk(ModbusRtuProtocol(), Several(kTogether));
  const Task registers = WriteAll({{0, std::uint64_t{10}}, {1, std::uint64_t{258}}});
  EXPECT_EQ(Asked(talk, registers), "10 00 01 00 02 04 00 0A 01 02");
  EXPECT_EQ(Exchange(talk, registers, "10 0001 0002").outcome, Outcome::ok);
  EXPECT_EQ(Asked(talk, WriteAll({{2, std::uint64_t{1}}, {3, 1.0}})),
            "10 00 04 00 03 06 00 01 3F 80 00 00");
  std::vector<PointValue> coils;
  for (const bool on : {true, false, true, true, false, false, true, true, true, false}) {
    coils.push_back({4 + coils.size(), on});
  }
  EXPECT_EQ(Asked(talk, WriteAll(coils)), "0F 00 13 00 0A 02 CD 01");
}

TEST(ModbusTogether, AValueThatDoesNotFitRefusesAllValues) {
  Talk talk(ModbusRtuProtocol(), Several(kTogether));
  EXPECT_THAT(Asked(talk, WriteAll({{0, std::uint64_t{10}}, {1, std::uint64_t{65536}}})),
              HasSubstr("point b: "));
}

/// Example of 6.16, masks F2 and 25: bits 0, 2 and 3 become 1, 1 and 0.
TEST(ModbusTogether, BitsOfARegisterAreOneMaskWrite) {
  const config::Device device = MakeDevice({WritePoint("b0", "holding 4[b0]", {}, Type::boolean),
                                            WritePoint("b2-b3", "holding 4[b2-b3]")});
  Talk talk(ModbusRtuProtocol(), device);
  EXPECT_EQ(Asked(talk, WriteAll({{0, true}, {1, std::uint64_t{1}}})), "16 00 04 FF F2 00 05");
  EXPECT_EQ(Together(Bits(), {0, 1, 2, 3, 4}), 4U);
  EXPECT_EQ(Together(Bits(), {0, 0}), 1U) << "one after the other";
}

TEST(ModbusBits, WithoutMaskWriteTheRegisterIsReadTwiceAndWritten) {
  Talk talk(ModbusRtuProtocol(), Bits(kByRead));
  const Task task = Write(1, true);
  EXPECT_EQ(Asked(talk, task), "03 00 04 00 01");
  EXPECT_TRUE(talk.request().prepares);
  EXPECT_EQ(Exchange(talk, task, "03 02 1203").then, Then::ask_again);
  EXPECT_EQ(Asked(talk, task), "03 00 04 00 01");
  EXPECT_TRUE(talk.request().prepares);
  EXPECT_EQ(Exchange(talk, task, "03 02 1203").then, Then::ask_again);
  EXPECT_EQ(Asked(talk, task), "06 00 04 12 07");
  EXPECT_FALSE(talk.request().prepares);
  EXPECT_FALSE(talk.request().expect.repeatable);
  const Answer answer = Exchange(talk, task, "06 0004 1207");
  EXPECT_EQ(answer.outcome, Outcome::ok);
  EXPECT_EQ(answer.then, Then::done);
  EXPECT_EQ(Asked(talk, task), "03 00 04 00 01") << "the next write reads anew";
}

TEST(ModbusBits, AreWrittenTogetherAndByFunction16) {
  Talk talk(ModbusRtuProtocol(), Bits({{"bit_write", std::string("read_write")},
                                       {"write_function", std::string("multiple")}}));
  const Task task = WriteAll({{0, false}, {2, true}, {3, std::uint64_t{5}}});
  Exchange(talk, task, "03 02 F2FF");
  Exchange(talk, task, "03 02 F2FF");
  EXPECT_EQ(Asked(talk, task), "10 00 04 00 01 02 F5 FE");
}

TEST(ModbusBits, ARegisterThatChangesBetweenTheReadsIsNotWritten) {
  Talk talk(ModbusRtuProtocol(), Bits(kByRead));
  const Task task = Write(1, true);
  Exchange(talk, task, "03 02 1203");
  const Answer answer = Exchange(talk, task, "03 02 1202");
  EXPECT_EQ(answer.outcome, Outcome::refused);
  EXPECT_EQ(answer.then, Then::done);
  EXPECT_THAT(answer.reason, HasSubstr("changed from 1203 to 1202"));
  EXPECT_EQ(Asked(talk, task), "03 00 04 00 01");
}

TEST(ModbusBits, AReadOfAnotherTaskIsNotUsed) {
  Talk talk(ModbusRtuProtocol(), Bits(kByRead));
  const auto read_twice = [&] {
    Exchange(talk, Write(1, true), "03 02 1203");
    Exchange(talk, Write(1, true), "03 02 1203");
  };
  read_twice();
  EXPECT_EQ(Asked(talk, Write(2, true)), "03 00 04 00 01") << "another bit";
  read_twice();
  EXPECT_EQ(Asked(talk, Write(1, false)), "03 00 04 00 01") << "another value";
  read_twice();
  EXPECT_EQ(Asked(talk, Write(4, true)), "03 00 05 00 01") << "another register";
  read_twice();
  talk.Ask(Probe());
  EXPECT_EQ(Asked(talk, Write(1, true)), "03 00 04 00 01") << "something came between";
  read_twice();
  talk.Ask(Write(1, true));
  talk.Fail(Write(1, true), Outcome::busy);
  EXPECT_EQ(Asked(talk, Write(1, true)), "03 00 04 00 01") << "it was broken off";
  read_twice();
  talk->OnReconnect();
  EXPECT_EQ(Asked(talk, Write(1, true)), "03 00 04 00 01");
}

TEST(ModbusBits, ARefusedReadEndsTheWrite) {
  Talk talk(ModbusRtuProtocol(), Bits(kByRead));
  EXPECT_EQ(Exchange(talk, Write(1, true), "83 02").outcome, Outcome::unsupported);
  EXPECT_EQ(Exchange(talk, Write(1, true), "83 06").outcome, Outcome::busy);
  EXPECT_EQ(Exchange(talk, Write(1, true), "83 05").outcome, Outcome::busy)
      << "a read has nothing to acknowledge";
}

TEST(ModbusBits, ADeviceWithoutMaskWriteNamesTheOption) {
  Talk talk(ModbusRtuProtocol(), Bits());
  EXPECT_THAT(Exchange(talk, Write(1, true), "96 01").reason, HasSubstr("bit_write: read_write"));
}

TEST(ModbusWriteExceptions, BusyIsBusyAndAcknowledgeIsOkWithAWait) {
  Talk talk(ModbusRtuProtocol(), Several());
  const Answer busy = Exchange(talk, Write(0, std::uint64_t{1}), "86 06");
  EXPECT_EQ(busy.outcome, Outcome::busy);
  const Answer accepted = Exchange(talk, Write(0, std::uint64_t{1}), "86 05");
  EXPECT_EQ(accepted.outcome, Outcome::ok);
  EXPECT_GT(accepted.wait, Duration::zero());
  EXPECT_THAT(accepted.reason, IsEmpty());
}

/// The point's scale is not applied again, because the value is the raw value that Convert
/// returned.
TEST(ModbusWrittenValue, IsEncodedFromTheConvertedValue) {
  struct Case {
    const char* place;
    Type type;
    Decimal scale;
    Value value;
    const char* pdu;
  };
  const Case cases[] = {
      {"holding 1", Type::uint16, 0.1, std::int64_t{25}, "06 00 01 00 FA"},
      {"holding 1", Type::uint16, 1, std::int64_t{65535}, "06 00 01 FF FF"},
      {"holding 1 int16", Type::int16, 1, std::int64_t{-2}, "06 00 01 FF FE"},
      {"holding 1", Type::float32, 1, 1.0, "10 00 01 00 02 04 3F 80 00 00"},
      {"holding 1 CDAB", Type::float32, 0.5, 0.5, "10 00 01 00 02 04 00 00 3F 80"},
      {"holding 1 DCBA", Type::int32, 1, std::int64_t{1}, "10 00 01 00 02 04 01 00 00 00"},
      {"holding 4[b8-b10]", Type::uint16, 1, std::int64_t{5}, "16 00 04 F8 FF 05 00"},
      {"coil 7", Type::boolean, 1, true, "05 00 07 FF 00"},
  };
  for (const Case& one : cases) {
    config::Point point = WritePoint("p", one.place, {}, one.type);
    point.scale = one.scale;
    const auto write = bus::Convert(point, 0, one.value);
    ASSERT_TRUE(write) << one.place;
    EXPECT_EQ(WhyInexact(point, one.value, *write), std::nullopt) << one.place;
    Talk talk(ModbusRtuProtocol(), MakeDevice({point}));
    EXPECT_EQ(Asked(talk, Write(0, write->raw)), one.pdu) << one.place;
  }
}

class WritingLine : public testing::Test {
 protected:
  void Make(const config::Device& device) {
    config::Line line;
    line.name = "bus";
    line.protocol = "modbus_rtu";
    line.serial = ModbusRtuProtocol().serial;
    line.devices = {device};
    line.devices[0].name = "slave";
    line.devices[0].protocol = line.protocol;
    line_ = std::make_unique<VirtualLine>(line, std::vector{&ModbusRtuProtocol()});
    line_->Open();
    line_->RunFor(3s);
    line_->sent.clear();
  }
  std::vector<std::string> SentWrites() {
    std::vector<std::string> pdus;
    for (const Sent& sent : line_->sent) {
      const auto adu = Unwrap(Framing::rtu, ToBytes(sent.text));
      if (!IsRead(adu->pdu[0])) pdus.push_back(ToHex(adu->pdu));
    }
    return pdus;
  }
  void Submit(std::vector<bus::PointWrite> writes) {
    bus::WriteCommand command;
    command.kind = std::move(writes);
    command.deadline = line_->now().instant + 10s;
    command.done = [this](const WriteResult& result) { results_.push_back(result); };
    line_->Submit(std::move(command));
  }

  std::unique_ptr<VirtualLine> line_;
  std::vector<WriteResult> results_;
};

TEST_F(WritingLine, OnlyTheWrittenBitsChange) {
  Make(Bits(kByRead));
  for (std::uint32_t point = 0; point < 3; ++point) line_->twin(0).values.Set(point, point != 1);
  line_->twin(0).values.Set(3, std::uint64_t{6});
  line_->RunFor(2s);
  line_->sent.clear();
  Submit({{1, true}, {3, std::uint64_t{2}}});
  line_->RunFor(3s);
  ASSERT_EQ(results_.size(), 1U);
  EXPECT_EQ(results_[0].end, WriteEnd::ok) << results_[0].reason;
  EXPECT_TRUE(results_[0].read_back);
  EXPECT_EQ(results_[0].written, 2U);
  EXPECT_THAT(SentWrites(), ElementsAre("06 00 04 02 25"));
}

TEST_F(WritingLine, AnUnansweredReadBeforeAWriteIsNotSent) {
  Make(Bits(kByRead));
  line_->twin(0).manner.dead = true;
  Submit({{1, true}});
  line_->RunFor(20s);
  ASSERT_EQ(results_.size(), 1U);
  EXPECT_EQ(results_[0].end, WriteEnd::not_sent);
  EXPECT_THAT(SentWrites(), IsEmpty());
}

TEST_F(WritingLine, SeveralPointsAreOneExchange) {
  Make(Several(kTogether));
  Submit({{0, std::uint64_t{7}}, {1, std::uint64_t{8}}, {3, 2.5}});
  line_->RunFor(3s);
  ASSERT_EQ(results_.size(), 1U);
  EXPECT_EQ(results_[0].end, WriteEnd::ok) << results_[0].reason;
  EXPECT_EQ(results_[0].written, 3U);
  EXPECT_THAT(SentWrites(),
              ElementsAre("10 00 01 00 02 04 00 07 00 08", "10 00 05 00 02 04 40 20 00 00"));
  EXPECT_EQ(ToDouble(line_->ValueOf(0, 1)), 8);
}

TEST_F(WritingLine, AnAcknowledgedWriteIsReadBackLater) {
  for (const bool does_it : {true, false}) {
    results_.clear();
    Make(Several());
    line_->twin(0).values.Set(0, std::uint64_t{1});
    line_->RunFor(2s);
    line_->twin(0).manner.instead = [&](View request) -> std::optional<Bytes> {
      if (request[1] != kWriteRegister) return std::nullopt;
      line_->twin(0).values.Set(0, std::uint64_t{1});
      return Wrap(Framing::rtu, kSlave, Hex("86 05"));
    };
    Submit({{0, std::uint64_t{77}, std::uint64_t{1}}});
    line_->RunFor(900ms);
    EXPECT_TRUE(results_.empty());
    if (does_it) line_->twin(0).values.Set(0, std::uint64_t{77});
    line_->RunFor(5s);
    ASSERT_EQ(results_.size(), 1U);
    EXPECT_EQ(results_[0].end, does_it ? WriteEnd::ok : WriteEnd::differs) << results_[0].reason;
  }
}

TEST_F(WritingLine, ABusySlaveEndsTheWriteAsBusy) {
  Make(Several());
  line_->twin(0).manner.instead = [](View request) -> std::optional<Bytes> {
    if (request[1] != kWriteRegister) return std::nullopt;
    return Wrap(Framing::rtu, kSlave, Hex("86 06"));
  };
  Submit({{0, std::uint64_t{7}}});
  line_->RunFor(5s);
  ASSERT_EQ(results_.size(), 1U);
  EXPECT_EQ(results_[0].end, WriteEnd::busy);
  EXPECT_THAT(SentWrites(), ElementsAre("06 00 01 00 07"));
}

TEST(ModbusChanges, TheWrittenPointsAreDerivedFromTheRequest) {
  struct Case {
    const char* pdu;
    const char* read;
    const char* write;
    std::optional<bool> changes;
  };
  const Case cases[] = {
      {"06 00 05 00 01", "holding 5", "", true},
      {"06 00 05 00 01", "holding 4 uint16", "", false},
      {"06 00 05 00 01", "holding 4 uint32", "", true},
      {"06 00 05 00 01", "holding 6 uint32", "", false},
      {"06 00 05 00 01", "holding 5[b3-b4]", "", true},
      {"06 00 05 00 01", "holding 2 int16 scale(5)", "", true},
      {"06 00 03 00 01", "holding 2 int16 scale(5)", "", false},
      {"06 00 05 00 01", "input 5", "", false},
      {"06 00 05 00 01", "input 9", "holding 5", true},
      {"06 00 05 00 01", "coil 5", "", false},
      {"10 00 05 00 02 04 00 01 00 01", "holding 6", "", true},
      {"10 00 05 00 02 04 00 01 00 01", "holding 7", "", false},
      {"16 00 05 FF FF 00 01", "holding 5[b0]", "", true},
      {"17 00 20 00 01 00 05 00 02 04 00 01 00 01", "holding 6", "", true},
      {"17 00 20 00 01 00 05 00 02 04 00 01 00 01", "holding 32", "", false},
      {"05 00 05 FF 00", "coil 5", "", true},
      {"05 00 05 FF 00", "holding 5", "", false},
      {"0F 00 05 00 09 02 FF 01", "coil 13", "", true},
      {"0F 00 05 00 09 02 FF 01", "coil 14", "", false},
      {"03 00 05 00 01", "holding 5", "", false},
      {"08 00 00 12 34", "holding 5", "", false},
      {"41 00", "holding 5", "", std::nullopt},
      {"06 00 05", "holding 5", "", std::nullopt},
  };
  for (const Case& one : cases) {
    const std::string read = one.read;
    const bool bit = read.starts_with("coil") || read.ends_with("[b0]");
    config::Point point = ReadPoint("p", read, bit ? Type::boolean : Type::float32);
    if (*one.write != 0) point = WritePoint("p", one.read, one.write);
    for (const Framing framing : {Framing::rtu, Framing::ascii, Framing::tcp}) {
      const Protocol& protocol = ProtocolOf(framing);
      const auto on = [&](const char* address) -> std::optional<bool> {
        const Bytes frame = Wrap(framing, kSlave, Hex(one.pdu));
        const auto changed = protocol.changes(frame, MakeDevice({point}, {}, address));
        return changed ? std::optional(!changed->empty()) : std::nullopt;
      };
      EXPECT_EQ(on("20"), one.changes) << one.pdu << " " << one.read;
      EXPECT_EQ(on("21"), false) << one.pdu << " " << one.read;
    }
  }
}

}  // namespace
}  // namespace baudgate::protocols::modbus
