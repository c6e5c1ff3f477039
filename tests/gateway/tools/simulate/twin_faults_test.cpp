// What faults of twins make of a reply.
// SPDX-License-Identifier: Apache-2.0
#include "gateway/tools/simulate/twin_faults.h"

#include <gmock/gmock.h>

#include <bit>

#include "tests/gateway/tools/simulate/twin_faults_fixture.h"

namespace baudgate {
namespace {

using ::testing::ElementsAre;

TEST(TwinFaults, WithoutAnyTheReplyComesAfterItsThinkTime) {
  TwinFaults faults = Make({});
  EXPECT_THAT(Said(faults), ElementsAre("15ms 0123456789"));
  EXPECT_THAT(Said(faults, 1s, {}), ElementsAre()) << "a request to somebody else";
  TwinWire fast = Wire();
  fast.paced = false;
  TwinFaults unpaced = Make({}, fast);
  EXPECT_THAT(Said(unpaced), ElementsAre("5ms 0123456789"));
}

TEST(TwinFaults, BitsAreFlipped) {
  TwinFaults faults = Make({"bits:count=3"});
  for (int i = 0; i < 200; ++i) {
    const auto pieces = faults.Deliver(kRequest, kReply, kStart + i * 1s);
    ASSERT_EQ(pieces.size(), 1U);
    ASSERT_EQ(pieces[0].bytes.size(), kReply.size());
    int flipped = 0;
    for (std::size_t at = 0; at < kReply.size(); ++at)
      flipped += std::popcount(static_cast<unsigned>(pieces[0].bytes[at] ^ kReply[at]));
    EXPECT_EQ(flipped, 3);
  }
}

/// A port that checks parity sees an odd number of wrong bits, and hands on 0xFF.
TEST(TwinFaults, AFlippedBitIsAParityErrorWhereThereIsParity) {
  TwinWire wire = Wire();
  wire.serial.data_bits = 7;
  wire.serial.parity = config::Parity::even;
  TwinFaults faults = Make({"bits"}, wire);
  for (int i = 0; i < 200; ++i) {
    Bytes bytes = faults.Deliver(kRequest, kReply, kStart + i * 1s).at(0).bytes;
    int errors = 0;
    for (std::size_t at = 0; at < kReply.size(); ++at) {
      if (bytes[at] == kReply[at]) continue;
      EXPECT_EQ(bytes[at], 0xFF);
      ++errors;
    }
    EXPECT_EQ(errors, 1);
  }
}

TEST(TwinFaults, AnEchoComesAtOnceAndForEveryRequestOnTheLine) {
  TwinFaults faults = Make({"echo"});
  EXPECT_THAT(Said(faults), ElementsAre("0s ?A1\r", "15ms 0123456789"));
  EXPECT_THAT(Said(faults, 1s, {}), ElementsAre("0s ?A1\r"));
  EXPECT_EQ(faults.Counts()[0].struck, 2U);
}

TEST(TwinFaults, AStallIsASilenceInsideTheReply) {
  TwinFaults faults = Make({"stall:pause=100ms"});
  for (int i = 0; i < 50; ++i) {
    const auto pieces = faults.Deliver(kRequest, kReply, kStart + i * 1s);
    ASSERT_EQ(pieces.size(), 2U);
    EXPECT_GE(pieces[0].bytes.size(), 1U);
    EXPECT_GE(pieces[1].bytes.size(), 1U);
    EXPECT_EQ(pieces[1].after, 115ms);
    EXPECT_EQ(pieces[0].after, 5ms + pieces[0].bytes.size() * 1ms);
    Bytes whole = pieces[0].bytes;
    Append(whole, pieces[1].bytes);
    EXPECT_EQ(whole, kReply);
  }
  EXPECT_THAT(Said(faults, 1h, {'x'}), ElementsAre("6ms x")) << "nothing can be torn apart";
  EXPECT_EQ(faults.Counts()[0].struck, 50U);
}

TEST(TwinFaults, ADribblingReplyComesByteByByte) {
  TwinFaults faults = Make({"dribble:pause=20ms"});
  EXPECT_THAT(Said(faults, 0s, ToBytes("abc")), ElementsAre("6ms a", "27ms b", "48ms c"));
}

TEST(TwinFaults, GarbageStandsAroundTheReply) {
  TwinFaults faults = Make({"garbage_after:bytes=2", "garbage_before:bytes=3"});
  const auto pieces = faults.Deliver(kRequest, kReply, kStart);
  ASSERT_EQ(pieces.size(), 3U);
  EXPECT_EQ(pieces[0].bytes.size(), 3U);
  EXPECT_EQ(pieces[0].after, 8ms);
  EXPECT_EQ(pieces[1].bytes, kReply);
  EXPECT_EQ(pieces[2].bytes.size(), 2U);
  EXPECT_EQ(pieces[2].after, 20ms);
}

TEST(TwinFaults, AReplyComesTwice) {
  TwinFaults faults = Make({"double:pause=30ms"});
  EXPECT_THAT(Said(faults, 0s, ToBytes("abc")), ElementsAre("8ms abc", "41ms abc"));
}

TEST(TwinFaults, ALateReplyIsWaitedForByThoseAfterIt) {
  TwinFaults faults = Make({"late:delay=2s,for=500ms"});
  EXPECT_THAT(Said(faults, 0s, ToBytes("abc")), ElementsAre("2.008s abc"));
  EXPECT_THAT(Said(faults, 1s, ToBytes("def")), ElementsAre("1.011s def"));
  EXPECT_THAT(Said(faults, 5s, ToBytes("ghi")), ElementsAre("8ms ghi"));
}

TEST(TwinFaults, AReplyComesWithALaterRequest) {
  TwinFaults faults = Make({"late:exchanges=2,for=3s"});
  EXPECT_THAT(Said(faults, 0s, ToBytes("a")), ElementsAre());
  EXPECT_THAT(Said(faults, 1s, {}), ElementsAre()) << "not asked, so it does not count";
  EXPECT_THAT(Said(faults, 1s, ToBytes("b")), ElementsAre());
  EXPECT_THAT(Said(faults, 2s, ToBytes("c")), ElementsAre("6ms a"));
  EXPECT_THAT(Said(faults, 3s, ToBytes("d")), ElementsAre("6ms b", "7ms d"));
  EXPECT_THAT(Said(faults, 4s, ToBytes("e")), ElementsAre("6ms c", "7ms e"));
  EXPECT_THAT(Said(faults, 5s, ToBytes("f")), ElementsAre("6ms f"));
}

TEST(TwinFaults, ADeadDeviceSaysNothingAndForgets) {
  TwinFaults faults = Make({"late:exchanges=1,for=1s", "death:after=1s,for=2s", "echo:after=1s"});
  EXPECT_FALSE(faults.IsDead(kStart));
  EXPECT_THAT(Said(faults, 0s), ElementsAre());
  EXPECT_TRUE(faults.IsDead(kStart + 1s));
  EXPECT_THAT(Said(faults, 1s), ElementsAre("0s ?A1\r")) << "the line's echo needs no device";
  EXPECT_FALSE(faults.IsDead(kStart + 3s));
  EXPECT_THAT(Said(faults, 3s), ElementsAre("0s ?A1\r", "15ms 0123456789"));
  EXPECT_EQ(faults.Counts()[1].struck, 1U);
  EXPECT_EQ(faults.Counts()[1].exchanges, 3U);
}

TEST(TwinFaults, AStrangerAnswersInItsPlace) {
  const auto stranger = [](View request, Instant) {
    return request.size() == kRequest.size() ? ToBytes("foreign") : Bytes();
  };
  TwinFaults faults = Make({"wrong_address"}, Wire(), stranger);
  EXPECT_THAT(Said(faults), ElementsAre("12ms foreign"));
  EXPECT_THAT(Shown(faults.Deliver(ToBytes("?"), kReply, kStart + 1s)),
              ElementsAre("15ms 0123456789"));
  EXPECT_EQ(faults.Counts()[0].struck, 1U);
  EXPECT_EQ(faults.Counts()[0].exchanges, 2U);
  TwinFaults alone = Make({"wrong_address"});
  EXPECT_THAT(Said(alone), ElementsAre("15ms 0123456789"));
  EXPECT_EQ(alone.Counts()[0].struck, 0U);
}

/// Whatever strikes, the twin's own characters take their time, one after the other.
TEST(TwinFaults, PiecesAreNeverFasterThanTheWire) {
  TwinFaults faults =
      Make({"stall:rate=0.5,pause=3ms", "dribble:rate=0.3,pause=2ms", "double:rate=0.5",
            "garbage_before:rate=0.5", "garbage_after:rate=0.5", "late:rate=0.2,delay=100ms",
            "late:rate=0.2,exchanges=2", "bits:rate=0.5", "loss:rate=0.1"});
  Instant said = kStart;
  std::size_t bytes = 0;
  for (int i = 0; i < 2000; ++i) {
    const Instant end = kStart + i * 30ms;
    for (const TimedPiece& piece : faults.Deliver(kRequest, kReply, end)) {
      ASSERT_GE(end + piece.after - said, piece.bytes.size() * 1ms) << "exchange " << i;
      said = end + piece.after;
      bytes += piece.bytes.size();
    }
  }
  EXPECT_GT(bytes, 2000 * kReply.size());
}

}  // namespace
}  // namespace baudgate
