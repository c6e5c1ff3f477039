// Transparent routes on a bus that echoes, under virtual time: an echo must not confirm a write
// that the slave never heard.
// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "gateway/bus/poller/poller.h"
#include "tests/gateway/bus/poller/routed_line.h"

namespace baudgate {
namespace {

using Pieces = std::vector<TimedPiece>;

// The confirmation of a write equals its request, and so does an echo: a dead slave would obey.
TEST(PollerRoutedEcho, TheFirstWriteIsNotBelievedOnABusThatEchoesWhileItIsSent) {
  RoutedLine line(DriveLine(), {"20"});
  line.echo = [](View request) { return Bytes(request.begin(), request.end()); };
  line.twin(0).manner.dead = true;
  line.Ask("start", kStartDrive);
  line.RunFor(2s);
  EXPECT_NE(line.Of("start").outcome, Outcome::ok);
}

// A reply before the end of its request can be no reply.
TEST(PollerRoutedEcho, TheFirstWriteIsNotBelievedWhenItsEchoIsEarly) {
  RoutedLine line(DriveLine(), {"20"});
  line.twin(0).manner.deliver = [](View request, const Bytes&, Instant) -> Pieces {
    return {{-1ms, Bytes(request.begin(), request.end())}};
  };
  line.Ask("start", kStartDrive);
  line.RunFor(2s);
  EXPECT_NE(line.Of("start").outcome, Outcome::ok);
}

// An echo in one piece after the request is not early: only a read, whose reply differs from its
// request, tells that the bus echoes. From then on no write is believed.
TEST(PollerRoutedEcho, AWriteIsNotBelievedOnceAReadHasRevealedAnEchoInOnePiece) {
  RoutedLine line(DriveLine(), {"20"});
  bool dead = false;
  line.twin(0).manner.deliver = [&](View request, Bytes reply, Instant) -> Pieces {
    Pieces pieces{{1ms, Bytes(request.begin(), request.end())}};
    if (!dead) pieces.push_back({15ms, std::move(reply)});
    return pieces;
  };
  line.Ask("read", kRead);
  line.RunFor(1s);
  EXPECT_EQ(line.Of("read").outcome, Outcome::ok);
  EXPECT_EQ(line.warnings.size(), 1U) << "the user is told to set 'echo: strip'";
  dead = true;
  line.Ask("start", kStartDrive);
  line.RunFor(2s);
  EXPECT_NE(line.Of("start").outcome, Outcome::ok);
}

TEST(PollerRoutedEcho, AReplyThatMayEqualItsRequestRevealsNoEcho) {
  RoutedLine line(DriveLine(), {"20"});
  line.twin(0).manner.instead = [](View request) -> std::optional<Bytes> {
    if (request[1] != 0x08 && request[1] != 0x41) return std::nullopt;
    return Bytes(request.begin(), request.end());
  };
  line.Ask("clear counters", "08 00 0A 00 00");
  line.Ask("own function", "41 01 02 03");
  line.RunFor(1s);
  line.Ask("start", kStartDrive);
  line.RunFor(1s);
  EXPECT_EQ(line.Of("start").outcome, Outcome::ok);
  EXPECT_TRUE(line.warnings.empty());
}

TEST(PollerRoutedEcho, AWriteIsBelievedAgainOnceTheBusEchoesNoMore) {
  RoutedLine line(DriveLine(), {"20"});
  bool echoes = true;
  line.twin(0).manner.deliver = [&](View request, Bytes reply, Instant) -> Pieces {
    Pieces pieces{{15ms, std::move(reply)}};
    if (echoes) pieces.insert(pieces.begin(), {1ms, Bytes(request.begin(), request.end())});
    return pieces;
  };
  line.Ask("read", kRead);
  line.RunFor(1s);
  echoes = false;
  line.Ask("read again", kRead);
  line.RunFor(1s);
  line.Ask("start", kStartDrive);
  line.RunFor(1s);
  EXPECT_EQ(line.Of("start").outcome, Outcome::ok);
}

}  // namespace
}  // namespace baudgate
