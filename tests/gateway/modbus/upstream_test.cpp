// Routed requests against a scripted Modbus TCP server on loopback: what goes out, what comes back,
// and what is never sent.
// SPDX-License-Identifier: Apache-2.0
#include "gateway/modbus/upstream.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <asio/ip/tcp.hpp>
#include <deque>
#include <optional>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "gateway/base/text.h"
#include "tests/transports/far_end.h"

namespace baudgate::modbus {
namespace {

using asio::ip::tcp;
using test::RunReady;
using test::RunUntil;
using testing::HasSubstr;
using testing::Not;

/// Takes connections and keeps what they bring; answers when told.
class ScriptedServer {
 public:
  explicit ScriptedServer(asio::io_context& io, std::uint16_t port = 0)
      : io_(io), acceptor_(io, tcp::endpoint(asio::ip::address_v4::loopback(), port)) {
    Accept();
  }

  std::uint16_t port() const { return acceptor_.local_endpoint().port(); }
  std::size_t accepted() const { return sessions_.size(); }
  test::FarEnd<tcp::socket>& session(std::size_t number) { return sessions_.at(number); }

  /// The requests that this connection has brought, as hex.
  std::vector<std::string> Requests(std::size_t session = 0) {
    std::vector<std::string> requests;
    if (session >= sessions_.size()) return requests;
    View rest = sessions_[session].received();
    while (rest.size() >= 6) {
      const std::size_t size = 6U + *ByteReader(rest).U16Be(4);
      if (rest.size() < size) break;
      requests.push_back(ToHex(rest.first(size)));
      rest = rest.subspan(size);
    }
    return requests;
  }
  bool Wait(std::size_t count, std::size_t session = 0) {
    return RunUntil(io_, [&] { return Requests(session).size() >= count; });
  }
  void Write(const std::string& hex, std::size_t session = 0) {
    sessions_.at(session).Write(ParseHex(hex).value());
  }
  void Close(std::size_t session = 0) {
    sessions_.at(session).stream().shutdown(tcp::socket::shutdown_send);
  }
  /// Connections are closed as soon as they come.
  bool turns_away = false;

 private:
  void Accept() {
    acceptor_.async_accept([this](const asio::error_code& error, tcp::socket socket) {
      if (error) return;
      sessions_.emplace_back(std::move(socket));
      if (turns_away) Close(sessions_.size() - 1);
      sessions_.back().Start();
      Accept();
    });
  }

  asio::io_context& io_;
  tcp::acceptor acceptor_;
  std::deque<test::FarEnd<tcp::socket>> sessions_;
};

/// What became of one request.
struct Asked {
  int calls = 0;
  RoutedReply reply;
};

struct Ask {
  std::uint8_t slave = 20;
  std::string pdu = "03 00 C8 00 01";
  std::uint64_t client = 1;
  config::Priority priority = config::Priority::normal;
  Duration within = 1h;
};

class UpstreamTest : public testing::Test {
 protected:
  UpstreamTest() { upstream_.Start(); }

  RoutedRequest Make(const Ask& ask) {
    Asked& asked = asked_.emplace_back();
    RoutedRequest request;
    request.client = ask.client;
    request.slave = ask.slave;
    request.pdu = ParseHex(ask.pdu).value();
    request.priority = ask.priority;
    request.arrived = std::chrono::steady_clock::now();
    request.deadline = request.arrived + ask.within;
    request.done = [&asked](RoutedReply reply) {
      ++asked.calls;
      asked.reply = std::move(reply);
    };
    return request;
  }
  Asked& Submit(const Ask& ask = {}) {
    EXPECT_TRUE(upstream_.Submit(Make(ask)));
    return asked_.back();
  }
  const RoutedReply& Wait(const Asked& asked) {
    EXPECT_TRUE(RunUntil(io_, [&] { return asked.calls > 0; }));
    EXPECT_EQ(asked.calls, 1);
    return asked.reply;
  }
  /// Reads of distinct registers, as many as the wire takes.
  void FillTheWire() {
    for (std::size_t i = 0; i < Upstream::kMostOnWire; ++i) {
      Submit({.pdu = "03 01 " + HexByte(static_cast<std::uint8_t>(i)) + " 00 01"});
    }
    ASSERT_TRUE(server_.Wait(Upstream::kMostOnWire));
  }

