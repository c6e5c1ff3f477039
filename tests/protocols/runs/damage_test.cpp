// Real protocols on a bad wire: thousands of exchanges with flipped bits, lost and foreign
// characters. The oracle knows what the twins measure; a wrong value may become Good only where the
// damage has hit upon a good check value, which no receiver could notice.
// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <bit>
#include <optional>
#include <random>

#include "gateway/assembler.h"
#include "gateway/base/text.h"
#include "tests/protocols/runs/rig.h"

namespace baudgate {
namespace {

/// A wire that damages replies, and knows of the latest one of each device what came out of it.
class BadWire {
 public:
  BadWire(Rig& rig, unsigned seed) : rig_(rig), random_(seed), latest_(rig.devices()) {
    for (std::uint32_t device = 0; device < rig.devices(); ++device) {
      Manner& manner = rig->twin(device).manner;
      manner.instead = [this, device](View request) -> std::optional<Bytes> {
        latest_[device].request.assign(request.begin(), request.end());
        return std::nullopt;
      };
      manner.distort = [this, device](Bytes reply) { return Carry(device, std::move(reply)); };
    }
  }

  void End() {
    for (std::uint32_t device = 0; device < rig_.devices(); ++device) {
      rig_->twin(device).manner.instead = {};
      rig_->twin(device).manner.distort = {};
    }
  }

  /// The latest reply of the device was damaged, and the frame that the plugin takes out of what is
  /// left carries a good check value.
  bool IsBeyondDetection(std::uint32_t device) {
    const Latest& latest = latest_[device];
    if (!latest.damaged) return false;
    Assembler assembler;
    const Protocol& protocol = *rig_.setup().protocol;
    assembler.Begin(protocol.reply_rule,
                    protocol.expect(latest.request, rig_.device(device).options));
    assembler.Feed(latest.arrived);
    auto frame = assembler.Next(false);
    if (!frame) frame = assembler.Next(true);
    if (!frame || !HasGoodChecksum(protocol, *frame)) return false;
    ++undetected_;
    return true;
  }

  std::size_t replies() const { return replies_; }
  std::size_t damaged() const { return damaged_; }
  std::size_t undetected() const { return undetected_; }

 private:
  struct Latest {
    Bytes request;
    Bytes arrived;
    bool damaged = false;
  };

  Bytes Carry(std::uint32_t device, Bytes reply) {
    ++replies_;
    Latest& latest = latest_[device];
    latest.arrived = random_() % 3 == 0 && !reply.empty() ? Damage(reply) : reply;
    latest.damaged = latest.arrived != reply;
    if (latest.damaged) ++damaged_;
    return latest.arrived;
  }

  Bytes Damage(Bytes reply) {
    const std::size_t at = random_() % reply.size();
    switch (random_() % 8) {
      case 0:  // a character is not seen
        reply.erase(reply.begin() + static_cast<std::ptrdiff_t>(at));
        return reply;
      case 1:  // noise is taken for one
        reply.insert(reply.begin() + static_cast<std::ptrdiff_t>(at), Noise());
        return reply;
      case 2:  // the rest is lost
        reply.resize(at);
        return reply;
      case 3:  // a burst
        return Flip(std::move(reply), at, 4, 12);
      default:
        return Flip(std::move(reply), 0, reply.size(), 1 + random_() % 6);
    }
  }

  std::uint8_t Noise() {
    const unsigned mask = rig_.setup().serial.data_bits == 7 ? 0x7FU : 0xFFU;
    return static_cast<std::uint8_t>(random_() & mask);
  }

  /// Flips bits on the wire, the parity bit among them. A character whose parity is wrong then
  /// arrives as the transport hands it on: 0xFF.
  Bytes Flip(Bytes reply, std::size_t from, std::size_t length, std::size_t count) {
    const config::SerialSettings& serial = rig_.setup().serial;
    const bool parity = serial.parity != config::Parity::none;
    const auto bits = static_cast<std::size_t>(serial.data_bits) + (parity ? 1 : 0);
    std::vector<unsigned> flips(reply.size());
    for (; count > 0; --count) {
      const std::size_t at = from + random_() % length;
      if (at < reply.size()) flips[at] ^= 1U << (random_() % bits);
    }
    for (std::size_t i = 0; i < reply.size(); ++i) {
      const unsigned data = flips[i] & ((1U << static_cast<unsigned>(serial.data_bits)) - 1);
      const bool odd = std::popcount(flips[i]) % 2 != 0;
      reply[i] = parity && odd ? 0xFF : static_cast<std::uint8_t>(reply[i] ^ data);
    }
    return reply;
  }

