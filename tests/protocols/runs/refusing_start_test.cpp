// A device starts that refuses much of what its profile asks for; its neighbour keeps its polls.
// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <cstdio>

#include "gateway/base/bytes.h"
#include "gateway/base/text.h"
#include "tests/protocols/runs/rig.h"

namespace baudgate {
namespace {

constexpr Duration kTime = 90s;

/// ">1RI3/6:" of a relay that has I1 to I5, its name and its events.
bool HasIt(std::string_view request) {
  const std::string_view item = request.substr(3, request.rfind(':') - 3);
  if (item == "F" || item == "L" || item == "B") return true;
  return item.size() < 5 && item[0] == 'I' && item.back() <= '5';
}

std::optional<Bytes> SmallRelay(View request) {
  const std::string_view text = AsText(request);
  if (HasIt(text)) return std::nullopt;
  Bytes said = ToBytes("<" + std::string(text.substr(1, 1)) + "N:5:");
  Append(said, HexByte(Xor8(said)) + "\r\n");
  return said;
}

/// It does not tell its serial number.
std::optional<Bytes> ShyMeter(View request) {
  if (request.size() != 5 || request[1] != 0x08 || request[2] != 0x00) return std::nullopt;
  Bytes said = {request[0], 0x01};
  AppendCrc16(said);
  return said;
}

class RefusingStart : public ::testing::Test {
 protected:
  /// Its first device says `instead`. The neighbour has one point, so that each poll is a reading.
  void Start(const std::string& setup, std::optional<Bytes> (*instead)(View request),
             std::optional<std::int64_t> serial_number = {}) {
    rig_ = std::make_unique<Rig>(RealLine(setup), [&](config::Line& line) {
      for (config::Device& device : line.devices) device.poll = 1s;
      if (serial_number) line.devices[0].options.Set("serial_number", *serial_number);
      line.devices[1].points.resize(1);
    });
    line().twin(0).manner.instead = instead;
    line().read = [this](std::uint32_t device, Instant) { readings_ += device == 1 ? 1 : 0; };
    line().Open();
    line().RunFor(kTime);
    const auto periods = static_cast<double>(kTime / 1s);
    std::printf("%s: the neighbour has %.3f of its polls\n", setup.c_str(),
                static_cast<double>(readings_) / periods);
    EXPECT_GE(static_cast<double>(readings_), 0.95 * periods);
  }
  VirtualLine& line() { return rig_->line(); }

  std::unique_ptr<Rig> rig_;
  std::size_t readings_ = 0;
};

TEST_F(RefusingStart, OfARelayThatHasLittle) {
  Start("Spa9600", SmallRelay);
  EXPECT_LE(line().CountSent(">1RF"), 7U) << "the proof of a start, a minute later, and a point";
  for (std::uint32_t point = 0; point < 5; ++point) {
    EXPECT_EQ(line().QualityOf(0, point), Quality::good) << point;
  }
  std::size_t late = 0;
  for (const Sent& sent : line().sent) {
    late += line().now().instant - sent.at < 20s && sent.text.starts_with(">1") ? 1 : 0;
  }
  EXPECT_LE(late, 30U) << "it knows what it has";
  line().RunFor(3min);
  EXPECT_EQ(line().QualityOf(0, 5), Quality(Quality::bad_configuration, Reason::not_fitted));
}

TEST_F(RefusingStart, OfAMeterThatDoesNotTellItsSerialNumber) {
  Start("Set4tm9600", ShyMeter);
  EXPECT_LE(line().CountSent(std::string("\xC8\x08\x00", 3)), 3U);
  EXPECT_EQ(line().QualityOf(0, 0), Quality::good);
}

TEST_F(RefusingStart, OfAMeterThatShouldTellItsSerialNumberAndDoesNot) {
  Start("Set4tm9600", ShyMeter, 9020001);
  EXPECT_LE(line().CountSent(std::string("\xC8\x08\x00", 3)), 5U)
      << "once a minute, and at first until it is certain that the refusal is its own";
  EXPECT_FALSE(IsGood(line().QualityOf(0, 0)));
}

/// What noise looks like: it is answered again when the noise is over.
class OneRefusal : public ::testing::TestWithParam<std::string> {
 protected:
  /// How many requests a minute has, with one refusal in it or none.
  static std::size_t Requests(int refusals) {
    Rig rig(RealLine(GetParam()), [](config::Line& line) {
      for (config::Device& device : line.devices) device.poll = 1s;
    });
    rig.LearnTruth();
    const bool spa = GetParam() == "Spa9600";
    rig->twin(0).manner.instead = [&](View request) -> std::optional<Bytes> {
      const std::string_view text = AsText(request);
      const bool poll = spa ? text.starts_with(">1RI1/") : text.starts_with("#01");
      if (!poll || refusals == 0) return std::nullopt;
      --refusals;
      if (spa) return SmallRelay(ToBytes(">1RX:"));
      Bytes said = ToBytes("?01");
      Append(said, HexByte(Sum8(said)) + "\r");
      return said;
    };
    const std::size_t before = rig->sent.size();
    rig->always = [&] { ASSERT_FALSE(IsBad(rig->QualityOf(0, 0))); };
    rig->RunFor(1min);
    EXPECT_EQ(refusals, 0);
    EXPECT_TRUE(rig.FastGood(0));
    rig->always = {};
    return rig->sent.size() - before;
  }
};

TEST_P(OneRefusal, OfWhatWasAnsweredBeforeChangesNothing) {
  EXPECT_NEAR(static_cast<double>(Requests(1)), static_cast<double>(Requests(0)), 8)
      << "it is asked as before";
}

INSTANTIATE_TEST_SUITE_P(Lines, OneRefusal, ::testing::Values("Spa9600", "Dcon9600"),
                         [](const auto& info) { return info.param; });

}  // namespace
}  // namespace baudgate
