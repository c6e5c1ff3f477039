// Tests of `ask`, `read` and `write` over the control socket.
// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>
#include <sys/socket.h>

#include <future>
#include <thread>

#include "gateway/outputs/control/request_handler.h"
#include "protocols/protocol.h"
#include "tests/gateway/outputs/control/fixture.h"
#include "tests/support/renew_store.h"

namespace baudgate::control {
namespace {

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

/// A telegram that begins with '?' is a read. Its second byte is a password, and CR ends it.
const protocols::TelegramRule kRule = {
    "?!",
    [](View written, const protocols::ParsedOptions&) -> Result<Bytes> {
      Bytes frame(written.begin(), written.end());
      if (frame.size() > 4) return Error{"a telegram has four bytes at most"};
      frame.push_back(0x0D);
      return frame;
    },
    [](View request, const protocols::ParsedOptions&) { return request[0] == '?'; }};

const protocols::Protocol& HandProtocol() {
  static const protocols::Protocol kProtocol = {.name = "spabus",
                                                .expect =
                                                    [](View, const protocols::ParsedOptions&) {
                                                      protocols::Expectation expect;
                                                      expect.secrets = {{1, 1}};
                                                      return expect;
                                                    },
                                                .telegram = &kRule};
  return kProtocol;
}

class TelegramRequestsTest : public ::testing::Test {
 protected:
  TelegramRequestsTest() { lines_.protocol = &HandProtocol(); }
  std::string Ask(const std::string& target, const std::string& telegram,
                  const std::string& more = "") {
    std::string later;
    const Reply reply = service_.Answer(R"({"command":"ask","target":")" + target +
                                            R"(","telegram":")" + telegram + "\"" + more + "}",
                                        {"user:anna", 1}, status::kNow,
                                        [&later](const std::string& text) { later = text; });
    return reply.text.empty() ? later : reply.text;
  }

  config::Config config_ = status::TwoLines();
  bus::PointStore store_{config_};
  FakeLines lines_{store_};
  RequestHandler service_{config_, store_, lines_, lines_, {"1.2.3", status::kStarted}};
};

TEST_F(TelegramRequestsTest, AReadGoesToTheFirstDeviceOfTheLine) {
  const std::string answer = Ask("bay-1", "3F 31");
  EXPECT_THAT(answer, HasSubstr(R"("sent":"3F ** 0D")"));
  EXPECT_THAT(answer, HasSubstr(R"("write":false)"));
  EXPECT_THAT(answer, HasSubstr(R"("device":"feeder-1")"));
  EXPECT_THAT(lines_.calls(), ElementsAre("user:anna reads of device 0"));
}

TEST_F(TelegramRequestsTest, AnUnsentTelegramIsNotShownAsSent) {
  for (const WriteEnd end : {WriteEnd::not_sent, WriteEnd::denied}) {
    lines_.result = {.end = end, .reason = "the port is in use by 10.0.0.7:40112"};
    const std::string answer = Ask("bay-1", "3F 31");
    EXPECT_THAT(answer, HasSubstr(R"("sent":"")"));
    EXPECT_THAT(answer, HasSubstr("in use by 10.0.0.7:40112"));
  }
  lines_.result = {.end = WriteEnd::unknown, .reason = "no reply"};
  EXPECT_THAT(Ask("bay-1", "3F 31"), HasSubstr(R"("sent":"3F ** 0D")")) << "it was, in vain";
}

TEST_F(TelegramRequestsTest, AReadGoesToTheNamedDevice) {
  EXPECT_THAT(Ask("bay-1.feeder-2", "3F 31"), HasSubstr(R"("device":"feeder-2")"));
  EXPECT_THAT(lines_.calls(), ElementsAre("user:anna reads of device 1"));
}

TEST_F(TelegramRequestsTest, AWritingTelegramNeedsPermissionOfLineAndUser) {
  EXPECT_THAT(Ask("bay-1", "21 31", R"(,"write":true)"), HasSubstr("'ask: write'"));
  config_.lines[0].ask = config::Ask::write;
  EXPECT_THAT(Ask("bay-1", "21 31"), HasSubstr("add --write"));
  EXPECT_THAT(Ask("bay-1", "21 31", R"(,"write":true)"), HasSubstr(R"("write":true)"));
  EXPECT_THAT(
      lines_.calls(),
      ElementsAre(AllOf(HasSubstr("user:anna may not write 21 ** 0D"), HasSubstr("'ask: write'")),
                  AllOf(HasSubstr("user:anna may not write 21 ** 0D"), HasSubstr("add --write")),
                  "user:anna reads of device 0"));
}

TEST_F(TelegramRequestsTest, AnInvalidTelegramIsRefused) {
  EXPECT_THAT(Ask("bay-1", "31 32 33 34 35"), HasSubstr("four bytes at most"));
  EXPECT_THAT(Ask("bay-1", "zz"), HasSubstr("bytes in hex"));
  EXPECT_THAT(Ask("bay-9", "3F 31"), HasSubstr("bay-9"));
  lines_.full = true;
  EXPECT_THAT(Ask("bay-1", "3F 31"), HasSubstr("too many commands"));
  lines_.protocol = nullptr;
  EXPECT_THAT(Ask("bay-1", "3F 31"), HasSubstr("telegrams by hand are not supported"));
}

using ::testing::IsEmpty;

class ServiceTest : public ::testing::Test {
 protected:
  std::string Ask(const std::string& request) {
    std::string later;
    const Reply reply = service_.Answer(request, {"user:anna", 1}, status::kNow,
                                        [&later](const std::string& text) { later = text; });
    wish_ = reply.trace;
    return reply.text.empty() ? later : reply.text;
  }

