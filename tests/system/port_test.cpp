// Ports of the running daemon: found when they appear, followed when they are renumbered, lent to
// another program and taken back; and what the flight recorder leaves of a failure.
// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>
#include <signal.h>
#include <unistd.h>

#include <nlohmann/json.hpp>
#include <sstream>

#include "tests/system/station.h"
#include "transports/port_lock.h"

namespace baudgate::system_test {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::json;
using ::testing::EndsWith;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;

constexpr int kGood = 0xC0;
constexpr int kNotConnected = 0x08;
constexpr int kOutOfService = 0x1C;

class Ports : public Station {
 protected:
  Ports() {
    PinProfile("dcon", "owen-mv110-8a", "module", {{"input_1", "100.25"}});
    PinProfile("dcon", "owen-mv110-8a", "other", {{"input_1", "-7.5"}});
  }

  /// One line "bay" on `port`, with one module.
  std::string Yaml(const fs::path& port) const {
    std::string head = Head();
    const std::string_view name = "gateway: { ";
    head.insert(name.size(), "socket: " + Socket() + ", recordings: " + Folder().string() + ", ");
    return head + "  - name: bay\n    port: " + port.string() +
           "\n    protocol: dcon\n    serial: 115200 8N1\n    devices:\n"
           "      - { name: bay-1, address: 1, profile: module, unit: 1, poll: 50ms }\n";
  }
  std::string Socket() const { return (directory() / "socket").string(); }
  fs::path Folder() const { return directory() / "recordings"; }
  Finished Release(std::vector<std::string> words) const {
    words.insert(words.begin(), "release");
    words.insert(words.end(), {"--socket", Socket()});
    return Command(words);
  }
  /// Of line bay, as `status` tells it.
  Json Status() const {
    const Finished status = Command({"status", "bay", "--json", "--socket", Socket()});
    EXPECT_EQ(status.code, 0) << status.errors;
    return Json::parse(status.output)["lines"][0];
  }
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

// ---------------------------------------------------------------- appearing and moving

TEST_F(Ports, AFolderThatComesLaterIsNotMissed) {
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
    // The last adapter goes, and with it the folder.
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
  EXPECT_TRUE(EventuallyLogged(*daemon, "line bay: down: " + LinkOf("usb-x") + " is gone"));
  EXPECT_TRUE(EventuallyFloat(client, 1, 0, -7.5F));
  EXPECT_TRUE(EventuallyQualityIs(kGood));
  const Json status = Status();
  EXPECT_EQ(status["port_state"], "open");
  EXPECT_EQ(status["port_text"], "serial " + LinkOf("usb-x") + " 115200 8N1");
  EXPECT_EQ(status["times_lost"], 1);
  EXPECT_TRUE(status["port_since"].is_string());
}

TEST_F(Ports, APortThatWasLostComesBackAgainAndAgain) {
  const auto daemon = StartDaemon(Yaml(LinkOf("bay")));
  for (int life = 0; life < 5; ++life) {
    const auto twin = StartTwin("bay", "module", "1");
    EXPECT_TRUE(EventuallyQualityIs(kGood)) << life;
    twin->Signal(SIGKILL);
    EXPECT_TRUE(EventuallyQualityIs(kNotConnected)) << life;
  }
}

// ---------------------------------------------------------------- lending

TEST_F(Ports, AReleasedPortIsFreeForOthersAndComesBackByItself) {
  const auto twin = StartTwin("bay", "module", "1");
  const auto daemon = StartDaemon(Yaml(LinkOf("bay")));
  ASSERT_TRUE(EventuallyQualityIs(kGood));
  EXPECT_FALSE(OpenExclusive(LinkOf("bay")).ok()) << "the daemon has it for itself";

  const Finished release = Release({"bay", "--for", "3s"});
  ASSERT_EQ(release.code, 0) << release.errors;
  EXPECT_EQ(client.Register(1, 20000), kOutOfService);
  EXPECT_EQ(Status()["port_state"], "released");
  EXPECT_TRUE(Status()["released_until"].is_string());
  const auto tool = OpenExclusive(LinkOf("bay"));
  ASSERT_TRUE(tool.ok()) << tool.error();
  EXPECT_TRUE(EventuallyLogged(*daemon, "is released for 3s"));

  // The time is over, but the vendor's tool still has it; the daemon says who that is.
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

TEST_F(Ports, AReleaseCountsAnewAndEndsWhenAsked) {
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
}

TEST_F(Ports, AReleasedLineDoesNotHoldUpTheStop) {
  const auto twin = StartTwin("bay", "module", "1");
  const auto daemon = StartDaemon(Yaml(LinkOf("bay")));
  ASSERT_TRUE(EventuallyQualityIs(kGood));
  ASSERT_EQ(Release({"bay", "--for", "1h"}).code, 0);
  EXPECT_EQ(client.Input(1, 0, 2).exception, 0x0B);
  daemon->Signal(SIGTERM);
  EXPECT_EQ(daemon->WaitForEnd(10s), 0);
}

// ---------------------------------------------------------------- recordings

TEST_F(Ports, ADeviceThatGoesOfflineLeavesARecordingThatReplays) {
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
  std::istringstream lines(decode.output);
  std::vector<Json> exchanges;
  for (std::string line; std::getline(lines, line);) exchanges.push_back(Json::parse(line));
  ASSERT_GT(exchanges.size(), 2U);
  ASSERT_EQ(exchanges.front()["outcome"], "ok");
  EXPECT_EQ(exchanges.front()["values"][0]["value"], 100.25);
  EXPECT_EQ(exchanges.back()["outcome"], "no_reply");
  EXPECT_EQ(exchanges.back()["device"], "bay-1");
}

/// An adapter that echoes although nobody said so sends the password back.
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
    trace = Command({"trace", "bay", "--last", "--socket", Socket()}).output;
    return trace.find(" > C8 01 ** ** ** ** ** ** ** ** | ..********") != std::string::npos &&
           trace.find("bay-1 < ") != std::string::npos;
  };
  ASSERT_TRUE(Eventually(has_password)) << trace;
  EXPECT_THAT(trace, HasSubstr(" < C8 01 ** ** ** ** ** ** ** **"));
  EXPECT_THAT(trace, Not(HasSubstr("30 30 30")));
  EXPECT_THAT(trace, Not(HasSubstr("000000 |")));
  const std::string file = Write("last.trace", trace).string();
  const Finished decode = Command({"decode", "--protocol", "set4tm", file});
  EXPECT_EQ(decode.code, 0) << decode.errors;
  EXPECT_THAT(decode.output, HasSubstr("secret bytes are masked"));
}

class Traces : public Station {
 protected:
  std::vector<Json> Decode(std::vector<std::string> words, const std::string& trace) const {
    words.insert(words.begin(), "decode");
    words.push_back(Write("saved.trace", trace).string());
    const Finished decode = Command(words);
    EXPECT_EQ(decode.code, 0) << decode.errors;
    std::vector<Json> exchanges;
    std::istringstream lines(decode.output);
    for (std::string line; std::getline(lines, line);) exchanges.push_back(Json::parse(line));
    return exchanges;
  }
};

TEST_F(Traces, AreDecodedLikeCaptures) {
  const auto exchanges = Decode({"--protocol", "dcon"}, R"(# baudgate 1.0
04:05:06.000000 - # port open: serial
04:05:06.000500 - < 41 | A
04:05:06.123456 ai-1 > 23 30 31 0D | #01.
04:05:06.140000 ai-1 < 3E 2B | >+
04:05:06.140100 ai-1 < 30 31 2E 35 30 30 0D | 01.500.
04:05:06.140300 ai-1 = ok, 16.8 ms
04:05:06.150000 - < 3E 39 | >9
04:05:07.000000 ai-2 > 23 30 32 0D | #02.
04:05:08.000000 ai-2 = no_reply
04:05:08.000001 ai-2 # offline: no_reply
)");
  ASSERT_EQ(exchanges.size(), 2U);
  ASSERT_EQ(exchanges[0]["outcome"], "ok") << exchanges[0];
  EXPECT_EQ(exchanges[0]["values"][0]["value"], 1.5);
  EXPECT_EQ(exchanges[0]["time"], "04:05:06.123456");
  EXPECT_EQ(exchanges[0]["device"], "ai-1");
  EXPECT_EQ(exchanges[1]["outcome"], "no_reply");
}

TEST_F(Traces, OfOneDevice) {
  const std::string trace =
      "04:05:06.123456 ai-1 > 23 30 31 0D | #01.\n04:05:06.223456 ai-2 > 23 30 32 0D | #02.\n"
      "04:05:06.323456 ai-2 < 3E 2B 30 31 2E 30 30 30 0D | >+01.000.\n";
  const auto exchanges = Decode({"--protocol", "dcon", "--device", "ai-2"}, trace);
  ASSERT_EQ(exchanges.size(), 1U);
  EXPECT_EQ(exchanges[0]["device"], "ai-2");
  ASSERT_EQ(exchanges[0]["outcome"], "ok") << exchanges[0];
  EXPECT_EQ(exchanges[0]["values"][0]["value"], 1.0);
}

TEST_F(Traces, MaskedBytesAreNoErrors) {
  const auto meter = Decode({"--protocol", "set4tm"}, R"(
04:05:06.000000 m > 05 01 ** ** ** ** ** ** ** ** | ..********
04:05:06.010000 m < 05 03 42 E1 | ..B.
04:05:06.010100 m = refused, 10.0 ms
04:05:07.000000 m > 05 01 ** ** ** ** ** ** ** ** | ..********
04:05:07.010000 m < 05 03 42 E1 | ..B.
04:05:08.000000 m > 05 01 ** ** ** ** ** ** ** ** | ..********
04:05:08.010000 m < 05 01 ** ** ** ** ** ** ** ** | ..********
04:05:08.010100 m = unexpected, 10.0 ms
04:05:09.000000 m > 05 01 ** ** ** ** ** ** ** ** | ..********
)");
  ASSERT_EQ(meter.size(), 4U);
  const char* const outcomes[] = {"refused", "none", "unexpected", "no_reply"};
  for (std::size_t i = 0; i < meter.size(); ++i) {
    EXPECT_EQ(meter[i]["outcome"], outcomes[i]) << i;
    EXPECT_THAT(meter[i]["reason"].get<std::string>(), HasSubstr("masked")) << i;
    EXPECT_THAT(meter[i]["reason"].get<std::string>(), Not(HasSubstr("rong"))) << i;
    EXPECT_THAT(meter[i]["values"], IsEmpty()) << i;
  }
  const auto relay = Decode({"--protocol", "spabus"}, R"(
> 3E 31 57 56 31 36 30 3A ** ** ** 3A ** ** 0D
< 0A 3C 31 41 3A 37 36 0D 0A
)");
  ASSERT_EQ(relay.size(), 1U);
  EXPECT_EQ(relay[0]["outcome"], "ok") << relay[0]["reason"];
  EXPECT_THAT(relay[0]["reason"].get<std::string>(), HasSubstr("masked"));
}

TEST_F(Traces, WithBadHexAreRefused) {
  const std::string file =
      Write("bad.trace", "04:05:06.123456 ai-1 > 23 3* 31 0D | #01.\n").string();
  const Finished decode = Command({"decode", "--protocol", "dcon", file});
  EXPECT_EQ(decode.code, 2);
  EXPECT_THAT(decode.errors, HasSubstr("line 1"));
}

}  // namespace
}  // namespace baudgate::system_test
