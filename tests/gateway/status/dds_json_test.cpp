// The DDS output in the status: fields, sentences and the line that people see.
// SPDX-License-Identifier: Apache-2.0
#include "gateway/status/dds_json.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "gateway/cli/client/status_view.h"
#include "gateway/status/status_json.h"
#include "tests/gateway/status/two_lines.h"

namespace baudgate::control {
namespace {

using dds::LinkState;
using ::testing::HasSubstr;
using ::testing::Not;

LinkState Up() {
  LinkState state;
  state.phase = LinkState::Phase::up;
  state.heard = kNow.instant - 300ms;
  state.subscribers = 3;
  state.written = 1234;
  return state;
}

LinkState Lost() {
  LinkState state = Up();
  state.phase = LinkState::Phase::waiting;
  state.reason = "was ended by signal 6";
  state.next_start = kNow.instant + 2s;
  state.times_lost = 3;
  state.subscribers = 0;
  return state;
}

std::string Shown(const LinkState& state, const std::string& target = {}) {
  const config::Config config = TwoLines();
  PointStore store(config);
  GatewayInfo info{"1.2.3", kStarted};
  info.dds = [&] { return state; };
  std::optional<Target> found;
  if (!target.empty()) found = FindTarget(config, target).value();
  return RenderStatus(StatusJson(config, store, info, found, kNow), target, {});
}

TEST(DdsJson, Fields) {
  EXPECT_EQ(DdsJson(7, Up(), kNow.instant).dump(),
            R"({"domain":7,"state":"up","subscribers":3,"samples":1234,"refused":0,)"
            R"("times_lost":0,"last_end":null,"heard_ms":300,"next_start_ms":null,"advice":[]})");
  const auto lost = DdsJson(7, Lost(), kNow.instant);
  EXPECT_EQ(lost["state"], "waiting");
  EXPECT_EQ(lost["heard_ms"], nullptr);
  EXPECT_EQ(lost["next_start_ms"], 2000);
  EXPECT_EQ(lost["last_end"], "was ended by signal 6");
}

TEST(DdsJson, OneLineWhenAllIsWell) {
  EXPECT_THAT(Shown(Up()), HasSubstr("\nDDS domain 0: 3 subscribers, 1234 samples\n"));
  EXPECT_THAT(Shown(Up(), "bay-1"), Not(HasSubstr("DDS")));
}

TEST(DdsJson, ASentenceWhenItIsNot) {
  EXPECT_THAT(Shown(Lost()), HasSubstr("\nDDS: the process was ended by signal 6; it is started "
                                       "again in 2.0 s (lost 3 times)\n"));
  EXPECT_THAT(Shown(Lost()), Not(HasSubstr("DDS domain")));
  LinkState silent = Up();
  silent.phase = LinkState::Phase::silent;
  silent.heard = kNow.instant - 5s;
  EXPECT_THAT(Shown(silent), HasSubstr("\nDDS: the process does not read since 5.0 s\n"));
  LinkState awaited;
  EXPECT_THAT(Shown(awaited), HasSubstr("\nDDS: the process has not connected yet\n"));
}

TEST(DdsJson, NothingWhereItIsOff) {
  const config::Config config = TwoLines();
  PointStore store(config);
  const Json status = StatusJson(config, store, {"1.2.3", kStarted}, std::nullopt, kNow);
  EXPECT_EQ(status["dds"], nullptr);
  EXPECT_THAT(RenderStatus(status, {}, {}), Not(HasSubstr("DDS")));
}

}  // namespace
}  // namespace baudgate::control
