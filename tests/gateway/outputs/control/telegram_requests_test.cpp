// `ask` over the control socket: what is completed, allowed and handed to the line.
// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>

#include "gateway/outputs/control/request_handler.h"
#include "protocols/protocol.h"
#include "tests/gateway/outputs/control/fixture.h"

namespace baudgate::control {
namespace {

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

/// '?' reads; the second byte is a password; CR ends a telegram.
const TelegramRule kRule = {"?!",
                            [](View written, const ParsedOptions&) -> Result<Bytes> {
                              Bytes frame(written.begin(), written.end());
                              if (frame.size() > 4)
                                return Error{"a telegram has four bytes at most"};
                              frame.push_back(0x0D);
                              return frame;
                            },
                            [](View request, const ParsedOptions&) { return request[0] == '?'; }};

const Protocol& HandProtocol() {
  static const Protocol kProtocol = {.name = "spabus",
                                     .expect =
                                         [](View, const ParsedOptions&) {
                                           Expectation expect;
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
                                        {"user:anna", 1}, kNow,
                                        [&later](const std::string& text) { later = text; });
    return reply.text.empty() ? later : reply.text;
  }

  config::Config config_ = TwoLines();
  PointStore store_{config_};
  FakeLines lines_{store_};
  RequestHandler service_{config_, store_, lines_, lines_, {"1.2.3", kStarted}};
};

TEST_F(TelegramRequestsTest, AReadGoesToTheFirstDeviceOfTheLine) {
  const std::string answer = Ask("bay-1", "3F 31");
  EXPECT_THAT(answer, HasSubstr(R"("sent":"3F ** 0D")"));
  EXPECT_THAT(answer, HasSubstr(R"("write":false)"));
  EXPECT_THAT(answer, HasSubstr(R"("device":"feeder-1")"));
  EXPECT_THAT(lines_.calls(), ElementsAre("user:anna reads of device 0"));
}

/// Nobody takes a request for sent that has never left the gateway.
TEST_F(TelegramRequestsTest, WhatWasNotSentIsNotShownAsSent) {
  for (const WriteEnd end : {WriteEnd::not_sent, WriteEnd::denied}) {
    lines_.result = {.end = end, .reason = "the port is in use by 10.0.0.7:40112"};
    const std::string answer = Ask("bay-1", "3F 31");
    EXPECT_THAT(answer, HasSubstr(R"("sent":"")"));
    EXPECT_THAT(answer, HasSubstr("in use by 10.0.0.7:40112"));
  }
  lines_.result = {.end = WriteEnd::unknown, .reason = "no reply"};
  EXPECT_THAT(Ask("bay-1", "3F 31"), HasSubstr(R"("sent":"3F ** 0D")")) << "it was, in vain";
}

TEST_F(TelegramRequestsTest, OrToTheDeviceThatIsNamed) {
  EXPECT_THAT(Ask("bay-1.feeder-2", "3F 31"), HasSubstr(R"("device":"feeder-2")"));
  EXPECT_THAT(lines_.calls(), ElementsAre("user:anna reads of device 1"));
}

TEST_F(TelegramRequestsTest, WhatMayWriteNeedsTheLineAndTheUser) {
  EXPECT_THAT(Ask("bay-1", "21 31", R"(,"write":true)"), HasSubstr("'ask: write'"));
  config_.lines[0].ask = config::Ask::write;
  EXPECT_THAT(Ask("bay-1", "21 31"), HasSubstr("say --write"));
  EXPECT_THAT(Ask("bay-1", "21 31", R"(,"write":true)"), HasSubstr(R"("write":true)"));
  EXPECT_THAT(
      lines_.calls(),
      ElementsAre(AllOf(HasSubstr("user:anna may not write 21 ** 0D"), HasSubstr("'ask: write'")),
                  AllOf(HasSubstr("user:anna may not write 21 ** 0D"), HasSubstr("say --write")),
                  "user:anna reads of device 0"));
}

TEST_F(TelegramRequestsTest, WhatIsNoTelegramIsRefused) {
  EXPECT_THAT(Ask("bay-1", "31 32 33 34 35"), HasSubstr("four bytes at most"));
  EXPECT_THAT(Ask("bay-1", "zz"), HasSubstr("bytes in hex"));
  EXPECT_THAT(Ask("bay-9", "3F 31"), HasSubstr("bay-9"));
  lines_.full = true;
  EXPECT_THAT(Ask("bay-1", "3F 31"), HasSubstr("too many commands"));
  lines_.protocol = nullptr;
  EXPECT_THAT(Ask("bay-1", "3F 31"), HasSubstr("telegrams by hand are not supported"));
}

}  // namespace
}  // namespace baudgate::control
