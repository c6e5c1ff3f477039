// Tests of transparent routes with random faults, and on a bus that echoes, under virtual time.
// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <array>
#include <map>
#include <random>

#include "gateway/base/text.h"
#include "gateway/bus/poller/poller.h"
#include "tests/gateway/bus/poller/routed_line.h"

namespace baudgate::bus {
namespace {

using config::Priority;

class Dice {
 public:
  explicit Dice(unsigned seed) : random_(seed) {}

  bool OneIn(std::size_t count) { return Below(count) == 0; }
  std::size_t Below(std::size_t limit) { return random_() % limit; }
  Duration MillisecondsBelow(std::size_t limit) { return std::chrono::milliseconds(Below(limit)); }
  template <typename T, std::size_t n>
  T OneOf(const std::array<T, n>& these) {
    return these[Below(n)];
  }

 private:
  std::mt19937 random_;
};

void Disturb(RoutedLine& line, std::size_t slaves, Dice& dice) {
  Manner& manner = line.twin(dice.Below(slaves)).manner;
  switch (dice.Below(4)) {
    case 0:
      manner.dead = !manner.dead;
      break;
    case 1:
      manner.think = dice.MillisecondsBelow(700);
      break;
    case 2:
      manner.distort = dice.OneIn(2) ? Damaged : std::function<Bytes(Bytes)>();
      break;
    default:
      line.Inject({0x14, 0x03, 0x02}, dice.MillisecondsBelow(50));
      break;
  }
}

class RandomRun {
 public:
  explicit RandomRun(unsigned seed)
      : dice_(seed), polled_(seed % 2 == 1), line_(DriveLine(Devices(polled_))) {}

  void Run() {
    for (int step = 0; step < 150; ++step) {
      Step();
      line_.RunFor(dice_.MillisecondsBelow(120));
    }
    if (!open_) line_.Open();
    line_.RunFor(60s);
  }

  const RoutedLine& line() const { return line_; }
  std::size_t asked() const { return asked_; }

 private:
  static std::vector<config::Device> Devices(bool polled) {
    if (!polled) return {};
    return {Polled("22", 3, 200ms)};
  }

  void Step() {
    switch (dice_.Below(12)) {
      case 0:
      case 1:
      case 2:
      case 3:
        Disturb(line_, polled_ ? 3 : 2, dice_);
        break;
      case 4:
        if (dice_.OneIn(4)) TogglePort();
        break;
      case 5:
        line_.poller().Abandon(dice_.Below(5), line_.now());
        break;
      case 6:
        if (polled_) line_.poller().SetInUse(0, !dice_.OneIn(3), line_.now());
        break;
      default:
        Ask();
        break;
    }
  }

  void TogglePort() {
    open_ = !open_;
    open_ ? line_.Open() : line_.Close();
  }

  void Ask() {
    static constexpr std::array kPdus = {
        kRead, kOther,  kBlock,           kStartDrive,
        kStop, "41 00", "08 00 00 12 34", "10 00 00 00 01 02 00 02"};
    static constexpr std::array<std::uint8_t, 6> kSlaves = {20, 20, 21, 22, 0, 33};
    static constexpr std::array kPriorities = {Priority::high, Priority::normal, Priority::low};
    const char* const pdu = dice_.OneOf(kPdus);
    const std::uint8_t slave = dice_.OneOf(kSlaves);
    const std::size_t client = dice_.Below(5);
    const Priority priority = dice_.OneOf(kPriorities);
    line_.Ask(std::to_string(asked_++), pdu, slave, client, priority,
              50ms + dice_.MillisecondsBelow(3000));
  }

