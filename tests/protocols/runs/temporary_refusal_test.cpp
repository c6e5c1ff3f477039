// A device that refuses everything for a while, as while it starts: what it has answered before is
// soon read again, with as few requests as before.
// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "gateway/base/bytes.h"
#include "gateway/base/text.h"
#include "protocols/dcon/codec.h"
#include "protocols/modbus/codec.h"
#include "protocols/modbus/protocol.h"
#include "tests/protocols/runs/rig.h"

namespace baudgate {
namespace {

/// How `setup` says "I do not have it" to a request.
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

TEST_P(TemporaryRefusal, IsSoonOver) {
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

/// A device that starts again and again: it refuses everything, is silent, in every second round
/// refuses again, and answers for a while.
TEST_P(TemporaryRefusal, AmongSilencesIsSoonOver) {
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

}  // namespace
}  // namespace baudgate
