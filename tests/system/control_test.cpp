// Tests the user's commands that use the control socket of the running daemon.
// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>
#include <signal.h>

#include <filesystem>
#include <fstream>
#include <iterator>

#include "tests/system/three_devices.h"

namespace baudgate::system_test {
namespace {

namespace fs = std::filesystem;

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;
using ::testing::StartsWith;

constexpr int kOutOfService = 0x1C;

/// Three lines: a relay that answers, a device that does not exist, and a line without its port.
class Control : public ThreeDevices {
 protected:
  std::string YamlOf(const std::string& head) const {
    return head +
           Line("relay", "spabus", "address: 7, profile: relay, unit: 1, poll: 1s",
                "serial: 38400 7E1") +
           "      - { name: ghost, address: 9, profile: relay }\n" +
           Line("io", "dcon", "address: 1, profile: module, unit: 11");
  }

  void StartRelay() {
    relay = StartTwin("relay", "relay", "7");
    daemon = StartDaemon(YamlOf(WithSocket(Head())));
    ASSERT_TRUE(EventuallyQuality(client, kRelayUnit, 0, kGood));
  }
};

TEST_F(Control, PointsAreReadAndWrittenFromTheCommandLine) {
  const auto module = StartTwin("io", "icpdas-i-7024", "1");
  daemon = StartDaemon(WithSocket(Head()) +
                       Line("io", "dcon",
                            "address: 1, profile: icpdas-i-7024, unit: 11, poll: 10min, "
                            "write: [output_0]"));
  ASSERT_TRUE(EventuallyQuality(client, 11, 0, kGood));
  const Finished done = Ask({"write", "io.io-1.output_0", "7.125"});
  EXPECT_EQ(done.code, 0) << done.errors;
  EXPECT_EQ(done.output, "io.io-1.output_0: 7.125 written, and read back\n");
  const Finished one = Ask({"read", "io.io-1.output_0", "--json"});
  EXPECT_EQ(one.code, 0) << one.errors;
  const Json read = Json::parse(one.output, nullptr, false);
  EXPECT_EQ(read["points"][0]["value"], 7.125);
  EXPECT_LT(read["points"][0]["age_ms"], 60'000) << "asked now, although its poll is 10 minutes";
  const Finished denied = Ask({"write", "io.io-1.output_1", "-1"});
  EXPECT_EQ(denied.code, 1);
  EXPECT_THAT(denied.errors, HasSubstr("'write: allow' or a list of points"));
  module->Signal(SIGKILL);
  const Finished lost = Ask({"write", "io.io-1.output_0", "1"});
  EXPECT_EQ(lost.code, 1);
  EXPECT_EQ(lost.output, "");
  EXPECT_EQ(Ask({"write", "io.io-1.output_9", "1"}).code, 2);
  EXPECT_EQ(Ask({"read", "io"}).code, 2);
}

TEST_F(Control, StatusReportsTheStateOfEachDevice) {
  StartRelay();
  ASSERT_TRUE(Eventually([&] { return Status("relay")["lines"][0]["notice_bound_ms"] > 0; }))
      << "the ghost is not missed";
  const Finished text = Ask({"status"});
  EXPECT_EQ(text.code, 0) << text.errors;
  EXPECT_THAT(text.output, StartsWith(gateway() + ": baudgate "));
  EXPECT_THAT(text.output, HasSubstr("\nrelay.relay-1  online "));
  EXPECT_THAT(text.output, HasSubstr("\nrelay.ghost: has never answered: "));
  EXPECT_THAT(text.output, HasSubstr("\nio: port closed"));

  const Json line = Status("relay")["lines"][0];
  EXPECT_EQ(line["port_state"], "open");
  const Json device = line["devices"][0];
  EXPECT_EQ(device["state"], "online");
  std::uint64_t counted = 0;
  for (const Json& bucket : device["round_trips"]["histogram"]) {
    counted += bucket["count"].get<std::uint64_t>();
  }
  EXPECT_EQ(counted, device["round_trips"]["count"]);
  const Finished one = Ask({"status", "relay.relay-1"});
  EXPECT_THAT(one.output, AllOf(HasSubstr("current_l1"), HasSubstr("1.25"), HasSubstr("good")));

  const Finished unknown = Ask({"status", "realy"});
  EXPECT_EQ(unknown.code, 2);
  EXPECT_THAT(unknown.errors, HasSubstr("did you mean 'relay'? lines: relay, io"));
}

TEST_F(Control, CommandsExitWithCodeFourWithoutAGateway) {
  for (const std::vector<std::string>& words : std::vector<std::vector<std::string>>{
           {"status"}, {"release", "x"}, {"trace", "x"}, {"enable", "x.y"}, {"disable", "x.y"}}) {
    const Finished none = Ask(words);
    EXPECT_EQ(none.code, 4) << words[0];
    EXPECT_THAT(none.errors, HasSubstr("start baudgate, or name its socket with --socket PATH"))
        << words[0];
  }
}

TEST_F(Control, ADeviceIsTakenOutOfUseAndBack) {
  StartRelay();
  EXPECT_EQ(Ask({"disable", "relay.relay-1"}).code, 0);
  EXPECT_TRUE(EventuallyQuality(client, kRelayUnit, 0, kOutOfService));
  EXPECT_THAT(Ask({"status", "relay"}).output, HasSubstr("disabled at run time"));
  EXPECT_EQ(Ask({"enable", "relay.relay-1"}).code, 0);
  EXPECT_TRUE(EventuallyQuality(client, kRelayUnit, 0, kGood));
  EXPECT_EQ(Ask({"disable", "relay"}).code, 2);
}

TEST_F(Control, ATraceShowsTheBytesAndEndsCleanly) {
  StartRelay();
  const auto trace = Start({"trace", "relay", "--device", "relay-1", "--socket", socket()});
  EXPECT_TRUE(Eventually([&] {
    const std::string text = trace->Output();
    return text.find(" relay-1 > 3E 37 ") != std::string::npos &&
           text.find(" relay-1 < ") != std::string::npos &&
           text.find(" relay-1 = ok") != std::string::npos;
  })) << trace->Errors();
  trace->Signal(SIGINT);
  EXPECT_EQ(trace->WaitForEnd(), 0);
  EXPECT_THAT(trace->Output(), Not(HasSubstr(" ghost ")));
  EXPECT_THAT(trace->Errors(), IsEmpty());

  const auto other = Start({"trace", "relay", "--socket", socket()});
  EXPECT_TRUE(Eventually([&] { return !other->Output().empty(); }));
  daemon->Signal(SIGTERM);
  EXPECT_EQ(other->WaitForEnd(), 4);
  // The text ends in "has closed the connection" if a record was being sent, so only its begin is
  // compared.
  EXPECT_THAT(other->Errors(), HasSubstr("the trace has ended: the gateway "));
  EXPECT_EQ(daemon->WaitForEnd(), 0);
  EXPECT_FALSE(fs::exists(socket()));
}

TEST_F(Control, ARecordedTraceIsDecoded) {
  StartRelay();
  const Finished last = Ask({"trace", "relay", "--device", "relay-1", "--last"});
  ASSERT_EQ(last.code, 0) << last.errors;
  const std::string file = Write("last.txt", last.output).string();
  const Finished decoded = Command({"decode", "--protocol", "spabus", file});
  ASSERT_EQ(decoded.code, 0) << decoded.errors << last.output;
  const auto exchanges = JsonLines(decoded.output);
  const auto good =
      std::ranges::count_if(exchanges, [](const Json& one) { return one["outcome"] == "ok"; });
  EXPECT_GT(good, 0) << last.output;
}

TEST_F(Control, TheGatewayPollsWithoutItsControlSocket) {
  relay = StartTwin("relay", "relay", "7");
  std::string head = WithSocket(Head());
  head.replace(head.find(socket()), socket().size(), "/nowhere/gate.sock");
  daemon = StartDaemon(YamlOf(head));
  EXPECT_TRUE(EventuallyQuality(client, kRelayUnit, 0, kGood));
  EXPECT_THAT(daemon->Errors(), HasSubstr("/nowhere/gate.sock: No such file or directory"));
}

TEST_F(Control, AGatewayIsFoundWithoutTheSocketOption) {
  relay = StartTwin("relay", "relay", "7");
  const std::string yaml =
      Head() + Line("relay", "spabus", "address: 7, profile: relay, unit: 1", "serial: 38400 7E1");
  daemon = Start({"run", "-c", Write("baudgate.yaml", yaml).string()});
  ASSERT_TRUE(EventuallyQuality(client, kRelayUnit, 0, kGood));
  const auto status = Start({"status"});
  // If another gateway of this machine runs in /run/baudgate, the command names both gateways.
  const auto code = status->WaitForEnd();
  EXPECT_THAT(status->Output() + status->Errors(), HasSubstr(gateway()));
  EXPECT_TRUE(code == 0 || code == 4);
}

class SettingsOfATwin : public ThreeDevices {
 protected:
  void SetUp() override {
    relay = StartTwin("relay", "spaj140c", "7");
    daemon = StartDaemon(WithSocket(Head()) +
                         Line("relay", "spabus", "address: 7, profile: spaj140c, unit: 1, slow: 1s",
                              "serial: 38400 7E1"));
    ASSERT_TRUE(Eventually([&] { return Settings("dump", {}).code == 0; }));
  }

  std::string file() const { return (directory() / "relay.yaml").string(); }
  Finished Settings(const std::string& what, std::vector<std::string> more) const {
    more.insert(more.begin(), {"settings", what, "relay.relay-1"});
    return Ask(more);
  }
};

TEST_F(SettingsOfATwin, AreDumpedComparedAndNotWrittenWithoutPermission) {
  ASSERT_EQ(Settings("dump", {file()}).code, 0);
  EXPECT_EQ(Settings("dump", {file()}).code, 4) << "it is there";
  const Finished same = Settings("compare", {file()});
  EXPECT_EQ(same.code, 0) << same.errors;
  EXPECT_THAT(same.output, HasSubstr("relay.relay-1 (SPCJ 4D29): no setting differs"));

  std::ifstream stream(file());
  std::string text{std::istreambuf_iterator<char>(stream), {}};
  const std::string held = "item: \"S24\", value: \"0.08\"";
  ASSERT_NE(text.find(held), std::string::npos) << text;
  text.replace(text.find(held), held.size(), "item: \"S24\", value: 0.3");
  std::ofstream(file()) << text;
  for (const char* what : {"compare", "restore"}) {
    const Finished differs = Settings(what, {file()});
    EXPECT_EQ(differs.code, 3) << what;
    EXPECT_THAT(differs.output, HasSubstr("main_phase_high_time  S24   0.08    0.3   s"));
  }
  for (const bool confirmed : {false, true}) {
    const Finished denied =
        Settings("restore", confirmed ? std::vector<std::string>{file(), "--confirm"}
                                      : std::vector<std::string>{file()});
    EXPECT_EQ(denied.code, 3);
    EXPECT_THAT(denied.errors,
                HasSubstr("main_phase_high_time (S24) would be denied: 'main_phase_high_time' may "
                          "not be written: add it to 'write' of the device in the configuration"));
    EXPECT_THAT(denied.output, HasSubstr("nothing is written: 1 setting of 1 would be denied"));
  }
  EXPECT_EQ(Settings("restore", {}).code, 2);
}

}  // namespace
}  // namespace baudgate::system_test
