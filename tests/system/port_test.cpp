// Tests ports that appear, get another number or are lent, and the flight recorder's recordings.
// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>
#include <signal.h>
#include <unistd.h>

#include "tests/system/station.h"
#include "tests/system/taken_server.h"
#include "transports/serial_port.h"

namespace baudgate::system_test {
namespace {

namespace fs = std::filesystem;
using ::testing::EndsWith;
using ::testing::HasSubstr;
using ::testing::Not;

constexpr int kOutOfService = 0x1C;

class Ports : public Station {
 protected:
  Ports() {
    PinProfile("dcon", "owen-mv110-8a", "module", {{"input_1", "100.25"}});
    PinProfile("dcon", "owen-mv110-8a", "other", {{"input_1", "-7.5"}});
  }

  std::string Yaml(const fs::path& port) const {
    return WithSocket(Head(), "recordings: " + Folder().string() + ", ") +
           "  - name: bay\n    port: " + port.string() +
           "\n    protocol: dcon\n    serial: 115200 8N1\n    devices:\n"
           "      - { name: bay-1, address: 1, profile: module, unit: 1, poll: 50ms }\n";
  }
  fs::path Folder() const { return directory() / "recordings"; }
  Finished Release(std::vector<std::string> words) const {
    words.insert(words.begin(), "release");
    return Ask(words);
  }
  Json Status() const { return Station::Status("bay")["lines"][0]; }
  bool EventuallyQualityIs(int quality) { return EventuallyQuality(client, 1, 0, quality); }
  std::vector<fs::path> Recordings() const {
    std::vector<fs::path> files;
    std::error_code none_yet;
    for (const auto& file : fs::directory_iterator(Folder(), none_yet)) {
      if (file.path().extension() == ".trace") files.push_back(file.path());
    }
    return files;
  }