  config::Config config_ = status::TwoLines();
  bus::PointStore store_{config_};
  FakeLines lines_{store_};
  RequestHandler service_{config_, store_, lines_, lines_, {"1.2.3", status::kStarted}};
  std::optional<TraceWish> wish_;
};

TEST_F(ServiceTest, ReleaseLendsThePortForTheTimeGiven) {
  EXPECT_EQ(Ask(R"({"command":"release","target":"io","for_ms":600000})"),
            R"({"ok":true,"line":"io","port":"/dev/ttyUSB1","until":"2026-09-21T14:23:20.000Z"})");
  EXPECT_THAT(lines_.calls(), ElementsAre("release 1 for 10min"));
}

TEST_F(ServiceTest, ReleaseOverTheNetworkOffersThePort) {
  const auto release = [this](const std::string& more) {
    return Ask(R"({"command":"release","target":"io","for_ms":60000,)" + more + "}");
  };
  EXPECT_THAT(release(R"("tcp":"localhost:4001","rfc2217":true)"),
              HasSubstr(R"("at":"127.0.0.1:4001")"));
  EXPECT_THAT(lines_.calls(), ElementsAre("offer 1 at 127.0.0.1:4001, rfc2217, for 1min"));
  EXPECT_THAT(release(R"("tcp":"0.0.0.0:4001")"), AllOf(HasSubstr("usage"), HasSubstr("--allow")));
  EXPECT_THAT(release(R"("tcp":"0.0.0.0:4001","allow":"10.0.0.7")"),
              HasSubstr(R"("at":"0.0.0.0:4001")"));
  EXPECT_THAT(release(R"("tcp":"gate:4001")"), HasSubstr("is not ADDRESS:PORT of this machine"));
  EXPECT_THAT(release(R"("tcp":"127.0.0.1:4001","allow":"all")"), HasSubstr("usage"));
}

TEST_F(ServiceTest, APortInUseIsNotReleasedToAnotherProgram) {
  const auto release = [this](const std::string& more) {
    return Ask(R"({"command":"release","target":"io","for_ms":60000)" + more + "}");
  };
  EXPECT_THAT(release(""), HasSubstr("true"));
  EXPECT_THAT(release(""), HasSubstr("true")) << "its time begins anew";
  EXPECT_THAT(release(R"(,"tcp":"127.0.0.1:4001")"), HasSubstr("is lent to another program until"));
  Ask(R"({"command":"take_back","target":"io"})");
  const auto set = [this](const std::string& why) {
    store_.UpdateLine(1, [&](bus::LineStatus& status) {
      bus::PortService service;
      service.place = "127.0.0.1:4002";
      service.visit.emplace().client = "10.0.0.7:40000";
      service.visit->why = why;
      status.services = {service};
    });
  };
  set("");
  for (const char* more : {"", R"(,"tcp":"127.0.0.1:4001")"}) {
    EXPECT_THAT(release(more), HasSubstr("client 10.0.0.7:40000 uses the port of line 'io'"));
  }
  EXPECT_THAT(lines_.calls(), testing::SizeIs(3));
  set("it disconnected");
  EXPECT_THAT(release(""), HasSubstr("true"));
}

TEST_F(ServiceTest, NonsenseTimesAreRefused) {
  const auto release = [this](const std::string& time) {
    return Ask(R"({"command":"release","target":"io","for_ms":)" + time + "}");
  };
  for (const char* time : {"0", "-5", "999", "86400001"}) {
    EXPECT_THAT(release(time), HasSubstr("for 1s to 24h")) << time;
  }
  for (const char* time : {"1e30", "1.5", "\"10min\"", "null", "18446744073709551615"}) {
    EXPECT_THAT(release(time), HasSubstr("'for_ms' of 'release' must be a whole number")) << time;
  }
  EXPECT_THAT(Ask(R"({"command":"release","target":"io"})"), HasSubstr("for 1s to 24h"));
  EXPECT_THAT(lines_.calls(), IsEmpty());
  EXPECT_THAT(Ask(R"({"command":"release","target":"io","for_ms":86400000})"), HasSubstr("true"));
}

TEST_F(ServiceTest, AMemberOfAnotherTypeIsAnError) {
  const struct {
    const char* request;
    const char* says;
  } wrong[] = {
      {R"("release","target":"io","for":"x")",
       "'for' is not a member of 'release'; members: target, for_ms, tcp, rfc2217, allow"},
      {R"("release","target":7,"for_ms":1000)",
       "'target' of 'release' must be a text in quotation marks, not 7"},
      {R"("write","target":"io.ai-1.setting","value":"7","confirm":7)",
       "'confirm' of 'write' must be true or false, not 7"},
      {R"("write","target":"io.ai-1.setting","value":7)", "'value' of 'write' must be a text"},
      {R"("may_write","target":"io.ai-1.setting","value":null)", "'value' of 'may_write' must be"},
      {R"("reload","dry_run":"yes")", "'dry_run' of 'reload' must be true or false, not"},
      {R"("reload","confirm_ms":1.5)", "'confirm_ms' of 'reload' must be a whole number, not 1.5"},
      {R"("confirm","by":"me")", "'by' is not a member of 'confirm'; members: applied"},
      {R"("history","point":"a.b.c","after":[1])",
       "'after' of 'history' must be two whole numbers"},
      {R"("events","since_ms":"2h")", "'since_ms' of 'events' must be a whole number"},
      {R"("status","target":["io"])", "'target' of 'status' must be a text"},
  };
  for (const auto& [request, says] : wrong) {
    const status::Json answer =
        status::Json::parse(Ask(std::string(R"({"command":)") + request + "}"));
    EXPECT_EQ(answer.value("error", ""), "usage") << request;
    EXPECT_THAT(answer.value("message", ""), HasSubstr(says)) << request;
  }
  EXPECT_THAT(lines_.calls(), IsEmpty());
}

TEST_F(ServiceTest, TakeBackReportsWhetherThePortWasReleased) {
  EXPECT_EQ(Ask(R"({"command":"take_back","target":"io"})"),
            R"({"ok":true,"line":"io","was_released":false})");
  lines_.Release(1, 10min);
  EXPECT_THAT(Ask(R"({"command":"take_back","target":"io"})"), HasSubstr(R"("was_released":true)"));
  EXPECT_THAT(lines_.calls(), ElementsAre("take back 1", "release 1 for 10min", "take back 1"));
}

TEST_F(ServiceTest, DevicesAreEnabledAndDisabled) {
  EXPECT_EQ(Ask(R"({"command":"disable","target":"bay-1.feeder-2"})"),
            R"({"ok":true,"line":"bay-1","device":"feeder-2","in_use":false,"enabled":true})");
  Ask(R"({"command":"enable","target":"io.ai-1"})");
  EXPECT_THAT(lines_.calls(), ElementsAre("do not use 1", "use 2"));
  EXPECT_THAT(Ask(R"({"command":"disable","target":"bay-1"})"), HasSubstr("bay-1.DEVICE"));
}

TEST_F(ServiceTest, AnUnknownNameIsAnsweredWithTheExistingNames) {
  const auto ask = [&](const std::string& target) {
    return Ask(R"({"command":"status","target":")" + target + "\"}");
  };
  EXPECT_EQ(ask("bay1"), R"({"error":"unknown","message":"there is no line 'bay1'; did you mean )"
                         R"('bay-1'? lines: bay-1, io"})");
  EXPECT_THAT(ask("bay-1.feeder2"),
              HasSubstr("line 'bay-1' has no device 'feeder2'; did you mean 'feeder-2'? its "
                        "devices: feeder-1, feeder-2"));
  EXPECT_THAT(ask("ai-1"), HasSubstr("'ai-1' is a device of line 'io': write io.ai-1"));
  EXPECT_THAT(ask(""), HasSubstr("name a line"));
  EXPECT_THAT(ask("bay-1."), HasSubstr("has no device ''"));
  EXPECT_THAT(ask("io.feeder-1"), HasSubstr("its devices: ai-1"));
  EXPECT_THAT(Ask(R"({"command":"release","target":"io.ai-1","for_ms":5000})"),
              HasSubstr("a whole line: write io"));
  EXPECT_THAT(Ask(R"({"command":"trace","target":"io","device":"feeder-1"})"),
              HasSubstr("has no device 'feeder-1'"));
  EXPECT_FALSE(wish_);
  EXPECT_THAT(lines_.calls(), IsEmpty());
}

