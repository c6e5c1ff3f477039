// Tests of the DDS output in the status: fields, sentences, and the line of text for users.
// SPDX-License-Identifier: Apache-2.0
#include "gateway/outputs/dds/output/dds_json.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "gateway/outputs/status/status_json.h"
#include "gateway/tools/cli/client/status_view.h"
#include "tests/gateway/outputs/fake_output.h"
#include "tests/gateway/outputs/status/two_lines.h"

namespace baudgate::dds {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

LinkState Up() {
  LinkState state;
  state.phase = LinkState::Phase::up;
  state.heard = status::kNow.instant - 300ms;
  state.subscribers = {.points = 3, .events = 1};
  state.written = 1234;
  return state;
}

LinkState Lost() {
  LinkState state = Up();
  state.phase = LinkState::Phase::waiting;
  state.reason = "was ended by signal 6";
  state.next_start = status::kNow.instant + 2s;
  state.times_lost = 3;
  state.subscribers = {};
  return state;
}

std::string Shown(const LinkState& state, const std::string& target = {}) {
  const config::Config config = status::TwoLines();
  bus::PointStore store(config);
  outputs::OutputList outputs;
  outputs.push_back(
      std::make_unique<outputs::FakeOutput>("dds", DdsJson(0, state, status::kNow.instant)));
  const status::GatewayInfo info{"1.2.3", status::kStarted, &outputs};
  std::optional<status::Target> found;
  if (!target.empty()) found = status::FindTarget(config, target).value();
  return tools::RenderStatus(StatusJson(config, store, info, found, status::kNow), target, {});
}

TEST(DdsJson, HasAllFields) {
  EXPECT_EQ(
      DdsJson(7, Up(), status::kNow.instant).dump(),
      R"({"domain":7,"state":"up","subscribers":3,)"
      R"("readers":{"points":3,"devices":0,"events":1,"alarms":0},"samples":1234,"refused":0,)"
      R"("times_lost":0,"last_end":null,"heard_ms":300,"next_start_ms":null,)"
      R"("requests":null,"events":null,"datagrams":{"let_in":0,"refused":{"not_rtps":0,"length":0,"fragment":0,)"
      R"("vendor_submessage":0,"data":0,"parameters":0,"numbers":0,"window":0,"security":0,)"
      R"("participants":0,"address":0,"endpoints":0,"secured":0,"clear_text":0,)"
      R"("handshakes":0},"participants":0,"text":""},"advice":[]})");
  const auto lost = DdsJson(7, Lost(), status::kNow.instant);
  EXPECT_EQ(lost["state"], "waiting");
  EXPECT_EQ(lost["heard_ms"], nullptr);
  EXPECT_EQ(lost["next_start_ms"], 2000);
  EXPECT_EQ(lost["last_end"], "was ended by signal 6");
}

TEST(DdsJson, IsShownAsOneLineWhileTheLinkIsUp) {
  EXPECT_THAT(Shown(Up()),
              HasSubstr("\nDDS domain 0: 3 subscribers of points, none of devices, 1 of "
                        "events, none of alarms, 1234 samples\n"));
  LinkState equal = Up();
  equal.subscribers = {3, 3, 3, 3};
  EXPECT_THAT(Shown(equal), HasSubstr("\nDDS domain 0: 3 subscribers, 1234 samples\n"));
  EXPECT_THAT(Shown(Up(), "bay-1"), Not(HasSubstr("DDS")));
}

TEST(DdsJson, NamesUnreachableSubscribers) {
  LinkState state = Up();
  state.remarks = {"10.0.0.9 was discovered but cannot be answered"};
  EXPECT_EQ(DdsJson(7, state, status::kNow.instant)["advice"].dump(),
            R"(["10.0.0.9 was discovered but cannot be answered"])");
  EXPECT_THAT(Shown(state), HasSubstr("10.0.0.9 was discovered but cannot be answered"));
}

LinkState Attacked(LinkState state) {
  state.datagrams.passed = 12345;
  state.datagrams.participants = 4;
  state.datagrams.refused[static_cast<std::size_t>(dds::Refusal::fragment)] = 38;
  state.datagrams.refused[static_cast<std::size_t>(dds::Refusal::parameters)] = 1;
  return state;
}

TEST(DdsJson, CountsRefusedDatagramsByReason) {
  const auto json = DdsJson(7, Attacked(Up()), status::kNow.instant)["datagrams"];
  EXPECT_EQ(json["let_in"], 12345);
  EXPECT_EQ(json["participants"], 4);
  EXPECT_EQ(json["refused"]["fragment"], 38);
  EXPECT_EQ(json["refused"]["parameters"], 1);
  EXPECT_THAT(
      Shown(Attacked(Up())),
      HasSubstr(" samples\nDDS accepted 12345 datagrams, refused 39: 38 fragments, a broken "
                "parameter list\n\n"));
  EXPECT_THAT(Shown(Attacked(Lost())), HasSubstr("\n\nDDS accepted 12345 datagrams, refused 39: "));
  EXPECT_THAT(Shown(Up()), Not(HasSubstr("accepted")));
  LinkState peaceful = Up();
  peaceful.datagrams.passed = 1;
  EXPECT_THAT(Shown(peaceful), HasSubstr("\nDDS accepted 1 datagram, refused none\n"));
}

TEST(DdsJson, CountsWriteRequestsWhereWritingIsAllowed) {
  EXPECT_EQ(DdsJson(7, Up(), status::kNow.instant)["requests"], nullptr);
  LinkState state = Up();
  state.requests = 1;
  EXPECT_THAT(Shown(state), HasSubstr(" samples\nDDS took 1 write request\n"));
  state.requests = 12;
  state.requests_dropped = 3;
  const auto json = DdsJson(7, state, status::kNow.instant)["requests"];
  EXPECT_EQ(json["taken"], 12);
  EXPECT_EQ(json["dropped"], 3);
  EXPECT_THAT(
      Shown(Attacked(state)),
      HasSubstr("\nDDS took 12 write requests, dropped 3 that came too fast\nDDS accepted 12345 "));
}

TEST(DdsJson, CountsSamplesThatTheLibraryRefused) {
  LinkState state = Up();
  state.refused = 2;
  EXPECT_THAT(Shown(state), HasSubstr(", 1234 samples, 2 refused by the DDS library\n"));
}

TEST(DdsJson, IsShownAsASentenceWhileTheLinkIsDown) {
  EXPECT_THAT(Shown(Lost()),
              HasSubstr("\nDDS: the process was ended by signal 6; the gateway starts it "
                        "again in 2.0 s (lost 3 times)\n"));
  EXPECT_THAT(Shown(Lost()), Not(HasSubstr("DDS domain")));
  LinkState silent = Up();
  silent.phase = LinkState::Phase::silent;
  silent.heard = status::kNow.instant - 5s;
  EXPECT_THAT(Shown(silent), HasSubstr("\nDDS: the process has been opening DDS for 5.0 s; "));
  silent.opened = true;
  EXPECT_THAT(Shown(silent),
              HasSubstr("\nDDS: the process has read no samples of the gateway for 5.0 s\n"));
  LinkState awaited;
  EXPECT_THAT(Shown(awaited), HasSubstr("\nDDS: the process has not connected yet\n"));
}

TEST(DdsJson, IsNullWhereDdsIsOff) {
  const config::Config config = status::TwoLines();
  bus::PointStore store(config);
  outputs::OutputList outputs;
  outputs.push_back(std::make_unique<outputs::FakeOutput>("dds", nullptr));
  const status::Json status = status::StatusJson(
      config, store, {"1.2.3", status::kStarted, &outputs}, std::nullopt, status::kNow);
  EXPECT_EQ(status.at("dds"), nullptr);
  EXPECT_THAT(tools::RenderStatus(status, {}, {}), Not(HasSubstr("DDS")));
}

}  // namespace
}  // namespace baudgate::dds
