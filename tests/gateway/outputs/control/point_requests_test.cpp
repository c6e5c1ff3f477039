// `read` and `write` over the control socket: what lines are asked, and what is answered.
// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>
#include <sys/socket.h>

#include <future>
#include <thread>

#include "gateway/outputs/control/request_handler.h"
#include "tests/gateway/outputs/control/fixture.h"

namespace baudgate::control {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

config::Config WithWrites() {
  config::Config config = TwoLines();
  config::Point setting;
  setting.name = "setting";
  setting.type = config::Type::int16;
  setting.access = config::Access::read_write;
  setting.writing.allowed = true;
  setting.writing.max = 10;
  config::Point trip;
  trip.name = "trip";
  trip.type = config::Type::boolean;
  trip.access = config::Access::write;
  trip.writing.allowed = true;
  trip.writing.select = true;
  config::Device& device = config.lines[1].devices[0];
  device.points.insert(device.points.begin(), {setting, trip});
  return config;
}

class PointRequestsTest : public ::testing::Test {
 protected:
  std::string Ask(const std::string& request) {
    std::string later;
    const Reply reply = service_.Answer(request, {"user:anna", 1}, kNow,
                                        [&later](const std::string& text) { later = text; });
    return reply.text.empty() ? later : reply.text;
  }
  std::string Write(const std::string& point, const std::string& value,
                    const std::string& more = "") {
    return Ask(R"({"command":"write","target":"io.ai-1.)" + point + R"(","value":")" + value +
               "\"" + more + "}");
  }

  config::Config config_ = WithWrites();
  PointStore store_{config_};
  FakeLines lines_{store_};
  RequestHandler service_{config_, store_, lines_, lines_, {"1.2.3", kStarted}};
};

TEST_F(PointRequestsTest, AWriteGoesToTheLineAndItsEndComesBack) {
  EXPECT_EQ(Write("setting", "7"), R"({"end":"ok","reason":"","read_back":true})");
  EXPECT_THAT(lines_.calls(), ElementsAre("user:anna writes 0=7 of device 2"));
  lines_.result = {WriteEnd::unknown, "no reply"};
  EXPECT_EQ(Write("setting", "-7"), R"({"end":"unknown","reason":"no reply","read_back":false})");
}

TEST_F(PointRequestsTest, TheSameRequestAgainIsNotWrittenAgain) {
  const char* const night = R"(,"client":"night","seq":7)";
  EXPECT_EQ(Write("setting", "7", night), R"({"end":"ok","reason":"","read_back":true})");
  EXPECT_EQ(Write("setting", "7", night), R"({"end":"ok","reason":"","read_back":false})");
  EXPECT_THAT(lines_.calls(), ElementsAre("user:anna writes 0=7 of device 2"));
  EXPECT_THAT(Write("setting", "8", night), HasSubstr("this seq for another request"));
  EXPECT_THAT(Write("trip", "on", R"(,"client":"night","seq":8)"), HasSubstr("\"needs\""));
  EXPECT_THAT(Write("setting", "7", R"(,"client":"night")"), HasSubstr("belong together"));
  EXPECT_THAT(Write("setting", "7", R"(,"seq":9)"), HasSubstr("belong together"));
  EXPECT_THAT(lines_.calls(), ElementsAre("user:anna writes 0=7 of device 2",
                                          HasSubstr("user:anna may not write true")));
}

