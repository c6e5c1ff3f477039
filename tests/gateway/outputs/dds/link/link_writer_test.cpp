// The writer over a real socket pair: who is there, who is not, and a socket that is full.
// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <cmath>

#include "gateway/outputs/dds/link/packet_socket.h"
#include "gateway/outputs/dds/link/process_link.h"
#include "gateway/outputs/dds/published_types.h"

namespace baudgate::dds {
namespace {

PointSample Point(double value) {
  PointSample sample;
  sample.gateway = "g", sample.device = "d", sample.point = "p", sample.value = value;
  return sample;
}

class LinkWriterTest : public ::testing::Test {
 protected:
  /// The value of the next sample; NaN when there is no packet.
  double Next() {
    const ReceivedPacket received = ReceivePacket(ends_.second.get(), buffer_);
    PointSample sample;
    if (received.got != PacketGot::packet) return std::nan("");
    const auto message = ParseLink(received.packet);
    return message.ok() && Decode(message->body, sample) ? sample.value : std::nan("");
  }

  std::pair<Descriptor, Descriptor> ends_ = std::move(*MakePacketPair());
  PacketBuffer buffer_{};
  LinkWriter writer_;
};

TEST_F(LinkWriterTest, NobodyIsThereUntilAttached) {
  int told = 0;
  writer_.OnSession([&] { ++told; });
  EXPECT_EQ(writer_.session(), 0U);
  EXPECT_EQ(writer_.Write(Point(1)), Sent::later);
  writer_.Attach(ends_.first.get());
  EXPECT_EQ(writer_.session(), 1U);
  EXPECT_EQ(writer_.Write(Point(2)), Sent::yes);
  EXPECT_EQ(Next(), 2.0);
  writer_.Detach();
  EXPECT_EQ(writer_.session(), 0U);
  EXPECT_EQ(writer_.Write(Point(3)), Sent::later);
  writer_.Attach(ends_.first.get());
  EXPECT_EQ(writer_.session(), 2U);
  EXPECT_EQ(told, 3);
}

TEST_F(LinkWriterTest, AFullSocketMeansLaterAndKeepsWhatItHas) {
  writer_.Attach(ends_.first.get());
  int sent = 0;
  while (sent < 100'000 && writer_.Write(Point(sent)) == Sent::yes) ++sent;
  ASSERT_GT(sent, 50);
  ASSERT_LT(sent, 5000);  // bounded by the socket: some hundreds
  EXPECT_EQ(writer_.Write(Point(0)), Sent::later);
  for (int i = 0; i < sent; ++i) EXPECT_EQ(Next(), i);
  EXPECT_EQ(writer_.Write(Point(7)), Sent::yes);
  EXPECT_EQ(Next(), 7.0);
}

TEST_F(LinkWriterTest, ASampleBeyondItsBoundsIsRefused) {
  writer_.Attach(ends_.first.get());
  PointSample sample = Point(1);
  sample.text = std::string(kMaxText + 1, 't');
  EXPECT_EQ(writer_.Write(sample), Sent::refused);
}

TEST_F(LinkWriterTest, AGatewayIsAMessageOfItsOwn) {
  writer_.Attach(ends_.first.get());
  const GatewaySample sample{"g", 7, "1.2.3"};
  ASSERT_EQ(writer_.Write(sample), Sent::yes);
  const ReceivedPacket received = ReceivePacket(ends_.second.get(), buffer_);
  ASSERT_EQ(received.got, PacketGot::packet);
  const auto message = ParseLink(received.packet);
  ASSERT_TRUE(message.ok()) << message.error();
  EXPECT_EQ(message->kind, LinkKind::gateway);
  GatewaySample back;
  ASSERT_TRUE(Decode(message->body, back));
  EXPECT_EQ(back, sample);
}

TEST_F(LinkWriterTest, AClosedSocketIsNoFailureOfTheSample) {
  writer_.Attach(ends_.first.get());
  ends_.second.Close();
  EXPECT_EQ(writer_.Write(Point(1)), Sent::later);
}

TEST_F(LinkWriterTest, TheEndIsTold) {
  writer_.Attach(ends_.first.get());
  EXPECT_FALSE(writer_.WaitAcknowledged(Duration::zero()));  // the other end is still there
  EXPECT_TRUE(writer_.ending());
  const ReceivedPacket received = ReceivePacket(ends_.second.get(), buffer_);
  ASSERT_EQ(received.got, PacketGot::packet);
  EXPECT_EQ(ParseLink(received.packet)->kind, LinkKind::end);
}

TEST_F(LinkWriterTest, NothingGoesOutUntilTheProcessHasReplacedItsWriters) {
  EXPECT_EQ(writer_.Reopen({.points = 7}), Sent::later);
  EXPECT_EQ(writer_.open().room.points, 7U) << "the next process is asked for it";
  writer_.Attach(ends_.first.get());
  EXPECT_EQ(writer_.Reopen({.points = 8}), Sent::yes);
  const ReceivedPacket received = ReceivePacket(ends_.second.get(), buffer_);
  ASSERT_EQ(received.got, PacketGot::packet);
  EXPECT_EQ(DecodeOpen(ParseLink(received.packet)->body)->room.points, 8U);
  EXPECT_EQ(writer_.Write(Point(1)), Sent::later);
  EXPECT_EQ(writer_.Reopen({.points = 9}), Sent::later);
  writer_.Attach(ends_.first.get());
  EXPECT_EQ(writer_.session(), 2U);
  EXPECT_EQ(writer_.Write(Point(2)), Sent::yes);
}

TEST(PacketSocket, APacketBeyondTheLongestIsSeenAsSuch) {
  auto ends = std::move(*MakePacketPair());
  const Bytes large(kMaxLinkMessage * 2, 1);
  ASSERT_EQ(SendPacket(ends.first.get(), large), PacketSent::yes);
  PacketBuffer buffer;
  const ReceivedPacket received = ReceivePacket(ends.second.get(), buffer);
  ASSERT_EQ(received.got, PacketGot::packet);
  EXPECT_FALSE(ParseLink(received.packet).ok());
}

}  // namespace
}  // namespace baudgate::dds
