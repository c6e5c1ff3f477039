// In which order the sentences of a status stand.
// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>

#include <string>

#include "gateway/tools/cli/client/status_view.h"

namespace baudgate {
namespace {

using ::testing::ElementsAre;
using Json = nlohmann::ordered_json;

Json Device(const std::string& name, const std::string& state, int ok, const std::string& says) {
  return {{"name", name},
          {"state", state},
          {"recent", {{"exchanges", 32}, {"ok", ok}}},
          {"advice", Json::array({says})}};
}

TEST(StatusSentences, WhatFailsStandsAboveWhatSuffersFromIt) {
  Json status;
  status["modbus"] = {{"masters", Json::array()}, {"routes", Json::array()}};
  status["lines"] = Json::array(
      {{{"name", "bay"},
        {"advice", Json::array({"noise"})},
        {"devices", Json::array({Device("healthy", "online", 30, "two replies were late"),
                                 Device("culprit", "online", 8, "its replies come damaged"),
                                 Device("dead", "offline", 32, "not a byte came")})}}});
  EXPECT_THAT(AdviceOf(status), ElementsAre("bay: noise", "bay.dead: not a byte came",
                                            "bay.culprit: its replies come damaged",
                                            "bay.healthy: two replies were late"));
}

TEST(StatusSentences, EachSectionHasItsOwn) {
  const Json status = {{"gateway", "plant"},
                       {"lines", Json::array()},
                       {"dds", {{"advice", Json::array({"the process has not connected yet"})}}},
                       {"new-output", {{"advice", Json::array({"nobody listens"})}}},
                       {"audit", nullptr},
                       {"files", {{"advice", Json::array()}}}};
  EXPECT_THAT(AdviceOf(status),
              ElementsAre("DDS: the process has not connected yet", "new-output: nobody listens"));
}

}  // namespace
}  // namespace baudgate
