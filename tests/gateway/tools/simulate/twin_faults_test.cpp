// Tests of `TwinFaults`: how each fault changes a reply.
// SPDX-License-Identifier: Apache-2.0
#include "gateway/tools/simulate/twin_faults.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <bit>
#include <string>

#include "tests/gateway/tools/simulate/twin_faults_fixture.h"

namespace baudgate::tools {
namespace {

using ::testing::ElementsAre;

TEST(TwinFaults, WithoutFaultsTheReplyComesAfterItsThinkTime) {
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

/// A port that checks parity detects an odd number of wrong bits and delivers 0xFF.
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

TEST(TwinFaults, AnEchoFollowsEveryRequestOnTheLineAtOnce) {
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

TEST(TwinFaults, GarbageSurroundsTheReply) {
  TwinFaults faults = Make({"garbage_after:bytes=2", "garbage_before:bytes=3"});
  const auto pieces = faults.Deliver(kRequest, kReply, kStart);
  ASSERT_EQ(pieces.size(), 3U);
  EXPECT_EQ(pieces[0].bytes.size(), 3U);
  EXPECT_EQ(pieces[0].after, 8ms);
  EXPECT_EQ(pieces[1].bytes, kReply);
  EXPECT_EQ(pieces[2].bytes.size(), 2U);
  EXPECT_EQ(pieces[2].after, 20ms);
}

TEST(TwinFaults, AReplyIsDoubled) {
  TwinFaults faults = Make({"double:pause=30ms"});
  EXPECT_THAT(Said(faults, 0s, ToBytes("abc")), ElementsAre("8ms abc", "41ms abc"));
}

TEST(TwinFaults, ALateReplyDelaysLaterReplies) {
  TwinFaults faults = Make({"late:delay=2s,for=500ms"});
  EXPECT_THAT(Said(faults, 0s, ToBytes("abc")), ElementsAre("2.008s abc"));
  EXPECT_THAT(Said(faults, 1s, ToBytes("def")), ElementsAre("1.011s def"));
  EXPECT_THAT(Said(faults, 5s, ToBytes("ghi")), ElementsAre("8ms ghi"));
}

TEST(TwinFaults, AReplyIsSentAfterALaterRequest) {
  TwinFaults faults = Make({"late:exchanges=2,for=3s"});
  EXPECT_THAT(Said(faults, 0s, ToBytes("a")), ElementsAre());
  EXPECT_THAT(Said(faults, 1s, {}), ElementsAre()) << "not asked, so it does not count";
  EXPECT_THAT(Said(faults, 1s, ToBytes("b")), ElementsAre());
  EXPECT_THAT(Said(faults, 2s, ToBytes("c")), ElementsAre("6ms a"));
  EXPECT_THAT(Said(faults, 3s, ToBytes("d")), ElementsAre("6ms b", "7ms d"));
  EXPECT_THAT(Said(faults, 4s, ToBytes("e")), ElementsAre("6ms c", "7ms e"));
  EXPECT_THAT(Said(faults, 5s, ToBytes("f")), ElementsAre("6ms f"));
}

TEST(TwinFaults, ADeadDeviceIsSilentAndForgetsPendingReplies) {
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

TEST(TwinFaults, AnotherDeviceAnswersInstead) {
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

TEST(FaultSchedule, BeginsEndsAndRepeats) {
  const Fault always = Parsed("loss");
  EXPECT_TRUE(always.IsDue(0s));
  EXPECT_TRUE(always.IsDue(100h));
  const Fault once = Parsed("loss:after=30s,for=20s");
  for (const auto& [when, due] :
       {std::pair<Duration, bool>{29999ms, false}, {30s, true}, {49999ms, true}, {50s, false}}) {
    EXPECT_EQ(once.IsDue(when), due) << FormatDuration(when);
    EXPECT_EQ(once.IsDue(when + 1h), false);
  }
  const Fault again = Parsed("loss:after=30s,for=20s,every=1min");
  for (const Duration round : {Duration(0s), Duration(1min), Duration(10h)}) {
    EXPECT_FALSE(again.IsDue(29999ms + round)) << FormatDuration(round);
    EXPECT_TRUE(again.IsDue(30s + round));
    EXPECT_TRUE(again.IsDue(49999ms + round));
    EXPECT_FALSE(again.IsDue(50s + round));
  }
}

TEST(FaultSchedule, RepliesOutsideTheScheduleAreUndisturbed) {
  TwinFaults faults = Make({"loss:after=30s,for=20s,every=1min"});
  int lost = 0;
  for (Duration time = 0s; time < 3min; time += 1s) {
    const auto said = Said(faults, time);
    if (said.empty()) ++lost;
    EXPECT_TRUE(said.empty() || said[0] == "15ms 0123456789");
  }
  EXPECT_EQ(lost, 3 * 20);
  EXPECT_EQ(faults.Counts()[0].struck, 60U);
  EXPECT_EQ(faults.Counts()[0].exchanges, 180U);
  EXPECT_EQ(faults.Counts()[0].fault, "loss:after=30s,for=20s,every=1min");
}

std::string Pattern(const std::string& fault, int exchanges) {
  TwinFaults faults = Make({fault});
  std::string pattern;
  for (int i = 0; i < exchanges; ++i) pattern += Said(faults, i * 1s).empty() ? 'x' : '.';
  return pattern;
}

TEST(FaultRate, IsTheShareOfAffectedReplies) {
  for (const auto& [text, share] : {std::pair("loss:rate=0.25", 0.25), {"loss:rate=0.01", 0.01}}) {
    const std::string pattern = Pattern(text, 10'000);
    const auto struck = static_cast<double>(std::count(pattern.begin(), pattern.end(), 'x'));
    EXPECT_NEAR(struck, share * 10'000, 150) << text;
  }
  EXPECT_EQ(Pattern("loss:rate=0", 50), std::string(50, '.'));
  EXPECT_EQ(Pattern("loss:rate=1", 50), std::string(50, 'x'));
}

TEST(FaultSeed, RepeatsARunOnEveryMachine) {
  EXPECT_EQ(Pattern("loss:rate=0.5", 32), "...xx..xxxxxx.xxxx..xxxx.xx....x");
  EXPECT_EQ(Pattern("loss:rate=0.5,seed=2", 32), ".xx..x......xxxx.....xxx.x...x.x");
  EXPECT_EQ(Pattern("loss:rate=0.5,seed=1", 200), Pattern("loss:rate=0.5", 200));
}

using ::testing::HasSubstr;

std::string ErrorOf(const std::string& text) {
  const auto fault = ParseFault(text);
  return fault ? "no error" : fault.error();
}

TEST(FaultText, KindsHaveDefaults) {
  const Fault loss = Parsed("loss");
  EXPECT_EQ(loss.kind, Fault::Kind::loss);
  EXPECT_EQ(loss.rate, 1);
  EXPECT_EQ(loss.seed, 1U);
  EXPECT_EQ(loss.text, "loss");
  EXPECT_EQ(Parsed("bits").count, 1U);
  EXPECT_EQ(Parsed("garbage_before").count, 8U);
  EXPECT_EQ(Parsed("stall").pause, 200ms);
  EXPECT_EQ(Parsed("dribble").pause, 20ms);
  EXPECT_EQ(Parsed("late").pause, 1s);
  EXPECT_EQ(Parsed("late").exchanges, 0U);
  EXPECT_EQ(Parsed("late:exchanges=3").pause, 0s);
  for (const char* name : {"echo", "garbage_after", "wrong_address", "double", "death"}) {
    EXPECT_EQ(Name(Parsed(name).kind), name);
  }
}

TEST(FaultText, KeysAreParsed) {
  const Fault bits = Parsed("bits:rate=0.25,seed=7,count=3,after=30s,for=20s,every=1min");
  EXPECT_EQ(bits.kind, Fault::Kind::bits);
  EXPECT_EQ(bits.rate, 0.25);
  EXPECT_EQ(bits.seed, 7U);
  EXPECT_EQ(bits.count, 3U);
  EXPECT_EQ(bits.after, 30s);
  EXPECT_EQ(bits.lasts, 20s);
  EXPECT_EQ(bits.every, 1min);
  EXPECT_EQ(Parsed("garbage_after:bytes=20").count, 20U);
  EXPECT_EQ(Parsed("late:delay=300ms").pause, 300ms);
  EXPECT_EQ(Parsed("late:exchanges=2").exchanges, 2U);
  EXPECT_EQ(Parsed("double:pause=0ms").pause, 0s);
}

TEST(FaultText, ARateMayHaveAnExponent) {
  EXPECT_DOUBLE_EQ(Parsed("loss:rate=1e-9").rate, 1e-9);
  EXPECT_DOUBLE_EQ(Parsed("loss:rate=2.5E-3,seed=7").rate, 0.0025);
  EXPECT_EQ(Parsed("loss:rate=1e0").rate, 1);
  for (const char* rate : {"1e", "e-9", "1e-9x", "1e-1.5", "1e1", "-1e-9", "0e999", "1e9999999999"})
    EXPECT_THAT(ErrorOf(std::string("loss:rate=") + rate), HasSubstr("write a number from 0"));
}

TEST(FaultText, ErrorsListTheAllowedWords) {
  EXPECT_THAT(ErrorOf("los"), HasSubstr("did you mean 'loss'?"));
  EXPECT_THAT(ErrorOf(""), HasSubstr("loss, bits, echo, stall, dribble"));
  EXPECT_THAT(
      ErrorOf("bits:cuont=2"),
      HasSubstr(
          "fault bits: unknown key 'cuont'; did you mean 'count'? allowed: count, rate, seed"));
  EXPECT_THAT(ErrorOf("loss:count=2"), HasSubstr("fault loss: unknown key 'count'"));
  EXPECT_THAT(ErrorOf("death:rate=0.5"), HasSubstr("allowed: after, for, every"));
  EXPECT_THAT(ErrorOf("loss:"), HasSubstr("fault loss: unknown key ''"));
  EXPECT_THAT(ErrorOf("loss:rate"), HasSubstr("key rate has no value"));
  EXPECT_THAT(ErrorOf("loss:seed=1,seed=2"), HasSubstr("seed= is given twice"));
  EXPECT_THAT(ErrorOf("loss:rate=2"), HasSubstr("fault loss: rate=2: write a number from 0"));
  EXPECT_THAT(ErrorOf("loss:rate=often"), HasSubstr("rate=often: write a number from 0"));
  EXPECT_THAT(ErrorOf("loss:seed=-1"), HasSubstr("seed=-1: write a whole number from 0"));
  EXPECT_THAT(ErrorOf("bits:count=0"), HasSubstr("write a whole number from 1 to 1024"));
  EXPECT_THAT(ErrorOf("late:exchanges=17"), HasSubstr("write a whole number from 1 to 16"));
  EXPECT_THAT(ErrorOf("loss:after=30"), HasSubstr("'30' has no unit"));
  EXPECT_THAT(ErrorOf("loss:for=0s"), HasSubstr("for=0s: write a duration from 1ms"));
  EXPECT_THAT(ErrorOf("stall:pause=1h"), HasSubstr("write a duration from 1ms to 10min"));
  EXPECT_THAT(ErrorOf("loss:every=1min"), HasSubstr("fault loss: every= needs for="));
  EXPECT_THAT(ErrorOf("loss:every=1s,for=1s"), HasSubstr("every= has to be longer than for="));
  EXPECT_THAT(ErrorOf("late:delay=1s,exchanges=1"), HasSubstr("not both"));
}

}  // namespace
}  // namespace baudgate::tools
