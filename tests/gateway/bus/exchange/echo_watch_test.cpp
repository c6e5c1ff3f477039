// What is told of echoes, by the mode that the configuration gives.
// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "gateway/bus/exchange/line.h"

namespace baudgate {
namespace {

using config::Echo;

Request Asking(std::string_view bytes, bool mirrors = false) {
  Request request;
  request.bytes = ToBytes(bytes);
  request.expect.mirrors = mirrors;
  return request;
}

class EchoWatchTest : public ::testing::Test {
 protected:
  EchoWatch::Received Exchange(EchoWatch& watch, const Request& request, std::string_view heard,
                               Outcome outcome = Outcome::ok) {
    watch.OnSent(request.bytes);
    EchoWatch::Received told = watch.OnReceived(ToBytes(heard), &request);
    end_ = {outcome, {}, {}, 0};
    missed_ = watch.OnExchangeEnd(request, end_);
    return told;
  }

  const Request read_ = Asking("?1");
  const Request write_ = Asking("W1", true);
  ExchangeEnd end_;
  bool missed_ = false;
};

TEST_F(EchoWatchTest, OffPassesTheEchoAndWarnsOnce) {
  EchoWatch watch(Echo::off);
  EchoWatch::Received heard = Exchange(watch, read_, "?1!5");
  EXPECT_EQ(AsText(heard.bytes), "?1!5");
  EXPECT_TRUE(heard.echo);
  EXPECT_NE(heard.warning, nullptr);
  heard = Exchange(watch, read_, "?1!5");
  EXPECT_TRUE(heard.echo);
  EXPECT_EQ(heard.warning, nullptr);
}

TEST_F(EchoWatchTest, AReplyThatEqualsItsRequestIsNotBelievedWhileTheBusEchoes) {
  EchoWatch watch(Echo::off);
  EXPECT_FALSE(watch.MayBeEcho(write_, ToBytes("W1"))) << "nothing is known of this bus";
  Exchange(watch, read_, "?1!5");
  EXPECT_TRUE(watch.MayBeEcho(write_, ToBytes("W1")));
  EXPECT_FALSE(watch.MayBeEcho(write_, ToBytes("W2")));
  EXPECT_FALSE(watch.MayBeEcho(read_, ToBytes("?1"))) << "no reply of this protocol anyway";
  Exchange(watch, read_, "!5");
  EXPECT_FALSE(watch.MayBeEcho(write_, ToBytes("W1"))) << "the bus echoes no more";
}

TEST_F(EchoWatchTest, AReplyThatEqualsItsRequestTellsNothingOfTheBus) {
  EchoWatch watch(Echo::off);
  EXPECT_FALSE(Exchange(watch, write_, "W1").echo);
}

TEST_F(EchoWatchTest, AnOpenedPortIsAnotherBus) {
  EchoWatch watch(Echo::off);
  Exchange(watch, read_, "?1!5");
  watch.OnOpened();
  EXPECT_FALSE(watch.MayBeEcho(write_, ToBytes("W1")));
}

TEST_F(EchoWatchTest, StripTakesTheEchoAndSaysNothing) {
  EchoWatch watch(Echo::strip);
  const EchoWatch::Received heard = Exchange(watch, read_, "?1!5");
  EXPECT_EQ(AsText(heard.bytes), "!5");
  EXPECT_FALSE(heard.echo);
  EXPECT_EQ(heard.warning, nullptr);
}

TEST_F(EchoWatchTest, VerifyTellsOfACollisionAndWarnsOnce) {
  EchoWatch watch(Echo::verify);
  EchoWatch::Received heard = Exchange(watch, read_, "?9");
  EXPECT_TRUE(heard.collision);
  EXPECT_NE(heard.warning, nullptr);
  heard = Exchange(watch, read_, "?9");
  EXPECT_TRUE(heard.collision);
  EXPECT_EQ(heard.warning, nullptr);
}

TEST_F(EchoWatchTest, VerifyNamesAnEchoThatNeverCame) {
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

TEST_F(EchoWatchTest, ABusThatHasEchoedAndDoesNoMoreIsCut) {
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

TEST_F(EchoWatchTest, OnlyVerifyKnowsOfARing) {
  for (const Echo mode : {Echo::off, Echo::strip}) {
    EchoWatch watch(mode);
    Exchange(watch, read_, "?1!5");
    for (int i = 0; i < 5; ++i) Exchange(watch, read_, "", Outcome::no_reply);
    EXPECT_FALSE(watch.is_cut());
  }
}

}  // namespace
}  // namespace baudgate
