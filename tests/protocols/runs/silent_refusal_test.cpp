// A slave that is silent to what it does not know, where nothing else of it is polled: its answered
// probes show that the silence is a refusal.
// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "protocols/modbus/protocol.h"
#include "tests/protocols/runs/rig.h"

namespace baudgate {
namespace {

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
  /// It is silent to reads that these are true of: first register, count.
  void SilentTo(std::function<bool(unsigned first, unsigned count)> to) {
    line_->server = [to = std::move(to)](View request, Bytes reply, Instant) {
      const bool reads = request.size() == 8 && request[1] == 3;
      if (reads && to(request[3], request[5])) reply.clear();
      std::vector<TimedPiece> pieces;
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

TEST_F(SilentRefusal, OfOneRegisterIsNotFitted) {
  SilentTo([](unsigned first, unsigned count) { return first <= 5 && 5 < first + count; });
  line_->Open();
  line_->RunFor(3min);
  for (std::uint32_t i = 0; i < kPoints; ++i) {
    const Quality wanted =
        i == 5 ? Quality(Quality::bad_configuration, Reason::not_fitted) : Quality(Quality::good);
    EXPECT_EQ(line_->QualityOf(0, i), wanted) << i;
  }
}

}  // namespace
}  // namespace baudgate
