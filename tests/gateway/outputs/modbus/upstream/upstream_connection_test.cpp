// Tests of the connection to a Modbus TCP server, and of the requests that are outstanding when the
// connection ends.
// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <deque>
#include <string>
#include <utility>

#include "gateway/outputs/modbus/upstream/upstream_link.h"
#include "tests/gateway/outputs/modbus/upstream/upstream_fixture.h"

namespace baudgate::modbus {
namespace {

using asio::ip::tcp;
using test::RunReady;
using test::RunUntil;
using testing::HasSubstr;
using testing::Not;

using UpstreamConnectionTest = UpstreamTest;

TEST_F(UpstreamConnectionTest, RequestsShareOneConnectionThatIsOpenedOnDemand) {
  RunReady(io_);
  EXPECT_EQ(server_.accepted(), 0U);
  for (int i = 0; i < 3; ++i) {
    const Asked& asked = Submit();
    ASSERT_TRUE(server_.Wait(static_cast<std::size_t>(i) + 1));
    server_.Write("00 0" + std::to_string(i) + " 00 00 00 05 14 03 02 00 01");
    EXPECT_EQ(Wait(asked).outcome, Outcome::ok);
  }
  EXPECT_EQ(server_.accepted(), 1U);
}

TEST_F(UpstreamConnectionTest, HalfAReplyAtTheDeadlineEndsTheConnection) {
  Submit({.within = 300ms});
  ASSERT_TRUE(server_.Wait(1));
  server_.Write("00 00 00 00 00 05 14 03");
  EXPECT_EQ(Wait(asked_[0]).outcome, Outcome::no_reply);
  const Asked& next = Submit();
  ASSERT_TRUE(server_.Wait(1, 1)) << "on a new connection, at once";
  server_.Write(server_.Requests(1)[0].substr(0, 5) + " 00 00 00 05 14 03 02 00 01", 1);
  EXPECT_EQ(Wait(next).outcome, Outcome::ok);
}

TEST_F(UpstreamConnectionTest, HalfAReplyOfAnotherUnitKeepsTheConnection) {
  const Asked& slow = Submit({.slave = 21});
  ASSERT_TRUE(server_.Wait(1));
  server_.Write("00 00 00 00 00 05 15 03");
  SendInVain();
  server_.Write("02 00 01");
  EXPECT_EQ(Wait(slow).outcome, Outcome::ok);
  EXPECT_EQ(server_.accepted(), 1U);
}

TEST_F(UpstreamConnectionTest, GarbageEndsTheConnection) {
  const Asked& asked = Submit();
  ASSERT_TRUE(server_.Wait(1));
  server_.Write("48 54 54 50 2F 31 2E 31");
  const bus::RoutedReply& reply = Wait(asked);
  EXPECT_EQ(reply.outcome, Outcome::no_reply);
  EXPECT_THAT(reply.reason, HasSubstr("not Modbus TCP"));
  EXPECT_TRUE(RunUntil(io_, [&] { return server_.session(0).ended(); }));
}

TEST_F(UpstreamConnectionTest, AConnectionClosedInAReplyFailsAllAndRepeatsNothing) {
  const Asked& before = Submit();
  ASSERT_TRUE(server_.Wait(1));
  server_.Write("00 00 00 00 00 05 14 03 02 00 01");
  Wait(before);
  const Asked& write = Submit({.pdu = "06 00 08 00 02"});
  const Asked& read = Submit({.slave = 21});
  const Asked& second_write = Submit({.pdu = "06 00 08 00 00"});
  ASSERT_TRUE(server_.Wait(3));
  server_.Write("00 02 00 00 00 05 15");
  server_.Close();
  EXPECT_THAT(Wait(write).reason, HasSubstr("closed the connection; the request may have been"));
  EXPECT_THAT(Wait(read).reason, Not(HasSubstr("may have been")));
  EXPECT_EQ(read.reply.outcome, Outcome::no_reply);
  EXPECT_TRUE(read.reply.sent);
  EXPECT_EQ(second_write.calls, 0) << "it was not sent, so it goes out on the next connection";
  ASSERT_TRUE(server_.Wait(1, 1));
  EXPECT_EQ(server_.Requests(1)[0], "00 03 00 00 00 06 14 06 00 08 00 00");
  RunReady(io_);
  EXPECT_EQ(server_.Requests(1).size(), 1U);
}

TEST_F(UpstreamConnectionTest, AReadOnAClosedConnectionIsRepeatedOnce) {
  const Asked& before = Submit();
  ASSERT_TRUE(server_.Wait(1));
  const Asked& read = Submit({.slave = 21});
  const Asked& write = Submit({.slave = 22, .pdu = "06 00 08 00 02"});
  const Asked& unknown = Submit({.slave = 23, .pdu = "64 01"});
  ASSERT_TRUE(server_.Wait(4));
  server_.Write("00 00 00 00 00 05 14 03 02 00 01");
  server_.Close();
  EXPECT_EQ(Wait(before).outcome, Outcome::ok);
  EXPECT_EQ(Wait(write).outcome, Outcome::no_reply) << "it may have been carried out";
  EXPECT_EQ(Wait(unknown).outcome, Outcome::no_reply);
  ASSERT_TRUE(server_.Wait(1, 1));
  EXPECT_EQ(read.calls, 0);
  const Asked& second = Submit();
  ASSERT_TRUE(server_.Wait(2, 1));
  EXPECT_EQ(server_.Requests(1)[0], "00 04 00 00 00 06 15 03 00 C8 00 01");
  server_.Write("00 05 00 00 00 05 14 03 02 00 02", 1);
  EXPECT_EQ(Wait(second).outcome, Outcome::ok);
  server_.Close(1);
  EXPECT_EQ(Wait(read).outcome, Outcome::no_reply) << "once is enough";
  EXPECT_TRUE(read.reply.sent);
}

TEST_F(UpstreamConnectionTest, ARefusedConnectionIsNotTriedForEveryRequest) {
  tcp::acceptor closed(io_, tcp::endpoint(asio::ip::address_v4::loopback(), 0));
  const std::uint16_t port = closed.local_endpoint().port();
  closed.close();
  Upstream upstream(
      io_, "127.0.0.1", port, {}, [](std::uint8_t) {}, [this] { return Clock(); });
  upstream.Start();
  ASSERT_TRUE(upstream.Submit(Make({})));
  const bus::RoutedReply first = Wait(asked_.back());
  EXPECT_EQ(first.outcome, Outcome::line_down);
  EXPECT_FALSE(first.sent);
  EXPECT_THAT(first.reason, HasSubstr("server 127.0.0.1:" + std::to_string(port) +
                                      " cannot be reached: Connection refused"));
  ScriptedServer back(io_, port);
  ASSERT_TRUE(upstream.Submit(Make({})));
  EXPECT_EQ(Wait(asked_.back()).reason, first.reason);
  RunReady(io_);
  EXPECT_EQ(back.accepted(), 0U) << "the pause is not over";
  ahead_ += 1s;
  ASSERT_TRUE(upstream.Submit(Make({})));
  EXPECT_TRUE(RunUntil(io_, [&] { return back.accepted() == 1; }));
}

TEST_F(UpstreamConnectionTest, AServerThatClosesAtOnceIsRetriedAfterAPause) {
  server_.turns_away = true;
  EXPECT_EQ(Wait(Submit()).outcome, Outcome::no_reply);
  EXPECT_EQ(Wait(Submit()).outcome, Outcome::line_down);
  EXPECT_EQ(Wait(Submit()).outcome, Outcome::line_down);
  EXPECT_THAT(asked_.back().reply.reason, HasSubstr("closed the connection"));
  RunReady(io_);
  EXPECT_EQ(server_.accepted(), 2U);
  EXPECT_EQ(Wait(Submit({.slave = 21})).outcome, Outcome::no_reply) << "another unit is asked";
  EXPECT_EQ(server_.accepted(), 4U);
}

class ClosingServer : public UpstreamConnectionTest {
 protected:
  bool Serve() {
    RunReady(io_);
    if (server_.accepted() == 0) return false;
    const std::size_t session = server_.accepted() - 1;
    if (std::exchange(session_, session) != session) {
      served_ = 0;
      closed_ = false;
    }
    if (closed_) return true;
    const auto requests = server_.Requests(session);
    for (; served_ < requests.size(); ++served_) {
      const std::string& request = requests[served_];
      if (request.substr(18) == closes_on || request.substr(18, 2) == closes_on) {
        server_.Close(session);
        return closed_ = true;
      }
      server_.Write(request.substr(0, 5) + " 00 00 00 05 " + request.substr(18, 2) + " 03 02 00 01",
                    session);
    }
    return false;
  }
  bus::RoutedReply Served(const Asked& asked) {
    EXPECT_TRUE(RunUntil(io_, [&] {
      Serve();
      return asked.calls > 0;
    }));
    return asked.reply;
  }