TEST_F(ServiceTest, RecordedReturnsTheStoredRecordsOfALineOrDevice) {
  records::TraceRecord record;
  record.kind = records::TraceRecord::Kind::received;
  record.hex = "3C 31";
  for (const char* device : {"feeder-1", "feeder-2"}) {
    record.device = device;
    lines_.recorded.push_back(record);
  }
  const status::Json all = status::Json::parse(Ask(R"({"command":"recorded","target":"bay-1"})"));
  ASSERT_EQ(all["records"].size(), 2U);
  EXPECT_EQ(all["records"][0], ToText(lines_.recorded[0]));
  const status::Json one =
      status::Json::parse(Ask(R"({"command":"recorded","target":"bay-1","device":"feeder-2"})"));
  ASSERT_EQ(one["records"].size(), 1U);
  EXPECT_THAT(one["records"][0].get<std::string>(), HasSubstr("feeder-2 < 3C 31"));
  EXPECT_FALSE(wish_);
}

config::Config WithWrites() {
  config::Config config = status::TwoLines();
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
    const Reply reply = service_.Answer(request, {"user:anna", 1}, status::kNow,
                                        [&later](const std::string& text) { later = text; });
    return reply.text.empty() ? later : reply.text;
  }
  std::string Write(const std::string& point, const std::string& value,
                    const std::string& more = "") {
    return Ask(R"({"command":"write","target":"io.ai-1.)" + point + R"(","value":")" + value +
               "\"" + more + "}");
  }

  config::Config config_ = WithWrites();
  bus::PointStore store_{config_};
  FakeLines lines_{store_};
  RequestHandler service_{config_, store_, lines_, lines_, {"1.2.3", status::kStarted}};
};

