// Tests described devices on lines in virtual time: cost, writes, and values that get old.
// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <deque>
#include <filesystem>
#include <fstream>
#include <random>
#include <set>

#include "gateway/base/bytes.h"
#include "gateway/bus/poller/poller.h"
#include "protocols/dcon/protocol.h"
#include "tests/protocols/telegram/support.h"
#include "tests/support/virtual_line.h"

namespace baudgate::protocols::telegram {
namespace {

config::Line LineWith(const Protocol& protocol, config::Device device, int baud) {
  config::Line line;
  line.name = "line";
  line.protocol = std::string(protocol.name);
  line.serial = protocol.serial;
  line.serial.baud = baud;
  line.options = device.options;
  line.devices.push_back(std::move(device));
  return line;
}

struct Used {
  double exchanges = 0;  ///< number of exchanges in 42 s
  double age = 0;        ///< average age of the first point, in seconds
};

Used UseOf(const Protocol& protocol, const std::string& profile, int baud) {
  config::Device device = ShippedDevice(protocol, profile);
  device.poll = 5ms;
  VirtualLine line(LineWith(protocol, std::move(device), baud), {&protocol});
  for (std::size_t i = 0; i < 8; ++i) line.twin(0).values.values[i] = 10.5 + static_cast<double>(i);
  line.keep_sent = false;
  line.Open();
  line.RunFor(5s);
  const auto before = line.StatusOf(0).exchanges;
  Used used;
  for (int sample = 0; sample < 6000; ++sample) {
    line.RunFor(7ms);
    used.age += std::chrono::duration<double>(line.AgeOf(0, 0).value_or(1h)).count() / 6000;
  }
  EXPECT_EQ(line.QualityOf(0, 0), Quality::good);
  used.exchanges = line.StatusOf(0).exchanges - before;
  return used;
}

TEST(TelegramLine, TheMv110IsAsFastAsWithItsOwnPlugin) {
  for (const int baud : {9600, 115200}) {
    const Used own = UseOf(TelegramProtocol(), "owen-mv110-8a-telegrams", baud);
    const Used dcon = UseOf(DconProtocol(), "owen-mv110-8a", baud);
    EXPECT_GT(dcon.exchanges, 100);
    EXPECT_NEAR(own.exchanges / dcon.exchanges, 1, 0.02) << baud;
    EXPECT_NEAR(own.age / dcon.age, 1, 0.02) << baud;
  }
}

TEST(TelegramLine, AWriteIsSentOnceAndReadBack) {
  config::Device device = ShippedDevice(TelegramProtocol(), "mt-sics");
  VirtualLine line(LineWith(TelegramProtocol(), device, 9600), {&TelegramProtocol()});
  const auto point = [&](const std::string& name) {
    std::uint32_t index = 0;
    while (device.points[index].name != name) ++index;
    return index;
  };
  line.twin(0).values.values[point("weight")] = 100.0;
  line.twin(0).values.values[point("stable")] = true;
  line.twin(0).values.values[point("weight_unit")] = std::string("g");
  line.twin(0).values.values[point("tare_weight")] = 0.0;
  line.Open();
  line.RunFor(5s);
  EXPECT_EQ(line.QualityOf(0, point("weight")), Quality::good);
  ASSERT_TRUE(line.Write(0, point("tare"), true));
  line.RunFor(5s);
  ASSERT_EQ(line.ends.size(), 1U);
  EXPECT_EQ(line.ends[0], WriteEnd::ok);
  EXPECT_EQ(line.CountSent("T\r\n"), 1U);
  line.twin(0).manner.instead = [](View request) -> std::optional<Bytes> {
    if (AsText(request) == "T\r\n") return Bytes();
    return std::nullopt;
  };
  ASSERT_TRUE(line.Write(0, point("tare"), true));
  line.RunFor(30s);
  ASSERT_EQ(line.ends.size(), 2U);
  EXPECT_EQ(line.ends[1], WriteEnd::unknown) << "nobody knows what became of it";
  EXPECT_EQ(line.CountSent("T\r\n"), 2U) << "and it is not repeated";
}

/// The only telegram is a write, so nothing proves to which request an answer belongs.
TEST(TelegramLine, AWriteOnlyDeviceIsWritten) {
  const config::Device device = Described(R"(
device: d
telegrams:
  limit: { send: 'L={value:03d}\r', receive: 'L={value:03d}\r', example: { send: 'L=050\r', receive: 'L=050\r' } }
points: [ { name: limit, access: w, write: limit, type: uint16 } ]
)");
  VirtualLine line(LineWith(TelegramProtocol(), device, 9600), {&TelegramProtocol()});
  line.Open();
  ASSERT_TRUE(line.Write(0, 0, std::uint64_t{50}));
  line.RunFor(3s);
  EXPECT_EQ(line.ends, std::vector{WriteEnd::ok});
  line.twin(0).manner.dead = true;
  ASSERT_TRUE(line.Write(0, 0, std::uint64_t{51}));
  line.RunFor(1min);
  EXPECT_EQ(line.ends.back(), WriteEnd::unknown);
  line.twin(0).manner.dead = false;
  ASSERT_TRUE(line.Write(0, 0, std::uint64_t{52}));
  line.RunFor(3s);
  EXPECT_EQ(line.ends.back(), WriteEnd::ok) << "its answer repeats the value";
  EXPECT_EQ(line.sent.size(), 3U);
}

TEST(TelegramLine, UnaskedValuesAge) {
  VirtualLine line(
      LineWith(TelegramProtocol(), ShippedDevice(TelegramProtocol(), "nmea-0183-weather"), 4800),
      {&TelegramProtocol()});
  line.Open();
  line.RunFor(10s);
  EXPECT_EQ(line.QualityOf(0, 0), Quality::bad_waiting);
  const std::string sentence = "$WIMWV,045,R,011.63,N,A*09\r\n";
  for (int i = 0; i < 5; ++i) {
    line.Inject(ToBytes(sentence.substr(0, 9)));
    line.Inject(ToBytes(sentence.substr(9)), 5ms);
    line.RunFor(1s);
    EXPECT_EQ(line.QualityOf(0, 0), Quality::good);
    EXPECT_NEAR(ToDouble(line.ValueOf(0, 1)), 11.63, 1e-5);
  }
  EXPECT_TRUE(line.sent.empty()) << "nothing is ever sent";
  line.RunFor(8s);
  EXPECT_FALSE(IsGood(line.QualityOf(0, 0))) << "three times its poll";
}

TEST(TelegramLine, APauseIsKeptBeforeItsTelegram) {
  const config::Device device = Described(R"(
device: d
telegrams:
  wake: { send: '\x00', reads: yes, example: { send: '\x00' } }
  value: { send: 'V\r', receive: '={value:+decimal}\r', reads: yes, before: wake, pause: 200ms, example: { send: 'V\r', receive: '=+5\r', value: 5 } }
points: [ { name: value, read: value.value, type: float32 } ]
)");
  VirtualLine line(LineWith(TelegramProtocol(), device, 9600), {&TelegramProtocol()});
  line.twin(0).values.values[0] = 5.0;
  line.Open();
  line.RunFor(3s);
  std::size_t asked = 0;
  for (std::size_t i = 1; i < line.sent.size(); ++i) {
    if (line.sent[i].text != "V\r") continue;
    ++asked;
    EXPECT_EQ(line.sent[i - 1].text, std::string(1, '\0'));
    EXPECT_GE(line.sent[i].at - line.sent[i - 1].at, Duration(200ms));
  }
  EXPECT_GE(asked, 2U);
  EXPECT_EQ(line.QualityOf(0, 0), Quality::good);
}

TEST(TelegramLine, AReplyOfAnotherChannelIsNeverGood) {
  for (const char* answer : {"", ", receive: 'OK\\r'"}) {
    const std::string receives(answer);
    const config::Device device =
        Described("device: d\npoll: 500ms\ntelegrams:\n  sel: { send: 'CH{n:d}\\r', reads: yes" +
                  receives + ", example: { send: 'CH1\\r'" + receives +
                  " } }\n  val: { send: 'READ\\r', receive: '={v:+decimal}\\r', reads: yes, "
                  "before: sel, example: "
                  "{ send: 'READ\\r', receive: '=+5\\r', v: 5 } }\npoints:\n"
                  "  - { name: one, read: val(n=1).v, type: float32 }\n"
                  "  - { name: two, read: val(n=2).v, type: float32 }\n");
    for (const char* fault : {"lost", "late", "behind"}) {
      VirtualLine line(LineWith(TelegramProtocol(), device, 9600), {&TelegramProtocol()});
      line.twin(0).values.values[0] = 10.0;
      line.twin(0).values.values[1] = 20.0;
      int reads = 0;
      std::deque<Bytes> held;
      line.server = [&](View request, Bytes reply, Instant) -> std::vector<tools::TimedPiece> {
        if (reply.empty()) return {};
        reads += AsText(request) == "READ\r" ? 1 : 0;
        const std::string_view kind = fault;
        const bool read = AsText(request) == "READ\r";
        if (kind == "lost" && read && reads % 5 == 0) return {};
        if (kind == "late" && read && reads % 7 == 0) return {{450ms, std::move(reply)}};
        if (kind == "behind" && reads >= 9) {
          held.push_back(std::move(reply));
          if (held.size() == 1) return {};
          reply = std::move(held.front());
          held.pop_front();
        }
        return {{5ms, std::move(reply)}};
      };
      int good = 0;
      line.Open();
      for (int sample = 0; sample < 1800; ++sample) {
        line.RunFor(100ms);
        for (const std::uint32_t point : {0U, 1U}) {
          if (!IsGood(line.QualityOf(0, point))) continue;
          ++good;
          EXPECT_EQ(ToDouble(line.ValueOf(0, point)), point == 0 ? 10.0 : 20.0)
              << fault << answer << " after " << FormatDuration(line.elapsed());
        }
      }
      EXPECT_GT(good, 40) << fault << answer;
    }
  }
}

TEST(TelegramLine, AScaleWithoutSerialNumberKeepsGoodWeights) {
  for (const std::string refusal : {"I4 I\r\n", "ES\r\n", ""}) {
    SCOPED_TRACE(refusal);
    const config::Device device = ShippedDevice(TelegramProtocol(), "mt-sics");
    VirtualLine line(LineWith(TelegramProtocol(), device, 9600), {&TelegramProtocol()});
    line.twin(0).values.values[0] = 100.0;
    line.twin(0).values.values[1] = true;
    line.twin(0).values.values[2] = std::string("g");
    line.twin(0).values.values[3] = 0.0;
    line.twin(0).manner.instead = [&](View request) -> std::optional<Bytes> {
      if (AsText(request) == "I4\r\n") return ToBytes(refusal);
      return std::nullopt;
    };
    line.Open();
    line.RunFor(refusal.empty() ? 40s : 10s);
    EXPECT_EQ(line.QualityOf(0, 0), Quality::good);
    const std::size_t asked = line.CountSent("I4");
    int good = 0;
    for (int second = 0; second < 600; ++second) {
      line.RunFor(1s);
      good += line.QualityOf(0, 0) == Quality::good ? 1 : 0;
    }
    EXPECT_GT(good, refusal.empty() ? 540 : 590);
    EXPECT_LT(line.CountSent("I4") - asked, 40U) << "rarely";
    EXPECT_FALSE(IsGood(line.QualityOf(0, 4)));
  }
}

// ---------------- The OWEN MV110-8A read by a description (protocol `telegram`) must give the same
// readings as by protocol `dcon`.

const std::string kRequest = "#0184\r";

std::set<std::string> RecordedAnswers() {
  std::set<std::string> answers;
  for (const auto& entry : std::filesystem::directory_iterator("tests/transcripts")) {
    if (!entry.path().filename().string().starts_with("dcon-")) continue;
    std::ifstream file(entry.path());
    std::string whole;
    for (std::string line; std::getline(file, line);) {
      if (line.starts_with("> ")) whole.clear();
      if (!line.starts_with("< ")) continue;
      const auto bytes = ParseHex(line.substr(2));
      if (!bytes) continue;
      answers.emplace(AsText(*bytes));
      whole += AsText(*bytes);
      answers.insert(whole);
    }
  }
  return answers;
}

std::string Sealed(std::string line) {
  if (!line.empty() && line.back() == '\r') line.pop_back();
  return line + HexByte(Sum8(ToBytes(line))) + "\r";
}

std::string Resealed(std::string line) {
  if (!line.empty() && line.back() == '\r') line.pop_back();
  return line.size() < 3 ? line : Sealed(line.substr(0, line.size() - 2));
}

class BothPlugins : public ::testing::Test {
 protected:
  void Compare(const std::string& stream) {
    ++compared_;
    const Answer own = AnswerTo(TelegramProtocol(), described_, ToBytes(kRequest), ToBytes(stream));
    const Answer dcon = AnswerTo(DconProtocol(), plugin_, ToBytes(kRequest), ToBytes(stream));
    good_ += dcon.outcome == Outcome::ok ? 1 : 0;
    ASSERT_EQ(ProvesLife(own.outcome), ProvesLife(dcon.outcome)) << Printable(ToBytes(stream));
    if (ProvesLife(own.outcome)) {
      ASSERT_EQ(own.outcome, dcon.outcome) << Printable(ToBytes(stream));
    }
    ASSERT_EQ(Points(own), Points(dcon)) << Printable(ToBytes(stream));
  }