TEST_F(PointRequestsTest, WhatIsDeniedSaysWhatItNeeds) {
  EXPECT_THAT(Write("setting", "11"), HasSubstr(R"({"end":"denied","reason":"'setting': 11 is)"));
  EXPECT_THAT(Write("trip", "on"), HasSubstr(R"("needs":"confirm")"));
  EXPECT_THAT(Write("trip", "on", R"(,"confirm":true)"), HasSubstr(R"("end":"ok")"));
  config_.lines[1].devices[0].points[0].writing.allowed = false;
  EXPECT_THAT(Write("setting", "7"), HasSubstr(R"("needs":"write: allow")"));
  lines_.full = true;
  EXPECT_THAT(Write("trip", "on", R"(,"confirm":true)"), HasSubstr(R"({"end":"busy")"));
}

TEST_F(PointRequestsTest, WhetherAWriteWouldPassIsToldWithoutIt) {
  const auto may = [&](const std::string& point, const std::string& value) {
    return Ask(R"({"command":"may_write","target":"io.ai-1.)" + point + R"(","value":")" + value +
               "\"}");
  };
  EXPECT_EQ(may("setting", "7"), R"({"may_write":true,"reason":""})");
  EXPECT_THAT(may("setting", "11"),
              HasSubstr(R"({"may_write":false,"reason":"'setting': 11 is above)"));
  EXPECT_EQ(may("trip", "on"), R"({"may_write":true,"reason":""})") << "as if it were confirmed";
  EXPECT_THAT(may("setting", "seven"), HasSubstr("is not a value of 'setting', a number"));
  EXPECT_THAT(may("nothing", "7"), HasSubstr("setting, trip"));
  EXPECT_THAT(lines_.calls(), IsEmpty());
}

TEST_F(PointRequestsTest, WhatCanNotBeMeantIsAnError) {
  EXPECT_THAT(Write("setting", "seven"), HasSubstr("is not a value of 'setting', a number"));
  EXPECT_THAT(Write("settin", "7"), HasSubstr("did you mean 'setting'?"));
  EXPECT_THAT(Ask(R"({"command":"write","target":"io.ai-1","value":"7"})"),
              HasSubstr("name a point: io.ai-1.POINT; its points: setting, trip"));
  EXPECT_THAT(Ask(R"({"command":"write","target":"io","value":"7"})"), HasSubstr("name a point"));
  EXPECT_THAT(Ask(R"({"command":"write"})"), HasSubstr("name a line"));
  EXPECT_THAT(lines_.calls(), IsEmpty());
}

TEST_F(PointRequestsTest, AReadAsksForOnePointOrAllThatCanBeRead) {
  const Sample sample{0, std::int64_t{5}, Quality::good};
  store_.Update(2, {&sample, 1}, kNow, 10ms);
  const Json one = Json::parse(Ask(R"({"command":"read","target":"io.ai-1.setting"})"));
  EXPECT_EQ(one["read"], true);
  ASSERT_EQ(one["points"].size(), 1U);
  EXPECT_EQ(one["points"][0]["point"], "setting");
  EXPECT_EQ(one["points"][0]["value"], 5);
  const Json all = Json::parse(Ask(R"({"command":"read","target":"io.ai-1"})"));
  EXPECT_EQ(all["points"].size(), config_.lines[1].devices[0].points.size() - 1)
      << "trip cannot be read";
  EXPECT_EQ(lines_.calls().at(0), "user:anna reads 0 of device 2");
}

TEST_F(PointRequestsTest, AReadThatFailedGivesWhatIsKnown) {
  lines_.result = {.reason = "the device is offline"};
  const Json answer = Json::parse(Ask(R"({"command":"read","target":"io.ai-1.setting"})"));
  EXPECT_EQ(answer["read"], false);
  EXPECT_EQ(answer["reason"], "the device is offline");
  EXPECT_EQ(answer["points"][0]["value"], nullptr);
  EXPECT_EQ(answer["points"][0]["fresh"], false);
  const Sample sample{0, std::int64_t{5}, Quality::good};
  store_.Update(2, {&sample, 1}, {kNow.instant - 1s, kNow.wall - 1s}, 10ms);
  const Json old = Json::parse(Ask(R"({"command":"read","target":"io.ai-1.setting"})"));
  EXPECT_EQ(old["points"][0]["value"], 5);
  EXPECT_EQ(old["points"][0]["fresh"], false) << "it is from before";
  lines_.full = true;
  EXPECT_THAT(Ask(R"({"command":"read","target":"io.ai-1"})"), HasSubstr("too many commands"));
  EXPECT_THAT(Ask(R"({"command":"read","target":"io"})"), HasSubstr("name a point"));
}

/// A write waits for its line, and its client does something.
class WaitingWrite : public ControlTest {
 protected:
  WaitingWrite() : ControlTest(WithWrites()) {
    lines_.hold = &held_;
    StartServer();
    client_.emplace(Connect());
    client_->Send(R"({"command":"write","target":"io.ai-1.setting","value":"7"})"
                  "\n");
    command_ = held_.get_future().get();
  }
  bool abandoned() const { return command_.abandoned && *command_.abandoned; }

  std::optional<RawClient> client_;
  WriteCommand command_;

 private:
  std::promise<WriteCommand> held_;
};

TEST_F(WaitingWrite, IsAbandonedWhenItsClientLeaves) {
  EXPECT_FALSE(abandoned());
  client_.reset();
  const Instant until = ReadClocks().instant + 20s;
  while (!abandoned() && ReadClocks().instant < until) std::this_thread::yield();
  EXPECT_TRUE(abandoned());
  command_.done({WriteEnd::not_sent, "its client has left"});
}

/// As `socat` does behind the end of its input.
TEST_F(WaitingWrite, GoesOnWhenItsClientOnlySaysNothingMore) {
  ASSERT_EQ(::shutdown(client_->socket(), SHUT_WR), 0);
  Ask(Connect(), kStatus);  // the server has seen it by now
  EXPECT_FALSE(abandoned());
  command_.done({.read_back = true});
  EXPECT_THAT(client_->ReceiveLine().value_or(""), HasSubstr(R"("end":"ok")"));
}

}  // namespace
}  // namespace baudgate::control
