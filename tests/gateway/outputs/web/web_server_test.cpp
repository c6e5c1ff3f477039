// Tests of the web server over HTTP: its answers, also to hostile clients.
// SPDX-License-Identifier: Apache-2.0
#include "gateway/outputs/web/web_server.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <regex>
#include <semaphore>
#include <vector>

#include "gateway/outputs/web/http_server.h"
#include "tests/gateway/outputs/web/fixture.h"

namespace baudgate::web {
namespace {

using status::Json;
using ::testing::HasSubstr;
using ::testing::StartsWith;

TEST_F(WebTest, EveryAnswerHasItsHeaders) {
  Start();
  for (const char* path : {"/", "/api/v1/status", "/metrics", "/nothing"}) {
    Reply reply = Get(path);
    EXPECT_THAT(reply.headers["content-security-policy"], StartsWith("default-src 'self';"))
        << path;
    EXPECT_EQ(reply.headers["content-security-policy"].find("unsafe"), std::string::npos);
    EXPECT_EQ(reply.headers["x-content-type-options"], "nosniff") << path;
    EXPECT_FALSE(reply.headers.contains("access-control-allow-origin")) << path;
  }
}

TEST_F(WebTest, ThePageIsCompressedAndCached) {
  Start();
  Reply plain = Get("/");
  EXPECT_EQ(plain.status, 200);
  EXPECT_EQ(plain.headers["content-type"], "text/html; charset=utf-8");
  EXPECT_THAT(plain.body, HasSubstr("<html"));
  Reply packed = Get("/", "Accept-Encoding: gzip, br\r\n");
  EXPECT_EQ(packed.headers["content-encoding"], "gzip");
  EXPECT_EQ(packed.body.substr(0, 2), "\x1f\x8b");
  EXPECT_EQ(Get("/", "If-None-Match: " + packed.headers["etag"] + "\r\n").status, 304);
  EXPECT_EQ(Get("/js/plot.js").headers["content-type"], "text/javascript; charset=utf-8");
}

TEST_F(WebTest, PathsLeadToNoOtherFiles) {
  Start();
  const struct {
    const char* path;
    int status;
  } kPaths[] = {{"/../../etc/passwd", 404},    {"/%2e%2e/%2e%2e/etc/passwd", 404},
                {"//api/v1/status", 404},      {"/api/v1/status/", 404},
                {"/api/v1/status%00.js", 404}, {"/API/v1/status", 404},
                {"/api/v1/%73tatus", 200},     {"/api/v1/../v1/status", 404},
                {"/index.html/", 404},         {"/page/index.html", 404},
                {"/api/v2/status", 404},       {"/api/v1/", 404}};
  for (const auto& [path, status] : kPaths) {
    const Reply reply = Get(path);
    EXPECT_EQ(reply.status, status) << path << " " << reply.body;
  }
}

TEST_F(WebTest, AnswersMatchTheControlSocket) {
  Start();
  const Json status = Json::parse(Get("/api/v1/status").body);
  EXPECT_EQ(status["gateway"], "substation-7");
  EXPECT_EQ(status["lines"].size(), 2U);
  const Json one = Json::parse(Get("/api/v1/status?target=bay-1.feeder-1").body);
  EXPECT_EQ(one["lines"][0]["devices"][0]["values"].size(), 2U);
  const struct {
    const char* path;
    int status;
    const char* says;
  } kRefused[] = {
      {"/api/v1/status?target=bay1", 404, "did you mean 'bay-1'?"},
      {"/api/v1/status?targt=bay-1", 400, "did you mean 'target'?"},
      {"/api/v1/alarms?after=x", 400, "'after' must be a whole number"},
      {"/api/v1/events", 503, "this gateway records no events"},
      {"/api/v1/alarms", 503, "this gateway records no events"},
      {"/api/v1/history?point=bay-1.feeder-1.current", 503, "records no history"},
      {"/api/v1/history?point=a.b.c&since_ms=5&until_ms=5", 400, "'since_ms' must be before"},
      {"/api/v1/history?pixels=0", 400, "'pixels' must be a number from 1"},
      {"/api/v1/history.csv?point=bay-1.feeder-1.current", 503, "records no history"},
      {"/api/v1/points?device=bay-1.feeder9", 404, "feeder9"},
      {"/api/v1/points/stream?device=bay-1", 404, "name one device"},
      {"/api/v1/map?device=x", 404, "there is no line 'x'"},
      {"/api/v1/trace?line=x", 404, "there is no line 'x'"},
      {"/api/v1/recorded", 404, "name a line; lines: bay-1"},
      {"/api/v1/map", 404, "name one device"},
  };
  for (const auto& [path, code, says] : kRefused) {
    Reply reply = Get(path);
    EXPECT_EQ(reply.status, code) << path << " " << reply.body;
    EXPECT_EQ(reply.headers["content-type"], "application/problem+json") << path;
    EXPECT_THAT(Json::parse(reply.body, nullptr, false).value("detail", ""), HasSubstr(says))
        << path;
  }
  EXPECT_THAT(lines_.calls(), ::testing::IsEmpty()) << "no line was asked for anything";
}

TEST_F(WebTest, PointsAreFiltered) {
  config_.lines[1].devices[0].points[1].description = "Mains voltage";
  Start();
  const struct {
    const char* query;
    std::size_t points;
  } kQueries[] = {
      {"", 6},         {"?line=bay-1", 4}, {"?device=io.ai-1", 2},    {"?q=FEEDER-2", 2},
      {"?q=mains", 1}, {"?q=nothing", 0},  {"?q=.current&line=io", 1}};
  for (const auto& [query, points] : kQueries) {
    const Json json = Json::parse(Get(std::string("/api/v1/points") + query).body);
    EXPECT_EQ(json["points"].size(), points) << query;
  }
}

TEST_F(WebTest, OnlyClientsWithTheTokenAreAnswered) {
  Start(kToken);
  for (const char* path : {"/api/v1/status", "/api/v1/points/stream", "/metrics", "/api/v1/x"}) {
    EXPECT_EQ(Get(path).status, 401) << path;
  }
  EXPECT_EQ(Get("/").status, 200) << "the page has the form";
  EXPECT_EQ(Get("/metrics", std::string("Authorization: Bearer ") + kToken + "\r\n").status, 200);
  const Json before = Json::parse(Get("/api/v1/session").body);
  EXPECT_TRUE(before["needs_token"]);
  EXPECT_FALSE(before["logged_in"]);
  for (const std::string& body :
       {std::string("token=") + kToken, std::string("{\"token\":\"") + kToken + "\"}"}) {
    Reply login = Client().Post("/login", body);
    ASSERT_EQ(login.status, 204);
    const std::string cookie = login.headers["set-cookie"];
    const std::string shown = "Cookie: " + cookie.substr(0, cookie.find(';')) + "\r\n";
    EXPECT_EQ(Get("/api/v1/status", shown).status, 200);
    EXPECT_EQ(Client().Post("/logout", "", shown).status, 204);
    EXPECT_EQ(Get("/api/v1/status", shown).status, 401);
  }
  for (int i = 0; i < 5; ++i) EXPECT_EQ(Client().Post("/login", "token=wrong").status, 401);
  Reply wait = Client().Post("/login", "token=wrong");
  EXPECT_EQ(wait.status, 429);
  EXPECT_EQ(wait.headers["retry-after"], "60");
  EXPECT_EQ(Client().Post("/login", std::string("token=") + kToken).status, 204);
}

TEST_F(WebTest, ChangingRequestsMustBePosted) {
  Start();
  EXPECT_EQ(Get("/login").status, 405);
  EXPECT_EQ(Get("/api/v1/alarms/ack?target=bay-1").status, 405);
  EXPECT_EQ(Client().Post("/api/v1/status", "").status, 405);
  EXPECT_EQ(Client().Send("DELETE /api/v1/status HTTP/1.1\r\n" + Client().Host() + "\r\n").status,
            405);
  EXPECT_EQ(Client().Post("/api/v1/alarms/ack", "{\"target\":\"bay-1\"}").status, 403);
}

TEST_F(WebTest, ForeignHostsAndPagesAreRefused) {
  Start();
  const std::string host = "\r\nHost: ";
  EXPECT_EQ(Client().Send("GET / HTTP/1.1" + host + "evil.example\r\n\r\n").status, 421);
  EXPECT_EQ(Client().Send("GET / HTTP/1.1" + host + "localhost:1\r\n\r\n").status, 200);
  EXPECT_EQ(Client().Send("GET / HTTP/1.1\r\n\r\n").status, 400) << "HTTP/1.1 needs one";
  EXPECT_EQ(Get("/api/v1/status", "Origin: http://evil.example\r\n").status, 403);
  EXPECT_EQ(Get("/api/v1/status", "Sec-Fetch-Site: same-site\r\n").status, 403);
  EXPECT_EQ(Get("/", "Host: evil.example\r\n").status, 421) << "two of them";
}

TEST_F(WebTest, AStreamBeginsWithASnapshotAndSendsBeats) {
  Put(0, 0, 1.25);
  Start();
  HttpClient client = Client();
  Reply head = client.Open("/api/v1/points/stream");
  EXPECT_EQ(head.headers["content-type"], "text/event-stream");
  EXPECT_EQ(head.headers["x-accel-buffering"], "no");
  EXPECT_THAT(client.NextEvent().value_or(""), HasSubstr("event: snapshot\ndata: {"));
  EXPECT_THAT(client.NextEvent().value_or(""), HasSubstr("event: alarms\ndata: {\"active\":0"));
  EXPECT_THAT(client.NextEvent().value_or(""), HasSubstr("event: beat"));
  Put(2, 1, 7.5);
  std::string event = client.NextEvent().value_or("");
  while (event.starts_with("event: beat")) event = client.NextEvent().value_or("");
  EXPECT_THAT(event, HasSubstr("[5,7.5,192,\"good\","));
  EXPECT_THAT(client.NextEvent().value_or(""), HasSubstr("event: beat"));
}

TEST_F(WebTest, AReloadEndsPointStreamsAndStopEndsAllStreams) {
  Start();
  HttpClient one = Client();
  one.Open("/api/v1/points/stream");
  server_->ApplyHistory(Running(), nullptr);
  std::string last;
  while (auto event = one.NextEvent()) last = *event;
  EXPECT_EQ(last, "event: reload\ndata: {}");
  HttpClient two = Client();
  two.Open("/api/v1/points/stream");
  HttpClient trace = Client();
  trace.Open("/api/v1/trace?line=bay-1");
  Stop();
  EXPECT_TRUE(two.raw().IsClosed());
  EXPECT_TRUE(trace.raw().IsClosed());
}

TEST_F(WebTest, ATraceIsStreamed) {
  Start();
  HttpClient client = Client();
  client.Open("/api/v1/trace?line=bay-1");
  ASSERT_TRUE(lines_.WaitForTraces(0, 1));
  records::TraceRecord record;
  record.device = "feeder-1";
  record.text = "offline: \"no_reply\"";
  EXPECT_TRUE(lines_.Push(0, record));
  std::string event = client.NextEvent().value_or("");
  while (event.starts_with("event: beat")) event = client.NextEvent().value_or("");
  EXPECT_THAT(event, StartsWith("event: record\ndata: {\"record\":\"00:00:00.000000 feeder-1 # "
                                "offline: \\\"no_reply\\\"\"}"));
  client.raw().Close();
  EXPECT_TRUE(lines_.WaitForTraces(0, 0)) << "who has left is noticed by the next beat";
}

struct HangingHistory final : history::HistorySource {
  history::HistoryState state() const override { return {}; }
  Result<history::Page> Read(const history::PageQuery&) const override {
    reading.release();
    goes_on.acquire();
    return history::Page{.known = true};
  }
  Result<history::TrendPage> ReadTrends(const history::TrendQuery&) const override {
    return Error{};
  }

