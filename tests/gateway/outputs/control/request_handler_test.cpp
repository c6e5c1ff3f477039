// What each request does to the lines and answers, without a socket.
// SPDX-License-Identifier: Apache-2.0
#include "gateway/outputs/control/request_handler.h"

#include <gmock/gmock.h>

#include "tests/gateway/outputs/control/fixture.h"

namespace baudgate::control {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

class ServiceTest : public ::testing::Test {
 protected:
  std::string Ask(const std::string& request) {
    std::string later;
    const Reply reply = service_.Answer(request, {"user:anna", 1}, kNow,
                                        [&later](const std::string& text) { later = text; });
    wish_ = reply.trace;
    return reply.text.empty() ? later : reply.text;
  }

  config::Config config_ = TwoLines();
  PointStore store_{config_};
  FakeLines lines_{store_};
  RequestHandler service_{config_, store_, lines_, lines_, {"1.2.3", kStarted}};
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

TEST_F(ServiceTest, APortThatSomebodyHasIsNotReleasedToAnother) {
  const auto release = [this](const std::string& more) {
    return Ask(R"({"command":"release","target":"io","for_ms":60000)" + more + "}");
  };
  EXPECT_THAT(release(""), HasSubstr("true"));
  EXPECT_THAT(release(""), HasSubstr("true")) << "its time begins anew";
  EXPECT_THAT(release(R"(,"tcp":"127.0.0.1:4001")"),
              HasSubstr("is released to another program until"));
  Ask(R"({"command":"take_back","target":"io"})");
  const auto set = [this](const std::string& why) {
    store_.UpdateLine(1, [&](LineStatus& status) {
      PortService service;
      service.place = "127.0.0.1:4002";
      service.visit.emplace().client = "10.0.0.7:40000";
      service.visit->why = why;
      status.services = {service};
    });
  };
  set("");
  for (const char* more : {"", R"(,"tcp":"127.0.0.1:4001")"}) {
    EXPECT_THAT(release(more), HasSubstr("client 10.0.0.7:40000 has the port of line 'io'"));
  }
  EXPECT_THAT(lines_.calls(), testing::SizeIs(3));
  set("it has left");
  EXPECT_THAT(release(""), HasSubstr("true"));
}

TEST_F(ServiceTest, NonsenseTimesAreRefused) {
  const auto release = [this](const std::string& time) {
    return Ask(R"({"command":"release","target":"io","for_ms":)" + time + "}");
  };
  for (const char* time : {"0", "-5", "999", "86400001"}) {
    EXPECT_THAT(release(time), HasSubstr("from 1s to 24h")) << time;
  }
  for (const char* time : {"1e30", "1.5", "\"10min\"", "null", "18446744073709551615"}) {
    EXPECT_THAT(release(time), HasSubstr("'for_ms' of 'release' is a whole number")) << time;
  }
  EXPECT_THAT(Ask(R"({"command":"release","target":"io"})"), HasSubstr("from 1s to 24h"));
  EXPECT_THAT(lines_.calls(), IsEmpty());
  EXPECT_THAT(Ask(R"({"command":"release","target":"io","for_ms":86400000})"), HasSubstr("true"));
}

TEST_F(ServiceTest, AMemberOfAnotherTypeIsNotTakenForAbsent) {
  const struct {
    const char* request;
    const char* says;
  } wrong[] = {
      {R"("release","target":"io","for":"x")",
       "'for' is no member of 'release'; there are: target, for_ms, tcp, rfc2217, allow"},
      {R"("release","target":7,"for_ms":1000)",
       "'target' of 'release' is a text in quotation marks, and not 7"},
      {R"("write","target":"io.ai-1.setting","value":"7","confirm":7)",
       "'confirm' of 'write' is true or false, and not 7"},
      {R"("write","target":"io.ai-1.setting","value":7)", "'value' of 'write' is a text"},
      {R"("may_write","target":"io.ai-1.setting","value":null)", "'value' of 'may_write' is"},
      {R"("reload","dry_run":"yes")", "'dry_run' of 'reload' is true or false, and not"},
      {R"("reload","confirm_ms":1.5)", "'confirm_ms' of 'reload' is a whole number, and not 1.5"},
      {R"("confirm","by":"me")", "'by' is no member of 'confirm'; it has none"},
      {R"("history","point":"a.b.c","after":[1])", "'after' of 'history' is two whole numbers"},
      {R"("events","since_ms":"2h")", "'since_ms' of 'events' is a whole number"},
      {R"("status","target":["io"])", "'target' of 'status' is a text"},
  };
  for (const auto& [request, says] : wrong) {
    const Json answer = Json::parse(Ask(std::string(R"({"command":)") + request + "}"));
    EXPECT_EQ(answer.value("error", ""), "usage") << request;
    EXPECT_THAT(answer.value("message", ""), HasSubstr(says)) << request;
  }
  EXPECT_THAT(lines_.calls(), IsEmpty());
}

TEST_F(ServiceTest, TakeBackSaysWhetherThereWasAnythingToTakeBack) {
  EXPECT_EQ(Ask(R"({"command":"take_back","target":"io"})"),
            R"({"ok":true,"line":"io","was_released":false})");
  lines_.Release(1, 10min);
  EXPECT_THAT(Ask(R"({"command":"take_back","target":"io"})"), HasSubstr(R"("was_released":true)"));
  EXPECT_THAT(lines_.calls(), ElementsAre("take back 1", "release 1 for 10min", "take back 1"));
}

TEST_F(ServiceTest, DevicesAreTakenInAndOutOfUse) {
  EXPECT_EQ(Ask(R"({"command":"disable","target":"bay-1.feeder-2"})"),
            R"({"ok":true,"line":"bay-1","device":"feeder-2","in_use":false,"enabled":true})");
  Ask(R"({"command":"enable","target":"io.ai-1"})");
  EXPECT_THAT(lines_.calls(), ElementsAre("do not use 1", "use 2"));
  EXPECT_THAT(Ask(R"({"command":"disable","target":"bay-1"})"), HasSubstr("bay-1.DEVICE"));
}

TEST_F(ServiceTest, UnknownNamesSayWhatThereIs) {
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
              HasSubstr("a line as a whole: write io"));
  EXPECT_THAT(Ask(R"({"command":"trace","target":"io","device":"feeder-1"})"),
              HasSubstr("has no device 'feeder-1'"));
  EXPECT_FALSE(wish_);
  EXPECT_THAT(lines_.calls(), IsEmpty());
}

TEST_F(ServiceTest, RecordedGivesTheRingOfALineOrADevice) {
  TraceRecord record;
  record.kind = TraceRecord::Kind::received;
  record.hex = "3C 31";
  for (const char* device : {"feeder-1", "feeder-2"}) {
    record.device = device;
    lines_.recorded.push_back(record);
  }
  const Json all = Json::parse(Ask(R"({"command":"recorded","target":"bay-1"})"));
  ASSERT_EQ(all["records"].size(), 2U);
  EXPECT_EQ(all["records"][0], ToText(lines_.recorded[0]));
  const Json one =
      Json::parse(Ask(R"({"command":"recorded","target":"bay-1","device":"feeder-2"})"));
  ASSERT_EQ(one["records"].size(), 1U);
  EXPECT_THAT(one["records"][0].get<std::string>(), HasSubstr("feeder-2 < 3C 31"));
  EXPECT_FALSE(wish_);
}

}  // namespace
}  // namespace baudgate::control
