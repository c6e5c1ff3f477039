// Real protocols on a bad wire: thousands of exchanges with flipped bits, lost and foreign
// characters. The oracle knows what the twins measure; a wrong value may become Good only where the
// damage has hit upon a good check value, which no receiver could notice.
// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "gateway/base/text.h"
#include "tests/protocols/runs/bad_wire.h"
#include "tests/support/long_run.h"

namespace baudgate {
namespace {

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
    constexpr std::size_t kReplies = 2400;
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
      EXPECT_GT(rig->StatusOf(device).Count(Outcome::corrupt), 40U);
      EXPECT_GT(rig->StatusOf(device).Count(Outcome::ok), 280U);
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
  for (unsigned seed = 1; seed <= LongRun(10); ++seed) {
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
  const auto spa = RealLine("Spa9600").good_checksum;
  EXPECT_TRUE(spa(ToBytes("<1D:SPCJ 4D29:18\r\n")));
  EXPECT_FALSE(spa(ToBytes("<1D:SPCJ 4D28:18\r\n")));
  const auto dcon = RealLine("Dcon9600").good_checksum;
  EXPECT_TRUE(dcon(ToBytes(">+100.23+34.050E2\r")));
  EXPECT_FALSE(dcon(ToBytes(">+100.23+34.051E2\r")));
  const auto meter = RealLine("Set4tm9600").good_checksum;
  EXPECT_TRUE(meter(*ParseHex("C8 00 80 66 43 AE 69")));
  EXPECT_FALSE(meter(*ParseHex("C8 00 80 67 43 AE 69")));
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
