// Behind an 8-bit sum every reading that comes first is proven or read twice: at the start, after
// an outage, and where the probe reads the very same as the poll.
// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "gateway/base/bytes.h"
#include "gateway/base/text.h"
#include "protocols/dcon/protocol.h"
#include "tests/protocols/runs/rig.h"
#include "tests/support/virtual_line.h"

namespace baudgate {
namespace {

/// ">+720.32" and ">+020.39" have the same sum.
constexpr double kTrue = 20.39;
constexpr std::string_view kDamaged = ">+720.32";

Bytes WithSum(std::string_view text) {
  const Bytes body = ToBytes(text);
  return ToBytes(std::string(text) + HexByte(Sum8(body)) + "\r");
}

class FirstReading : public ::testing::TestWithParam<config::Recheck> {
 protected:
  FirstReading() {
    config::Line line = LineOf(RealLine("Dcon9600"));
    line.devices.resize(1);
    config::Device& device = line.devices[0];
    device.poll = 1s;
    device.trust_order = true;
    device.options.Set("identify", false);
    device.options.Set("channel_types", false);
    device.options.Set("channels", std::int64_t{0});  // so that its probe is the poll's request
    config::Point point;
    point.name = "input";
    point.read = "#[0]";
    point.recheck = GetParam();
    device.points = {point};
    line_ = std::make_unique<VirtualLine>(line, std::vector{&DconProtocol()});
    line_->twin(0).values.Set(0, kTrue);
    line_->always = [this] {
      const bool good = IsGood(line_->QualityOf(0, 0));
      wrong_ = wrong_ || (good && line_->ValueOf(0, 0) != Value(kTrue));
    };
  }
  /// The next reply is.
  void Damage() {
    line_->twin(0).manner.instead = [once = true](View) mutable -> std::optional<Bytes> {
      return std::exchange(once, false) ? std::optional(WithSum(kDamaged)) : std::nullopt;
    };
  }
  bool IsGoodWithin(Duration limit) {
    return line_->RunUntil([this] { return IsGood(line_->QualityOf(0, 0)); }, limit);
  }

  std::unique_ptr<VirtualLine> line_;
  bool wrong_ = false;
};

TEST_P(FirstReading, OfAllIsNeverTakenAlone) {
  Damage();
  line_->Open();
  EXPECT_TRUE(IsGoodWithin(20s));
  line_->RunFor(1min);
  EXPECT_FALSE(wrong_);
}

TEST_P(FirstReading, BehindAnOutageIsNeverTakenAlone) {
  line_->Open();
  EXPECT_TRUE(IsGoodWithin(20s));
  for (const Duration outage : {Duration(4s), Duration(1min)}) {
    line_->twin(0).manner.dead = true;
    line_->RunFor(outage);
    line_->twin(0).manner.dead = false;
    Damage();
    EXPECT_TRUE(IsGoodWithin(1min));
    line_->RunFor(1min);
  }
  EXPECT_FALSE(wrong_);
}

INSTANTIATE_TEST_SUITE_P(Rules, FirstReading,
                         ::testing::Values(config::Recheck::jump, config::Recheck::always));

}  // namespace
}  // namespace baudgate
