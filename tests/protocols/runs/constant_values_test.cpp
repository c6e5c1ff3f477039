// Two points that always read the same, behind a server that falls one or two replies behind and
// stays so: identical replies tell nothing of their order, and one point must never show the
// other's value.
// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <deque>
#include <random>

#include "protocols/modbus/protocol.h"
#include "tests/protocols/runs/lag_line.h"
#include "tests/protocols/runs/lagging_server.h"
#include "tests/support/long_run.h"
#include "tests/support/virtual_line.h"

namespace baudgate {
namespace {

constexpr std::size_t kRuns = 3000;
constexpr std::uint8_t kDiagnostics = 0x08;

/// What the server does once it has fallen behind.
enum class Falls : std::uint8_t {
  keeps_a_queue,     ///< a reply releases the one before it
  answers_silence,   ///< a request releases the reply to the one before it, even an empty one
  answers_anything,  ///< the same, but where the device was silent nothing is put in its place
};

class ConstantValues : public ::testing::TestWithParam<Falls> {
 protected:
  ConstantValues() {
    config::Line line = LagLineOf(LagCaseOf("ModbusRtu19200", Queries::two, Proof::silent));
    line.devices.resize(1);
    line.devices[0].poll = 1s;
    for (config::Point& point : line.devices[0].points) {
      point.type = config::Type::uint16;
      point.read += " uint16";
    }
    line_ = line;
  }
  static Value TruthOf(std::size_t point) { return static_cast<std::int64_t>(100 * (point + 1)); }

  /// How often a point was good with another's value.
  std::size_t Run(std::mt19937& random) {
    VirtualLine line(line_, {&ModbusRtuProtocol()});
    line.keeps_bit_rate = random() % 2 == 0;
    TwinWire wire;
    wire.think = std::chrono::microseconds(random() % 40'000);
    LaggingServer server(wire, 1);
    std::deque<Bytes> held;
    bool fallen = false;
    line.server = [&](View request, Bytes reply, Instant end) {
      if (request.size() > 1 && request[1] == kDiagnostics) reply.clear();
      if (GetParam() != Falls::keeps_a_queue && fallen) {
        const bool waits = !reply.empty() || GetParam() == Falls::answers_silence;
        if (waits) held.push_back(std::exchange(reply, {}));
        const std::size_t behind = waits ? 1 : 0;
        if (held.size() > behind) {
          reply = held.front();
          held.pop_front();
        }
      }
      return server.OnRequest(request, std::move(reply), end);
    };
    const std::size_t points = line_.devices[0].points.size();
    for (std::size_t i = 0; i < points; ++i) line.twin(0).values.Set(i, TruthOf(i));
    std::size_t wrong = 0;
    line.always = [&] {
      for (std::uint32_t i = 0; i < points; ++i) {
        if (IsGood(line.QualityOf(0, i)) && line.ValueOf(0, i) != TruthOf(i)) ++wrong;
      }
    };
    line.Open();
    line.RunFor(6s + std::chrono::microseconds(random() % 4'000'000));
    fallen = true;
    if (GetParam() == Falls::keeps_a_queue) server.faults.behind = 1 + random() % 2;
    line.RunFor(90s);
    return wrong;
  }

  config::Line line_;
};

TEST_P(ConstantValues, AreNeverExchanged) {
  std::mt19937 random(20261126);
  for (std::size_t run = 0; run < LongRun(kRuns); ++run) ASSERT_EQ(Run(random), 0U) << run;
}

INSTANTIATE_TEST_SUITE_P(Servers, ConstantValues,
                         ::testing::Values(Falls::keeps_a_queue, Falls::answers_silence,
                                           Falls::answers_anything));

}  // namespace
}  // namespace baudgate
