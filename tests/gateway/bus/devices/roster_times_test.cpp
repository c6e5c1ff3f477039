// Times that a device has asked for itself: the longer of configured and learned counts.
// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "gateway/bus/devices/roster.h"
#include "tests/support/virtual_line.h"

namespace baudgate {
namespace {

/// Says what times it needs, and nothing else.
class Slow : public Conversation {
 public:
  explicit Slow(config::Timing least) : least_(least) {}
  std::span<const Query> Queries() const override { return {}; }
  Result<Request> Ask(const Task&, Instant) override { return Error{"not asked"}; }
  Answer OnFrame(const Task&, const Request&, View, Instant) override { return {}; }
  Outcome Check(View, View) const override { return Outcome::ok; }
  Answer Interpret(View, View) override { return {}; }
  config::Timing LeastTimes(Duration) const override { return least_; }

 private:
  config::Timing least_;
};

TEST(RosterTimes, TheLongerOneCounts) {
  const config::Line line = ToyLine({ToyDevice("a", "A", {"1"})});
  Roster roster(line, 0, [](const std::string&) -> const Protocol& { return ToyProtocol(); });
  Device& device = roster.device(0);
  const LineTimes configured = device.times;

  config::Timing least;
  least.quiet = configured.quiet + 40ms;
  least.reply = configured.reply + 2s;
  least.drain = configured.drain / 2;
  device.conversation = std::make_unique<Slow>(least);
  device.LearnTimes();
  EXPECT_EQ(device.times.quiet, configured.quiet + 40ms);
  EXPECT_EQ(device.times.reply, configured.reply + 2s);
  EXPECT_EQ(device.times.drain, configured.drain);
  EXPECT_EQ(device.times.gap, configured.gap);
  EXPECT_EQ(device.times.ceiling, configured.ceiling + 2s) << "it begins later, and takes as long";
  device.LearnTimes();
  EXPECT_EQ(device.times.ceiling, configured.ceiling + 2s) << "once";

  device.conversation = std::make_unique<Slow>(config::Timing());
  device.LearnTimes();
  EXPECT_EQ(device.times.quiet, configured.quiet);
  EXPECT_EQ(device.times.reply, configured.reply);
  EXPECT_EQ(device.times.ceiling, configured.ceiling);
}

}  // namespace
}  // namespace baudgate
