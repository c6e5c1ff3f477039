// Every example of docs/api.md is asked for, and the answer has the same form.
// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>

#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>
#include <vector>

#include "tests/gateway/outputs/web/fakes.h"
#include "tests/gateway/outputs/web/fixture.h"

namespace baudgate::web {
namespace {

using control::Json;

struct Example {
  std::string request;  ///< "GET /api/v1/status", "POST /login {…}"
  std::string answer;
};

std::vector<Example> Examples() {
  std::ifstream file("docs/api.md");
  std::vector<Example> examples;
  for (std::string line; std::getline(file, line);) {
    if (line != "```") continue;
    Example& example = examples.emplace_back();
    std::getline(file, example.request);
    for (std::string next; std::getline(file, next) && next != "```";) example.answer += next;
  }
  return examples;
}

/// Where the two differ in form; empty: nowhere. "…" in the example: there is more of it.
std::string Different(const Json& example, const Json& answer, const std::string& at = "") {
  if (example.is_null() || answer.is_null()) return {};
  if (example.is_number() && answer.is_number()) return {};
  if (example.type() != answer.type()) return at + " is another type";
  if (example.is_array()) {
    if (example.empty() || answer.empty()) return example.empty() ? "" : at + " is empty";
    for (std::size_t i = 0; i < std::min(example.size(), answer.size()); ++i) {
      const std::string deep = Different(example[i], answer[i], at + "[]");
      if (!deep.empty()) return deep;
    }
    return {};
  }
  if (!example.is_object()) return {};
  for (const auto& [key, value] : example.items()) {
    if (key == "…") continue;
    if (!answer.contains(key)) return at + " has no " + key;
    const std::string deep = Different(value, answer[key], at + "." + key);
    if (!deep.empty()) return deep;
  }
  for (const auto& [key, value] : answer.items()) {
    if (!example.contains("…") && !example.contains(key)) return at + " has " + key + ", too";
  }
  return {};
}

TEST_F(WebTest, ExamplesOfTheDocumentationAreAnsweredSo) {
  FakeEvents events;
  info_.events = &events;
  info_.history = std::make_shared<FakeHistory>();
  info_.reload = [] { return control::ReloadState{}; };
  config_.web.acknowledge = true;
  config_.lines[0].devices[0].points[0].modbus = 0;
  Put(0, 0, 1.25);
  Start();
  const auto examples = Examples();
  EXPECT_GE(examples.size(), 11U);
  for (const Example& example : examples) {
    const std::size_t blank = example.request.find(' ');
    const std::string method = example.request.substr(0, blank);
    const std::string rest = example.request.substr(blank + 1);
    const std::size_t body = rest.find(' ');
    const Reply reply =
        method == "GET" ? Get(rest) : Client().Post(rest.substr(0, body), rest.substr(body + 1));
    const Json expected = Json::parse(example.answer, nullptr, false);
    ASSERT_FALSE(expected.is_discarded()) << example.request;
    const Json answer = Json::parse(reply.body, nullptr, false);
    ASSERT_FALSE(answer.is_discarded()) << example.request << ": " << reply.body;
    EXPECT_EQ(Different(expected, answer), "") << example.request << ": " << reply.body;
    EXPECT_EQ(answer.contains("detail") ? answer["status"] : Json(200), Json(reply.status));
  }
  EXPECT_EQ(events.by, "web:127.0.0.1");
  Stop();  // before events end
}

TEST_F(WebTest, TheHistoryIsDownloadedPageByPage) {
  info_.history = std::make_shared<FakeHistory>();
  Start();
  Reply reply = Get("/api/v1/history.csv?point=bay-1.feeder-1.current");
  EXPECT_EQ(reply.headers["content-type"], "text/csv; charset=utf-8");
  EXPECT_EQ(reply.headers["content-disposition"],
            "attachment; filename=\"bay-1.feeder-1.current.csv\"");
  EXPECT_THAT(reply.body, ::testing::StartsWith(
                              "time_utc,point,value,quality,quality_text\r\n"
                              "2026-09-21 00:00:00.000,bay-1.feeder-1.current,10.0,192,good\r\n"));
  EXPECT_EQ(std::ranges::count(reply.body, '\n'), 601);
  Stop();
}

}  // namespace
}  // namespace baudgate::web
