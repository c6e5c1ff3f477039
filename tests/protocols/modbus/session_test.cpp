// Tests Modbus slaves on a line in virtual time. They disappear and return, answer one request
// late, do not answer function 08, refuse blocks of registers, or are written.
// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <utility>

#include "tests/protocols/modbus/support.h"
#include "tests/support/virtual_line.h"

namespace baudgate::protocols::modbus {
namespace {

using config::Type;

/// Two slaves with three blocks each. Each value contains the slave and the register.
config::Line Bus(const Settable& options = {}, Framing framing = Framing::rtu) {
  config::Line line;
  line.name = "bus";
  line.protocol = ProtocolOf(framing).name;
  line.serial = ProtocolOf(framing).serial;
  for (const char* address : {"20", "21"}) {
    config::Device device = MakeDevice(
        {ReadPoint("a", "holding 0"), ReadPoint("b", "holding 100"), ReadPoint("c", "holding 101"),
         ReadPoint("d", "input 0", Type::float32), WritePoint("w", "holding 200"),
         WritePoint("relay", "coil 3", {}, Type::boolean)},
        options, address);
    device.name = "slave-" + std::string(address);
    device.protocol = line.protocol;
    line.devices.push_back(std::move(device));
  }
  return line;
}

double Truth(std::uint32_t device, std::uint32_t point) { return 1000.0 * (device + 1) + point; }

class ModbusSession : public ::testing::Test {
 protected:
  void Make(const Settable& options = {}, Framing framing = Framing::rtu) {
    line_ = std::make_unique<VirtualLine>(Bus(options, framing), std::vector{&ProtocolOf(framing)});
    for (std::uint32_t device = 0; device < 2; ++device) {
      for (std::uint32_t point = 0; point < 5; ++point) {
        line_->twin(device).values.Set(point, Truth(device, point));
      }
      line_->twin(device).values.Set(5, false);
    }
    line_->always = [this] {
      for (std::uint32_t device = 0; device < 2; ++device) {
        for (std::uint32_t point = 0; point < 4; ++point) {
          if (IsBad(line_->QualityOf(device, point))) continue;
          ASSERT_EQ(ToDouble(line_->ValueOf(device, point)), Truth(device, point))
              << device << "." << point;
        }
      }
    };
    line_->Open();
  }
  bool AllGood(std::uint32_t device) {
    for (std::uint32_t point = 0; point < 6; ++point) {
      if (!IsGood(line_->QualityOf(device, point))) return false;
    }
    return true;
  }
  bool Becomes(std::uint32_t device, Duration within) {
    return line_->RunUntil([&] { return AllGood(device); }, within);
  }
  void AnswerOneRequestLate() {
    line_->twin(0).manner.distort = [earlier = Bytes()](Bytes reply) mutable {
      return std::exchange(earlier, std::move(reply));
    };
  }
  std::size_t Count(char slave, char function) {
    return line_->CountSent(std::string{slave, function});
  }

