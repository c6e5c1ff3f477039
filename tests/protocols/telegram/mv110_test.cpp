// The OWEN MV110-8A written as telegrams against the plugin `dcon`: the same readings from every
// answer of its transcripts and tests, whole or damaged.
// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <filesystem>
#include <fstream>
#include <random>
#include <set>

#include "gateway/base/bytes.h"
#include "protocols/dcon/protocol.h"
#include "tests/protocols/telegram/support.h"

namespace baudgate::protocols::telegram {
namespace {

const std::string kRequest = "#0184\r";

/// Every answer that stands in a transcript of DCON.
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

/// The same with another checksum in place of its own.
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

  /// Those of a point: value and quality.
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

TEST_F(BothPlugins, ReadTheSameFromEveryRecordedAnswer) {
  const std::set<std::string> answers = RecordedAnswers();
  ASSERT_GT(answers.size(), 50U);
  for (const std::string& answer : answers) {
    for (const std::string& stream : {answer, Sealed(answer), Resealed(answer)}) Compare(stream);
  }
  EXPECT_GT(good_, 2);
}

/// Each byte of every answer is replaced, lost or sent twice, with the wrong checksum that this
/// leaves and with a right one, as no damage of the line gives it.
TEST_F(BothPlugins, ReadTheSameFromEveryDamagedAnswer) {
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

/// Numbers, codes and what is neither, in any order and number.
TEST_F(BothPlugins, ReadTheSameFromAnyNumbers) {
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
