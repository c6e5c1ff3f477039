// Tests a device that refuses all requests for a while, for example while it starts.
// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <cstdio>

#include "gateway/base/bytes.h"
#include "gateway/base/text.h"
#include "protocols/dcon/codec.h"
#include "protocols/modbus/codec.h"
#include "protocols/modbus/protocol.h"
#include "tests/protocols/runs/rig.h"

namespace baudgate::protocols {
namespace {

Bytes RefusalOf(const Setup& setup, View request) {
  const std::string_view protocol = setup.protocol->name;
  if (protocol == "spabus") {
    const std::string_view text = AsText(request);
    Bytes said = ToBytes(
        "<" + std::string(text.substr(1, text.find_first_not_of("0123456789", 1) - 1)) + "N:5:");
    Append(said, HexByte(Xor8(said)) + "\r\n");
    return said;
  }
  if (protocol == "dcon") {
    const bool checksum = LineOf(setup).devices[0].options.Flag("checksum");
    return protocols::dcon::BuildReply("?" + std::string(AsText(request).substr(1, 2)), checksum);
  }
  if (protocol == "set4tm") {
    Bytes said = {request[0], 0x01};
    AppendCrc16(said);
    return said;
  }
  using protocols::modbus::Framing;
  const Framing framing = protocol == "modbus_rtu"     ? Framing::rtu
                          : protocol == "modbus_ascii" ? Framing::ascii
                                                       : Framing::tcp;
  const auto asked = protocols::modbus::Unwrap(framing, request);
  if (!asked) return {};
  const auto function = static_cast<std::uint8_t>(asked->pdu[0] | 0x80U);
  return protocols::modbus::Wrap(framing, asked->slave, Bytes{function, 2}, asked->transaction);
}

class TemporaryRefusal : public ::testing::TestWithParam<Setup> {
 protected:
  void SetUp() override {
    rig_ = std::make_unique<Rig>(GetParam());
    rig_->LearnTruth();
    rig_->line().RunFor(1min);
    rig_->Watch();
  }
  void Refuse(bool refuses) {
    line().twin(0).manner.instead = [this, refuses](View request) -> std::optional<Bytes> {
      return refuses ? std::optional(RefusalOf(GetParam(), request)) : std::nullopt;
    };
  }
  void Silence(bool silent) {
    line().twin(0).manner.instead = [silent](View) -> std::optional<Bytes> {
      return silent ? std::optional(Bytes{}) : std::nullopt;
    };
  }
  VirtualLine& line() { return rig_->line(); }
  std::size_t RequestsIn(Duration time) {
    const std::size_t before = line().sent.size();
    line().RunFor(time);
    return line().sent.size() - before;
  }

  std::string NotGood() {
    std::string text;
    const auto& points = rig_->device(0).points;
    for (std::uint32_t i = 0; i < points.size(); ++i) {
      if (line().QualityOf(0, i) != Quality::good) {
        text += points[i].name + " " + std::string(Name(points[i].group)) + "; ";
      }
    }
    return text;
  }

