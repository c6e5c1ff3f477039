// Devices that answer every request with the reply to an earlier one: k exchanges late by count, at
// once and for ever. Each reply is good in itself; none may become the value of another point.
// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <deque>
#include <optional>
#include <utility>
#include <vector>

#include "gateway/base/text.h"
#include "tests/protocols/runs/rig.h"

namespace baudgate {
namespace {

/// What the devices say comes so many requests late: of one device alone, or of all in one queue,
/// as a serial server before them has it.
class Shifted {
 public:
  Shifted(Rig& rig, std::vector<std::uint32_t> devices, std::size_t requests)
      : rig_(rig), devices_(std::move(devices)), requests_(requests) {
    for (const std::uint32_t device : devices_) {
      rig_->twin(device).manner.distort = [this](Bytes reply) {
        return Exchange(std::move(reply));
      };
    }
  }
  ~Shifted() {
    for (const std::uint32_t device : devices_) rig_->twin(device).manner.distort = {};
  }

 private:
  Bytes Exchange(Bytes reply) {
    replies_.push_back(std::move(reply));
    if (replies_.size() <= requests_) return {};
    Bytes earlier = std::move(replies_.front());
    replies_.pop_front();
    return earlier;
  }

  Rig& rig_;
  std::vector<std::uint32_t> devices_;
  std::size_t requests_;
  std::deque<Bytes> replies_;
};

class ShiftedRun : public ::testing::TestWithParam<Setup> {};

TEST_P(ShiftedRun, NoReplyBecomesTheValueOfAnotherPoint) {
  for (const std::size_t requests : {1U, 2U, 3U, 5U}) {
    Rig rig(GetParam());
    rig.LearnTruth();
    rig.Watch();
    {
      const Shifted shifted(rig, {0}, requests);
      const std::uint32_t neighbour = rig->StatusOf(1).Count(Outcome::ok);
      rig->RunFor(10min);
      EXPECT_EQ(rig.wrong(), 0U) << requests << " requests late";
      const DeviceStatus status = rig->StatusOf(0);
      EXPECT_LT(status.Count(Outcome::ok), status.exchanges) << "it is found out";
      EXPECT_GT(rig->StatusOf(1).Count(Outcome::ok), neighbour + 150) << "it is served";
    }
    EXPECT_TRUE(rig->RunUntil([&] { return rig.AllGood(); }, 5min)) << "in step again";
    EXPECT_EQ(rig.wrong(), 0U);
    if (HasFailure()) return;
  }
}

TEST_P(ShiftedRun, NorWhereASerialServerShiftsAllOfThem) {
  for (const std::size_t requests : {1U, 2U, 3U, 5U}) {
    Rig rig(GetParam());
    rig.LearnTruth();
    rig.Watch();
    {
      const Shifted shifted(rig, {0, 1}, requests);
      rig->RunFor(10min);
      EXPECT_EQ(rig.wrong(), 0U) << requests << " requests late";
      for (const std::uint32_t device : {0U, 1U}) {
        const DeviceStatus status = rig->StatusOf(device);
        EXPECT_LT(status.Count(Outcome::ok), status.exchanges) << "it is found out";
      }
    }
    EXPECT_TRUE(rig->RunUntil([&] { return rig.AllGood(); }, 5min)) << "in step again";
    EXPECT_EQ(rig.wrong(), 0U);
    if (HasFailure()) return;
  }
}

INSTANTIATE_TEST_SUITE_P(Real, ShiftedRun, ::testing::ValuesIn(RealLines()), SetupName);
INSTANTIATE_TEST_SUITE_P(Network, ShiftedRun, ::testing::Values(TcpLine()), SetupName);

TEST(ReplacedDevice, IsBelievedAfterAWhile) {
  Rig rig(RealLine("Spa9600"));
  rig.LearnTruth();
  std::string other = "<1D:SPCX 1C1:";
  std::uint8_t sum = 0;
  for (const char c : other) sum ^= static_cast<std::uint8_t>(c);
  other += HexByte(sum) + "\r\n";
  rig->twin(0).manner.instead = [&](View request) -> std::optional<Bytes> {
    if (!AsText(request).starts_with(">1RF:")) return std::nullopt;
    return ToBytes(other);
  };
  rig->twin(0).manner.dead = true;
  rig->RunFor(1min);
  rig->twin(0).manner.dead = false;
  EXPECT_TRUE(rig->RunUntil([&] { return rig.AllGood(0); }, 15min));
}

}  // namespace
}  // namespace baudgate