  static std::vector<std::tuple<std::size_t, std::string, std::uint16_t>> Points(
      const Answer& answer) {
    std::vector<std::tuple<std::size_t, std::string, std::uint16_t>> points;
    for (const Reading& reading : answer.readings) {
      if (reading.point == kNoPoint) continue;
      points.emplace_back(reading.point, ToText(reading.value), reading.quality.word());
    }
    std::ranges::sort(points);
    return points;
  }

  const config::Device described_ = ShippedDevice(TelegramProtocol(), "owen-mv110-8a-telegrams");
  const config::Device plugin_ = ShippedDevice(DconProtocol(), "owen-mv110-8a");
  int compared_ = 0;
  int good_ = 0;
};

TEST_F(BothPlugins, HaveTheSamePoints) {
  ASSERT_EQ(described_.points.size(), plugin_.points.size());
  for (std::size_t i = 0; i < plugin_.points.size(); ++i) {
    const config::Point& one = described_.points[i];
    const config::Point& other = plugin_.points[i];
    EXPECT_EQ(std::tie(one.name, one.type, one.modbus, one.unit, one.group),
              std::tie(other.name, other.type, other.modbus, other.unit, other.group));
  }
}

TEST_F(BothPlugins, SendTheSameBytes) {
  Talk described(TelegramProtocol(), described_);
  Talk plugin(DconProtocol(), plugin_);
  ASSERT_EQ(described->Queries().size(), plugin->Queries().size());
  EXPECT_EQ(described.Ask(Poll(0))->bytes, plugin.Ask(Poll(0))->bytes);
  EXPECT_EQ(described.Ask(Probe())->bytes, plugin.Ask(Probe())->bytes);
  EXPECT_EQ(described.request().unlike_polls, plugin.request().unlike_polls);
}

TEST_F(BothPlugins, DecodeEveryRecordedReplyEqually) {
  const std::set<std::string> answers = RecordedAnswers();
  ASSERT_GT(answers.size(), 50U);
  for (const std::string& answer : answers) {
    for (const std::string& stream : {answer, Sealed(answer), Resealed(answer)}) Compare(stream);
  }
  EXPECT_GT(good_, 2);
}

/// Each byte of a reply is replaced, lost or doubled. Some damaged replies get a checksum that
/// fits.
TEST_F(BothPlugins, DecodeEveryDamagedReplyEqually) {
  constexpr std::string_view kOthers = "09.+- >!?A\r\xFF";
  for (const std::string& answer : RecordedAnswers()) {
    for (std::size_t at = 0; at < answer.size(); ++at) {
      std::vector<std::string> damaged = {answer.substr(0, at), answer.substr(at)};
      for (const char other : kOthers) {
        damaged.push_back(answer);
        damaged.back()[at] = other;
      }
      for (int bit = 0; bit < 8; ++bit) {
        damaged.push_back(answer);
        damaged.back()[at] = static_cast<char>(damaged.back()[at] ^ (1 << bit));
      }
      damaged.push_back(answer);
      damaged.back().erase(at, 1);
      damaged.push_back(answer);
      damaged.back().insert(at, 1, answer[at]);
      for (const std::string& one : damaged) {
        if (one.empty()) continue;
        Compare(one);
        Compare(Resealed(one));
        if (HasFatalFailure()) return;
      }
    }
  }
  EXPECT_GT(compared_, 50'000);
  EXPECT_GT(good_, 1000);
}

TEST_F(BothPlugins, DecodeAnyNumbersEqually) {
  const std::vector<std::string> words = {
      "+100.23", "-00.000", "+99999.", "-9.9999", "+.99999", "+9999.9", "-9999.9", "+888888",
      "-888888", "+99999",  "-0000",   "-000000", "+123456", "+12",     "+1234",   "+12345.6",
      "       ", "      ",  "+1.2.34", "+...",    "100.23",  "+1,2345", "7FFF"};
  std::mt19937 random(20261127);
  for (int round = 0; round < 20'000 && !HasFatalFailure(); ++round) {
    std::string line = ">";
    for (int i = 0; i < 8; ++i) line += words[random() % (round % 2 == 0 ? 10 : words.size())];
    if (random() % 10 == 0) line += words[random() % words.size()];
    Compare(Sealed(line));
  }
  EXPECT_GT(good_, 5000);
}

}  // namespace
}  // namespace baudgate::protocols::telegram
