// Warnings of times that cannot work, and of more polls than a line has room for.
// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "config/loader.h"
#include "tests/config/fake_protocol.h"

namespace baudgate::testing {
namespace {

/// A line with one device of one fast point; the fake asks and answers with 10 characters each.
std::string Warnings(const std::string& line, const std::string& device = "") {
  const config::Loaded loaded =
      Load("lines:\n- { name: l, port: /dev/l, protocol: fake, " + line +
           "\n  devices: [\n  { name: d, address: 1, points: [{ name: p, read: A1, type: int16 }]" +
           device + " }] }\n");
  EXPECT_TRUE(loaded.ok()) << Shown(loaded.problems);
  return Shown(loaded.problems);
}

TEST(TimingWarnings, WaitsBelowWhatAdaptersNeed) {
  EXPECT_EQ(Warnings("timing: { gap: 19ms },"),
            "t.yaml:2:3: warning: line 'l': timing: gap 19ms is shorter than USB adapters and "
            "serial servers may hold bytes back (16ms): good replies would be lost; write 20ms or "
            "more\n");
  EXPECT_EQ(Warnings("timing: { gap: 20ms, reply: 20ms },"), "");
  EXPECT_EQ(Warnings("", ", timing: { reply: 5ms }"),
            "t.yaml:4:3: warning: device 'd': timing: reply 5ms is shorter than USB adapters and "
            "serial servers may hold bytes back (16ms): good replies would be lost; write 20ms or "
            "more\n");
}

TEST(TimingWarnings, GapBelowThreeCharacters) {
  EXPECT_EQ(Warnings("serial: 300 8N1, timing: { gap: 99ms },"),
            "t.yaml:2:3: warning: line 'l': timing: gap 99ms is shorter than three characters at "
            "300 8N1: good replies would be cut in two; leave it out, or write 100ms or more\n");
  EXPECT_EQ(Warnings("serial: 300 8N1, timing: { gap: 100ms },"), "");
}

TEST(TimingWarnings, CeilingThatIsNotUsed) {
  EXPECT_EQ(Warnings("timing: { ceiling: 520ms },"),
            "t.yaml:2:3: warning: line 'l': timing: ceiling 520ms is shorter than reply 500ms and "
            "gap 25ms together; 525ms is used\n");
  EXPECT_EQ(Warnings("timing: { ceiling: 525ms },"), "");
  EXPECT_EQ(Warnings("timing: { ceiling: 1s },", ", timing: { reply: 2s }"),
            "t.yaml:4:3: warning: device 'd': timing: ceiling 1s is shorter than reply 2s and gap "
            "25ms together; 2.025s is used\n")
      << "from two levels, neither wrong by itself";
}

TEST(TimingWarnings, DrainBelowGap) {
  EXPECT_EQ(Warnings("timing: { drain: 24ms },"),
            "t.yaml:2:3: warning: line 'l': timing: drain 24ms is shorter than gap 25ms: the rest "
            "of a broken reply may meet the next request; write at least as much\n");
}

TEST(LoadWarnings, PollShorterThanTheRequests) {
  // 5 ms quiet and 20 characters of 10 bits: 25.8 ms at 9600, 71.7 ms at 3000.
  EXPECT_EQ(
      Warnings("serial: 9600 8N1,", ", poll: 25ms"),
      "t.yaml:4:3: warning: device 'd': poll 25ms is shorter than one round of its fast "
      "points takes at 9600 8N1 (requests: 1, time: at least 26ms): periods will be missed\n");
  EXPECT_EQ(Warnings("serial: 9600 8N1,", ", poll: 26ms"), "");
  EXPECT_EQ(Warnings("serial: 9600 8N1,", ", poll: 25ms, enabled: false"), "");
  EXPECT_EQ(
      Warnings("serial: 9600 8N1,", ", poll: 26ms, serial: 3000 8N1"),
      "t.yaml:4:3: warning: device 'd': poll 26ms is shorter than one round of its fast "
      "points takes at 3000 8N1 (requests: 1, time: at least 72ms): periods will be missed\n");
}

TEST(LoadWarnings, PollsOfAllDevicesTogether) {
  const auto with = [](const std::string& poll) {
    return Shown(Load("gateway: { poll: " + poll +
                      " }\n"
                      "lines:\n"
                      "- name: l\n"
                      "  port: /dev/l\n"
                      "  protocol: fake\n"
                      "  serial: 9600 8N1\n"
                      "  devices:\n"
                      "  - { name: d, address: 1, points: [{ name: p, read: A1, type: int16 }] }\n"
                      "  - { name: e, address: 2, points: [{ name: p, read: A1, type: int16 }, { "
                      "name: s, read: A1, type: int16, group: slow }] }\n")
                     .problems);
  };
  EXPECT_EQ(with("40ms"),
            "t.yaml:3:3: warning: line 'l': its polls need at least 129 % of the line's time: "
            "periods will be missed; lengthen poll, or move points to the group slow\n");
  EXPECT_EQ(with("52ms"), "");
  EXPECT_EQ(
      with("10s, slow: 10ms"),
      "t.yaml:9:5: warning: device 'e': slow 10ms is shorter than one round of its slow "
      "points takes at 9600 8N1 (requests: 1, time: at least 26ms): periods will be missed\n");
}

}  // namespace
}  // namespace baudgate::testing