  Rig& rig_;
  std::mt19937 random_;
  std::vector<Latest> latest_;
  std::size_t replies_ = 0;
  std::size_t damaged_ = 0;
  std::size_t undetected_ = 0;
};

/// The real lines, polled without a pause, and SPA Bus with a port that does not check parity,
/// which leaves the weak exclusive-or alone with the damage.
std::vector<Setup> DamagedLines() {
  std::vector<Setup> lines = RealLines();
  lines.push_back(RealLine("Spa9600"));
  lines.back().name = "SpaWithoutParity";
  lines.back().serial.parity = config::Parity::none;
  return lines;
}

/// How many damaged replies of `damaged` may slip through.
std::size_t MostUndetected(const Setup& setup, std::size_t damaged) {
  // A sum or an exclusive-or alone.
  if (setup.serial.parity == config::Parity::none) return damaged / 64;
  // Text of 7 bits does not have the 0xFF that stands for a character with a parity error. For a
  // binary protocol it is a byte like others, and only the CRC can tell.
  return setup.serial.data_bits == 7 ? 0 : damaged / 1000;
}

class DamagedRun : public ::testing::TestWithParam<Setup> {
 protected:
  void Run(unsigned seed) {
    constexpr std::size_t kReplies = 6000;
    Rig rig(GetParam(), [](config::Line& line) {
      for (config::Device& device : line.devices) device.poll = 10ms;
    });
    rig.LearnTruth();
    BadWire wire(rig, seed);
    rig.Watch([&](std::uint32_t device) { return wire.IsBeyondDetection(device); });
    EXPECT_TRUE(rig->RunUntil([&] { return wire.replies() >= kReplies; }, 4h));
    wire.End();
    EXPECT_GT(wire.damaged(), kReplies / 4);
    damaged_ += wire.damaged();
    undetected_ += wire.undetected();
    for (std::uint32_t device = 0; device < rig.devices(); ++device) {
      EXPECT_GT(rig->StatusOf(device).Count(Outcome::corrupt), 100U);
      EXPECT_GT(rig->StatusOf(device).Count(Outcome::ok), 1000U);
    }
    // On a good wire again, whatever was learned from damage is forgotten.
    EXPECT_TRUE(rig->RunUntil([&] { return rig.AllGood(); }, 10min));
    const std::size_t wrong = rig.wrong();
    rig->RunFor(2min);
    EXPECT_TRUE(rig->RunUntil([&] { return rig.AllGood(); }, 10s));
    EXPECT_EQ(rig.wrong(), wrong);
    EXPECT_EQ(rig->StatusOf(0).state, DeviceState::online);
  }

  std::size_t damaged_ = 0;
  std::size_t undetected_ = 0;
};

TEST_P(DamagedRun, NothingWrongBecomesGood) {
  for (unsigned seed = 1; seed <= 4; ++seed) {
    Run(seed);
    if (HasFailure()) FAIL() << "seed " << seed;
  }
  RecordProperty("damaged", static_cast<int>(damaged_));
  RecordProperty("undetected", static_cast<int>(undetected_));
  EXPECT_LE(undetected_, MostUndetected(GetParam(), damaged_));
}

INSTANTIATE_TEST_SUITE_P(Real, DamagedRun, ::testing::ValuesIn(DamagedLines()), SetupName);

/// The check values of the test itself: without them no excuse is worth anything.
TEST(DamageOracle, KnowsGoodCheckValuesFromBadOnes) {
  const auto& spa = *RealLine("Spa9600").protocol;
  EXPECT_TRUE(HasGoodChecksum(spa, ToBytes("<1D:SPCJ 4D29:18\r\n")));
  EXPECT_FALSE(HasGoodChecksum(spa, ToBytes("<1D:SPCJ 4D28:18\r\n")));
  const auto& dcon = *RealLine("Dcon9600").protocol;
  EXPECT_TRUE(HasGoodChecksum(dcon, ToBytes(">+100.23+34.050E2\r")));
  EXPECT_FALSE(HasGoodChecksum(dcon, ToBytes(">+100.23+34.051E2\r")));
  const auto& meter = *RealLine("Set4tm9600").protocol;
  EXPECT_TRUE(HasGoodChecksum(meter, *ParseHex("C8 00 80 66 43 AE 69")));
  EXPECT_FALSE(HasGoodChecksum(meter, *ParseHex("C8 00 80 67 43 AE 69")));
}

TEST(DamageOracle, SeesAWrongValue) {
  Rig rig(RealLine("Spa9600"));
  rig.LearnTruth();
  rig.Watch([](std::uint32_t device) { return device == 1; });
  rig->RunFor(5s);
  EXPECT_EQ(rig.wrong(), 0U);
  rig->twin(1).values.Set(0, 7.0);
  rig->RunFor(2s);
  EXPECT_EQ(rig.wrong(), 2U) << "one for each poll";
}

}  // namespace
}  // namespace baudgate
