// A relay that always has events, or says the same ones for ever, delays its neighbours by no more
// than a round.
// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <algorithm>
#include <map>

#include "gateway/base/bytes.h"
#include "gateway/base/text.h"
#include "tests/protocols/runs/rig.h"

namespace baudgate {
namespace {

using Said = std::function<std::string(char asked)>;

/// What goes on in a minute in which device 0 answers L and B with `said`, if that is given.
struct Minute {
  explicit Minute(const Said& said) {
    Rig rig(RealLine("Spa9600"), [](config::Line& line) {
      for (config::Device& device : line.devices) device.events = true;
    });
    if (said) rig->twin(0).manner.instead = [&](View request) { return Instead(request, said); };
    rig->Open();
    rig->RunFor(10s);
    rig->sent.clear();
    rig->RunFor(1min);
    for (const Sent& sent : rig->sent) Count(sent);
  }

  std::size_t polls = 0;  ///< of device 1
  Duration longest{};     ///< between two requests of it that are the same
  std::size_t asked = 0;  ///< L and B to device 0

 private:
  static bool AsksForEvents(std::string_view text) {
    return text.starts_with(">1RL:") || text.starts_with(">1RB:");
  }
  static std::optional<Bytes> Instead(View request, const Said& said) {
    const std::string_view text = AsText(request);
    if (!AsksForEvents(text)) return std::nullopt;
    Bytes reply = ToBytes("<1D:" + said(text[3]) + ":");
    const std::string checksum = HexByte(Xor8(reply));
    Append(reply, checksum + "\r\n");
    return reply;
  }
  void Count(const Sent& sent) {
    if (AsksForEvents(sent.text)) ++asked;
    if (!sent.text.starts_with(">2R")) return;
    ++polls;
    const auto [last, is_first] = last_.try_emplace(sent.text, sent.at);
    if (!is_first) longest = std::max<Duration>(longest, sent.at - last->second);
    last->second = sent.at;
  }

  std::map<std::string, Instant> last_;
};

TEST(EventFlood, TheSameForEverIsHeardOnceAPoll) {
  const Minute in_peace({});
  const Minute same([](char) { return "12.345 0E1"; });
  EXPECT_GE(same.polls + 2, in_peace.polls);
  EXPECT_LE(same.longest, in_peace.longest + 1s);
  EXPECT_LE(same.asked, 2 * 62U) << "L and B a second";
}

TEST(EventFlood, EverNewEventsTakeARoundOfTheLine) {
  const Minute in_peace({});
  int number = 0;
  const Minute flooded([&number](char asked) {
    if (asked == 'L') ++number;
    return std::to_string(10 + number / 1000 % 50) + "." + std::to_string(100 + number % 900) +
           " 0E1";
  });
  EXPECT_GE(flooded.polls + 2, in_peace.polls);
  EXPECT_LE(flooded.longest, in_peace.longest + 1s);
  EXPECT_GT(flooded.asked, 200U);
  EXPECT_LE(flooded.asked, in_peace.polls + 200) << "as many as others ask, and its turns";
  RecordProperty("asked", static_cast<int>(flooded.asked));
}

}  // namespace
}  // namespace baudgate