  std::unique_ptr<Rig> rig_;
};

TEST_P(TemporaryRefusal, RecoversSoon) {
  const auto usual = static_cast<double>(RequestsIn(2min));
  for (const Duration time : {4s, 30s, 300s}) {
    Refuse(true);
    line().RunFor(time);
    Refuse(false);
    EXPECT_TRUE(line().RunUntil([&] { return rig_->AllGood(0); }, 30s))
        << "after " << FormatDuration(time) << ": " << NotGood();
    line().RunFor(30s);
    EXPECT_NEAR(static_cast<double>(RequestsIn(2min)), usual, 0.1 * usual)
        << "after " << FormatDuration(time);
  }
}

TEST_P(TemporaryRefusal, AmongSilencesRecoversSoon) {
  struct Cycle {
    Duration refused{};
    Duration silent{};
    Duration good{};
  };
  for (const Cycle& cycle : {Cycle{30s, 30s, 30s}, Cycle{60s, 30s, 40s}, Cycle{45s, 60s, 35s}}) {
    for (int round = 0; round < 4; ++round) {
      Refuse(true);
      line().RunFor(cycle.refused);
      Silence(true);
      line().RunFor(cycle.silent);
      if (round % 2 == 1) {
        Refuse(true);
        line().RunFor(cycle.refused);
      }
      Refuse(false);
      const auto is_found = [&] { return Answers(line().StatusOf(0).state); };
      ASSERT_TRUE(line().RunUntil(is_found, 2min)) << "round " << round << ": not looked for";
      EXPECT_TRUE(line().RunUntil([&] { return rig_->AllGood(0); }, 30s))
          << "round " << round << ", refused for " << FormatDuration(cycle.refused) << ": "
          << NotGood();
      line().RunFor(cycle.good);
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Lines, TemporaryRefusal, ::testing::ValuesIn(RealLines()), SetupName);

// ---------------- A slave that does not answer unsupported requests, but answers probes.

constexpr std::size_t kPoints = 8;

class SilentRefusal : public ::testing::Test {
 protected:
  SilentRefusal() {
    config::Line line = LineOf(RealLine("ModbusRtu19200"));
    line.devices.resize(1);
    line.devices[0].poll = 1s;
    line.devices[0].points.clear();
    for (std::size_t i = 0; i < kPoints; ++i) {
      config::Point point;
      point.name = "p" + std::to_string(i);
      point.read = "holding " + std::to_string(i);
      point.type = config::Type::uint16;
      line.devices[0].points.push_back(point);
    }
    line_ = std::make_unique<VirtualLine>(line, std::vector{&ModbusRtuProtocol()});
    for (std::size_t i = 0; i < kPoints; ++i) {
      line_->twin(0).values.Set(i, static_cast<std::int64_t>(10 * i));
    }
  }
  void SilentTo(std::function<bool(unsigned first, unsigned count)> to) {
    line_->server = [to = std::move(to)](View request, Bytes reply, Instant) {
      const bool reads = request.size() == 8 && request[1] == 3;
      if (reads && to(request[3], request[5])) reply.clear();
      std::vector<tools::TimedPiece> pieces;
      if (!reply.empty()) pieces.push_back({20ms, std::move(reply)});
      return pieces;
    };
  }

  std::unique_ptr<VirtualLine> line_;
};

TEST_F(SilentRefusal, OfALongBlockSplitsIt) {
  SilentTo([](unsigned, unsigned count) { return count > 4; });
  line_->Open();
  line_->RunFor(1min);
  for (std::uint32_t i = 0; i < kPoints; ++i) EXPECT_EQ(line_->QualityOf(0, i), Quality::good) << i;
  line_->states.clear();
  line_->RunFor(5min);
  EXPECT_TRUE(line_->states.empty()) << "it does not flap";
}

TEST_F(SilentRefusal, OfARegisterIsNotFitted) {
  SilentTo([](unsigned first, unsigned count) { return first <= 5 && 5 < first + count; });
  line_->Open();
  line_->RunFor(3min);
  for (std::uint32_t i = 0; i < kPoints; ++i) {
    const Quality wanted =
        i == 5 ? Quality(Quality::bad_configuration, Reason::not_fitted) : Quality(Quality::good);
    EXPECT_EQ(line_->QualityOf(0, i), wanted) << i;
  }
}

constexpr Duration kTime = 90s;

/// True for requests that a small relay answers: the inputs I1 to I5, its name F, and its events L
/// and B. Example: ">1RI3/6:".
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

std::optional<Bytes> ShyMeter(View request) {
  if (request.size() != 5 || request[1] != 0x08 || request[2] != 0x00) return std::nullopt;
  Bytes said = {request[0], 0x01};
  AppendCrc16(said);
  return said;
}

class RefusingStart : public ::testing::Test {
 protected:
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

TEST_F(RefusingStart, OfARelayWithFewItemsNeedsFewRequests) {
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

TEST_F(RefusingStart, OfAMeterWithoutSerialNumberGivesGoodValues) {
  Start("Set4tm9600", ShyMeter);
  EXPECT_LE(line().CountSent(std::string("\xC8\x08\x00", 3)), 3U);
  EXPECT_EQ(line().QualityOf(0, 0), Quality::good);
}

TEST_F(RefusingStart, OfAMeterWithoutRequiredSerialNumberGivesNoGoodValue) {
  Start("Set4tm9600", ShyMeter, 9020001);
  EXPECT_LE(line().CountSent(std::string("\xC8\x08\x00", 3)), 5U)
      << "once a minute, and at first until it is certain that the refusal is its own";
  EXPECT_FALSE(IsGood(line().QualityOf(0, 0)));
}

class OneRefusal : public ::testing::TestWithParam<std::string> {
 protected:
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

TEST_P(OneRefusal, OfAnAnsweredRequestChangesNothing) {
  EXPECT_NEAR(static_cast<double>(Requests(1)), static_cast<double>(Requests(0)), 8)
      << "it is asked as before";
}

INSTANTIATE_TEST_SUITE_P(Lines, OneRefusal, ::testing::Values("Spa9600", "Dcon9600"),
                         [](const auto& info) { return info.param; });

}  // namespace
}  // namespace baudgate::protocols