  std::string closes_on;

 private:
  std::size_t session_ = 0;
  std::size_t served_ = 0;
  bool closed_ = false;
};

TEST_F(ClosingServer, FailsOnlyForTheUnitThatItClosesOn) {
  closes_on = "07";
  int failed = 0;
  for (int i = 0; i < 50; ++i) {
    const Asked& bad = Submit({.slave = 7});
    const Asked& good = Submit({.slave = 20, .client = 2});
    const Asked& other = Submit({.slave = 21, .client = 3});
    failed += Served(good).outcome != Outcome::ok;
    failed += Served(other).outcome != Outcome::ok;
    EXPECT_NE(Served(bad).outcome, Outcome::ok);
  }
  EXPECT_EQ(failed, 0);
  EXPECT_LE(server_.accepted(), 6U) << "unit 7 pauses";
}

TEST_F(ClosingServer, FailsOnlyForTheRequestThatItClosesOn) {
  closes_on = "01 01 00";
  int failed = 0;
  for (int i = 0; i < 50; ++i) {
    const Asked& good = Submit({.slave = 1, .client = 2});
    const Asked& bad = Submit({.slave = 1, .pdu = "01 00"});
    const Asked& other = Submit({.slave = 1, .pdu = "03 00 C9 00 01", .client = 3});
    failed += Served(good).outcome != Outcome::ok;
    failed += Served(other).outcome != Outcome::ok;
    EXPECT_NE(Served(bad).outcome, Outcome::ok);
  }
  EXPECT_EQ(failed, 0);
}

TEST_F(ClosingServer, IsAskedForTheUnitAgainAfterThePause) {
  closes_on = "07";
  Served(Submit({.slave = 7}));
  closes_on.clear();
  EXPECT_EQ(Served(Submit({.slave = 7})).outcome, Outcome::line_down);
  ahead_ += UnitPauses::kFirst;
  EXPECT_EQ(Served(Submit({.slave = 7})).outcome, Outcome::ok);
}

TEST_F(UpstreamConnectionTest, AClosedIdleConnectionIsReopenedAtOnce) {
  const Asked& first = Submit();
  ASSERT_TRUE(server_.Wait(1));
  server_.Write("00 00 00 00 00 05 14 03 02 00 01");
  Wait(first);
  server_.Close();
  ASSERT_TRUE(RunUntil(io_, [&] { return server_.session(0).ended(); }));
  const Asked& second = Submit();
  ASSERT_TRUE(server_.Wait(1, 1));
  server_.Write("00 01 00 00 00 05 14 03 02 00 02", 1);
  EXPECT_EQ(Wait(second).outcome, Outcome::ok);
}

TEST_F(UpstreamConnectionTest, ADeadServerIsDisconnectedAfterSilentDeadlines) {
  const Asked& first = Submit();
  ASSERT_TRUE(server_.Wait(1));
  server_.Write("00 00 00 00 00 05 14 03 02 00 01");
  Wait(first);
  for (int i = 0; i < RequestsOnWire::kSilentDeadlines; ++i) {
    EXPECT_FALSE(server_.session(0).ended());
    // Requests that expire at the same time count as one silence of the server.
    Submit({.slave = 21, .within = 300ms});
    Submit({.slave = 22, .within = 300ms});
    const Asked& silent = Submit({.within = 300ms});
    Wait(silent);
    ASSERT_TRUE(silent.reply.sent) << "the machine stood still for 300 ms";
    RunReady(io_);
  }
  ASSERT_TRUE(RunUntil(io_, [&] { return server_.session(0).ended(); }));
  Submit();
  EXPECT_TRUE(server_.Wait(1, 1)) << "it had answered once, so there is no pause";
}

TEST_F(UpstreamConnectionTest, ADeadlineWhileConnectingIsNotExceeded) {
  tcp::acceptor full(io_, tcp::endpoint(asio::ip::address_v4::loopback(), 0));
  full.listen(0);
  std::deque<tcp::socket> crowd;
  for (int i = 0; i < 4; ++i) {
    crowd.emplace_back(io_).async_connect(full.local_endpoint(), [](const asio::error_code&) {});
  }
  RunReady(io_);
  Upstream upstream(io_, "127.0.0.1", full.local_endpoint().port(), {}, [](std::uint8_t) {});
  upstream.Start();
  ASSERT_TRUE(upstream.Submit(Make({.within = 10ms})));
  const bus::RoutedReply& reply = Wait(asked_.back());
  EXPECT_EQ(reply.outcome, Outcome::no_reply);
  EXPECT_FALSE(reply.sent);
  EXPECT_THAT(reply.reason, HasSubstr("connected"));
}

TEST_F(UpstreamConnectionTest, StopAnswersAllRequestsAndRefusesNewOnes) {
  const Asked& write = Submit({.pdu = "06 00 08 00 02"});
  ASSERT_TRUE(server_.Wait(1));
  const Asked& waits = Submit({.pdu = "06 00 08 00 00"});
  RunReady(io_);
  const Asked& just_in = Submit();
  upstream_.Stop();
  EXPECT_EQ(write.calls, 1);
  EXPECT_THAT(write.reply.reason, HasSubstr("stopping; the request may have been carried out"));
  EXPECT_EQ(waits.calls, 1);
  EXPECT_EQ(waits.reply.outcome, Outcome::line_down);
  EXPECT_FALSE(waits.reply.sent);
  EXPECT_EQ(just_in.calls, 1);
  EXPECT_FALSE(upstream_.Submit(Make({})));
  ASSERT_TRUE(RunUntil(io_, [&] { return server_.session(0).ended(); }));
  EXPECT_EQ(server_.Requests().size(), 1U);
}

TEST_F(UpstreamConnectionTest, HostNamesAreResolved) {
  Upstream upstream(io_, "localhost", server_.port(), {}, [](std::uint8_t) {});
  upstream.Start();
  ASSERT_TRUE(upstream.Submit(Make({})));
  ASSERT_TRUE(server_.Wait(1));
  server_.Write("00 00 00 00 00 05 14 03 02 00 01");
  EXPECT_EQ(Wait(asked_.back()).outcome, Outcome::ok);
}

}  // namespace
}  // namespace baudgate::modbus