  asio::io_context io_;
  ScriptedServer server_{io_};
  std::deque<Asked> asked_;
  Upstream upstream_{io_, "127.0.0.1", server_.port()};
};

TEST_F(UpstreamTest, RequestAndReplyPassAsTheyAre) {
  const Asked& asked = Submit();
  ASSERT_TRUE(server_.Wait(1));
  EXPECT_EQ(server_.Requests()[0], "00 00 00 00 00 06 14 03 00 C8 00 01");
  server_.Write("00 00 00 00 00 05 14 03 02 09 C4");
  const RoutedReply& reply = Wait(asked);
  EXPECT_EQ(reply.outcome, Outcome::ok);
  EXPECT_EQ(ToHex(reply.pdu), "03 02 09 C4");
  EXPECT_TRUE(reply.sent);
  EXPECT_FALSE(reply.shared);
  EXPECT_EQ(server_.accepted(), 1U);
}

TEST_F(UpstreamTest, NoConnectionWithoutARequestAndOneForAll) {
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

TEST_F(UpstreamTest, AnExceptionIsPassedOn) {
  const Asked& asked = Submit();
  ASSERT_TRUE(server_.Wait(1));
  server_.Write("00 00 00 00 00 03 14 83 02");
  const RoutedReply& reply = Wait(asked);
  EXPECT_EQ(reply.outcome, Outcome::refused);
  EXPECT_EQ(ToHex(reply.pdu), "83 02");
}

TEST_F(UpstreamTest, RepliesFindTheirRequestsInAnyOrder) {
  const Asked& first = Submit({.slave = 1});
  const Asked& second = Submit({.slave = 2});
  ASSERT_TRUE(server_.Wait(2));
  server_.Write("00 01 00 00 00 05 02 03 02 00 22 00 00 00 00 00 05 01 03 02 00 11");
  EXPECT_EQ(ToHex(Wait(second).pdu), "03 02 00 22");
  EXPECT_EQ(ToHex(Wait(first).pdu), "03 02 00 11");
}

TEST_F(UpstreamTest, AReplyMayComeInAnyPieces) {
  constexpr std::size_t kSize = 11;
  for (std::size_t cut = 0; cut <= kSize; ++cut) {
    const Asked& asked = Submit();
    ASSERT_TRUE(server_.Wait(cut + 1));
    const std::string id = HexByte(static_cast<std::uint8_t>(cut));
    const Bytes whole = ParseHex("00 " + id + " 00 00 00 05 14 03 02 00 " + id).value();
    auto& session = server_.session(0);
    if (cut == kSize) {
      for (const std::uint8_t byte : whole) {
        session.Write({byte});
        RunReady(io_);
      }
    } else {
      session.Write(Bytes(whole.begin(), whole.begin() + static_cast<std::ptrdiff_t>(cut)));
      RunReady(io_);
      EXPECT_EQ(asked.calls, 0);
      session.Write(Bytes(whole.begin() + static_cast<std::ptrdiff_t>(cut), whole.end()));
    }
    EXPECT_EQ(ToHex(Wait(asked).pdu), "03 02 00 " + id);
  }
}

TEST_F(UpstreamTest, OtherUnitsAndFunctionsAreNoReply) {
  for (const std::string reply :
       {"00 00 00 00 00 05 15 03 02 09 C4", "00 01 00 00 00 05 14 04 02 09 C4",
        "00 02 00 00 00 05 14 83 02 09 C4", "00 03 00 00 00 02 14 83"}) {
    const Asked& asked = Submit();
    ASSERT_TRUE(server_.Wait(asked_.size()));
    server_.Write(reply);
    EXPECT_EQ(Wait(asked).outcome, Outcome::unexpected) << reply;
    EXPECT_TRUE(asked.reply.pdu.empty());
    EXPECT_THAT(asked.reply.reason, HasSubstr("answered"));
  }
}

TEST_F(UpstreamTest, AnUnknownIdIsDropped) {
  const Asked& asked = Submit();
  ASSERT_TRUE(server_.Wait(1));
  server_.Write("00 07 00 00 00 05 14 03 02 09 C4");
  ASSERT_TRUE(RunUntil(io_, [&] { return upstream_.late_replies() == 1; }));
  EXPECT_EQ(asked.calls, 0);
  server_.Write("00 00 00 00 00 05 14 03 02 00 01");
  EXPECT_EQ(ToHex(Wait(asked).pdu), "03 02 00 01");
}

TEST_F(UpstreamTest, ALateReplyIsNotTheNextOnes) {
  const Asked& slow = Submit({.within = 5ms});
  // Either expired before it could be sent, on a slow machine, or on the wire.
  const RoutedReply& reply = Wait(slow);
  EXPECT_EQ(reply.outcome, Outcome::no_reply);
  if (!reply.sent) GTEST_SKIP() << "the machine is too slow to send within 5 ms";
  EXPECT_THAT(reply.reason, HasSubstr("did not answer in time"));
  const Asked& next = Submit();
  ASSERT_TRUE(server_.Wait(2));
  server_.Write("00 00 00 00 00 05 14 03 02 AA AA 00 01 00 00 00 05 14 03 02 BB BB");
  EXPECT_EQ(ToHex(Wait(next).pdu), "03 02 BB BB");
  EXPECT_EQ(slow.calls, 1);
  EXPECT_EQ(upstream_.late_replies(), 1U);
}

TEST_F(UpstreamTest, NothingIsSentAfterItsDeadline) {
  const Asked& late = Submit({.pdu = "06 00 08 00 02", .within = -1s});
  const RoutedReply& reply = Wait(late);
  EXPECT_EQ(reply.outcome, Outcome::no_reply);
  EXPECT_FALSE(reply.sent);
  EXPECT_THAT(reply.reason, HasSubstr("deadline"));
  RunReady(io_);
  EXPECT_EQ(server_.accepted(), 0U);
}

TEST_F(UpstreamTest, WhatWaitsForTheWireExpires) {
  FillTheWire();
  const Asked& late = Submit({.within = 1ms});
  EXPECT_FALSE(Wait(late).sent);
  server_.Write("00 00 00 00 00 05 14 03 02 00 01");
  Wait(asked_[0]);
  RunReady(io_);
  EXPECT_EQ(server_.Requests().size(), Upstream::kMostOnWire);
}

TEST_F(UpstreamTest, GarbageEndsTheConnection) {
  const Asked& asked = Submit();
  ASSERT_TRUE(server_.Wait(1));
  server_.Write("48 54 54 50 2F 31 2E 31");
  const RoutedReply& reply = Wait(asked);
  EXPECT_EQ(reply.outcome, Outcome::no_reply);
  EXPECT_THAT(reply.reason, HasSubstr("no Modbus TCP"));
  EXPECT_TRUE(RunUntil(io_, [&] { return server_.session(0).ended(); }));
}

TEST_F(UpstreamTest, AnEndInTheMidstAnswersAllAndRepeatsNothing) {
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

TEST_F(UpstreamTest, ARefusedConnectionIsNotTriedForEveryRequest) {
  tcp::acceptor closed(io_, tcp::endpoint(asio::ip::address_v4::loopback(), 0));
  const std::uint16_t port = closed.local_endpoint().port();
  closed.close();
  Upstream upstream(io_, "127.0.0.1", port);
  upstream.Start();
  ASSERT_TRUE(upstream.Submit(Make({})));
  const RoutedReply first = Wait(asked_.back());
  EXPECT_EQ(first.outcome, Outcome::no_reply);
  EXPECT_FALSE(first.sent);
  EXPECT_THAT(first.reason, HasSubstr("server 127.0.0.1:" + std::to_string(port) +
                                      " can not be reached: Connection refused"));
  ScriptedServer back(io_, port);
  ASSERT_TRUE(upstream.Submit(Make({})));
  EXPECT_EQ(Wait(asked_.back()).reason, first.reason);
  RunReady(io_);
  EXPECT_EQ(back.accepted(), 0U) << "the pause is not over";
  ASSERT_TRUE(RunUntil(io_, [&] {
    if (asked_.back().calls > 0) upstream.Submit(Make({}));
    return back.accepted() == 1;
  }));
}

TEST_F(UpstreamTest, AServerThatTurnsUsAwayIsNotPestered) {
  server_.turns_away = true;
  EXPECT_EQ(Wait(Submit()).outcome, Outcome::no_reply);
  EXPECT_EQ(Wait(Submit()).outcome, Outcome::no_reply);
  EXPECT_EQ(Wait(Submit()).outcome, Outcome::no_reply);
  RunReady(io_);
  EXPECT_EQ(server_.accepted(), 1U);
}

TEST_F(UpstreamTest, AnIdleConnectionThatEndsIsMadeAnewAtOnce) {
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

TEST_F(UpstreamTest, ADeadServerIsGivenUpAfterSilentDeadlines) {
  const Asked& first = Submit();
  ASSERT_TRUE(server_.Wait(1));
  server_.Write("00 00 00 00 00 05 14 03 02 00 01");
  Wait(first);
  for (int i = 0; i < Upstream::kSilentDeadlines; ++i) {
    EXPECT_FALSE(server_.session(0).ended());
    // Several that expire together count once.
    Submit({.slave = 21, .within = 20ms});
    Submit({.slave = 22, .within = 20ms});
    const Asked& silent = Submit({.within = 20ms});
    Wait(silent);
    if (!silent.reply.sent) GTEST_SKIP() << "the machine is too slow to send within 20 ms";
    RunReady(io_);
  }
  ASSERT_TRUE(RunUntil(io_, [&] { return server_.session(0).ended(); }));
  Submit();
  EXPECT_TRUE(server_.Wait(1, 1)) << "it had answered once, so there is no pause";
}

TEST_F(UpstreamTest, ADeadlineWhileConnectingIsNotExceeded) {
  tcp::acceptor full(io_, tcp::endpoint(asio::ip::address_v4::loopback(), 0));
  full.listen(0);
  std::deque<tcp::socket> crowd;
  for (int i = 0; i < 4; ++i) {
    crowd.emplace_back(io_).async_connect(full.local_endpoint(), [](const asio::error_code&) {});
  }
  RunReady(io_);
  Upstream upstream(io_, "127.0.0.1", full.local_endpoint().port());
  upstream.Start();
  ASSERT_TRUE(upstream.Submit(Make({.within = 10ms})));
  const RoutedReply& reply = Wait(asked_.back());
  EXPECT_EQ(reply.outcome, Outcome::no_reply);
  EXPECT_FALSE(reply.sent);
  EXPECT_THAT(reply.reason, HasSubstr("connected"));
}

TEST_F(UpstreamTest, TheWireTakesSixteenAndThenThePriorityDecides) {
  FillTheWire();
  Submit({.pdu = "03 00 0A 00 01", .priority = config::Priority::low});
  Submit({.pdu = "03 00 0B 00 01"});
  Submit({.pdu = "03 00 0C 00 01", .priority = config::Priority::high});
  RunReady(io_);
  ASSERT_EQ(server_.Requests().size(), 16U);
  for (const std::string id : {"04", "05", "06"}) {
    server_.Write("00 " + id + " 00 00 00 05 14 03 02 00 01");
    ASSERT_TRUE(server_.Wait(asked_.size() - 2));
    asked_.emplace_back();
  }
  const auto requests = server_.Requests();
  EXPECT_THAT(requests[16], HasSubstr("03 00 0C"));
  EXPECT_THAT(requests[17], HasSubstr("03 00 0B"));
  EXPECT_THAT(requests[18], HasSubstr("03 00 0A"));
}

TEST_F(UpstreamTest, TheNextWriteToAUnitWaitsForTheOneBefore) {
  const Asked& start = Submit({.pdu = "06 00 08 00 02", .client = 1});
  Submit({.pdu = "06 00 08 00 00", .client = 2, .priority = config::Priority::high});
  Submit({.slave = 21, .pdu = "06 00 08 00 07", .client = 2});
  ASSERT_TRUE(server_.Wait(2));
  RunReady(io_);
  ASSERT_EQ(server_.Requests().size(), 2U);
  EXPECT_EQ(server_.Requests()[0], "00 00 00 00 00 06 14 06 00 08 00 02");
  EXPECT_EQ(server_.Requests()[1], "00 01 00 00 00 06 15 06 00 08 00 07");
  server_.Write("00 00 00 00 00 06 14 06 00 08 00 02");
  EXPECT_EQ(Wait(start).outcome, Outcome::ok);
  ASSERT_TRUE(server_.Wait(3));
  EXPECT_EQ(server_.Requests()[2], "00 02 00 00 00 06 14 06 00 08 00 00");
}

TEST_F(UpstreamTest, ABroadcastIsNotWaitedFor) {
  const Asked& all = Submit({.slave = 0, .pdu = "06 00 08 00 00"});
  const RoutedReply& reply = Wait(all);
  EXPECT_EQ(reply.outcome, Outcome::ok);
  EXPECT_TRUE(reply.pdu.empty());
  EXPECT_TRUE(reply.sent);
  ASSERT_TRUE(server_.Wait(1));
  EXPECT_EQ(server_.Requests()[0], "00 00 00 00 00 06 00 06 00 08 00 00");
  server_.Write("00 00 00 00 00 06 00 06 00 08 00 00");
  ASSERT_TRUE(RunUntil(io_, [&] { return upstream_.late_replies() == 1; }));
  const Asked& read = Submit({.slave = 0});
  ASSERT_TRUE(server_.Wait(2));
  server_.Write("00 01 00 00 00 05 00 03 02 00 01");
  EXPECT_EQ(ToHex(Wait(read).pdu), "03 02 00 01") << "unit 0 is the server itself";
}

TEST_F(UpstreamTest, IdenticalReadsThatWaitTogetherShareOneReply) {
  const Asked& first = Submit({.client = 1});
  const Asked& second = Submit({.client = 2});
  ASSERT_TRUE(server_.Wait(1));
  server_.Write("00 00 00 00 00 05 14 03 02 00 01");
  EXPECT_EQ(ToHex(Wait(first).pdu), "03 02 00 01");
  EXPECT_EQ(ToHex(Wait(second).pdu), "03 02 00 01");
  EXPECT_NE(first.reply.shared, second.reply.shared);
  EXPECT_EQ(server_.Requests().size(), 1U);
}

TEST_F(UpstreamTest, AForgottenClientIsNotSentForAndNotAnswered) {
  FillTheWire();
  const Asked& gone = Submit({.client = 7});
  RunReady(io_);
  Submit({.pdu = "03 00 01 00 01", .client = 7});
  const Asked& stays = Submit({.pdu = "03 00 02 00 01", .client = 8});
  upstream_.Forget(7);
  server_.Write("00 00 00 00 00 05 14 03 02 00 01");
  ASSERT_TRUE(server_.Wait(17));
  EXPECT_EQ(server_.Requests()[16], "00 10 00 00 00 06 14 03 00 02 00 01");
  upstream_.Forget(8);
  RunReady(io_);
  server_.Write("00 10 00 00 00 05 14 03 02 00 02 00 01 00 00 00 05 14 03 02 00 03");
  Wait(asked_[1]);
  EXPECT_EQ(gone.calls, 0);
  EXPECT_EQ(stays.calls, 0);
  EXPECT_EQ(upstream_.late_replies(), 0U) << "it was waited for";
}

TEST_F(UpstreamTest, AFullQueueSaysNoUntilThereIsRoom) {
  FillTheWire();
  for (std::size_t i = 0; i < Upstream::kMostWaiting; ++i) {
    Submit({.pdu = "06 00 01 00 01", .client = i});
    if (i % 2 == 0) RunReady(io_);
  }
  EXPECT_FALSE(upstream_.Submit(Make({})));
  EXPECT_EQ(asked_.back().calls, 0);
  RunReady(io_);
  EXPECT_FALSE(upstream_.Submit(Make({})));
  upstream_.Forget(5);
  RunReady(io_);
  EXPECT_TRUE(upstream_.Submit(Make({})));
}

TEST_F(UpstreamTest, StopAnswersEveryoneAndLetsNobodyIn) {
  const Asked& write = Submit({.pdu = "06 00 08 00 02"});
  ASSERT_TRUE(server_.Wait(1));
  const Asked& waits = Submit({.pdu = "06 00 08 00 00"});
  RunReady(io_);
  const Asked& just_in = Submit();
  upstream_.Stop();
  EXPECT_EQ(write.calls, 1);
  EXPECT_THAT(write.reply.reason, HasSubstr("stopping; the request may have been carried out"));
  EXPECT_EQ(waits.calls, 1);
  EXPECT_FALSE(waits.reply.sent);
  EXPECT_EQ(just_in.calls, 1);
  EXPECT_FALSE(upstream_.Submit(Make({})));
  ASSERT_TRUE(RunUntil(io_, [&] { return server_.session(0).ended(); }));
  EXPECT_EQ(server_.Requests().size(), 1U);
}

TEST_F(UpstreamTest, NamesAreLookedUp) {
  Upstream upstream(io_, "localhost", server_.port());
  upstream.Start();
  ASSERT_TRUE(upstream.Submit(Make({})));
  ASSERT_TRUE(server_.Wait(1));
  server_.Write("00 00 00 00 00 05 14 03 02 00 01");
  EXPECT_EQ(Wait(asked_.back()).outcome, Outcome::ok);
}

TEST_F(UpstreamTest, AnyThreadMayAsk) {
  std::vector<std::thread> threads;
  std::vector<RoutedRequest> requests;
  for (std::uint8_t i = 0; i < 16; ++i) requests.push_back(Make({.slave = i, .client = i}));
  for (RoutedRequest& request : requests) {
    threads.emplace_back([this, &request] {
      const std::uint64_t client = request.client;
      EXPECT_TRUE(upstream_.Submit(std::move(request)));
      if (client % 4 == 0) upstream_.Forget(client);
    });
  }
  ASSERT_TRUE(server_.Wait(12));
  for (std::thread& thread : threads) thread.join();
}

}  // namespace
}  // namespace baudgate::modbus