  Dice dice_;
  bool polled_;
  RoutedLine line_;
  bool open_ = true;
  std::size_t asked_ = 0;
};

TEST(PollerRoutedRandom, EveryRequestIsAnsweredOnce) {
  for (unsigned seed = 1; seed <= 300; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    RandomRun run(seed);
    run.Run();
    std::map<std::string, int> answers;
    for (const RoutedLine::Reply& reply : run.line().replies) ++answers[reply.name];
    for (const auto& [name, count] : answers) EXPECT_EQ(count, 1) << "request " << name;
    EXPECT_EQ(answers.size(), run.asked());
  }
}

struct Tally {
  int ok = 0;
  int wrong = 0;
};

Tally TallyOf(const RoutedLine& line) {
  Tally tally;
  for (const RoutedLine::Reply& reply : line.replies) {
    if (reply.reply.outcome != Outcome::ok) continue;
    ++tally.ok;
    const Bytes& pdu = reply.reply.pdu;
    if (std::to_string(pdu.at(2) * 256 + pdu.at(3)) != reply.name) ++tally.wrong;
  }
  return tally;
}

Tally ReadAtRandom(unsigned seed) {
  Dice dice(seed);
  RoutedLine line;
  line.Number(0, 1000);
  line.Number(1, 2000);
  for (int step = 0; step < 150; ++step) {
    if (dice.Below(10) < 4) {
      Disturb(line, 2, dice);
    } else {
      const std::size_t reg = dice.Below(5);
      const std::size_t slave = dice.Below(2);
      line.Ask(std::to_string(1000 * (slave + 1) + reg), ReadOf(static_cast<std::uint8_t>(reg)),
               static_cast<std::uint8_t>(20 + slave), dice.Below(5), Priority::normal, 3s);
    }
    line.RunFor(dice.MillisecondsBelow(120));
  }
  line.RunFor(10s);
  return TallyOf(line);
}

// A Modbus RTU reply does not contain its register number, so only the order of replies shows its
// register.
TEST(PollerRoutedRandom, NoReadReturnsAValueOfAnotherRegister) {
  int ok = 0;
  for (unsigned seed = 1; seed <= 150; ++seed) {
    const Tally tally = ReadAtRandom(seed);
    EXPECT_EQ(tally.wrong, 0) << "seed " << seed;
    ok += tally.ok;
  }
  EXPECT_GT(ok, 1400);
}

Tally ReadFromLateSlave(config::Line settings, int every, Duration late) {
  const std::size_t devices = settings.devices.size();
  RoutedLine line(std::move(settings),
                  devices == 0 ? std::vector<std::string>{"20"} : std::vector<std::string>{});
  line.Number(0, 0);
  int asked = 0;
  Instant last{};
  line.twin(0).manner.deliver = [&](View, Bytes reply,
                                    Instant now) -> std::vector<tools::TimedPiece> {
    const Duration due = ++asked % every == 0 ? late : 10ms;
    last = std::max(last, now + due);
    return {{last - now, std::move(reply)}};
  };
  std::size_t reg = 0;
  for (int step = 0; step < 400; ++step) {
    const std::size_t before = line.replies.size();
    reg = (reg + 7) % 120;
    line.Ask(std::to_string(reg), ReadOf(static_cast<std::uint8_t>(reg)), 20);
    line.RunUntil([&] { return line.replies.size() > before; }, 5s);
    line.RunFor(devices == 0 ? 1ms : 100ms);
  }
  return TallyOf(line);
}

TEST(PollerRoutedRandom, AVeryLateReplyIsNeverGivenToAnotherRequest) {
  for (const bool polled : {false, true}) {
    for (const Duration late : {800ms, 900ms, 1000ms, 1500ms, 3000ms}) {
      for (const int every : {1, 2, 3, 5, 20}) {
        config::Line settings = DriveLine();
        if (polled) settings.devices.push_back(Polled("20", 120));
        const Tally tally = ReadFromLateSlave(std::move(settings), every, late);
        EXPECT_EQ(tally.wrong, 0) << FormatDuration(late) << " each " << every << " " << polled;
        if (every == 20 && late <= 1s) {
          EXPECT_GT(tally.ok, polled ? 100 : 200) << FormatDuration(late) << " " << polled;
        }
      }
    }
  }
}

using Pieces = std::vector<tools::TimedPiece>;

TEST(PollerRoutedEcho, AnEchoWhileSendingDoesNotConfirmTheFirstWrite) {
  RoutedLine line(DriveLine(), {"20"});
  line.echo = [](View request) { return Bytes(request.begin(), request.end()); };
  line.twin(0).manner.dead = true;
  line.Ask("start", kStartDrive);
  line.RunFor(2s);
  EXPECT_NE(line.Of("start").outcome, Outcome::ok);
}

TEST(PollerRoutedEcho, AnEarlyEchoDoesNotConfirmTheFirstWrite) {
  RoutedLine line(DriveLine(), {"20"});
  line.twin(0).manner.deliver = [](View request, const Bytes&, Instant) -> Pieces {
    return {{-1ms, Bytes(request.begin(), request.end())}};
  };
  line.Ask("start", kStartDrive);
  line.RunFor(2s);
  EXPECT_NE(line.Of("start").outcome, Outcome::ok);
}

// The echo arrives after the request, so the port is no reason to reject it. A read reveals that
// the bus echoes, because the echo differs from the reply.
TEST(PollerRoutedEcho, AnEchoDoesNotConfirmAWriteAfterAReadRevealedTheEcho) {
  RoutedLine line(DriveLine(), {"20"});
  bool dead = false;
  line.twin(0).manner.deliver = [&](View request, Bytes reply, Instant) -> Pieces {
    Pieces pieces{{1ms, Bytes(request.begin(), request.end())}};
    if (!dead) pieces.push_back({15ms, std::move(reply)});
    return pieces;
  };
  line.Ask("read", kRead);
  line.RunFor(1s);
  EXPECT_EQ(line.Of("read").outcome, Outcome::ok);
  EXPECT_EQ(line.warnings.size(), 1U) << "the user is told to set 'echo: strip'";
  dead = true;
  line.Ask("start", kStartDrive);
  line.RunFor(2s);
  EXPECT_NE(line.Of("start").outcome, Outcome::ok);
}

TEST(PollerRoutedEcho, AReplyThatMayEqualItsRequestIsNotTakenAsAnEcho) {
  RoutedLine line(DriveLine(), {"20"});
  line.twin(0).manner.instead = [](View request) -> std::optional<Bytes> {
    if (request[1] != 0x08 && request[1] != 0x41) return std::nullopt;
    return Bytes(request.begin(), request.end());
  };
  line.Ask("clear counters", "08 00 0A 00 00");
  line.Ask("own function", "41 01 02 03");
  line.RunFor(1s);
  line.Ask("start", kStartDrive);
  line.RunFor(1s);
  EXPECT_EQ(line.Of("start").outcome, Outcome::ok);
  EXPECT_TRUE(line.warnings.empty());
}

TEST(PollerRoutedEcho, AWriteIsConfirmedAgainWhenTheBusStopsEchoing) {
  RoutedLine line(DriveLine(), {"20"});
  bool echoes = true;
  line.twin(0).manner.deliver = [&](View request, Bytes reply, Instant) -> Pieces {
    Pieces pieces{{15ms, std::move(reply)}};
    if (echoes) pieces.insert(pieces.begin(), {1ms, Bytes(request.begin(), request.end())});
    return pieces;
  };
  line.Ask("read", kRead);
  line.RunFor(1s);
  echoes = false;
  line.Ask("read again", kRead);
  line.RunFor(1s);
  line.Ask("start", kStartDrive);
  line.RunFor(1s);
  EXPECT_EQ(line.Of("start").outcome, Outcome::ok);
}

}  // namespace
}  // namespace baudgate::bus
