// A server elsewhere to which no route leads any more.
// SPDX-License-Identifier: Apache-2.0
#include "tests/gateway/outputs/modbus/upstream/upstream_fixture.h"

namespace baudgate::modbus {
namespace {

constexpr const char* kReply = "00 00 00 00 00 05 14 03 02 00 07";

class UpstreamRest : public UpstreamTest {
 protected:
  bool RunUntilDisconnected() {
    return test::RunUntil(io_, [&] { return server_.session(0).ended(); });
  }
};

TEST_F(UpstreamRest, AnswersWhatIsUnderWayAndDisconnects) {
  const Asked& asked = Submit();
  ASSERT_TRUE(server_.Wait(1));
  upstream_.Rest();
  test::RunReady(io_);
  EXPECT_FALSE(server_.session(0).ended());
  server_.Write(kReply);
  EXPECT_EQ(ToHex(Wait(asked).pdu), "03 02 00 07");
  EXPECT_TRUE(RunUntilDisconnected());
}

TEST_F(UpstreamRest, DisconnectsAtOnceWhereNothingIsUnderWay) {
  const Asked& asked = Submit();
  ASSERT_TRUE(server_.Wait(1));
  server_.Write(kReply);
  Wait(asked);
  upstream_.Rest();
  EXPECT_TRUE(RunUntilDisconnected());
}

TEST_F(UpstreamRest, DisconnectsWhenTheLastDeadlineHasPassed) {
  SendInVain();
  const Asked& asked = Submit({.within = 50ms});
  upstream_.Rest();
  EXPECT_EQ(Wait(asked).outcome, Outcome::no_reply);
  EXPECT_TRUE(RunUntilDisconnected());
}

TEST_F(UpstreamRest, EndsWithTheNextRoute) {
  Submit();
  ASSERT_TRUE(server_.Wait(1));
  upstream_.Rest();
  upstream_.Start();
  server_.Write(kReply);
  Wait(asked_[0]);
  test::RunReady(io_);
  EXPECT_FALSE(server_.session(0).ended());
  upstream_.Rest();
  EXPECT_TRUE(RunUntilDisconnected());
  upstream_.Start();
  Submit();
  EXPECT_TRUE(server_.Wait(1, 1)) << "a new connection";
}

}  // namespace
}  // namespace baudgate::modbus
