// Fuzzes the web server with any request.
// Input: a byte for the method; a byte for a known path, or for a text that follows. Texts, each
// behind its length byte: host, origin, cookie, authorization, body. Pairs of a byte for the name
// of a query and a text.
// SPDX-License-Identifier: Apache-2.0
#include <array>
#include <asio/io_context.hpp>
#include <nlohmann/json.hpp>

#include "gateway/outputs/web/access.h"
#include "gateway/outputs/web/api.h"
#include "gateway/outputs/web/web_server.h"
#include "tests/fuzz/fuzz.h"
#include "tests/fuzz/target.h"
#include "tests/gateway/outputs/control/fixture.h"
#include "tests/gateway/outputs/web/fakes.h"

namespace baudgate::fuzz {
namespace {

using web::AssetResponse;
using web::Logins;

constexpr std::array<const char*, 15> kWebPaths = {
    "/",           "/api/v1/status",     "/api/v1/points",  "/api/v1/points/stream",
    "/api/v1/map", "/api/v1/recorded",   "/api/v1/trace",   "/api/v1/configuration",
    "/metrics",    "/api/v1/events",     "/api/v1/history", "/api/v1/history.csv",
    "/login",      "/api/v1/alarms/ack", "/api/v1/alarms"};
constexpr std::array<const char*, 10> kWebQueries = {
    "target", "device", "line", "q", "after", "point", "pixels", "since_ms", "until_ms", "x"};
constexpr Instant kWebStart{1h};

std::string CountedText(Input& input) {
  const View bytes = input.TakeCounted();
  return {bytes.begin(), bytes.end()};
}

web::Request AnyRequest(Input& input) {
  web::Request request;
  request.method = input.U8() % 2 == 0 ? "GET" : "POST";
  const std::size_t path = input.U8();
  request.path = path < kWebPaths.size() ? kWebPaths[path] : CountedText(input);
  request.peer = "127.0.0.1";
  request.local = "127.0.0.1";
  for (const char* header : {"host", "origin", "cookie", "authorization"}) {
    const std::string value = CountedText(input);
    if (!value.empty()) request.headers[header] = value;
  }
  request.body = CountedText(input);
  while (!input.empty()) {
    const char* const name = kWebQueries[input.Below(kWebQueries.size())];
    request.query.emplace(name, CountedText(input));
  }
  return request;
}

struct WebWorld {
  WebWorld() : live(config, {store, lines, Info()}, io), past(config, store, lines, Info(), io) {
    config.web.on = true;
    config.web.hosts = {"gate"};
    logins.SetToken("0123456789abcdef");
  }
  status::GatewayInfo Info() {
    status::GatewayInfo info{"1.2.3", kWebStart};
    info.events = &events;
    info.history = history;
    return info;
  }

  config::Config config = status::TwoLines();
  bus::PointStore store{config};
  control::FakeLines lines{store};
  web::FakeEvents events;
  std::shared_ptr<web::FakeHistory> history = std::make_shared<web::FakeHistory>();
  asio::io_context io;
  Logins logins{8502};
  web::LiveApi live;
  web::PastApi past;
};

void CheckWebAnswer(const web::Response& response) {
  Require(response.status >= 200 && response.status < 600, "an answer has a status");
  if (response.stream) {
    std::array<char, 512> part{};
    response.stream->SetWake([] {});
    for (int i = 0; i < 50 && response.stream->Read(part) > 0; ++i) {
    }
    return;
  }
  Require(response.body.size() < 1'000'000, "an answer is bounded");
  if (response.type != web::kJson && response.type != "application/problem+json") return;
  Require(nlohmann::json::accept(response.body), "an answer is JSON");
  if (response.status >= 400) {
    Require(response.type == "application/problem+json", "a refusal has words");
  }
}

void FuzzWebRequest(View bytes) {
  static WebWorld world;
  Input input(bytes);
  const web::Request request = AnyRequest(input);
  const auto refused = web::Refusal(world.config.web, request);
  if (refused) CheckWebAnswer(*refused);
  const Now now{kWebStart, WallTime(std::chrono::seconds(1'790'000'000))};
  if (world.logins.Check(request, now).verdict == Logins::Verdict::yes) {
    Require(
        request.Header("authorization").value_or("").find("0123456789abcdef") != std::string::npos,
        "only who has the token is in");
  }
  if (const auto asset = AssetResponse(request)) CheckWebAnswer(*asset);
  int answers = 0;
  const auto answered = [&answers](const web::Response& response) {
    ++answers;
    CheckWebAnswer(response);
  };
  if (request.path == "/api/v1/alarms/ack") {
    world.live.Acknowledge(request, answered);
  } else if (!world.live.Answer(request, now, answered) &&
             !world.past.Answer(request, now, answered)) {
    return;
  }
  Require(answers == 1, "a request is answered once");
  Require(world.lines.calls().empty(), "no line is asked for anything");
}

const Registered kWebRequest("web_request", FuzzWebRequest);

}  // namespace
}  // namespace baudgate::fuzz