TEST_F(PointRequestsTest, AWriteGoesToTheLineAndItsOutcomeIsReturned) {
  EXPECT_EQ(Write("setting", "7"), R"({"end":"ok","reason":"","read_back":true})");
  EXPECT_THAT(lines_.calls(), ElementsAre("user:anna writes 0=7 of device 2"));
  lines_.result = {WriteEnd::unknown, "no reply"};
  EXPECT_EQ(Write("setting", "-7"), R"({"end":"unknown","reason":"no reply","read_back":false})");
}

TEST_F(PointRequestsTest, ARepeatedRequestIsNotWrittenTwice) {
  const char* const night = R"(,"client":"night","seq":7)";
  EXPECT_EQ(Write("setting", "7", night), R"({"end":"ok","reason":"","read_back":true})");
  EXPECT_EQ(Write("setting", "7", night), R"({"end":"ok","reason":"","read_back":false})");
  EXPECT_THAT(lines_.calls(), ElementsAre("user:anna writes 0=7 of device 2"));
  EXPECT_THAT(Write("setting", "8", night), HasSubstr("this seq for another request"));
  EXPECT_THAT(Write("trip", "on", R"(,"client":"night","seq":8)"), HasSubstr("\"needs\""));
  EXPECT_THAT(Write("setting", "7", R"(,"client":"night")"),
              HasSubstr("both 'client' and 'seq', or neither"));
  EXPECT_THAT(Write("setting", "7", R"(,"seq":9)"),
              HasSubstr("both 'client' and 'seq', or neither"));
  EXPECT_THAT(lines_.calls(), ElementsAre("user:anna writes 0=7 of device 2",
                                          HasSubstr("user:anna may not write true")));
}

