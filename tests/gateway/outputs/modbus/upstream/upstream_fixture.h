// A scripted Modbus TCP server on loopback, and an upstream that connects to it.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <gtest/gtest.h>

#include <asio/ip/tcp.hpp>
#include <deque>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "gateway/base/text.h"
#include "gateway/outputs/modbus/upstream/requests_on_wire.h"
#include "gateway/outputs/modbus/upstream/upstream.h"
#include "tests/transports/far_end.h"

namespace baudgate::modbus {

class ScriptedServer {
 public:
  explicit ScriptedServer(asio::io_context& io, std::uint16_t port = 0)
      : io_(io), acceptor_(io, asio::ip::tcp::endpoint(asio::ip::address_v4::loopback(), port)) {
    Accept();
  }

  std::uint16_t port() const { return acceptor_.local_endpoint().port(); }
  std::size_t accepted() const { return sessions_.size(); }
  test::FarEnd<asio::ip::tcp::socket>& session(std::size_t number) { return sessions_.at(number); }

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
    return test::RunUntil(io_, [&] { return Requests(session).size() >= count; });
  }
  void Write(const std::string& hex, std::size_t session = 0) {
    sessions_.at(session).Write(ParseHex(hex).value());
  }
  void Close(std::size_t session = 0) {
    sessions_.at(session).stream().shutdown(asio::ip::tcp::socket::shutdown_send);
  }
  bool turns_away = false;

 private:
  void Accept() {
    acceptor_.async_accept([this](const asio::error_code& error, asio::ip::tcp::socket socket) {
      if (error) return;
      socket.set_option(asio::ip::tcp::no_delay(true));
      sessions_.emplace_back(std::move(socket));
      if (turns_away) Close(sessions_.size() - 1);
      sessions_.back().Start();
      Accept();
    });
  }

  asio::io_context& io_;
  asio::ip::tcp::acceptor acceptor_;
  std::deque<test::FarEnd<asio::ip::tcp::socket>> sessions_;
};

struct Asked {
  int calls = 0;
  bus::RoutedReply reply;
};

struct Question {
  std::uint8_t slave = 20;
  std::string pdu = "03 00 C8 00 01";
  std::uint64_t client = 1;
  std::uint64_t host = 1;
  config::Priority priority = config::Priority::normal;
  Duration within = 1h;
  bool broadcast = false;
};

class UpstreamTest : public testing::Test {
 protected:
  UpstreamTest() { upstream_.Start(); }

  Instant Clock() const { return std::chrono::steady_clock::now() + ahead_; }
  bus::RoutedRequest Make(const Question& ask) {
    Asked& asked = asked_.emplace_back();
    bus::RoutedRequest request;
    request.client = ask.client;
    request.host = ask.host;
    request.slave = ask.slave;
    request.pdu = ParseHex(ask.pdu).value();
    request.priority = ask.priority;
    request.broadcast = ask.broadcast;
    request.arrived = Clock();
    request.deadline = request.arrived + ask.within;
    request.done = [&asked](bus::RoutedReply reply) {
      ++asked.calls;
      asked.reply = std::move(reply);
    };
    return request;
  }
  Asked& Submit(const Question& ask = {}) {
    EXPECT_TRUE(upstream_.Submit(Make(ask)));
    return asked_.back();
  }
  const bus::RoutedReply& Wait(const Asked& asked) {
    EXPECT_TRUE(test::RunUntil(io_, [&] { return asked.calls > 0; }));
    EXPECT_EQ(asked.calls, 1);
    return asked.reply;
  }
  static constexpr std::size_t kReadsOnWire =
      RequestsOnWire::kMost - RequestsOnWire::kKeptForWrites;

  /// Sends a request that is not answered in time. It gets more time if it expires before it is
  /// sent.
  const Asked& SendInVain(std::uint8_t slave = 20) {
    const Asked* asked = nullptr;
    for (Duration within = 5ms; asked == nullptr || !asked->reply.sent; within *= 4) {
      if (within > 10s) throw std::runtime_error("nothing was ever sent");
      asked = &Submit({.slave = slave, .within = within});
      EXPECT_EQ(Wait(*asked).outcome, Outcome::no_reply);
    }
    return *asked;
  }
  void FillTheWire() {
    for (std::size_t i = 0; i < kReadsOnWire; ++i) {
      Submit({.slave = static_cast<std::uint8_t>(20 + i / RequestsOnWire::kMostPerUnit),
              .pdu = "03 01 " + HexByte(static_cast<std::uint8_t>(i)) + " 00 01"});
    }
    ASSERT_TRUE(server_.Wait(kReadsOnWire));
  }

  asio::io_context io_;
  ScriptedServer server_{io_};
  std::deque<Asked> asked_;
  std::vector<std::uint8_t> late_;
  Duration ahead_{};
  Upstream upstream_{io_,
                     "127.0.0.1",
                     server_.port(),
                     {},
                     [this](std::uint8_t unit) { late_.push_back(unit); },
                     [this] { return Clock(); }};
};

}  // namespace baudgate::modbus
