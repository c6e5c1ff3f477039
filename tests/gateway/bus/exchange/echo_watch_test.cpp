// Tests of `EchoWatch` and `EchoFilter` in each configured echo mode.
// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "gateway/bus/exchange/line.h"
#include "tests/transports/far_end.h"

namespace baudgate::bus {
namespace {

using config::Echo;

protocols::Request Asking(std::string_view bytes, bool mirrors = false) {
  protocols::Request request;
  request.bytes = ToBytes(bytes);
  request.expect.mirrors = mirrors;
  return request;
}

class EchoWatchTest : public ::testing::Test {
 protected:
  EchoWatch::Received Exchange(EchoWatch& watch, const protocols::Request& request,
                               std::string_view heard, Outcome outcome = Outcome::ok) {
    watch.OnSent(request.bytes);
    EchoWatch::Received told = watch.OnReceived(ToBytes(heard), &request);
    end_ = {outcome, {}, {}, 0};
    missed_ = watch.OnExchangeEnd(request, end_);
    return told;
  }

  const protocols::Request read_ = Asking("?1");
  const protocols::Request write_ = Asking("W1", true);
  ExchangeEnd end_;
  bool missed_ = false;
};

TEST_F(EchoWatchTest, OffModePassesTheEchoAndWarnsOnce) {
  EchoWatch watch(Echo::off);
  EchoWatch::Received heard = Exchange(watch, read_, "?1!5");
  EXPECT_EQ(AsText(heard.bytes), "?1!5");
  EXPECT_TRUE(heard.echo);
  EXPECT_NE(heard.warning, nullptr);
  heard = Exchange(watch, read_, "?1!5");
  EXPECT_TRUE(heard.echo);
  EXPECT_EQ(heard.warning, nullptr);
}

TEST_F(EchoWatchTest, AReplyEqualToItsRequestMayBeAnEchoWhileTheBusEchoes) {
  EchoWatch watch(Echo::off);
  EXPECT_FALSE(watch.MayBeEcho(write_, ToBytes("W1"))) << "nothing is known of this bus";
  Exchange(watch, read_, "?1!5");
  EXPECT_TRUE(watch.MayBeEcho(write_, ToBytes("W1")));
  EXPECT_FALSE(watch.MayBeEcho(write_, ToBytes("W2")));
  EXPECT_FALSE(watch.MayBeEcho(read_, ToBytes("?1"))) << "no reply of this protocol anyway";
  Exchange(watch, read_, "!5");
  EXPECT_FALSE(watch.MayBeEcho(write_, ToBytes("W1"))) << "the bus echoes no more";
}

TEST_F(EchoWatchTest, AReplyEqualToItsRequestDoesNotProveAnEcho) {
  EchoWatch watch(Echo::off);
  EXPECT_FALSE(Exchange(watch, write_, "W1").echo);
}

TEST_F(EchoWatchTest, OpeningThePortForgetsTheEcho) {
  EchoWatch watch(Echo::off);
  Exchange(watch, read_, "?1!5");
  watch.OnOpened();
  EXPECT_FALSE(watch.MayBeEcho(write_, ToBytes("W1")));
}

TEST_F(EchoWatchTest, StripModeRemovesTheEchoWithoutAWarning) {
  EchoWatch watch(Echo::strip);
  const EchoWatch::Received heard = Exchange(watch, read_, "?1!5");
  EXPECT_EQ(AsText(heard.bytes), "!5");
  EXPECT_FALSE(heard.echo);
  EXPECT_EQ(heard.warning, nullptr);
}

TEST_F(EchoWatchTest, VerifyModeReportsEachCollisionAndWarnsOnce) {
  EchoWatch watch(Echo::verify);
  EchoWatch::Received heard = Exchange(watch, read_, "?9");
  EXPECT_TRUE(heard.collision);
  EXPECT_NE(heard.warning, nullptr);
  heard = Exchange(watch, read_, "?9");
  EXPECT_TRUE(heard.collision);
  EXPECT_EQ(heard.warning, nullptr);
}

TEST_F(EchoWatchTest, VerifyModeReportsAMissingEcho) {
  EchoWatch watch(Echo::verify);
  Exchange(watch, read_, "", Outcome::no_reply);
  EXPECT_TRUE(missed_);
  EXPECT_EQ(end_.reason, "no reply, and not even the echo of the request");
  Exchange(watch, read_, "?", Outcome::no_reply);
  EXPECT_TRUE(missed_);
  EXPECT_EQ(end_.reason, "the echo of the request broke off");
  Exchange(watch, read_, "", Outcome::line_down);
  EXPECT_FALSE(missed_) << "the port was lost";
}

TEST_F(EchoWatchTest, ThreeMissingEchoesOnAnEchoingBusReportACut) {
  EchoWatch watch(Echo::verify);
  for (int i = 0; i < 5; ++i) Exchange(watch, read_, "", Outcome::no_reply);
  EXPECT_FALSE(watch.is_cut()) << "it may be one that never echoes";
  Exchange(watch, read_, "?1!5");
  Exchange(watch, read_, "", Outcome::no_reply);
  Exchange(watch, read_, "", Outcome::no_reply);
  EXPECT_FALSE(watch.is_cut()) << "a request may be lost";
  Exchange(watch, read_, "", Outcome::no_reply);
  EXPECT_TRUE(watch.is_cut());
  Exchange(watch, read_, "?1", Outcome::no_reply);
  EXPECT_FALSE(watch.is_cut()) << "a silent device on a ring that is closed";
}

TEST_F(EchoWatchTest, OnlyVerifyModeReportsACutRing) {
  for (const Echo mode : {Echo::off, Echo::strip}) {
    EchoWatch watch(mode);
    Exchange(watch, read_, "?1!5");
    for (int i = 0; i < 5; ++i) Exchange(watch, read_, "", Outcome::no_reply);
    EXPECT_FALSE(watch.is_cut());
  }
}

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

TEST(EchoFilter, OffModePassesAllBytesAndReportsTheEcho) {
  Check(Echo::off, "#01\r", "#01\r>+1.5\r", {ToBytes("#01\r>+1.5\r"), 1, 0});
}

TEST(EchoFilter, StripModeRemovesTheEcho) {
  Check(Echo::strip, "#01\r", "#01\r>+1.5\r", {ToBytes(">+1.5\r"), 1, 0});
}

TEST(EchoFilter, StripModePassesAReplyWithoutEcho) {
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

TEST(EchoFilter, TheEchoOfARequestSentInTwoPiecesIsStripped) {
  EchoFilter filter(Echo::strip);
  filter.OnSent(ToBytes("#0"));
  EXPECT_TRUE(filter.Filter(ToBytes("#0")).bytes.empty());
  filter.OnSent(ToBytes("1\r"));
  const EchoResult result = filter.Filter(ToBytes("1\r!"));
  EXPECT_TRUE(result.complete);
  EXPECT_EQ(AsText(result.bytes), "!");
}

}  // namespace
}  // namespace baudgate::bus
