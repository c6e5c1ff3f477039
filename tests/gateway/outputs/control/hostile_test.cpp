// Clients that send garbage, too much or nothing, that never read, or that are too many.
// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>

#include "tests/gateway/outputs/control/fixture.h"

namespace baudgate::control {
namespace {

using ::testing::HasSubstr;
using ::testing::StartsWith;

TEST_F(ControlTest, GarbageGetsAnErrorAndTheClientMayTryAgain) {
  StartServer();
  RawClient client = Connect();
  const std::string garbage[] = {"",
                                 "status",
                                 "[]",
                                 "null",
                                 "{\"command\"",
                                 "{\"command\":7}",
                                 "\x01\xFF\xFE",
                                 std::string("{\0}", 3),
                                 std::string(4000, '['),
                                 R"({"command":"statsu"})"};
  for (const std::string& request : garbage) {
    EXPECT_THAT(Ask(client, request), StartsWith(R"({"error":"usage","message":")")) << request;
  }
  EXPECT_THAT(Ask(client, R"({"command":"statsu"})"), HasSubstr("did you mean 'status'?"));
  EXPECT_THAT(Ask(client, kStatus), HasSubstr("substation-7"));
}

TEST_F(ControlTest, ALineOfAMegabyteIsNotTaken) {
  StartServer();
  RawClient client = Connect();
  const std::string request(1U << 20U, 'x');
  EXPECT_LT(client.Send(request), request.size());
  EXPECT_THAT(client.ReceiveLine().value_or(""), HasSubstr("longer than 4096 bytes"));
  EXPECT_TRUE(client.IsClosed());
  EXPECT_THAT(Ask(Connect(), kStatus), HasSubstr("substation-7"));
}

TEST_F(ControlTest, ALineOfExactlyTheLimitIsTaken) {
  StartServer();
  std::string request = kStatus;
  request.resize(4096, ' ');
  RawClient client = Connect();
  EXPECT_THAT(Ask(client, request), HasSubstr("substation-7"));
  EXPECT_THAT(Ask(client, request + " "), HasSubstr("longer than"));
}

TEST_F(ControlTest, HalfALineDoesNotHoldAPlaceForEver) {
  limits_.patience = 30ms;
  StartServer();
  RawClient half = Connect();
  half.Send("{\"comm");
  RawClient silent = Connect();
  EXPECT_TRUE(half.IsClosed());
  EXPECT_TRUE(silent.IsClosed());
}

TEST_F(ControlTest, WhoAsksNothingMakesRoom) {
  StartServer();
  std::vector<RawClient> clients;
  for (int i = 0; i < 16; ++i) {
    clients.push_back(Connect());
    ASSERT_THAT(Ask(clients.back(), kStatus), HasSubstr("substation-7")) << "client " << i;
  }
  Ask(clients.front(), kTrace);
  EXPECT_THAT(Ask(Connect(), kStatus), HasSubstr("substation-7"));
  EXPECT_TRUE(clients[1].IsClosed()) << "it has been idle longest; the first one traces";
}

TEST_F(ControlTest, SixteenTracesLeaveRoomForAQuestionAndForNoTrace) {
  StartServer();
  std::vector<RawClient> traces;
  for (int i = 0; i < 16; ++i) {
    traces.push_back(Connect());
    ASSERT_THAT(Ask(traces.back(), kTrace), Not(HasSubstr("error"))) << "client " << i;
  }
  ASSERT_TRUE(lines_.WaitForTraces(0, 16));
  RawClient more = Connect();
  EXPECT_THAT(Ask(more, kTrace), StartsWith(R"({"error":"busy","message":"16 clients)"));
  EXPECT_THAT(Ask(more, kStatus), HasSubstr("substation-7"));
  traces.front().Close();
  ASSERT_TRUE(lines_.WaitForTraces(0, 15));
}

/// So many points that an answer does not fit into the buffers of a socket.
config::Config WithManyPoints() {
  config::Config config = TwoLines();
  config::Point point;
  for (int i = 0; i < 20'000; ++i) {
    point.name = "point_with_a_long_name_" + std::to_string(i);
    config.lines[0].devices[0].points.push_back(point);
  }
  return config;
}

class WideDeviceTest : public ControlTest {
 protected:
  WideDeviceTest() : ControlTest(WithManyPoints()) {}
};

TEST_F(WideDeviceTest, AReaderThatStopsIsDroppedAndOthersAreServed) {
  limits_.patience = 2s;
  StartServer();
  RawClient slow = Connect();
  slow.Send("{\"command\":\"status\",\"target\":\"bay-1.feeder-1\"}\n");
  EXPECT_THAT(Ask(Connect(), R"({"command":"status","target":"io"})"), HasSubstr("substation-7"));
  // One that came later is dropped for its silence: so the slow one has been as well.
  RawClient silent = Connect();
  ASSERT_TRUE(silent.IsClosed());
  EXPECT_FALSE(slow.ReceiveLine()) << "the whole answer was kept for it";
}

TEST_F(WideDeviceTest, AReaderGetsALongAnswerWhole) {
  StartServer();
  const std::string answer = Ask(Connect(), R"({"command":"status","target":"bay-1.feeder-1"})");
  EXPECT_GT(answer.size(), 1'000'000U);
  EXPECT_THAT(answer, HasSubstr("point_with_a_long_name_19999"));
}

TEST_F(ControlTest, ATraceThatIsNotReadLosesRecordsAndSaysSo) {
  StartServer();
  RawClient client = Connect();
  Ask(client, kTrace);
  ASSERT_TRUE(lines_.WaitForTraces(0, 1));
  TraceRecord record;
  record.kind = TraceRecord::Kind::received;
  record.device = "feeder-1";
  record.hex = std::string(600, '4');
  // Far more than the buffers of the socket and the queue hold together.
  for (int i = 0; i < 50'000; ++i) lines_.Push(0, record);
  TraceRecord last;
  last.text = "the last";
  bool noted = false;
  int received = 0;
  std::string line;
  do {
    // The note stands where records are missing; the last one finds room again by and by.
    lines_.Push(0, last);
    line = client.ReceiveLine().value_or("the last");
    ++received;
    noted = noted || line.find("dropped") != std::string::npos;
  } while (line.find("the last") == std::string::npos);
  EXPECT_TRUE(noted);
  EXPECT_LT(received, 50'000);
}

}  // namespace
}  // namespace baudgate::control
