// A participant that is let in and announces readers and writers without end, or with damaged
// types, to a gateway and a subscriber that are at work: memory stays, samples keep coming.
// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>
#include <malloc.h>

#include "tests/gateway/outputs/dds/at_work.h"

namespace baudgate::dds {
namespace {

using testing::AnnouncementOf;
using testing::Append32;
using testing::Rtps;

/// A text parameter, padded.
void AppendText(Bytes& to, std::uint16_t id, const std::string& text) {
  const std::size_t padded = (text.size() + 1 + 3) / 4 * 4;
  Append32(to, id | static_cast<std::uint32_t>(4 + padded) << 16);
  Append32(to, static_cast<std::uint32_t>(text.size() + 1));
  Append(to, text);
  to.resize(to.size() + padded - text.size());
}

/// What participant 1 says of its endpoints: numbers and sequence numbers go up together from 1.
class Announcer {
 public:
  explicit Announcer(bool readers) : readers_(readers) {}

  /// `count` more in one datagram, with further parameters in hex.
  Bytes More(std::size_t count, const std::string& topic, const std::string& further = "") {
    Bytes datagram = Rtps("", 1);
    for (std::size_t i = 0; i < count; ++i) {
      const std::uint32_t number = ++number_;
      Bytes body = *ParseHex(readers_ ? "00 00 10 00 00 00 04 C7 00 00 04 C2 00 00 00 00"
                                      : "00 00 10 00 00 00 03 C7 00 00 03 C2 00 00 00 00");
      Append32(body, number);
      Append(body, View(*ParseHex("00 03 00 00 5A 00 10 00")));
      Append(body, View(Rtps("", 1)).subspan(8));
      for (const unsigned shift : {16U, 8U, 0U}) {
        body.push_back(static_cast<std::uint8_t>(number >> shift));
      }
      body.push_back(readers_ ? 0x07 : 0x02);
      AppendText(body, 0x05, topic.empty() ? "made/up/" + std::to_string(number) : topic);
      AppendText(body, 0x07, topic.empty() ? "Made" : "baudgate::v1::PointSample");
      Append(body, View(*ParseHex(further)));
      Append32(body, 1);
      Append(datagram, View(testing::Submessage(0x15, 0x04, body)));
    }
    return datagram;
  }

 private:
  const bool readers_;
  std::uint32_t number_ = 0;
};

class FloodTest : public testing::AtWork {
 protected:
  void SetUp() override {
    AtWork::SetUp();
    Send(AnnouncementOf(1));
  }
  DatagramCounters Counted() const { return publisher_->counters().datagrams; }
  /// Waits until the gateway has looked at it, so that none is lost.
  void Send(const Bytes& datagram) {
    const auto seen = [this] { return Counted().passed + Counted().AllRefused(); };
    const std::uint64_t before = seen();
    attacker_.Send(datagram);
    while (seen() == before) ASSERT_TRUE(SampleArrives());
  }
};

TEST_F(FloodTest, WritersAndReadersOfMadeUpTopics) {
  Announcer writers(false);
  Announcer readers(true);
  const std::size_t memory = mallinfo2().uordblks;
  for (int i = 0; i < 100; ++i) {
    Send(writers.More(100, ""));
    Send(readers.More(100, ""));
  }
  EXPECT_GT(Counted().Refused(Refusal::endpoints), 100U);
  EXPECT_LT(mallinfo2().uordblks, memory + (16U << 20));
  EXPECT_TRUE(SampleArrives());
}

TEST_F(FloodTest, AHundredRightReadersOfOneParticipantAreMatched) {
  Send(Announcer(true).More(100, kPointTopic));
  while (publisher_->counters().subscribers.points != 101) ASSERT_TRUE(SampleArrives());
}

TEST_F(FloodTest, DamagedTypes) {
  Announcer writers(false);
  for (const char* id : {"69", "72", "75"}) {
    for (const char* content : {"FF FF FF FF FF FF FF FF", "00 01 00 00 F2 51 00 00",
                                "00 01 00 00 00 00 00 10", "00 03 00 00 FF FF FF 7F"}) {
      Send(writers.More(1, "", std::string(id) + " 00 08 00 " + content));
      EXPECT_TRUE(SampleArrives()) << id << ' ' << content;
    }
  }
  EXPECT_EQ(Counted().AllRefused(), 0U) << "right peers announce types";
}

}  // namespace
}  // namespace baudgate::dds
