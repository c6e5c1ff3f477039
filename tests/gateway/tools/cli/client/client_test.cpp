// The subcommands against a control server: what they print, and their exit codes.
// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <sstream>

#include "gateway/tools/cli/client/control_client.h"
#include "gateway/tools/cli/client/operation.h"
#include "gateway/tools/cli/client/status.h"
#include "tests/gateway/outputs/control/fixture.h"

namespace baudgate::control {
namespace {

using ::testing::ElementsAre;
using ::testing::EndsWith;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::StartsWith;

class ClientTest : public ControlTest {
 protected:
  int Status(const std::string& target, bool json = false) {
    Clear();
    return RunStatus({.target = target, .json = json, .socket = path()}, out_, err_);
  }
  int Release(const std::string& line, Duration time, bool end = false) {
    Clear();
    return RunRelease({line, time, end, path()}, out_, err_);
  }
  int InUse(const std::string& target, bool in_use) {
    Clear();
    return RunInUse({target, in_use, path()}, out_, err_);
  }
  void Clear() {
    out_.str({});
    err_.str({});
  }

  std::ostringstream out_;
  std::ostringstream err_;
};

TEST_F(ClientTest, StatusShowsTablesOrJson) {
  StartServer();
  EXPECT_EQ(Status(""), 0) << err_.str();
  EXPECT_THAT(out_.str(), StartsWith("substation-7: baudgate 1.2.3, up "));
  EXPECT_EQ(Status("bay-1", true), 0);
  EXPECT_EQ(Json::parse(out_.str())["lines"].size(), 1U);
  EXPECT_THAT(err_.str(), IsEmpty());
}

TEST(CureOfSilence, NamesAProcessThatIsStopped) {
  const pid_t child = ::fork();
  if (child == 0) {
    ::raise(SIGSTOP);
    ::_exit(0);
  }
  ::waitpid(child, nullptr, WUNTRACED);
  const std::string id = std::to_string(child);
  EXPECT_EQ(CureOfSilence(child),
            "process " + id + " is stopped; let it go on with: kill -CONT " + id);
  ::kill(child, SIGKILL);
  ::waitpid(child, nullptr, 0);
  EXPECT_EQ(
      CureOfSilence(child),
      "process " + id +
          " may be frozen or have no processor time; look at: systemctl status baudgate, top");
  EXPECT_THAT(CureOfSilence(0), StartsWith("it may be frozen"));
}

TEST_F(ClientTest, AWatchedStatusLeavesTheTerminalAsItWas) {
  StartServer();
  const StatusOptions options{.target = "",
                              .socket = path(),
                              .terminal = TableView{.width = 80, .height = 24},
                              .watch = true,
                              .seconds = 1ms};
  EXPECT_EQ(RunStatusWatch(options, out_, err_), 0) << err_.str();
  EXPECT_THAT(out_.str(), StartsWith("\x1b[?1049h"));
  EXPECT_THAT(out_.str(), HasSubstr("\x1b[Hsubstation-7: baudgate 1.2.3, up "));
  EXPECT_THAT(out_.str(), EndsWith("\x1b[?1049l"));
  StopServer();
  Clear();
  EXPECT_EQ(RunStatusWatch(options, out_, err_), 4);
  EXPECT_THAT(out_.str(), IsEmpty()) << "what is wrong stands in the terminal as it is";
  EXPECT_THAT(err_.str(), HasSubstr("no gateway answers"));
}

class PointsClient : public ClientTest {
 protected:
  PointsClient() {
    config::Point& point = config_.lines[1].devices[0].points[0];
    point.name = "setting";
    point.type = config::Type::float32;
    point.access = config::Access::read_write;
    point.writing.allowed = true;
    point.writing.max = 10;
  }
  int Write(const std::string& value, bool json = false) {
    Clear();
    return RunWrite({"io.ai-1.setting", value, false, json, path()}, out_, err_);
  }
};

TEST_F(PointsClient, AWriteSaysWhatBecameOfIt) {
  StartServer();
  EXPECT_EQ(Write("7.5"), 0) << err_.str();
  EXPECT_EQ(out_.str(), "io.ai-1.setting: 7.5 written, and read back\n");
  lines_.result = {};
  EXPECT_EQ(Write("7.5"), 0);
  EXPECT_EQ(out_.str(), "io.ai-1.setting: 7.5 written, confirmed by the device; not read back\n");
  lines_.result = {WriteEnd::unknown, "no reply"};
  EXPECT_EQ(Write("7.5"), kNotDone);
  EXPECT_THAT(out_.str(), IsEmpty());
  EXPECT_EQ(err_.str(),
            "io.ai-1.setting: sent, and nobody knows what became of it: no reply; read it before "
            "you try again\n");
  lines_.result = {WriteEnd::refused, "NACK 5"};
  EXPECT_EQ(Write("7.5"), kNotDone);
  EXPECT_EQ(err_.str(), "io.ai-1.setting: refused: NACK 5\n");
  EXPECT_EQ(Write("7.5", true), kNotDone);
  EXPECT_EQ(out_.str(), "{\"end\":\"refused\",\"reason\":\"NACK 5\",\"read_back\":false}\n");
}

TEST_F(PointsClient, WhatIsNotWrittenSaysWhy) {
  StartServer();
  EXPECT_EQ(Write("11"), kNotDone);
  EXPECT_THAT(err_.str(), HasSubstr("not written: 'setting': 11 is above the maximum"));
  EXPECT_EQ(Write("much"), 2);
  EXPECT_THAT(err_.str(), HasSubstr("is not a value of 'setting'"));
  StopServer();
  EXPECT_EQ(Write("1"), 4);
}

TEST_F(PointsClient, ReadPrintsATable) {
  const Sample sample{0, 5.25, Quality::good};
  store_.Update(2, {&sample, 1}, ReadClocks(), 10ms);
  StartServer();
  EXPECT_EQ(RunRead({"io.ai-1.setting", false, path()}, out_, err_), 0) << err_.str();
  EXPECT_THAT(out_.str(), StartsWith("point    value  unit  quality  age\nsetting  5.25   A     "));
  Clear();
  lines_.result = {.reason = "the device is offline"};
  EXPECT_EQ(RunRead({"io.ai-1.setting", false, path()}, out_, err_), kNotDone);
  EXPECT_THAT(out_.str(), HasSubstr("setting  5.25   A     not read now; before: "));
  EXPECT_THAT(err_.str(), HasSubstr("io.ai-1.setting: the device is offline"));
}

TEST_F(ClientTest, UnknownNamesAreWrongUsage) {
  StartServer();
  EXPECT_EQ(Status("bay-2"), 2);
  EXPECT_THAT(err_.str(), HasSubstr("there is no line 'bay-2'; did you mean 'bay-1'?"));
  EXPECT_EQ(Release("bay-2", 1min), 2);
  EXPECT_EQ(InUse("bay-1.feeder-3", false), 2);
  EXPECT_THAT(out_.str(), IsEmpty());
}

TEST_F(ClientTest, WithoutAGatewayTheySayWhereTheyLooked) {
  EXPECT_EQ(Status(""), 4);
  EXPECT_THAT(err_.str(), HasSubstr("no gateway answers at " + path()));
  EXPECT_THAT(err_.str(), HasSubstr("is baudgate running? give --socket PATH"));
  EXPECT_EQ(Release("io", 1min), 4);
  EXPECT_EQ(InUse("io.ai-1", true), 4);
}

TEST_F(ClientTest, TheOneGatewayInTheDefaultPlacesIsFound) {
  const RuntimeDirectory runtime(directory_);
  std::filesystem::create_directory(directory_ / "baudgate");
  const auto connect = [] { return ControlClient::Connect({}); };
  // A gateway of this machine's own would be found as well, so nothing is expected before.
  config_.socket = (directory_ / "baudgate" / "a.sock").string();
  StartServer();
  asio::io_context io;
  config::Config other = config_;
  other.socket = (directory_ / "baudgate" / "b.sock").string();
  {
    ControlServer second(other, store_, lines_, lines_, {"1", kStarted}, io);
    ASSERT_TRUE(second.Listen());
    const auto several = connect();
    ASSERT_FALSE(several);
    EXPECT_THAT(several.error(), HasSubstr("several gateways run here"));
    EXPECT_THAT(several.error(), HasSubstr(config_.socket + ", " + other.socket));
    second.Stop();
  }
  {
    const asio::local::stream_protocol::acceptor dead(
        io, asio::local::stream_protocol::endpoint(other.socket));
  }
  const auto one = connect();
  ASSERT_TRUE(one) << one.error();
  EXPECT_EQ(one->path(), config_.socket) << "what a dead process left does not count";
}

TEST_F(ClientTest, ReleaseWaitsForThePortAndSaysUntilWhen) {
  SetOpen(store_, 1, "serial");
  StartServer();
  EXPECT_EQ(Release("io", 10min), 0) << err_.str();
  EXPECT_THAT(out_.str(), StartsWith("io: /dev/ttyUSB1 is free for another program until "));
  EXPECT_THAT(out_.str(), HasSubstr(" UTC; its points are out of service meanwhile"));
  EXPECT_EQ(Release("io", 10min, true), 0);
  EXPECT_EQ(out_.str(), "io: taken back; the port is open: serial\n");
  EXPECT_EQ(Release("io", 10min, true), 0);
  EXPECT_EQ(out_.str(), "io: was not released\n");
  EXPECT_EQ(Release("io", 25h), 2);
  EXPECT_THAT(err_.str(), HasSubstr("from 1s to 24h"));
  EXPECT_THAT(lines_.calls(), ElementsAre("release 1 for 10min", "take back 1", "take back 1"));
}

TEST_F(ClientTest, InUseSaysThatARestartForgets) {
  StartServer();
  EXPECT_EQ(InUse("bay-1.feeder-2", false), 0);
  EXPECT_EQ(out_.str(),
            "bay-1.feeder-2: out of use, it is not asked and its points are out of service. A "
            "restart forgets this: 'enabled: false' in the configuration keeps it\n");
  EXPECT_EQ(InUse("bay-1.feeder-2", true), 0);
  EXPECT_EQ(out_.str(), "bay-1.feeder-2: in use, it is asked again\n");
}

}  // namespace
}  // namespace baudgate::control
