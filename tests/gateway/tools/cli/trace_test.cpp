// `trace` against a control server.
// SPDX-License-Identifier: Apache-2.0
#include "gateway/tools/cli/trace.h"

#include <gmock/gmock.h>
#include <signal.h>

#include <sstream>

#include "gateway/records/trace/trace_text.h"
#include "gateway/tools/cli/client/control_client.h"
#include "tests/gateway/outputs/control/fixture.h"

namespace baudgate::control {
namespace {

using ::testing::EndsWith;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;

class TraceTest : public ControlTest {
 protected:
  int Trace(const TraceOptions& options) { return RunTrace(options, {}, out_, err_); }
  /// The head of a trace of bay-1.
  std::string Head() const {
    std::string head;
    for (const std::string& line : TraceHead(config_.lines[0])) head += line + "\n";
    return head;
  }

  std::ostringstream out_;
  std::ostringstream err_;
};

TEST_F(TraceTest, UnknownNamesAndNoGatewayHaveTheirExitCodes) {
  EXPECT_EQ(Trace({.line = "io", .socket = path()}), 4);
  StartServer();
  EXPECT_EQ(Trace({.line = "iO", .socket = path()}), 2);
  EXPECT_THAT(out_.str(), IsEmpty());
}

TEST_F(TraceTest, TraceShowsTheRing) {
  TraceRecord record;
  record.kind = TraceRecord::Kind::sent;
  record.device = "feeder-1";
  record.hex = "3E 31";
  lines_.recorded = {record, record};
  StartServer();
  EXPECT_EQ(Trace({.line = "bay-1", .last = true, .socket = path()}), 0);
  EXPECT_EQ(out_.str(), Head() + ToText(record) + "\n" + ToText(record) + "\n");
  out_.str({});
  EXPECT_EQ(Trace({.line = "bay-1", .device = "feeder-2", .last = true, .socket = path()}), 0);
  EXPECT_THAT(out_.str(), Not(HasSubstr(" feeder-1")));
  EXPECT_THAT(err_.str(), HasSubstr("nothing is recorded yet"));
}

TEST_F(TraceTest, PiecesAreOneFrameOrBytesAsTheyCame) {
  TraceRecord first;
  first.kind = TraceRecord::Kind::received;
  first.device = "feeder-1";
  first.hex = "3C";
  first.text = "<";
  TraceRecord second = first;
  second.hex = "31";
  second.text = "1";
  lines_.recorded = {first, second};
  StartServer();
  EXPECT_EQ(Trace({.line = "bay-1", .last = true, .socket = path()}), 0);
  EXPECT_THAT(out_.str(), EndsWith(" feeder-1 < 3C 31 | <1\n"));
  out_.str({});
  EXPECT_EQ(Trace({.line = "bay-1", .last = true, .bytes = true, .socket = path()}), 0);
  EXPECT_EQ(out_.str(), Head() + ToText(first) + "\n" + ToText(second) + "\n");
}

TEST_F(TraceTest, TraceEndsWithItsTimeOrASignal) {
  StartServer();
  EXPECT_EQ(Trace({.line = "bay-1", .seconds = 1ms, .socket = path()}), 0);
  EXPECT_THAT(err_.str(), IsEmpty());
  ASSERT_TRUE(lines_.WaitForTraces(0, 0)) << "or the signal would come for the first one";

  const pthread_t here = ::pthread_self();
  std::thread stopper([&] {
    if (lines_.WaitForTraces(0, 1)) ::pthread_kill(here, SIGINT);
  });
  EXPECT_EQ(Trace({.line = "bay-1", .socket = path()}), 0);
  stopper.join();
  EXPECT_THAT(err_.str(), IsEmpty());
  EXPECT_TRUE(lines_.WaitForTraces(0, 0));
}

TEST_F(TraceTest, TraceSaysThatTheGatewayStops) {
  StartServer();
  TraceRecord record;
  record.text = "went offline";
  std::thread stopper([&] {
    lines_.WaitForTraces(0, 1);
    lines_.Push(0, record);
    StopServer();
  });
  EXPECT_EQ(Trace({.line = "bay-1", .socket = path()}), kNoDaemon);
  stopper.join();
  EXPECT_THAT(out_.str(), ::testing::AnyOf(Head(), EndsWith("went offline\n")));
  EXPECT_THAT(err_.str(), HasSubstr("the trace has ended: the gateway "));
}

}  // namespace
}  // namespace baudgate::control
