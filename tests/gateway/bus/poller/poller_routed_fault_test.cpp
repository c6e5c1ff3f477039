// Tests of transparent routes on a line with faults, under virtual time.
#include <gtest/gtest.h>

#include "gateway/base/text.h"
#include "gateway/bus/poller/poller.h"
#include "protocols/modbus/protocol.h"
#include "tests/gateway/bus/poller/routed_line.h"

namespace baudgate::bus {
namespace {

using Pieces = std::vector<tools::TimedPiece>;

// These requests use function 16. Its reply does not contain the value, so the replies to start and
// stop are equal.
constexpr const char* kStartBlock = "10 00 00 00 01 02 00 02";
constexpr const char* kStopBlock = "10 00 00 00 01 02 00 00";
constexpr const char* kOdd = "41 00 00";

/// The first bytes of a reply of slave 20 without the rest, so the exchange ends as damaged.
const Bytes kNoise = {0x14, 0x55};

TEST(PollerRoutedFaults, NoiseThatEndsAnExchangeEarlyDoesNotShiftReplies) {
  RoutedLine line;
  line.Number(0, 1);
  line.Ask("warm", kRead);
  line.RunFor(1s);
  line.twin(0).manner.think = 300ms;
  line.Ask("read", kRead);
  line.Ask("other", kOther, 20, 2);
  line.Inject(kNoise, 20ms);
  line.RunFor(3s);
  EXPECT_EQ(ToHex(line.Of("other").pdu), "03 02 00 02");
}

TEST(PollerRoutedFaults, OneByteAfterAReplyDoesNotSlowTheNextReads) {
  std::vector<int> answered;
  for (const bool noisy : {false, true}) {
    RoutedLine line;
    BusyClients clients(line);
    clients.Add(kRead, 20);
    line.RunFor(1s);
    int replies = 0;
    line.twin(0).manner.deliver = [&](View, Bytes reply, Instant) -> Pieces {
      if (++replies == 1 && noisy) reply.push_back(0);
      return {{5ms, reply}};
    };
    const int before = clients.answered(0);
    line.RunFor(2s);
    answered.push_back(clients.answered(0) - before);
  }
  EXPECT_GT(answered[0], 100);
  EXPECT_GT(answered[1], answered[0] * 9 / 10);
}

TEST(PollerRoutedFaults, ADamagedReadIsNotRetriedIfItsClientHasLeft) {
  struct Row {
    const char* what;
    Bytes noise;
    bool stays;
  };
  const Bytes corrupt = {0x14, 0x03, 0x02, 0x00, 0x07, 0x00, 0x00};
  const std::vector<Row> rows = {{"partial, nobody waits", kNoise, false},
                                 {"corrupt, nobody waits", corrupt, false},
                                 {"partial, another waits", kNoise, true}};
  for (const Row& row : rows) {
    SCOPED_TRACE(row.what);
    RoutedLine line(DriveLine({Polled("20", 1, 1h)}), {});
    line.RunFor(1s);
    line.twin(0).manner.think = 300ms;
    line.Ask("left", kRead, 20, 1);
    if (row.stays) line.Ask("stays", kRead, 20, 2);
    line.Inject(row.noise, 20ms);
    line.RunFor(10ms);
    line.poller().Abandon(1, line.now());
    line.RunFor(3s);
    EXPECT_EQ(line.StatusOf(0).retries > 0, row.stays);
    EXPECT_TRUE(line.Of("left").sent);
    if (!row.stays) continue;
    EXPECT_EQ(line.Of("stays").outcome, Outcome::ok);
  }
}

TEST(PollerRoutedFaults, ADamagedReadIsSentAgainAsOftenAsThereAreRetries) {
  for (const Outcome outcome : {Outcome::corrupt, Outcome::partial}) {
    RoutedLine line;
    line.Ask("warm", kRead);
    line.RunFor(1s);
    line.twin(0).manner.distort = [outcome](Bytes reply) {
      if (outcome == Outcome::corrupt) return Damaged(std::move(reply));
      reply.resize(3);
      return reply;
    };
    const std::size_t before = line.OnWire().size();
    line.Ask("read", kRead);
    line.RunFor(2s);
    EXPECT_EQ(line.Of("read").outcome, outcome);
    EXPECT_EQ(line.OnWire().size() - before, 3U);
  }
}

TEST(PollerRoutedFaults, ADamagedProbeOfAnAbsentSlaveIsNotRepeatedAtOnce) {
  RoutedLine line;
  line.twin(0).manner.dead = true;
  for (int i = 0; i < 4; ++i) {
    line.Ask("vain", kRead);
    line.RunFor(1s);
  }
  line.twin(0).manner.dead = false;
  line.twin(0).manner.distort = Damaged;
  const std::size_t before = line.sent.size();
  line.Ask("probe", kRead);
  ASSERT_TRUE(line.RunUntil([&] { return line.sent.size() > before; }, 5s));
  line.RunFor(300ms);
  EXPECT_EQ(line.sent.size(), before + 1);
}

// The slave answers each request with its reply to the request before.
TEST(PollerRoutedFaults, TheReplyToALostReadIsNotGivenToTheNextRead) {
  RoutedLine line;
  line.Number(0, 1);
  line.Ask("warm", kRead);
  line.RunFor(1s);
  Bytes late;
  line.twin(0).manner.deliver = [&](View, Bytes reply, Instant) -> Pieces {
    return {{5ms, std::exchange(late, std::move(reply))}};
  };
  line.Ask("lost", kRead);
  line.RunFor(1500ms);
  line.Ask("next", kOther, 20, 2);
  line.RunFor(2s);
  EXPECT_EQ(line.Of("lost").outcome, Outcome::no_reply);
  EXPECT_EQ(ToHex(line.Of("next").pdu), "03 02 00 02");
}

// Six replies were damaged, so six replies may answer an earlier request.
TEST(PollerRoutedFaults, AReadWhoseReplyMayBeOlderIsRepeatedFourTimes) {
  RoutedLine line;
  line.Ask("warm", kRead);
  line.RunFor(1s);
  line.twin(0).manner.distort = Damaged;
  line.Ask("damaged", ReadOf(1));
  line.Ask("damaged too", ReadOf(2), 20, 2);
  line.RunFor(1500ms);
  ASSERT_EQ(line.sent.size(), 7U);
  line.twin(0).manner.distort = {};
  line.Ask("next", ReadOf(3));
  line.RunFor(1500ms);
  EXPECT_EQ(line.Of("next").outcome, Outcome::unexpected);
  EXPECT_EQ(line.sent.size(), 7U + 5);
}

TEST(PollerRoutedFaults, AWriteWhoseReplyMayBeOlderIsNotRepeated) {
  RoutedLine line;
  line.Ask("warm", kRead);
  line.RunFor(1s);
  line.twin(0).manner.dead = true;
  line.Ask("start", kStartBlock);
  line.RunFor(1500ms);
  line.twin(0).manner.dead = false;
  const std::size_t before = line.sent.size();
  line.Ask("stop", kStopBlock);
  line.RunFor(1500ms);
  EXPECT_EQ(line.Of("stop").outcome, Outcome::unexpected);
  EXPECT_EQ(line.sent.size(), before + 1);
}

// After exception 04 the slave may have changed something.
TEST(PollerRoutedFaults, AfterAWriteThatTheSlaveDeclinesItsPointsAreNotReadAgain) {
  for (std::uint8_t code = 1; code <= 4; ++code) {
    RoutedLine line(DriveLine({Polled("20", 1, 1h)}), {});
    line.RunFor(5s);
    line.twin(0).manner.instead = [code](View request) -> std::optional<Bytes> {
      if (request[1] != 0x06) return std::nullopt;
      return protocols::ModbusRtuProtocol().carrier->wrap(20, Bytes{0x86, code});
    };
    const std::size_t before = line.sent.size();
    line.Ask("write", kStartDrive);
    line.RunFor(1s);
    EXPECT_EQ(line.Of("write").outcome, Outcome::refused);
    EXPECT_EQ(line.sent.size() > before + 1, code == 4) << int{code};
  }
}

// The replies to both writes of function 16 are equal. A PLC could take the late reply to the start
// for the stop, while the motor runs.
TEST(PollerRoutedFaults, TheLateReplyToAStartDoesNotConfirmTheStop) {
  RoutedLine line;
  line.Ask("warm", kRead);
  line.RunFor(1s);
  line.twin(0).manner.think = 300ms;
  line.Ask("start", kStartBlock, 20, 1);
  line.Inject(kNoise, 20ms);
  line.RunFor(50ms);
  line.twin(0).manner.dead = true;
  line.Ask("stop", kStopBlock, 20, 1);
  line.RunFor(3s);
  EXPECT_NE(line.Of("stop").outcome, Outcome::ok) << "the slave never heard it";
}

TEST(PollerRoutedFaults, TheLateReplyOfAnotherSlaveDoesNotEndAWrite) {
  RoutedLine line;
  line.Ask("warm", kRead, 20);
  line.Ask("warm too", kRead, 21);
  line.RunFor(1s);
  line.twin(0).manner.think = 650ms;
  line.twin(0).manner.fragment = 1;
  line.twin(1).manner.think = 150ms;
  line.Ask("late", kRead, 20);
  line.Ask("start", kStartDrive, 21, 2);
  line.RunFor(3s);
  EXPECT_EQ(line.Of("late").outcome, Outcome::no_reply);
  EXPECT_EQ(line.Of("start").outcome, Outcome::ok);
}

TEST(PollerRoutedFaults, TheLateReplyOfAnotherSlaveDoesNotShiftReplies) {
  RoutedLine line;
  line.Number(1, 1);
  line.Ask("warm", kRead, 20);
  line.Ask("warm too", kRead, 21);
  line.RunFor(1s);
  line.twin(0).manner.think = 650ms;
  line.twin(0).manner.fragment = 1;
  line.twin(1).manner.think = 300ms;
  line.Ask("late", kRead, 20);
  line.Ask("read", kRead, 21, 2);
  line.Ask("other", kOther, 21, 3);
  line.RunFor(3s);
  EXPECT_EQ(ToHex(line.Of("other").pdu), "03 02 00 02");
}

// A serial server stores bytes that arrive while no client is connected to it.
TEST(PollerRoutedFaults, AReplyFromBeforeAReconnectIsIgnored) {
  RoutedLine line;
  line.Number(0, 1);
  line.Ask("warm", kRead);
  line.RunFor(1s);
  line.twin(0).manner.think = 300ms;
  line.Ask("read", kRead);
  line.RunFor(50ms);
  line.Close();
  line.RunFor(100ms);
  line.Open();
  line.Inject(protocols::ModbusRtuProtocol().carrier->wrap(20, ParseHex("03 02 00 01").value()),
              200ms);
  line.Ask("other", kOther, 20, 2);
  line.RunFor(2s);
  EXPECT_EQ(ToHex(line.Of("other").pdu), "03 02 00 02");
}

using Odd = std::pair<std::string, std::string>;
constexpr const char* kEnron = "03 13 89 00 01";
constexpr const char* kWhole = "10 00 00 00 01 02 00 02";

const Odd kOddReplies[] = {
    {kEnron, "03 04 00 01 00 02"},
    {"06 00 0D 00 6C", "06 00 0D 00 64"},  // the slave limits the value
    {kWhole, kWhole},
    {"0F 00 00 00 01 01 01", "0F 00 00 00 01 01 01"},
    {"08 00 00 12 34", "08 00 00 12 35"},
    {"08 00 15 00 03", "08 00 15 00 03 00 02 00 00 00 01"},
};

void AnswerOddly(Manner& manner, const std::string& request, const std::string& reply,
                 const protocols::PduCarrier& carrier = *protocols::ModbusRtuProtocol().carrier) {
  manner.deliver = [=, &carrier](View asked, Bytes usual, Instant) -> Pieces {
    const bool odd = ToHex(asked) == ToHex(carrier.wrap(20, ParseHex(request).value()));
    return {{5ms, odd ? carrier.wrap(20, ParseHex(reply).value()) : std::move(usual)}};
  };
}

TEST(PollerRoutedFaults, AnOddReplyIsAcceptedWhenNoOtherReplyIsOutstanding) {
  for (const bool device : {false, true}) {
    for (const auto& [request, reply] : kOddReplies) {
      SCOPED_TRACE(request);
      RoutedLine line(
          DriveLine(device ? std::vector{Polled("20", 2, 1s)} : std::vector<config::Device>()),
          device ? std::vector<std::string>() : std::vector<std::string>{"20"});
      line.Ask("warm", kRead);
      line.RunFor(5s);
      AnswerOddly(line.twin(0).manner, request, reply);
      for (int i = 0; i < 8; ++i) {
        const std::string name = "odd " + std::to_string(i);
        line.Ask(name, request);
        line.RunFor(800ms);
        EXPECT_EQ(line.Of(name).outcome, Outcome::ok);
        EXPECT_EQ(ToHex(line.Of(name).pdu), reply);
      }
      line.Ask("a", kRead, 20, 2);
      line.RunFor(800ms);
      EXPECT_EQ(line.Of("a").outcome, Outcome::ok);
      EXPECT_TRUE(line.warnings.empty());
      if (device) {
        EXPECT_EQ(line.StatusOf(0).state, DeviceState::online);
      }
    }
  }
}

TEST(PollerRoutedFaults, AWholeEchoOfAWriteIsNoReplyWhenTheBusMayEcho) {
  RoutedLine line(DriveLine(), {"20"});
  AnswerOddly(line.twin(0).manner, kWhole, kWhole);
  for (int i = 0; i < 8; ++i) {
    line.Ask("write " + std::to_string(i), kWhole);
    line.RunFor(800ms);
    EXPECT_EQ(line.Of("write " + std::to_string(i)).outcome, Outcome::unexpected);
  }
  line.Ask("a", kRead, 20, 2);
  line.Ask("b", kOther, 20, 3);
  line.RunFor(800ms);
  EXPECT_EQ(line.Of("a").outcome, Outcome::ok) << "a slave that answers oddly is there";
  EXPECT_EQ(line.Of("b").outcome, Outcome::ok);
  line.Ask("write", kWhole);
  line.RunFor(800ms);
  EXPECT_EQ(line.Of("write").outcome, Outcome::ok);
}

TEST(PollerRoutedFaults, TheEchoOfABlockOnADeadSlaveIsNoReply) {
  RoutedLine line(DriveLine(), {"20"});
  bool dead = false;
  line.twin(0).manner.deliver = [&](View request, Bytes reply, Instant) -> Pieces {
    Pieces pieces{{1ms, Bytes(request.begin(), request.end())}};
    if (!dead) pieces.push_back({5ms, std::move(reply)});
    return pieces;
  };
  line.Ask("read", kRead);
  line.RunFor(1s);
  line.Ask("write", kWhole);
  line.RunFor(1s);
  EXPECT_EQ(line.Of("write").outcome, Outcome::ok);
  dead = true;
  line.Ask("vain", kWhole);
  line.RunFor(1s);
  EXPECT_NE(line.Of("vain").outcome, Outcome::ok);
}

TEST(PollerRoutedFaults, ALateReplyOfAnotherLengthIsNotAcceptedAsAnOddReply) {
  for (const bool device : {false, true}) {
    RoutedLine line(
        DriveLine(device ? std::vector{Polled("20", 2, 1h)} : std::vector<config::Device>()),
        device ? std::vector<std::string>() : std::vector<std::string>{"20"});
    line.Ask("warm", kRead);
    line.RunFor(1s);
    for (Duration think = 20ms; think < 1500ms; think += 37ms) {
      line.twin(0).manner.think = think;
      line.Ask("long", "03 00 00 00 02");
      line.RunFor(10ms);
      line.Inject(kNoise, 20ms);
      line.Ask("short", kRead, 20, 2);
      line.RunFor(4s);
      for (const auto& reply : line.replies) {
        if (reply.name != "short" || reply.reply.outcome != Outcome::ok) continue;
        EXPECT_EQ(reply.reply.pdu.size(), 4U) << FormatDuration(think);
      }
    }
  }
}

Pieces IgnoreOdd(View request, Bytes reply, Instant) {
  if (request[1] == 0x41) return {};
  return {{5ms, std::move(reply)}};
}

TEST(PollerRoutedFaults, OddRequestsThatASlaveIgnoresDoNotPutItOffline) {
  RoutedLine line(DriveLine({Polled("20", 2, 60s)}), {});
  line.RunFor(5s);
  line.twin(0).manner.deliver = IgnoreOdd;
  for (int i = 0; i < 40; ++i) {
    line.Ask("odd", kOdd, 20, 9);
    line.RunFor(800ms);
  }
  EXPECT_EQ(line.Of("odd").outcome, Outcome::no_reply);
  EXPECT_EQ(line.StatusOf(0).state, DeviceState::online);
  EXPECT_EQ(line.QualityOf(0, 0), Quality::good);
}

TEST(PollerRoutedFaults, OddRequestsOfOneClientDoNotBlockTheSlaveForOthers) {
  RoutedLine line;
  line.twin(0).manner.deliver = IgnoreOdd;
  line.Ask("warm", kRead);
  line.RunFor(1s);
  for (int i = 0; i < 4; ++i) {
    line.Ask("odd", kOdd, 20, 9);
    line.RunFor(800ms);
  }
  line.Ask("a", kRead, 20, 1);
  line.Ask("b", kOther, 20, 2);
  line.RunFor(2s);
  EXPECT_EQ(line.Of("a").outcome, Outcome::ok);
  EXPECT_EQ(line.Of("b").outcome, Outcome::ok);
}

// A busy client of slave 20 leaves 2 % of the line's time for probes, so slave 21 is probed long
// after its return.
TEST(PollerRoutedFaults, AWriteReachesAReturnedSlaveBeforeAProbeFindsIt) {
  RoutedLine line;
  BusyClients clients(line);
  clients.Add(kRead, 20);
  line.Ask("warm", kRead, 21, 2);
  line.RunFor(1s);
  line.twin(1).manner.dead = true;
  for (int i = 0; i < 20; ++i) {
    line.Ask("vain", kStartDrive, 21, 2);
    line.RunFor(1s);
  }
  line.twin(1).manner.dead = false;
  line.RunFor(10s);
  const int before = clients.answered(0);
  line.Ask("stop", kStartDrive, 21, 2);
  line.RunFor(3s);
  EXPECT_EQ(line.Of("stop").outcome, Outcome::ok);
  EXPECT_GT(clients.answered(0), before + 50);
}

TEST(PollerRoutedFaults, WritesToAnAbsentSlaveTakeAtMostAFifthFromTheOthers) {
  RoutedLine line;
  BusyClients clients(line);
  clients.Add(kRead, 20);
  line.RunFor(30s);
  const int alone = clients.answered(0);
  line.twin(1).manner.dead = true;
  for (int i = 0; i < 150; ++i) {
    line.Ask("vain", kStartDrive, 21, 2);
    line.RunFor(200ms);
  }
  EXPECT_GT(clients.answered(0) - alone, alone * 4 / 5) << "a tenth for writes, and the probes";
}

TEST(PollerRoutedFaults, WritesThatASlaveIgnoresDoNotStarveItsPolls) {
  config::Device device = Polled("20", 4, 500ms);
  device.points[1].read = "holding 1000";
  device.points[2].read = "holding 2000";
  device.points[3].read = "holding 3000";
  RoutedLine line(DriveLine({device, Polled("21", 4, 500ms)}), {});
  line.Open();
  line.RunFor(1500ms);
  line.twin(0).manner.instead = [](View request) -> std::optional<Bytes> {
    if (request[1] != 0x06) return std::nullopt;
    return Bytes();
  };
  BusyClients clients(line);
  clients.Add(kStartDrive, 20);
  for (int second = 0; second < 30; ++second) {
    line.RunFor(1s);
    for (std::uint32_t point = 1; point < device.points.size(); ++point) {
      EXPECT_EQ(line.QualityOf(0, point), Quality::good) << second << " " << point;
    }
    EXPECT_LT(*line.AgeOf(0, 0), 1500ms) << second;
  }
  EXPECT_GE(clients.failed(0), 15);
}

TEST(PollerReadBack, AFailedReadBackMakesAllPointsOfItsRequestUncertain) {
  RoutedLine line(DriveLine({Polled("20", 2, 10s)}), {});
  line.Open();
  line.RunFor(11s);
  ASSERT_EQ(line.QualityOf(0, 1), Quality::good);
  line.twin(0).manner.instead = [](View request) -> std::optional<Bytes> {
    if (request[1] == 0x06 || request[1] == 0x10) return std::nullopt;
    return Bytes();
  };
  ASSERT_TRUE(line.Write(0, 0, std::uint64_t{7}));
  line.RunFor(5s);
  EXPECT_EQ(line.ends, std::vector{WriteEnd::ok});
  EXPECT_EQ(line.QualityOf(0, 0), Quality::uncertain);
  EXPECT_EQ(line.QualityOf(0, 1), Quality::uncertain);
}

TEST(PollerRoutedFaults, ReadsOfAnAbsentSlaveFailAtOnceAndBarelySlowTheOthers) {
  RoutedLine line;
  BusyClients clients(line);
  clients.Add(kRead, 20);
  line.RunFor(10s);
  const int alone = clients.answered(0);
  line.twin(1).manner.dead = true;
  int told = 0;
  for (int i = 0; i < 100; ++i) {
    line.Ask("read " + std::to_string(i), kRead, 21, 2);
    line.RunFor(100ms);
    for (const auto& reply : line.replies) told += reply.name == "read " + std::to_string(i);
  }
  EXPECT_GT(told, 80) << "not at its deadline, but at once";
  EXPECT_GT(clients.answered(0) - alone, alone * 17 / 20) << "the first silence, then probes";
}

TEST(PollerRoutedFaults, ALostReplyFailsNoOtherRequest) {
  RoutedLine line;
  int asked = 0;
  int lost = 0;
  line.twin(0).manner.deliver = [&](View, Bytes reply, Instant) -> Pieces {
    if (reply.empty()) return {};
    if (++asked % 3 == 0) {
      ++lost;
      return {};
    }
    return {{5ms, std::move(reply)}};
  };
  BusyClients clients(line);
  for (std::uint8_t i = 0; i < 5; ++i) clients.Add(ReadOf(i), 20);
  line.RunFor(60s);
  int answered = 0;
  int failed = 0;
  for (std::size_t i = 0; i < 5; ++i) {
    answered += clients.answered(i);
    failed += clients.failed(i);
  }
  EXPECT_GT(answered, 70) << "behind each loss one read is asked twice";
  EXPECT_NEAR(failed, lost, 1) << "one may be under way";
}

// An idle line sends no request, so it gets no reply. If it counted as silent, the gateway would
// reconnect to a serial server again and again.
TEST(PollerRoutedFaults, AnIdleLineIsNotSilentBecauseItsLastReplyWasLost) {
  RoutedLine line;
  line.Ask("warm", kRead);
  line.RunFor(1s);
  line.twin(0).manner.dead = true;
  line.Ask("lost", kRead);
  line.RunFor(60s);
  EXPECT_EQ(line.Of("lost").outcome, Outcome::no_reply);
  EXPECT_FALSE(line.poller().accounts().line.SilentSince(line.now().instant - 30s))
      << "nothing was asked since";
}

// Two devices of the configuration have the address of the same slave. Every fifth reply is late,
// and no reply contains its register number.
TEST(PollerRoutedFaults, ALateReplyToOneEntryIsNotStoredForTheOtherEntry) {
  for (Duration late = 100ms; late < 1050ms; late += 37ms) {
    SCOPED_TRACE(FormatDuration(late));
    config::Device second = Polled("20", 6, 400ms);
    second.points.erase(second.points.begin(), second.points.begin() + 5);
    RoutedLine line(DriveLine({Polled("20", 1, 300ms), second}), {"20"});
    line.twin(0).manner.dead = line.twin(1).manner.dead = true;
    line.Number(2, 1000);
    int asked = 0;
    line.twin(2).manner.deliver = [&](View, Bytes reply, Instant) -> Pieces {
      if (reply.empty()) return {};
      return {{++asked % 5 == 0 ? late : 5ms, std::move(reply)}};
    };
    line.always = [&] {
      const Value first = line.ValueOf(0, 0);
      const Value sixth = line.ValueOf(1, 0);
      ASSERT_TRUE(!HasValue(first) || ToText(first) == "1000") << ToText(first);
      ASSERT_TRUE(!HasValue(sixth) || ToText(sixth) == "1005") << ToText(sixth);
    };
    line.RunFor(1min);
    if (HasFatalFailure()) return;
    EXPECT_TRUE(HasValue(line.ValueOf(0, 0)));
    EXPECT_TRUE(HasValue(line.ValueOf(1, 0)));
  }
}

}  // namespace
}  // namespace baudgate::bus