TEST_F(PointRequestsTest, ADeniedWriteNamesWhatItNeeds) {
  EXPECT_THAT(Write("setting", "11"), HasSubstr(R"({"end":"denied","reason":"'setting': 11 is)"));
  EXPECT_THAT(Write("trip", "on"), HasSubstr(R"("needs":"confirm")"));
  EXPECT_THAT(Write("trip", "on", R"(,"confirm":true)"), HasSubstr(R"("end":"ok")"));
  config_.lines[1].devices[0].points[0].writing.allowed = false;
  Renew(store_, config_);
  EXPECT_THAT(Write("setting", "7"), HasSubstr(R"("needs":"write: allow")"));
  lines_.full = true;
  EXPECT_THAT(Write("trip", "on", R"(,"confirm":true)"), HasSubstr(R"({"end":"busy")"));
}

TEST_F(PointRequestsTest, MayWriteChecksAWriteWithoutSendingIt) {
  const auto may = [&](const std::string& point, const std::string& value) {
    return Ask(R"({"command":"may_write","target":"io.ai-1.)" + point + R"(","value":")" + value +
               "\"}");
  };
  EXPECT_EQ(may("setting", "7"), R"({"may_write":true,"reason":""})");
  EXPECT_THAT(may("setting", "11"),
              HasSubstr(R"({"may_write":false,"reason":"'setting': 11 is above)"));
  EXPECT_EQ(may("trip", "on"), R"({"may_write":true,"reason":""})") << "as if it were confirmed";
  EXPECT_THAT(may("setting", "seven"), HasSubstr("is not a value of 'setting', which is a number"));
  EXPECT_THAT(may("nothing", "7"), HasSubstr("setting, trip"));
  EXPECT_THAT(lines_.calls(), IsEmpty());
}

TEST_F(PointRequestsTest, AnUnknownPointOrInvalidValueIsAnError) {
  EXPECT_THAT(Write("setting", "seven"),
              HasSubstr("is not a value of 'setting', which is a number"));
  EXPECT_THAT(Write("settin", "7"), HasSubstr("did you mean 'setting'?"));
  EXPECT_THAT(Ask(R"({"command":"write","target":"io.ai-1","value":"7"})"),
              HasSubstr("name a point: io.ai-1.POINT; its points: setting, trip"));
  EXPECT_THAT(Ask(R"({"command":"write","target":"io","value":"7"})"), HasSubstr("name a point"));
  EXPECT_THAT(Ask(R"({"command":"write"})"), HasSubstr("name a line"));
  EXPECT_THAT(lines_.calls(), IsEmpty());
}

TEST_F(PointRequestsTest, AReadCoversOnePointOrAllReadablePoints) {
  const bus::Sample sample{0, std::int64_t{5}, Quality::good};
  store_.Update(2, {&sample, 1}, status::kNow, 10ms);
  const status::Json one =
      status::Json::parse(Ask(R"({"command":"read","target":"io.ai-1.setting"})"));
  EXPECT_EQ(one["read"], true);
  ASSERT_EQ(one["points"].size(), 1U);
  EXPECT_EQ(one["points"][0]["point"], "setting");
  EXPECT_EQ(one["points"][0]["value"], 5);
  const status::Json all = status::Json::parse(Ask(R"({"command":"read","target":"io.ai-1"})"));
  EXPECT_EQ(all["points"].size(), config_.lines[1].devices[0].points.size() - 1)
      << "trip cannot be read";
  EXPECT_EQ(lines_.calls().at(0), "user:anna reads 0 of device 2");
}

TEST_F(PointRequestsTest, AFailedReadReturnsTheStoredValues) {
  lines_.result = {.reason = "the device is offline"};
  const status::Json answer =
      status::Json::parse(Ask(R"({"command":"read","target":"io.ai-1.setting"})"));
  EXPECT_EQ(answer["read"], false);
  EXPECT_EQ(answer["reason"], "the device is offline");
  EXPECT_EQ(answer["points"][0]["value"], nullptr);
  EXPECT_EQ(answer["points"][0]["fresh"], false);
  const bus::Sample sample{0, std::int64_t{5}, Quality::good};
  store_.Update(2, {&sample, 1}, {status::kNow.instant - 1s, status::kNow.wall - 1s}, 10ms);
  const status::Json old =
      status::Json::parse(Ask(R"({"command":"read","target":"io.ai-1.setting"})"));
  EXPECT_EQ(old["points"][0]["value"], 5);
  EXPECT_EQ(old["points"][0]["fresh"], false) << "it is from before";
  lines_.full = true;
  EXPECT_THAT(Ask(R"({"command":"read","target":"io.ai-1"})"), HasSubstr("too many commands"));
  EXPECT_THAT(Ask(R"({"command":"read","target":"io"})"), HasSubstr("name a point"));
}

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
  bus::WriteCommand command_;

 private:
  std::promise<bus::WriteCommand> held_;
};

TEST_F(WaitingWrite, IsAbandonedWhenItsClientLeaves) {
  EXPECT_FALSE(abandoned());
  client_.reset();
  const Instant until = ReadClocks().instant + 20s;
  while (!abandoned() && ReadClocks().instant < until) std::this_thread::yield();
  EXPECT_TRUE(abandoned());
  command_.done({WriteEnd::not_sent, "its client has left"});
}

/// The client closes only its sending side, as `socat` does at the end of its input.
TEST_F(WaitingWrite, ContinuesWhenItsClientClosesOnlyItsSendingSide) {
  ASSERT_EQ(::shutdown(client_->socket(), SHUT_WR), 0);
  Ask(Connect(), kStatus);
  EXPECT_FALSE(abandoned());
  command_.done({.read_back = true});
  EXPECT_THAT(client_->ReceiveLine().value_or(""), HasSubstr(R"("end":"ok")"));
}

}  // namespace
}  // namespace baudgate::control
