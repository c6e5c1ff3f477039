// `~**` on a line that has all it can do: modules that are polled and written to, one that is dead,
// and host watchdogs that trip where the host is not heard of in time.
// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <algorithm>

#include "gateway/base/text.h"
#include "protocols/dcon/protocol.h"
#include "tests/protocols/runs/rig.h"

namespace baudgate {
namespace {

constexpr Duration kPeriod = 500ms;
constexpr std::uint32_t kWritten = 0;
constexpr std::uint32_t kDead = 2;

Setup TwoModules(Duration period) {
  config::SerialSettings serial;
  serial.baud = 9600;
  return {"HostWatchdog",
          &DconProtocol(),
          nullptr,
          "icpdas-i-7060",
          serial,
          {"1", "2", "3", "4"},
          {{"host_watchdog", std::int64_t{period.count()}}}};
}

class HostWatchdog : public ::testing::Test {
 protected:
  explicit HostWatchdog(Duration period = kPeriod)
      : rig_(TwoModules(period), [](config::Line& line) {
          for (config::Device& device : line.devices) device.poll = 300ms;
        }) {}

  /// "~04310F": 1.5 s, on; "~040": whether it has tripped.
  std::string Tell(std::uint32_t module, const std::string& command) {
    const std::string address = "0" + std::to_string(module + 1);
    const Bytes request = ToBytes("~" + address + command + "\r");
    return std::string(AsText(rig_->twin(module).twin->Answer(request, rig_->now().instant)));
  }

  /// A minute in which the line never rests.
  void RunUnderLoad() {
    rig_.LearnTruth();
    for (std::uint32_t module = 0; module < rig_.devices(); ++module) {
      EXPECT_EQ(Tell(module, "310F").front(), '!');
    }
    const auto& points = rig_.device(kWritten).points;
    const auto relay = std::ranges::find(points, std::string("relay_0"), &config::Point::name);
    ASSERT_NE(relay, points.end());
    const auto point = static_cast<std::uint32_t>(relay - points.begin());
    rig_->twin(kDead).manner.dead = true;
    rig_->sent.clear();
    bool on = false;
    rig_->always = [&, end = rig_->now().instant + 1min] {
      while (rig_->now().instant < end && rig_->Write(kWritten, point, on = !on)) {
      }
    };
    rig_->RunFor(1min);
    rig_->always = nullptr;
  }

  Rig rig_;
};

TEST_F(HostWatchdog, IsFedAtItsIntervalWhateverElseTheLineHasToDo) {
  RunUnderLoad();
  const std::vector<Sent>& sent = rig_->sent;
  ASSERT_GT(sent.size(), 1000U) << "it was a busy minute";
  std::optional<Instant> told;
  std::size_t times = 0;
  std::size_t late = 0;  // requests since it was due
  for (const Sent& one : sent) {
    if (one.text != "~**\r") {
      if (told && one.at - *told >= kPeriod) ++late;
      EXPECT_LE(late, 1U) << one.text << ": only what waited for the line already goes before it";
      continue;
    }
    if (told) {
      EXPECT_GE(one.at - *told, kPeriod) << "not more often than it has to";
    }
    told = one.at;
    late = 0;
    ++times;
  }
  EXPECT_GE(times, 60U);
  for (std::uint32_t module = 0; module < rig_.devices(); ++module) {
    if (module == kDead) continue;  // it hears nothing
    EXPECT_EQ(Tell(module, "0").substr(3, 2), "00") << module << " has tripped";
    EXPECT_TRUE(rig_.FastUsable(module)) << module;
  }
  EXPECT_GT(std::ranges::count(rig_->ends, WriteEnd::ok), 100);
}

class NoHostWatchdog : public HostWatchdog {
 protected:
  NoHostWatchdog() : HostWatchdog(Duration::zero()) {}
};

/// So that the test above can fail.
TEST_F(NoHostWatchdog, LetsThemTrip) {
  RunUnderLoad();
  EXPECT_EQ(rig_->CountSent("~**"), 0U);
  EXPECT_EQ(Tell(1, "0").substr(3, 2), "04");
}

}  // namespace
}  // namespace baudgate
