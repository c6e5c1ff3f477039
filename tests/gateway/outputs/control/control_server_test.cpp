// Tests of `ControlServer`: requests and traces over a real socket, and the socket file.
// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>
#include <sys/stat.h>

#include <fstream>

#include "gateway/outputs/control/socket_path.h"
#include "tests/gateway/outputs/control/fixture.h"

namespace baudgate::control {
namespace {

using ::testing::AnyOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::StartsWith;

records::TraceRecord Sent(const std::string& device, const std::string& hex = "3E 31") {
  records::TraceRecord record;
  record.kind = records::TraceRecord::Kind::sent;
  record.device = device;
  record.hex = hex;
  record.text = ">1";
  return record;
}

TEST_F(ControlTest, RequestsOfAClientAreAnsweredInOrder) {
  StartServer();
  ASSERT_TRUE(listening_) << listening_.error();
  RawClient client = Connect();
  EXPECT_THAT(Ask(client, kStatus), StartsWith(R"({"gateway":"substation-7","version":"1.2.3")"));
  EXPECT_THAT(Ask(client, R"({"command":"disable","target":"io.ai-1"})"),
              HasSubstr(R"("ok":true)"));
  client.Send(std::string(kStatus) + "\n" + kStatus + "\n{\"comm");
  EXPECT_TRUE(client.ReceiveLine());
  EXPECT_TRUE(client.ReceiveLine());
  client.Send("and\":\"status\"}\n");
  EXPECT_THAT(client.ReceiveLine().value_or(""), HasSubstr("substation-7"));
  EXPECT_THAT(lines_.calls(), ElementsAre("do not use 2"));
}

TEST_F(ControlTest, TheTroubleOfTheUsersFileIsInTheStatus) {
  config_.users.file = (directory_ / "users").string();
  StartServer();
  EXPECT_THAT(Ask(Connect(), kStatus), HasSubstr("users has no users, so nobody can log in"));
  std::ofstream(config_.users.file) << "user anna\n";
  ::chmod(config_.users.file.c_str(), 0640);
  std::string answer;
  for (int i = 0; i < 300 && answer.find("line 1: is not") == std::string::npos; ++i) {
    std::this_thread::sleep_for(10ms);
    answer = Ask(Connect(), kStatus);
  }
  EXPECT_THAT(answer, HasSubstr("users: line 1: is not 'user NAME ROLE HASH'"));
}

TEST_F(ControlTest, TheSocketFileIsAccessibleToOwnerAndGroupOnly) {
  StartServer();
  struct stat found {};
  ASSERT_EQ(::stat(path().c_str(), &found), 0);
  EXPECT_EQ(found.st_mode & 07777U, 0660U);
  StopServer();
  EXPECT_FALSE(std::filesystem::exists(path()));
}

TEST_F(ControlTest, ASocketOfADeadProcessIsReplaced) {
  {
    asio::io_context io;
    const asio::local::stream_protocol::acceptor dead(
        io, asio::local::stream_protocol::endpoint(path()));
  }
  ASSERT_TRUE(std::filesystem::is_socket(path()));
  ASSERT_FALSE(Connect().connected());
  StartServer();
  ASSERT_TRUE(listening_) << listening_.error();
  EXPECT_THAT(Ask(Connect(), kStatus), HasSubstr("substation-7"));
}

TEST_F(ControlTest, ARemovedSocketFileIsCreatedAgain) {
  limits_.look = 1ms;
  StartServer();
  const RawClient before = Connect();
  EXPECT_THAT(Ask(before, kStatus), HasSubstr("substation-7"));
  for (int times = 0; times < 2; ++times) {
    std::filesystem::remove(path());
    while (!Connect().connected()) std::this_thread::yield();
    EXPECT_THAT(Ask(Connect(), kStatus), HasSubstr("substation-7"));
  }
  EXPECT_THAT(Ask(before, kStatus), HasSubstr("substation-7")) << "who is connected stays so";
}

TEST_F(ControlTest, ARestoredStaleSocketFileIsReplaced) {
  limits_.look = 1ms;
  StartServer();
  const std::string away = path() + ".away";
  std::filesystem::rename(path(), away);
  std::filesystem::create_directory(path());
  while (RawClient(away).connected()) std::this_thread::yield();
  std::filesystem::remove(path());
  std::filesystem::rename(away, path());
  while (!Connect().connected()) std::this_thread::yield();
  EXPECT_THAT(Ask(Connect(), kStatus), HasSubstr("substation-7"));
}

TEST_F(ControlTest, ASocketInUseAndForeignFilesAreNotReplaced) {
  StartServer();
  asio::io_context io;
  ControlServer second(config_, store_, lines_, lines_, {"9", status::kStarted}, io);
  const Status taken = second.Listen();
  ASSERT_FALSE(taken);
  EXPECT_THAT(taken.error(), HasSubstr("another process answers at this socket"));
  second.Stop();
  EXPECT_THAT(Ask(Connect(), kStatus), HasSubstr("1.2.3")) << "the first still owns the file";

  config_.socket = (directory_ / "notes.txt").string();
  std::ofstream(config_.socket) << "precious";
  ControlServer third(config_, store_, lines_, lines_, {"9", status::kStarted}, io);
  EXPECT_THAT(third.Listen().error(), HasSubstr("not a socket"));
  EXPECT_EQ(std::filesystem::file_size(config_.socket), 8U);

  config_.socket = (directory_ / "missing" / "x.sock").string();
  ControlServer fourth(config_, store_, lines_, lines_, {"9", status::kStarted}, io);
  EXPECT_THAT(fourth.Listen().error(), HasSubstr("missing/x.sock: No such file"));

  config_.socket = "/tmp/" + std::string(200, 'x');
  ControlServer fifth(config_, store_, lines_, lines_, {"9", status::kStarted}, io);
  EXPECT_THAT(fifth.Listen().error(), HasSubstr("longer than"));
}

TEST_F(ControlTest, WithoutAPathTheFirstUsableFolderIsChosen) {
  const RuntimeDirectory runtime(directory_);
  const auto places = SocketPaths("substation-7");
  ASSERT_EQ(places.size(), 3U);
  EXPECT_EQ(places[0], "/run/baudgate/substation-7.sock");
  EXPECT_EQ(places[1], (directory_ / "baudgate/substation-7.sock").string());
  EXPECT_THAT(places[2], StartsWith("/tmp/baudgate-"));
  config_.socket.clear();
  StartServer();
  ASSERT_TRUE(listening_) << listening_.error();
  EXPECT_THAT(server_->path(), AnyOf(places[0], places[1]));
  EXPECT_THAT(Ask(RawClient(server_->path()), kStatus), HasSubstr("substation-7"));
}

TEST_F(ControlTest, AWorldWritableDirectoryIsRefused) {
  const std::string fresh = (directory_ / "fresh").string();
  EXPECT_TRUE(PrepareDirectory(fresh));
  EXPECT_TRUE(PrepareDirectory(fresh)) << "it is there already";
  std::filesystem::permissions(fresh, std::filesystem::perms::all);
  EXPECT_THAT(PrepareDirectory(fresh).error(), HasSubstr("may write to it"));
  const std::string link = (directory_ / "link").string();
  std::filesystem::create_symlink(directory_, link);
  EXPECT_THAT(PrepareDirectory(link).error(), HasSubstr("not a directory"));
}

TEST_F(ControlTest, ATraceStreamsNewRecordsOfItsLine) {
  StartServer();
  RawClient client = Connect();
  EXPECT_THAT(Ask(client, kTrace),
              StartsWith(R"({"ok":true,"line":"bay-1","head":["# line bay-1, )"));
  ASSERT_TRUE(lines_.WaitForTraces(0, 1));
  lines_.Push(0, Sent("feeder-1"));
  EXPECT_THAT(client.ReceiveLine().value_or(""), HasSubstr("feeder-1 > 3E 31 | >1"));
  lines_.Push(0, Sent("feeder-2"));
  lines_.Push(0, Sent("feeder-1", "41"));
  EXPECT_THAT(client.ReceiveLine().value_or(""), HasSubstr("feeder-2 > 3E 31"));
  EXPECT_THAT(client.ReceiveLine().value_or(""), HasSubstr("feeder-1 > 41"));
  EXPECT_FALSE(lines_.Push(1, Sent("ai-1"))) << "nobody follows the other line";
}

TEST_F(ControlTest, ATraceOfADeviceOmitsOtherDevices) {
  StartServer();
  RawClient client = Connect();
  Ask(client, R"({"command":"trace","target":"bay-1","device":"feeder-2"})");
  ASSERT_TRUE(lines_.WaitForTraces(0, 1));
  lines_.Push(0, Sent("feeder-1"));
  records::TraceRecord note;
  note.text = "records were dropped";
  lines_.Push(0, note);
  lines_.Push(0, Sent("feeder-2"));
  EXPECT_THAT(client.ReceiveLine().value_or(""), HasSubstr("records were dropped"));
  EXPECT_THAT(client.ReceiveLine().value_or(""), HasSubstr("feeder-2 >"));
}

TEST_F(ControlTest, ADisconnectedClientEndsItsTrace) {
  StartServer();
  RawClient leaving = Connect();
  RawClient staying = Connect();
  Ask(leaving, kTrace);
  Ask(staying, kTrace);
  ASSERT_TRUE(lines_.WaitForTraces(0, 2));
  leaving.Close();
  ASSERT_TRUE(lines_.WaitForTraces(0, 1));
  lines_.Push(0, Sent("feeder-1"));
  EXPECT_THAT(staying.ReceiveLine().value_or(""), HasSubstr("feeder-1"));
}

TEST_F(ControlTest, AStoppingGatewayNotifiesItsTraces) {
  StartServer();
  RawClient client = Connect();
  Ask(client, kTrace);
  ASSERT_TRUE(lines_.WaitForTraces(0, 1));
  StopServer();
  EXPECT_EQ(client.ReceiveLine().value_or(""), R"({"end":"the gateway is stopping"})");
  EXPECT_TRUE(client.IsClosed());
  EXPECT_FALSE(lines_.Push(0, Sent("feeder-1"))) << "the queue was not given back";
}

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

TEST_F(ControlTest, ARequestOfAMegabyteIsRefused) {
  StartServer();
  RawClient client = Connect();
  const std::string request(1U << 20U, 'x');
  EXPECT_LT(client.Send(request), request.size());
  EXPECT_THAT(client.ReceiveLine().value_or(""), HasSubstr("longer than 4096 bytes"));
  EXPECT_TRUE(client.IsClosed());
  EXPECT_THAT(Ask(Connect(), kStatus), HasSubstr("substation-7"));
}

TEST_F(ControlTest, ARequestOfExactlyTheLimitIsAccepted) {
  StartServer();
  std::string request = kStatus;
  request.resize(4096, ' ');
  RawClient client = Connect();
  EXPECT_THAT(Ask(client, request), HasSubstr("substation-7"));
  EXPECT_THAT(Ask(client, request + " "), HasSubstr("longer than"));
}

TEST_F(ControlTest, IncompleteAndSilentClientsAreClosed) {
  limits_.patience = 30ms;
  StartServer();
  RawClient half = Connect();
  half.Send("{\"comm");
  RawClient silent = Connect();
  EXPECT_TRUE(half.IsClosed());
  EXPECT_TRUE(silent.IsClosed());
}

TEST_F(ControlTest, TheLongestIdleClientIsClosedForANewOne) {
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

TEST_F(ControlTest, SixteenTracesAllowAStatusRequestButNoFurtherTrace) {
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

config::Config WithManyPoints() {
  config::Config config = status::TwoLines();
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

TEST_F(WideDeviceTest, AClientThatStopsReadingIsDroppedAndOthersAreServed) {
  limits_.patience = 2s;
  StartServer();
  RawClient slow = Connect();
  slow.Send("{\"command\":\"status\",\"target\":\"bay-1.feeder-1\"}\n");
  EXPECT_THAT(Ask(Connect(), R"({"command":"status","target":"io"})"), HasSubstr("substation-7"));
  RawClient silent = Connect();
  ASSERT_TRUE(silent.IsClosed());
  EXPECT_FALSE(slow.ReceiveLine()) << "the whole answer was kept for it";
}

TEST_F(WideDeviceTest, ALongAnswerArrivesComplete) {
  StartServer();
  const std::string answer = Ask(Connect(), R"({"command":"status","target":"bay-1.feeder-1"})");
  EXPECT_GT(answer.size(), 1'000'000U);
  EXPECT_THAT(answer, HasSubstr("point_with_a_long_name_19999"));
}

TEST_F(ControlTest, AnUnreadTraceDropsRecordsAndNotesTheLoss) {
  StartServer();
  RawClient client = Connect();
  Ask(client, kTrace);
  ASSERT_TRUE(lines_.WaitForTraces(0, 1));
  records::TraceRecord record;
  record.kind = records::TraceRecord::Kind::received;
  record.device = "feeder-1";
  record.hex = std::string(600, '4');
  for (int i = 0; i < 50'000; ++i) lines_.Push(0, record);
  records::TraceRecord last;
  last.text = "the last";
  bool noted = false;
  int received = 0;
  std::string line;
  do {
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
