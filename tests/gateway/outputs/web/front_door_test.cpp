// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "gateway/outputs/web/access.h"

namespace baudgate::web {
namespace {

config::Web WebOf(const std::string& allow = "") {
  config::Web web;
  web.hosts = {"gate.example", "proxy.example:8443"};
  if (!allow.empty()) web.allow.push_back(*config::ParseNetwork(allow));
  return web;
}

Request Asked(const std::map<std::string, std::string>& headers,
              const std::string& peer = "127.0.0.1", const std::string& path = "/api/v1/status") {
  Request request;
  request.method = "GET";
  request.path = path;
  request.headers = headers;
  request.peer = peer;
  request.local = peer == "127.0.0.1" ? peer : "10.0.0.9";
  return request;
}

int StatusOf(const config::Web& web, const Request& request) {
  const auto refused = Refusal(web, request);
  return refused ? refused->status : 200;
}

TEST(FrontDoor, KnowsTheNamesOfTheGateway) {
  const struct {
    std::string host;
    std::string peer;
    int status;
  } kHosts[] = {
      {"127.0.0.1:8502", "127.0.0.1", 200},
      {"localhost:8502", "127.0.0.1", 200},
      {"LOCALHOST", "127.0.0.1", 200},
      {"localhost", "10.0.0.7", 421},
      {"gate.example", "10.0.0.7", 200},
      {"GATE.example:9999", "10.0.0.7", 200},
      {"proxy.example:8443", "10.0.0.7", 200},
      {"proxy.example", "10.0.0.7", 421},
      {"evil.example", "127.0.0.1", 421},
      {"gate.example.evil.example", "10.0.0.7", 421},
      {"10.0.0.9:8502", "10.0.0.7", 200},
      {"10.0.0.8:8502", "10.0.0.7", 421},
      {"", "127.0.0.1", 421},
      {"127.0.0.1.evil.example", "127.0.0.1", 421},
      {"[::1]:8502", "127.0.0.1", 421},
      {"gate.example, evil.example", "10.0.0.7", 421},
  };
  for (const auto& [host, peer, status] : kHosts) {
    EXPECT_EQ(StatusOf(WebOf(), Asked({{"host", host}}, peer)), status) << host << " " << peer;
  }
  EXPECT_EQ(StatusOf(WebOf(), Asked({})), 421);
}

TEST(FrontDoor, LetsNoOtherPageIn) {
  const struct {
    std::map<std::string, std::string> headers;
    int status;
  } kPages[] = {
      {{{"origin", "http://gate.example"}}, 200},
      {{{"origin", "https://GATE.example"}}, 200},
      {{{"origin", "http://gate.example:3000"}}, 403},
      {{{"origin", "http://evil.example"}}, 403},
      {{{"origin", "null"}}, 403},
      {{{"origin", "gate.example"}}, 403},
      {{{"sec-fetch-site", "same-origin"}}, 200},
      {{{"sec-fetch-site", "none"}}, 200},
      {{{"sec-fetch-site", "same-site"}}, 403},
      {{{"sec-fetch-site", "cross-site"}}, 403},
      {{{"sec-fetch-site", "cross-site"},
        {"sec-fetch-mode", "navigate"},
        {"sec-fetch-dest", "document"}},
       403},
  };
  for (auto [headers, status] : kPages) {
    headers["host"] = "gate.example";
    EXPECT_EQ(StatusOf(WebOf(), Asked(headers)), status) << headers.begin()->second;
  }
  Request link = Asked({{"host", "gate.example"},
                        {"sec-fetch-site", "cross-site"},
                        {"sec-fetch-mode", "navigate"},
                        {"sec-fetch-dest", "document"}},
                       "10.0.0.7", "/");
  EXPECT_EQ(StatusOf(WebOf(), link), 200) << "a link to the page";
  link.headers["sec-fetch-dest"] = "iframe";
  EXPECT_EQ(StatusOf(WebOf(), link), 403);
}

TEST(FrontDoor, LetsInWhoIsAllowed) {
  const std::map<std::string, std::string> host = {{"host", "gate.example"}};
  EXPECT_EQ(StatusOf(WebOf("10.0.0.0/8"), Asked(host, "10.1.2.3")), 200);
  EXPECT_EQ(StatusOf(WebOf("10.0.0.0/8"), Asked(host, "192.0.2.1")), 403);
  EXPECT_EQ(StatusOf(WebOf("10.0.0.0/8"), Asked(host, "")), 403);
  EXPECT_EQ(StatusOf(WebOf(), Asked(host, "192.0.2.1")), 200);
}

TEST(FrontDoor, AlarmsAreAcknowledgedWhereNobodyListens) {
  config::Web web = WebOf("10.0.0.0/8");
  const std::map<std::string, std::string> tls = {{"x-forwarded-proto", "https"}};
  EXPECT_FALSE(MayAcknowledge(web, Asked({}))) << "not configured";
  web.acknowledge = true;
  EXPECT_TRUE(MayAcknowledge(web, Asked({})));
  EXPECT_TRUE(MayAcknowledge(web, Asked(tls)));
  EXPECT_TRUE(MayAcknowledge(web, Asked(tls, "10.0.0.5")));
  EXPECT_FALSE(MayAcknowledge(web, Asked({}, "10.0.0.5"))) << "in the clear";
  EXPECT_FALSE(MayAcknowledge(web, Asked({{"x-forwarded-proto", "http"}})));
  EXPECT_FALSE(MayAcknowledge(web, Asked({{"x-forwarded-for", "10.0.0.5"}})));
  web.allow.clear();
  EXPECT_FALSE(MayAcknowledge(web, Asked(tls, "10.0.0.5"))) << "anybody could say so";
}

}  // namespace
}  // namespace baudgate::web
