// The echo filter in all modes, over every fragmentation of what comes back.
// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "gateway/bus/exchange/line.h"
#include "tests/transports/far_end.h"

namespace baudgate {
namespace {

using config::Echo;

struct Seen {
  Bytes bytes;
  int complete = 0;
  int collisions = 0;

  void Add(const EchoResult& result) {
    Append(bytes, result.bytes);
    complete += result.complete ? 1 : 0;
    collisions += result.collision ? 1 : 0;
  }
  bool operator==(const Seen&) const = default;
};

/// One exchange, in every fragmentation; all of them have to give `expected`.
void Check(Echo mode, std::string_view request, std::string_view received, const Seen& expected) {
  test::EachFragmentation(ToBytes(received), [&](const std::vector<Bytes>& pieces) {
    EchoFilter filter(mode);
    filter.OnSent(ToBytes(request));
    Seen seen;
    for (const Bytes& piece : pieces) seen.Add(filter.Filter(piece));
    seen.Add(filter.OnExchangeEnd());
    ASSERT_EQ(AsText(seen.bytes), AsText(expected.bytes)) << pieces.size() << " pieces";
    ASSERT_EQ(seen.complete, expected.complete);
    ASSERT_EQ(seen.collisions, expected.collisions);
  });
}

TEST(EchoFilter, OffPassesEverythingAndTellsOfAnEcho) {
  Check(Echo::off, "#01\r", "#01\r>+1.5\r", {ToBytes("#01\r>+1.5\r"), 1, 0});
}

TEST(EchoFilter, StripTakesTheEcho) {
  Check(Echo::strip, "#01\r", "#01\r>+1.5\r", {ToBytes(">+1.5\r"), 1, 0});
}

TEST(EchoFilter, StripLeavesABusWithoutEchoAlone) {
  Check(Echo::strip, "#01\r", ">+1.5\r", {ToBytes(">+1.5\r"), 0, 0});
}

TEST(EchoFilter, StripReleasesAReplyThatBeginsLikeTheRequest) {
  Check(Echo::strip, "$012\r", "$01!\r", {ToBytes("$01!\r"), 0, 0});
}

TEST(EchoFilter, StripReleasesAReplyThatIsTheBeginningOfTheRequest) {
  Check(Echo::strip, "$012\r", "$01", {ToBytes("$01"), 0, 0});
}

TEST(EchoFilter, ReplyEqualToTheRequestSurvivesItsEcho) {
  Check(Echo::strip, "LINK!", "LINK!LINK!", {ToBytes("LINK!"), 1, 0});
  Check(Echo::verify, "LINK!", "LINK!LINK!", {ToBytes("LINK!"), 1, 0});
}

TEST(EchoFilter, VerifyReportsADifferentEcho) {
  Check(Echo::verify, "#01\r", "#07\r>+1\r", {ToBytes("#07\r>+1\r"), 0, 1});
}

TEST(EchoFilter, VerifyReportsAMissingEcho) {
  Check(Echo::verify, "#01\r", ">+1.5\r", {ToBytes(">+1.5\r"), 0, 1});
  Check(Echo::verify, "#01\r", "#01", {ToBytes("#01"), 0, 1});
}

TEST(EchoFilter, VerifyReportsSilence) {
  EchoFilter filter(Echo::verify);
  filter.OnSent(ToBytes("#01\r"));
  EXPECT_TRUE(filter.OnExchangeEnd().collision);
}

TEST(EchoFilter, BytesWithoutARequestPass) {
  EchoFilter filter(Echo::strip);
  const EchoResult result = filter.Filter(ToBytes("noise"));
  EXPECT_EQ(AsText(result.bytes), "noise");
  EXPECT_FALSE(result.complete);
  EXPECT_FALSE(filter.OnExchangeEnd().collision);
}

TEST(EchoFilter, ExchangesDoNotMix) {
  EchoFilter filter(Echo::strip);
  filter.OnSent(ToBytes("#01\r"));
  EXPECT_EQ(AsText(filter.Filter(ToBytes(">bad")).bytes), ">bad");
  filter.OnExchangeEnd();
  filter.OnSent(ToBytes("#02\r"));
  EXPECT_TRUE(filter.Filter(ToBytes("#0")).bytes.empty());
  EXPECT_TRUE(filter.holding());
  EXPECT_TRUE(filter.Filter(ToBytes("2\r")).complete);
  EXPECT_FALSE(filter.holding());
}

TEST(EchoFilter, ARequestInTwoPiecesIsOneEcho) {
  EchoFilter filter(Echo::strip);
  filter.OnSent(ToBytes("#0"));
  EXPECT_TRUE(filter.Filter(ToBytes("#0")).bytes.empty());
  filter.OnSent(ToBytes("1\r"));
  const EchoResult result = filter.Filter(ToBytes("1\r!"));
  EXPECT_TRUE(result.complete);
  EXPECT_EQ(AsText(result.bytes), "!");
}

}  // namespace
}  // namespace baudgate