  std::unique_ptr<VirtualLine> line_;
};

TEST_F(ModbusSession, EveryPointBecomesGoodInEveryFraming) {
  for (const Framing framing : {Framing::rtu, Framing::ascii, Framing::tcp}) {
    Make({}, framing);
    EXPECT_TRUE(Becomes(0, 5s));
    EXPECT_TRUE(Becomes(1, 5s));
    line_->RunFor(1min);
    const bus::DeviceStatus status = line_->StatusOf(0);
    EXPECT_EQ(status.Count(Outcome::ok), status.exchanges) << "and nothing is in vain";
  }
}

TEST_F(ModbusSession, AnExceptionWithATooLongHeaderDelaysNoOther) {
  Make({}, Framing::tcp);
  ASSERT_TRUE(Becomes(0, 5s));
  line_->twin(1).manner.instead = [](View request) -> std::optional<Bytes> {
    return Bytes{request[0], request[1], 0,          0,
                 0,          4,          request[6], static_cast<std::uint8_t>(request[7] | 0x80),
                 2};
  };
  line_->RunFor(10s);
  const bus::DeviceStatus before = line_->StatusOf(0);
  line_->RunFor(1min);
  const bus::DeviceStatus status = line_->StatusOf(0);
  EXPECT_GE(status.exchanges - before.exchanges, 50U);
  EXPECT_EQ(status.Count(Outcome::ok), status.exchanges);
  EXPECT_EQ(line_->StatusOf(1).Count(Outcome::partial), 0U);
  EXPECT_NE(line_->StatusOf(1).state, bus::DeviceState::offline);
}

TEST_F(ModbusSession, WorksWithoutSilenceBetweenFrames) {
  line_ = std::make_unique<VirtualLine>(
      [] {
        config::Line line = Bus();
        line.timing.quiet = 0ms;
        return line;
      }(),
      std::vector{&ModbusRtuProtocol()});
  line_->Open();
  EXPECT_TRUE(Becomes(1, 5s));
  EXPECT_TRUE(Becomes(0, 5s));
}

TEST_F(ModbusSession, ADeadSlaveRecovers) {
  Make();
  ASSERT_TRUE(Becomes(0, 5s));
  line_->twin(0).manner.dead = true;
  line_->RunFor(2min);
  EXPECT_EQ(line_->QualityOf(0, 0), Quality::bad_communication);
  EXPECT_TRUE(AllGood(1)) << "its neighbour is served";
  line_->twin(0).manner.dead = false;
  EXPECT_TRUE(Becomes(0, 2min));
}

TEST_F(ModbusSession, ASlaveThatStopsInsideAReplyRecovers) {
  Make();
  ASSERT_TRUE(Becomes(0, 5s));
  line_->twin(0).manner.distort = [](Bytes reply) {
    reply.resize(reply.size() / 2);
    return reply;
  };
  line_->RunFor(1min);
  EXPECT_FALSE(AllGood(0));
  line_->twin(0).manner.distort = {};
  EXPECT_TRUE(Becomes(0, 2min));
}

/// Each reply of a TCP server contains the number of its request.
TEST_F(ModbusSession, ALateNumberedReplyAffectsOnlyItsRequest) {
  Make({}, Framing::tcp);
  ASSERT_TRUE(Becomes(0, 5s));
  line_->twin(0).manner.think = 1100ms;
  line_->RunFor(5min);
  EXPECT_TRUE(AllGood(1));
  line_->twin(0).manner.think = 5ms;
  EXPECT_TRUE(Becomes(0, 2min));
  AnswerOneRequestLate();
  line_->RunFor(5min);
  EXPECT_TRUE(AllGood(1));
  line_->twin(0).manner.distort = {};
  EXPECT_TRUE(Becomes(0, 2min));
}

TEST_F(ModbusSession, ANumberShowsThatAReplyAfterARetryIsLate) {
  Make({}, Framing::tcp);
  ASSERT_TRUE(Becomes(0, 5s));
  int count = 0;
  line_->twin(0).manner.distort = [&](Bytes reply) {
    line_->twin(0).manner.think = ++count % 6 == 0 ? 1700ms : 5ms;
    return reply;
  };
  line_->RunFor(1min);
  const bus::Findings findings = line_->StatusOf(0).findings;
  EXPECT_GT(findings.Last(Symptom::late).time, 1700ms);
  EXPECT_LT(findings.Last(Symptom::late).time, 1800ms);
  EXPECT_EQ(findings.Last(Symptom::noise_behind).symptom, Symptom::clean) << "never seen";
}

TEST_F(ModbusSession, AServerWithMisalignedFramesRecoversAfterSilence) {
  Make({}, Framing::tcp);
  ASSERT_TRUE(Becomes(0, 5s));
  int count = 0;
  line_->twin(0).manner.distort = [&](Bytes reply) {
    if (++count % 5 == 0) reply[4] = 0x7F;
    if (count % 7 == 0) reply.erase(reply.begin());
    return reply;
  };
  line_->RunFor(2min);
  line_->twin(0).manner.distort = {};
  EXPECT_TRUE(Becomes(0, 1min));
}

TEST_F(ModbusSession, RepliesOneRequestLateAreNeverAccepted) {
  Make();
  ASSERT_TRUE(Becomes(0, 5s));
  AnswerOneRequestLate();
  line_->RunFor(10min);
  const bus::DeviceStatus status = line_->StatusOf(0);
  EXPECT_LT(status.Count(Outcome::ok), status.exchanges) << "it is found out";
  EXPECT_TRUE(AllGood(1));
  line_->twin(0).manner.distort = {};
  EXPECT_TRUE(Becomes(0, 5min)) << "in step again";
}

TEST_F(ModbusSession, AReplyAfterTheTimeoutAnswersNoOtherRequest) {
  Make();
  ASSERT_TRUE(Becomes(0, 5s));
  line_->twin(0).manner.think = 560ms;
  line_->RunFor(5min);
  line_->twin(0).manner.think = 5ms;
  EXPECT_TRUE(Becomes(0, 5min));
}

TEST_F(ModbusSession, AForeignReplyInFrontDoesNotHideTheOwnReply) {
  Make();
  ASSERT_TRUE(Becomes(0, 5s));
  line_->twin(0).manner.distort = [](Bytes reply) {
    Bytes wire = Wrap(Framing::rtu, 99, Hex("03021234"));
    Append(wire, reply);
    return wire;
  };
  line_->RunFor(1min);
  EXPECT_TRUE(AllGood(0));
}

TEST_F(ModbusSession, ASlaveThatIgnoresLoopbacksIsServed) {
  Make();
  const auto mute = [](View request) -> std::optional<Bytes> {
    if (request[1] == kDiagnostics) return Bytes();
    return std::nullopt;
  };
  line_->twin(0).manner.instead = mute;
  EXPECT_TRUE(Becomes(0, 1min));
  line_->twin(0).manner.dead = true;
  line_->RunFor(5min);
  line_->twin(0).manner.dead = false;
  EXPECT_TRUE(Becomes(0, 2min)) << "found by a read";
  const std::size_t before = Count(20, kDiagnostics);
  for (int i = 0; i < 5; ++i) {
    line_->twin(0).manner.dead = true;
    line_->RunFor(3s);
    line_->twin(0).manner.dead = false;
    EXPECT_TRUE(Becomes(0, 2min)) << i;
  }
  EXPECT_LT(Count(20, kDiagnostics), before + 60) << "it is not asked in vain for ever";
}

TEST_F(ModbusSession, ASlaveWithoutLoopbackIsSynchronisedByItsRefusal) {
  Make();
  line_->twin(0).manner.instead = [](View request) -> std::optional<Bytes> {
    if (request[1] == kDiagnostics) return Wrap(Framing::rtu, 20, Hex("8801"));
    return std::nullopt;
  };
  EXPECT_TRUE(Becomes(0, 10s));
  line_->twin(0).manner.dead = true;
  line_->RunFor(1min);
  line_->twin(0).manner.dead = false;
  EXPECT_TRUE(Becomes(0, 2min));
}

TEST_F(ModbusSession, AWriteIsConfirmedAndReadBack) {
  Make();
  ASSERT_TRUE(Becomes(0, 5s));
  line_->Write(0, 4, std::int64_t{77});
  line_->Write(0, 5, true);
  line_->RunFor(2s);
  EXPECT_EQ(line_->ends, (std::vector{WriteEnd::ok, WriteEnd::ok}));
  EXPECT_EQ(ToDouble(line_->ValueOf(0, 4)), 77);
  EXPECT_EQ(ToDouble(line_->ValueOf(0, 5)), 1);
}

/// Example: an inverter needs some seconds to clear its parameters.
TEST_F(ModbusSession, AFunctionMayHaveItsOwnReplyTime) {
  for (const bool given : {false, true}) {
    const std::vector<std::string> times = {"6=5s"};
    Make(given ? Settable{{"reply_times", times}} : Settable());
    ASSERT_TRUE(Becomes(0, 5s));
    line_->twin(0).manner.instead = [this](View request) -> std::optional<Bytes> {
      line_->twin(0).manner.think = request[1] == kWriteRegister ? 3s : 5ms;
      return std::nullopt;
    };
    line_->ends.clear();
    line_->Write(0, 4, std::int64_t{77});
    line_->RunFor(10s);
    EXPECT_EQ(line_->ends, std::vector{given ? WriteEnd::ok : WriteEnd::unknown});
    EXPECT_TRUE(Becomes(0, 2min));
    EXPECT_TRUE(AllGood(1));
  }
}

TEST_F(ModbusSession, ADeviceOfAnotherProfileHasNoGoodValue) {
  for (const Framing framing : {Framing::rtu, Framing::tcp}) {
    config::Line line = Bus({}, framing);
    for (config::Device& device : line.devices) {
      device.identity.names = {"Meter 7"};
      device.identity.others = {{config::SpokenName("Other 5"), "other-5"}};
    }
    line_ = std::make_unique<VirtualLine>(line, std::vector{&ProtocolOf(framing)});
    for (std::uint32_t point = 0; point < 5; ++point) {
      line_->twin(0).values.Set(point, Truth(0, point));
      line_->twin(1).values.Set(point, Truth(1, point));
    }
    std::string says = "Other 5";
    line_->twin(0).manner.instead = [&](View request) -> std::optional<Bytes> {
      const auto asked = Unwrap(framing, request);
      if (!asked || asked->pdu[0] != kEncapsulated) return std::nullopt;
      Bytes reply = Hex("2B 0E 01 01 00 00 01 01 07");
      Append(reply, says);
      return Wrap(framing, asked->slave, reply, asked->transaction);
    };
    line_->Open();
    EXPECT_TRUE(Becomes(1, 10s)) << "its twin says the name that the profile lists";
    line_->RunFor(10s);
    EXPECT_EQ(line_->QualityOf(0, 0), Quality(Quality::bad_configuration, Reason::other_module));
    says = "METER 7";
    EXPECT_TRUE(Becomes(0, 30s)) << "once it is the right one";
    line_->sent.clear();
    line_->RunFor(5min);
    EXPECT_TRUE(AllGood(0));
    for (const Sent& sent : line_->sent) {
      EXPECT_NE(Unwrap(framing, ToBytes(sent.text))->pdu[0], kEncapsulated) << "never again";
    }
  }
}

TEST_F(ModbusSession, AWriteIsNeverRepeated) {
  Make();
  ASSERT_TRUE(Becomes(0, 5s));
  line_->twin(0).manner.instead = [](View request) -> std::optional<Bytes> {
    if (request[1] == kWriteRegister) return Bytes();
    return std::nullopt;
  };
  line_->Write(0, 4, std::int64_t{77});
  line_->RunFor(10s);
  EXPECT_EQ(line_->ends, std::vector{WriteEnd::unknown});
  EXPECT_EQ(Count(20, kWriteRegister), 1U);
}

TEST_F(ModbusSession, ASlaveThatRefusesAHoleIsReadAroundIt) {
  Make({{"hole", std::int64_t{120}}, {"probe", std::string("loopback")}});
  EXPECT_TRUE(Becomes(0, 10s)) << "0 and 100 in one block are refused, and read in two";
  line_->sent.clear();
  line_->RunFor(1min);
  const bus::DeviceStatus status = line_->StatusOf(0);
  EXPECT_EQ(status.last_outcome, Outcome::ok);
  EXPECT_EQ(status.findings.Count(Symptom::refusal), 0U)
      << "only the combined read was refused, so `status` must not advise to remove points";
  EXPECT_TRUE(AllGood(0));
  const auto long_reads = std::ranges::count_if(line_->sent, [](const Sent& sent) {
    return sent.text.size() == 8 && sent.text[1] == kReadHolding && sent.text[5] > 2;
  });
  EXPECT_GE(long_reads, 2) << "it is tried as a whole again, less and less often";
  EXPECT_LE(long_reads, 16)
      << "of two slaves; a refusal is asked for again until it is certain whose it is";
}

}  // namespace
}  // namespace baudgate::protocols::modbus