  mutable std::counting_semaphore<> reading{0};
  mutable std::counting_semaphore<> goes_on{0};
};

TEST_F(WebTest, AReloadDoesNotWaitForAHistoryPage) {
  auto hanging = std::make_shared<HangingHistory>();
  info_.history = hanging;
  Start();
  info_.history.reset();
  HttpClient client = Client();
  client.raw().Send("GET /api/v1/history.csv?point=bay-1.feeder-1.current HTTP/1.1\r\n" +
                    client.Host() + "\r\n");
  hanging->reading.acquire();
  server_->ApplyHistory(Running(), nullptr);
  EXPECT_EQ(Get("/api/v1/status").status, 200);
  hanging->goes_on.release();
  EXPECT_EQ(client.Receive().status, 200);
  EXPECT_NE(Get("/api/v1/history.csv?point=bay-1.feeder-1.current").status, 200);
}

TEST_F(WebTest, AReloadAppliesTokenHostsAndPort) {
  Start();
  const auto next = std::make_shared<config::Config>(config_);
  next->web.hosts = {"gate.example"};
  WebServer::Opened opened;
  opened.token = kToken;
  ASSERT_TRUE(server_->Apply(next, std::move(opened), nullptr));
  EXPECT_EQ(Get("/api/v1/status").status, 401);
  EXPECT_EQ(Client().Send("GET / HTTP/1.1\r\nHost: gate.example\r\n\r\n").status, 200);
  auto moved = WebServer::ListenAt(next->web.listen);
  ASSERT_TRUE(moved);
  const std::uint16_t before = std::exchange(port_, moved->port());
  WebServer::Opened elsewhere;
  elsewhere.socket = std::move(*moved);
  ASSERT_TRUE(server_->Apply(next, std::move(elsewhere), nullptr));
  EXPECT_EQ(Get("/api/v1/status").status, 200);
  EXPECT_FALSE(HttpClient(before).raw().connected());
}

/// A proxy can serve the page below a path of its own, where "/js/main.js" does not exist.
TEST(Assets, NoFileOfThePageContainsAnAbsolutePath) {
  const std::regex from_root(R"re([`'"(]/[a-z][^`'")]*)re");
  int read = 0;
  for (const PackedFile& file : PackedFiles()) {
    const std::string path(file.path);
    if (path.ends_with(".svg")) continue;
    Request request;
    request.path = path;
    const auto response = AssetResponse(request);
    ASSERT_TRUE(response) << path;
    const std::string body(response->body);
    std::smatch found;
    EXPECT_FALSE(std::regex_search(body, found, from_root)) << path << ": " << found.str();
    ++read;
  }
  EXPECT_GT(read, 30);
}

using ::testing::ElementsAre;
using ::testing::IsEmpty;

constexpr Instant kStart{1h};

TEST(LimitsTest, FewDescriptorsAllowFewConnections) {
  const Limits all;
  EXPECT_EQ(Limits::Of(1000).at_all, all.at_all);
  EXPECT_EQ(Limits::Of(1000).connections, all.connections);
  EXPECT_EQ(Limits::Of(20).at_all, 20U);
  EXPECT_EQ(Limits::Of(20).connections, 16U);
  EXPECT_EQ(Limits::Of(20).of_host, 16U);
  EXPECT_GE(Limits::Of(0).connections, 1U);
}

TEST(Connections, TheLongestIdleConnectionIsClosedForANewOne) {
  Connections all({.at_all = 3});
  EXPECT_EQ(all.Open(1, "10.0.0.1", kStart), std::nullopt);
  EXPECT_EQ(all.Open(2, "10.0.0.2", kStart + 1s), std::nullopt);
  EXPECT_EQ(all.Open(3, "10.0.0.3", kStart + 2s), std::nullopt);
  EXPECT_TRUE(all.Begin(1, "10.0.0.1", kStart));
  EXPECT_EQ(all.Open(4, "10.0.0.4", kStart + 3s), 2) << "1 is answered";
  all.Close(2);
  all.End(1, kStart + 4s);
  EXPECT_EQ(all.Open(5, "10.0.0.5", kStart + 5s), 3);
}

TEST(Connections, ARequestMustArriveWithinTenSeconds) {
  Connections all({});
  all.Open(1, "10.0.0.1", kStart);
  all.Open(2, "10.0.0.2", kStart);
  all.Begin(2, "10.0.0.2", kStart);
  EXPECT_THAT(all.Overdue(kStart + 9s), IsEmpty());
  EXPECT_THAT(all.Overdue(kStart + 10s), ElementsAre(1));
  all.End(2, kStart + 15s);
  EXPECT_THAT(all.Overdue(kStart + 24s), ElementsAre(1));
  EXPECT_THAT(all.Overdue(kStart + 25s), ElementsAre(1, 2));
}

TEST(Connections, AnAnswerMustBeReadWithinAMinuteAndAStreamNever) {
  Connections all({});
  all.Open(1, "10.0.0.1", kStart);
  all.Open(2, "10.0.0.1", kStart);
  all.Begin(1, "10.0.0.1", kStart);
  all.Begin(2, "10.0.0.1", kStart);
  all.Stream(2);
  EXPECT_THAT(all.Overdue(kStart + 59s), IsEmpty());
  EXPECT_THAT(all.Overdue(kStart + 60s), ElementsAre(1));
}

TEST(Connections, TheNumberOfAnswersAtOnceIsLimited) {
  Connections all({.connections = 4, .of_host = 2});
  for (Connections::Id id = 1; id <= 7; ++id) {
    all.Open(id, id <= 3 ? "10.0.0.1" : "127.0.0.1", kStart);
  }
  EXPECT_TRUE(all.Begin(1, "10.0.0.1", kStart));
  EXPECT_TRUE(all.Begin(2, "10.0.0.1", kStart));
  EXPECT_FALSE(all.Begin(3, "10.0.0.1", kStart)) << "the third of one host";
  all.Close(3);
  EXPECT_TRUE(all.Begin(4, "127.0.0.1", kStart));
  EXPECT_TRUE(all.Begin(5, "127.0.0.1", kStart));
  EXPECT_FALSE(all.Begin(6, "127.0.0.1", kStart)) << "the fifth in all";
  all.Close(6);
  all.End(4, kStart);
  EXPECT_TRUE(all.Begin(7, "127.0.0.1", kStart)) << "this machine has no other limit";
}

TEST(Connections, TheHostWithTheMostConnectionsLosesOneFirst) {
  Connections all({.at_all = 3});
  all.Open(1, "10.0.0.1", kStart);
  all.Open(2, "10.0.0.9", kStart + 1s);
  all.Open(3, "10.0.0.9", kStart + 2s);
  all.Receive(2, kStart + 3s);
  EXPECT_EQ(all.Open(4, "10.0.0.2", kStart + 4s), 3) << "2 has begun its request later";
}

TEST(Connections, ABodyMustArriveWithinTenSecondsOfItsHeaderAndTakesNoPlaceOfAnAnswer) {
  Connections all({.connections = 1});
  all.Open(1, "10.0.0.1", kStart);
  all.Open(2, "10.0.0.2", kStart);
  all.Receive(1, kStart + 5s);
  EXPECT_TRUE(all.Begin(2, "10.0.0.2", kStart + 6s));
  EXPECT_THAT(all.Overdue(kStart + 14s), IsEmpty());
  EXPECT_THAT(all.Overdue(kStart + 15s), ElementsAre(1));
}

using ::testing::AnyOf;

TEST_F(WebTest, AThousandHalfOpenConnectionsBlockNoClient) {
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

TEST_F(WebTest, TooManyViewersAreRefused) {
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
    viewers.front().NextEvent();
    status = Get("/api/v1/status").status;
  }
  EXPECT_EQ(status, 200) << "who has left is noticed by the next beat";
}

TEST_F(WebTest, UnreadAnswersAreLimitedInMemory) {
  config_.lines[0].devices[0].points.resize(20'000);
  for (std::size_t i = 0; i < 20'000; ++i) {
    config_.lines[0].devices[0].points[i].name = "p" + std::to_string(i);
  }
  bus::PointStore store(config_);
  limits_.answers = 10'000'000;
  limits_.idle = 1min;  // so that no client is dropped for silence on a slow machine
  auto opened = WebServer::Open(config_.web, nullptr);
  ASSERT_TRUE(opened);
  port_ = opened->socket.port();
  auto server = WebServer::Start(Running(), std::move(*opened), {store, lines_, info_}, limits_);
  ASSERT_TRUE(server);
  std::vector<HttpClient> silent;
  int busy = 0;
  for (int i = 0; i < 5; ++i) {
    silent.push_back(Client(4096));
    const int status = silent.back().Open("/api/v1/points").status;
    EXPECT_THAT(status, AnyOf(200, 503));
    busy += status == 503 ? 1 : 0;
  }
  EXPECT_EQ(busy, 3);
  silent.clear();
}

TEST_F(WebTest, ExcessiveHeadersAreRefused) {
  Start();
  std::string flood = "GET / HTTP/1.1\r\n" + Client().Host();
  for (int i = 0; i < 5000; ++i) flood += "X-" + std::to_string(i) + ": aaaaaaaaaaaaaaaa\r\n";
  EXPECT_THAT(Client().Send(flood + "\r\n").status, AnyOf(0, 413, 431));
  EXPECT_THAT(Client().Send("GET /" + std::string(100'000, 'a') + " HTTP/1.1\r\n\r\n").status,
              AnyOf(0, 414, 431));
  EXPECT_THAT(Get("/", "X: " + std::string(20'000, 'b') + "\r\n").status, AnyOf(0, 413, 431));
  EXPECT_EQ(Get("/").status, 200);
}

TEST_F(WebTest, TheRequestBodyIsLimited) {
  Start();
  const std::string head = "POST /login HTTP/1.1\r\n" + Client().Host();
  EXPECT_EQ(Client().Post("/login", std::string(limits_.body + 1, 'a')).status, 413);
  EXPECT_THAT(Client().Send(head + "Content-Length: 99999999999999999999\r\n\r\n").status,
              AnyOf(0, 400, 413));
  EXPECT_EQ(Client().Send(head + "Transfer-Encoding: chunked\r\n\r\n1\r\na\r\n0\r\n\r\n").status,
            411);
  EXPECT_EQ(Client().Post("/login", std::string(limits_.body, 'a')).status, 204) << "no token here";
}

TEST_F(WebTest, MalformedRequestsAreHarmless) {
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

TEST_F(WebTest, AViewerThatReadsNothingIsDroppedWithoutEffectOnOthers) {
  limits_.idle = 1s;
  config_.lines[0].devices[0].points.resize(400);
  for (std::size_t i = 0; i < 400; ++i) {
    config_.lines[0].devices[0].points[i].name = "p" + std::to_string(i);
  }
  bus::PointStore store(config_);
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
  std::vector<bus::Sample> samples(400);
  int events = 0;
  for (int round = 0; round < 15; ++round) {
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
