// Those who want to harm: what they cost, and that nobody else notices.
// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>

#include <vector>

#include "tests/gateway/outputs/web/fixture.h"

namespace baudgate::web {
namespace {

using ::testing::AnyOf;

TEST_F(WebTest, AThousandHalfOpenConnectionsKeepNobodyOut) {
  Start();
  std::vector<HttpClient> silent;
  for (int i = 0; i < 1000; ++i) {
    silent.push_back(Client());
    if (i % 2 == 0) silent.back().raw().Send("GET /api/v1/status HTTP/1.1\r\nHost: 127.0.0.1\r\n");
    if (i % 100 == 0) {
      EXPECT_EQ(Get("/api/v1/status").status, 200) << i;
    }
  }
  EXPECT_EQ(Get("/api/v1/status").status, 200);
}

TEST_F(WebTest, TooManyViewersAreToldSo) {
  limits_.connections = 3;
  Start();
  std::vector<HttpClient> viewers;
  for (int i = 0; i < 3; ++i) {
    viewers.push_back(Client());
    EXPECT_EQ(viewers.back().Open("/api/v1/points/stream").status, 200);
  }
  Reply busy = Get("/api/v1/status");
  EXPECT_EQ(busy.status, 503);
  EXPECT_EQ(busy.headers["retry-after"], "5");
  viewers.pop_back();
  int status = 503;
  for (int i = 0; i < 200 && status == 503; ++i) {
    viewers.front().NextEvent();  // some tenths of a second
    status = Get("/api/v1/status").status;
  }
  EXPECT_EQ(status, 200) << "who has left is noticed by the next beat";
}

TEST_F(WebTest, AnswersThatNobodyTakesDoNotFillTheMemory) {
  config_.lines[0].devices[0].points.resize(20'000);
  for (std::size_t i = 0; i < 20'000; ++i) {
    config_.lines[0].devices[0].points[i].name = "p" + std::to_string(i);
  }
  PointStore store(config_);
  limits_.answers = 10'000'000;
  limits_.idle = 1min;  // none of them is dropped meanwhile, however slow the machine is
  auto opened = WebServer::Open(config_.web, nullptr);
  ASSERT_TRUE(opened);
  port_ = opened->socket.port();
  auto server = WebServer::Start(Running(), std::move(*opened), {store, lines_, info_}, limits_);
  ASSERT_TRUE(server);
  std::vector<HttpClient> silent;
  int busy = 0;
  for (int i = 0; i < 5; ++i) {
    silent.push_back(Client(4096));
    const int status = silent.back().Open("/api/v1/points").status;  // 4 MB each
    EXPECT_THAT(status, AnyOf(200, 503));
    busy += status == 503 ? 1 : 0;
  }
  EXPECT_EQ(busy, 3);
  silent.clear();
}

TEST_F(WebTest, FloodsOfHeadersEnd) {
  Start();
  std::string flood = "GET / HTTP/1.1\r\n" + Client().Host();
  for (int i = 0; i < 5000; ++i) flood += "X-" + std::to_string(i) + ": aaaaaaaaaaaaaaaa\r\n";
  EXPECT_THAT(Client().Send(flood + "\r\n").status, AnyOf(0, 413, 431));
  EXPECT_THAT(Client().Send("GET /" + std::string(100'000, 'a') + " HTTP/1.1\r\n\r\n").status,
              AnyOf(0, 414, 431));
  EXPECT_THAT(Get("/", "X: " + std::string(20'000, 'b') + "\r\n").status, AnyOf(0, 413, 431));
  EXPECT_EQ(Get("/").status, 200);
}

TEST_F(WebTest, ContentIsBounded) {
  Start();
  const std::string head = "POST /login HTTP/1.1\r\n" + Client().Host();
  EXPECT_EQ(Client().Post("/login", std::string(limits_.body + 1, 'a')).status, 413);
  EXPECT_THAT(Client().Send(head + "Content-Length: 99999999999999999999\r\n\r\n").status,
              AnyOf(0, 400, 413));
  EXPECT_EQ(Client().Send(head + "Transfer-Encoding: chunked\r\n\r\n1\r\na\r\n0\r\n\r\n").status,
            411);
  EXPECT_EQ(Client().Post("/login", std::string(limits_.body, 'a')).status, 204) << "no token here";
}

TEST_F(WebTest, NonsenseIsNoRequest) {
  Start();
  for (const std::string& bytes :
       {std::string("\r\n\r\n\r\n"), std::string("GET\r\n\r\n"),
        std::string(100, '\0') + "\r\n\r\n", std::string("GET / HTTP/9.9\r\n\r\n"),
        std::string("\x16\x03\x01\x02\x00\x01\x00\x01\xfc\r\n\r\n"),
        std::string("GET / HTTP/1.1\r\nHost : a\r\n\r\n")}) {
    HttpClient client = Client();
    client.raw().Send(bytes);
  }
  EXPECT_EQ(Get("/").status, 200);
}

TEST_F(WebTest, AViewerWhoReadsNothingIsDroppedAndNobodyElseNotices) {
  limits_.idle = 1s;
  config_.lines[0].devices[0].points.resize(400);
  for (std::size_t i = 0; i < 400; ++i) {
    config_.lines[0].devices[0].points[i].name = "p" + std::to_string(i);
  }
  PointStore store(config_);
  Stop();
  auto opened = WebServer::Open(config_.web, nullptr);
  ASSERT_TRUE(opened);
  port_ = opened->socket.port();
  auto server = WebServer::Start(Running(), std::move(*opened), {store, lines_, info_}, limits_);
  ASSERT_TRUE(server);
  HttpClient stalled = Client(4096);
  stalled.raw().Send("GET /api/v1/points/stream HTTP/1.1\r\n" + stalled.Host() + "\r\n");
  HttpClient good = Client();
  good.Open("/api/v1/points/stream");
  std::vector<Sample> samples(400);
  int events = 0;
  for (int round = 0; round < 15; ++round) {  // two seconds
    for (std::uint32_t i = 0; i < 400; ++i) samples[i] = {i, Value(round + 0.5), Quality::good};
    store.Update(0, samples, ReadClocks(), 20ms);
    events += good.NextEvent() ? 1 : 0;
  }
  EXPECT_EQ(events, 15);
  EXPECT_TRUE(stalled.raw().IsClosed()) << "else it would read beats for ever";
  (*server)->Stop();
}

}  // namespace
}  // namespace baudgate::web
