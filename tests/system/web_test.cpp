// Tests the page, the JSON and the metrics of a gateway with simulated devices over HTTP.
// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>

#include <asio/ip/address_v4.hpp>
#include <fstream>
#include <utility>

#include "tests/gateway/outputs/web/http_client.h"
#include "tests/system/reload_fixture.h"
#include "transports/listen_socket.h"

namespace baudgate::system_test {
namespace {

using ::testing::HasSubstr;
using web::HttpClient;

class Web : public Reload {
 protected:
  std::string WithWeb(const std::string& more = "") const {
    return YamlWithSocket() + "web: { listen: \"127.0.0.1:" + std::to_string(web_) + "\"" + more +
           " }\n";
  }
  Json Get(const std::string& path) const {
    return Json::parse(HttpClient(web_).Get(path).body, nullptr, false);
  }

  std::uint16_t web_ = FreePort();
};

TEST_F(Web, ShowsTheValuesOfTheLines) {
  StartAll(WithWeb());
  const Json points = Get("/api/v1/points?device=io.io-1");
  EXPECT_GT(points["points"].size(), 0U);
  EXPECT_EQ(points["points"][0]["quality_text"], "good");
  Json status = Get("/api/v1/status");
  const Json same = Status();
  EXPECT_EQ(status["lines"].size(), same["lines"].size());
  const std::string metrics = HttpClient(web_).Get("/metrics").body;
  EXPECT_THAT(metrics, HasSubstr("baudgate_line_up{line=\"io\"} 1"));
  EXPECT_THAT(metrics, HasSubstr("baudgate_line_busy_seconds_total{line=\"io\",why=\"poll\"} 0."));
  EXPECT_THAT(Get("/api/v1/configuration")["text"].get<std::string>(), HasSubstr("web:"));
  HttpClient stream(web_);
  EXPECT_EQ(stream.Open("/api/v1/points/stream").status, 200);
  std::string event = stream.NextEvent().value_or("");
  while (!event.empty() && !event.starts_with("event: change")) {
    event = stream.NextEvent().value_or("");
  }
  EXPECT_THAT(event, HasSubstr("\"good\""));
}

TEST_F(Web, FramesAreShownWithTheirMeaning) {
  StartAll(WithWeb());
  const Json points = Get("/api/v1/points?device=io.io-1");
  const auto name = points["points"][0]["point"].get<std::string>();
  const std::string meaning = " | " + name + " ";
  const Json recorded = Get("/api/v1/recorded?line=io&device=io-1");
  EXPECT_THAT(recorded["records"].dump(), HasSubstr(meaning));
  HttpClient stream(web_);
  EXPECT_EQ(stream.Open("/api/v1/trace?line=io").status, 200);
  std::string event = stream.NextEvent().value_or("");
  while (!event.empty() && event.find(meaning) == std::string::npos) {
    event = stream.NextEvent().value_or("");
  }
  EXPECT_THAT(event, HasSubstr("event: record"));
}

TEST_F(Web, IsStartedMovedAndStoppedByAReload) {
  StartAll(YamlWithSocket());
  EXPECT_FALSE(HttpClient(web_).raw().connected());
  SetFile(WithWeb());
  EXPECT_THAT(Ask({"reload"}).output, HasSubstr("web: changed\n"));
  EXPECT_EQ(HttpClient(web_).Get("/api/v1/status").status, 200);
  HttpClient stream(web_);
  stream.Open("/api/v1/points/stream");

  const std::string token = (directory() / "token").string();
  std::ofstream(token) << "0123456789abcdef\n";
  std::filesystem::permissions(token, std::filesystem::perms::owner_read);
  const std::uint16_t before = std::exchange(web_, FreePort());
  SetFile(WithWeb(", token: { file: " + token + " }"));
  EXPECT_EQ(Ask({"reload"}).code, 0);
  bool told = false;
  while (auto event = stream.NextEvent()) told = told || *event == "event: reload\ndata: {}";
  EXPECT_TRUE(told);
  EXPECT_FALSE(HttpClient(before).raw().connected());
  EXPECT_EQ(HttpClient(web_).Get("/api/v1/status").status, 401);

  std::filesystem::permissions(token, std::filesystem::perms::others_read);
  const Finished open = Ask({"reload"});
  EXPECT_EQ(open.code, 4);
  EXPECT_THAT(open.errors + open.output, HasSubstr("chmod 0600"));
  EXPECT_EQ(HttpClient(web_).Get("/api/v1/status").status, 401) << "as before";

  std::filesystem::remove(token);
  std::ofstream(token) << "another-token-in-it\n";
  std::filesystem::permissions(token, std::filesystem::perms::owner_read);
  EXPECT_THAT(Ask({"reload"}).output, HasSubstr("the token in " + token + ": changed\n"));
  EXPECT_EQ(HttpClient(web_)
                .Get("/api/v1/status", "Authorization: Bearer another-token-in-it\r\n")
                .status,
            200);

  SetFile(YamlWithSocket());
  EXPECT_EQ(Ask({"reload"}).code, 0);
  EXPECT_FALSE(HttpClient(web_).raw().connected());
}

TEST_F(Web, AnOccupiedPortIsReportedAtTheStart) {
  const auto other = transports::ListenSocket::Open({asio::ip::address_v4::loopback(), 0}, "");
  ASSERT_TRUE(other) << other.error();
  web_ = other->port();
  Write("baudgate.yaml", WithWeb());
  const Finished run = Command({"run", "--config", file().string()});
  EXPECT_EQ(run.code, 4);
  EXPECT_THAT(run.errors, HasSubstr("choose another port in web.listen"));
}

}  // namespace
}  // namespace baudgate::system_test