  ModbusClient client{port()};
};

TEST_F(Ports, APortInAFolderThatIsCreatedLaterIsFound) {
  const fs::path by_id = directory() / "serial" / "by-id";
  const auto daemon = StartDaemon(Yaml(by_id / "usb-x"));
  EXPECT_TRUE(EventuallyQualityIs(kNotConnected));
  EXPECT_TRUE(EventuallyLogged(*daemon, "no such port"));
  const auto twin = StartTwin("tty0", "module", "1");
  for (int plugged = 0; plugged < 2; ++plugged) {
    fs::create_directories(by_id);
    fs::create_symlink("../../tty0", by_id / "usb-x");
    EXPECT_TRUE(EventuallyQualityIs(kGood));
    EXPECT_EQ(client.Float(1, 0), 100.25F);
    fs::remove_all(by_id);
    if (plugged > 0) break;
    ASSERT_EQ(Release({"bay", "--for", "1s"}).code, 0);
    EXPECT_TRUE(EventuallyQualityIs(kNotConnected));
  }
}

TEST_F(Ports, AStableNameIsFollowedWhenTheAdapterIsRenumbered) {
  auto first = StartTwin("tty0", "module", "1");
  fs::create_symlink("tty0", directory() / "usb-x");
  const auto daemon = StartDaemon(Yaml(directory() / "usb-x"));
  ASSERT_TRUE(EventuallyFloat(client, 1, 0, 100.25F));

  const auto second = StartTwin("tty1", "other", "1");
  fs::remove(directory() / "usb-x");
  fs::create_symlink("tty1", directory() / "usb-x");
  first->Signal(SIGKILL);
  EXPECT_TRUE(EventuallyLogged(*daemon, "line bay: port down: " + LinkOf("usb-x") + " is gone"));
  EXPECT_TRUE(EventuallyFloat(client, 1, 0, -7.5F));
  EXPECT_TRUE(EventuallyQualityIs(kGood));
  const Json status = Status();
  EXPECT_EQ(status["port_state"], "open");
  EXPECT_EQ(status["port_text"], "serial " + LinkOf("usb-x") + " 115200 8N1");
  EXPECT_EQ(status["times_lost"], 1);
  EXPECT_TRUE(status["port_since"].is_string());
}

TEST_F(Ports, ALostPortComesBackRepeatedly) {
  const auto daemon = StartDaemon(Yaml(LinkOf("bay")));
  for (int life = 0; life < 5; ++life) {
    const auto twin = StartTwin("bay", "module", "1");
    EXPECT_TRUE(EventuallyQualityIs(kGood)) << life;
    twin->Signal(SIGKILL);
    EXPECT_TRUE(EventuallyQualityIs(kNotConnected)) << life;
  }
}

TEST_F(Ports, ABusyServerIsReportedOnceUntilItServes) {
  TakenServer server(FreePort());
  ASSERT_TRUE(server.listening());
  const std::string port = "tcp://127.0.0.1:" + std::to_string(server.port());
  const auto daemon = StartDaemon(Yaml(port));
  ASSERT_TRUE(Eventually([&] { return server.connections() >= 2; }));
  const auto closed = [&] { return Status()["port_state"] == "closed"; };
  ASSERT_TRUE(Eventually(closed));
  const Json before = Status();

  ASSERT_TRUE(Eventually([&] { return server.connections() >= 4; }));
  EXPECT_GE(server.Between(2, 3), 1200ms) << "2 s, were it not for jitter and a slow machine";
  ASSERT_TRUE(Eventually(closed));
  const Json status = Status();
  EXPECT_EQ(status["port_since"], before["port_since"]);
  EXPECT_THAT(status["port_text"].get<std::string>(), HasSubstr(port));
  EXPECT_THAT(status["advice"][0].get<std::string>(), HasSubstr("before any good reply"));

  server.Serve();
  EXPECT_TRUE(Eventually([&] { return Status()["port_state"] == "open"; }));
}

TEST_F(Ports, AReleasedPortIsFreeForOthersAndComesBackByItself) {
  const auto twin = StartTwin("bay", "module", "1");
  const auto daemon = StartDaemon(Yaml(LinkOf("bay")));
  ASSERT_TRUE(EventuallyQualityIs(kGood));
  EXPECT_FALSE(transports::OpenExclusive(LinkOf("bay")).ok()) << "the daemon has it for itself";

  const std::string time = FormatDuration(kLongEnough);
  const Finished release = Release({"bay", "--for", time});
  ASSERT_EQ(release.code, 0) << release.errors;
  EXPECT_THAT(release.output, HasSubstr("is free for another program until "));
  EXPECT_EQ(client.Register(1, 20000), kOutOfService);
  EXPECT_EQ(Status()["port_state"], "released");
  EXPECT_TRUE(Status()["released_until"].is_string());
  EXPECT_THAT(Ask({"status"}).output, HasSubstr("\nbay: released: the port is lent until "));
  const auto tool = transports::OpenExclusive(LinkOf("bay"));
  ASSERT_TRUE(tool.ok()) << tool.error();
  EXPECT_TRUE(EventuallyLogged(*daemon, "is released for " + time));

  // The other program still has the port open, so the daemon names that program.
  EXPECT_TRUE(EventuallyLogged(*daemon, "takes " + LinkOf("bay") + " back"));
  EXPECT_TRUE(EventuallyLogged(*daemon, "in use by"));
  EXPECT_THAT(daemon->Errors(), HasSubstr("(pid " + std::to_string(::getpid()) + ")"));
  EXPECT_TRUE(EventuallyQualityIs(kNotConnected));
  const Json busy = Status();
  EXPECT_EQ(busy["port_state"], "closed");
  EXPECT_THAT(busy["port_text"].get<std::string>(), HasSubstr("in use by"));
  EXPECT_TRUE(busy["released_until"].is_null());
  EXPECT_EQ(busy["times_lost"], 0) << "given away is not lost";
  ::close(*tool);
  EXPECT_TRUE(EventuallyQualityIs(kGood));
  EXPECT_EQ(client.Float(1, 0), 100.25F);
}

TEST_F(Ports, ASecondReleaseRestartsTheTimeAndEndsOnCommand) {
  const auto twin = StartTwin("bay", "module", "1");
  const auto daemon = StartDaemon(Yaml(LinkOf("bay")));
  ASSERT_TRUE(EventuallyQualityIs(kGood));
  ASSERT_EQ(Release({"bay", "--for", "1s"}).code, 0);
  ASSERT_EQ(Release({"bay", "--for", "1h"}).code, 0);
  EXPECT_TRUE(EventuallyLogged(*daemon, "is released for 1h"));
  const auto is_back = [&] { return client.Register(1, 20000) != kOutOfService; };
  EXPECT_FALSE(Eventually(is_back, 2s)) << "the first release has ended the second";
  EXPECT_EQ(Release({"bay", "--end"}).code, 0);
  EXPECT_TRUE(EventuallyQualityIs(kGood));
  EXPECT_EQ(Release({"bay", "--for", "25h"}).code, 2);
  EXPECT_EQ(Release({"bay", "--for", "10"}).code, 2);
}

TEST_F(Ports, AReleasedLineDoesNotDelayTheStop) {
  const auto twin = StartTwin("bay", "module", "1");
  const auto daemon = StartDaemon(Yaml(LinkOf("bay")));
  ASSERT_TRUE(EventuallyQualityIs(kGood));
  ASSERT_EQ(Release({"bay", "--for", "1h"}).code, 0);
  EXPECT_EQ(client.Input(1, 0, 2).exception, 0x0B);
  daemon->Signal(SIGTERM);
  EXPECT_EQ(daemon->WaitForEnd(10s), 0);
}

TEST_F(Ports, ADeviceThatGoesOfflineLeavesARecordingThatDecodes) {
  const auto twin = StartTwin("bay", "module", "1");
  const auto daemon = StartDaemon(Yaml(LinkOf("bay")));
  ASSERT_TRUE(EventuallyQualityIs(kGood));
  twin->Signal(SIGSTOP);
  ASSERT_TRUE(Eventually([&] { return !Recordings().empty(); }));
  const fs::path file = Recordings()[0];
  EXPECT_THAT(file.filename().string(), HasSubstr("bay-20"));
  EXPECT_THAT(file.filename().string(), EndsWith("-bay-1-offline.trace"));
  EXPECT_THAT(ReadWholeFile(file), HasSubstr(" bay-1 # offline"));

  const Finished decode = Command(
      {"decode", "--protocol", "dcon", "--profile", "module", "--device", "bay-1", file.string()});
  ASSERT_EQ(decode.code, 0) << decode.errors;
  const auto exchanges = JsonLines(decode.output);
  ASSERT_GT(exchanges.size(), 2U);
  ASSERT_EQ(exchanges.front()["outcome"], "ok");
  EXPECT_EQ(exchanges.front()["values"][0]["value"], 100.25);
  EXPECT_EQ(exchanges.back()["outcome"], "no_reply");
  EXPECT_EQ(exchanges.back()["device"], "bay-1");
}

/// The adapter echoes, which is not configured, so the echo contains the password.
TEST_F(Ports, APasswordIsInNoTrace) {
  PinProfile("set4tm", "set-4tm.03m", "meter", {{"frequency", "50.03125"}});
  const auto twin = Start({"simulate", "--profile", "meter", "--address", "200", "--pty",
                           LinkOf("bay"), "--fault", "echo"});
  std::string yaml = Yaml(LinkOf("bay"));
  for (const auto& [from, to] : {std::pair<std::string, std::string>{"dcon", "set4tm"},
                                 {"address: 1", "address: 200"},
                                 {"profile: module", "profile: meter"}}) {
    yaml.replace(yaml.find(from), from.size(), to);
  }
  const auto daemon = StartDaemon(yaml);
  std::string trace;
  const auto has_password = [&] {
    trace = Ask({"trace", "bay", "--last"}).output;
    return trace.find(" > C8 01 ** ** ** ** ** ** ** ** | ..********") != std::string::npos &&
           trace.find("bay-1 < ") != std::string::npos;
  };
  ASSERT_TRUE(Eventually(has_password)) << trace;
  EXPECT_THAT(trace, HasSubstr(" < ** "));
  EXPECT_THAT(trace, Not(HasSubstr("30 30 30")));
  EXPECT_THAT(trace, Not(HasSubstr("000000 |")));
  const std::string file = Write("last.trace", trace).string();
  const Finished decode = Command({"decode", "--protocol", "set4tm", file});
  EXPECT_EQ(decode.code, 0) << decode.errors;
  EXPECT_THAT(decode.output, HasSubstr("secret bytes are masked"));
}

}  // namespace
}  // namespace baudgate::system_test
