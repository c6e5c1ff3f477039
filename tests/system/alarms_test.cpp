// The alarms that the gateway raises itself: of a routed slave that leaves a client without a
// reply, of a device and a port, with and without events, over a restart and a reload.
// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>

#include <csignal>
#include <filesystem>
#include <fstream>
#include <thread>

#include "tests/system/libmodbus_slave.h"
#include "tests/system/null_modem.h"
#include "tests/system/routes_fixture.h"

namespace baudgate::system_test {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

class Alarms : public Routes {
 protected:
  std::vector<Json> All() const { return JsonLines(Ask({"alarms", "--json"}).output); }
  /// "drive unit-20 no answer to clients active high".
  std::vector<std::string> Shown() const {
    std::vector<std::string> shown;
    for (const Json& alarm : All()) {
      std::string text;
      for (const char* key : {"line", "device", "name", "state", "priority"}) {
        text += (text.empty() ? "" : " ") + alarm.at(key).get<std::string>();
      }
      shown.push_back(text);
    }
    return shown;
  }
  bool EventuallyShown(const std::vector<std::string>& alarms) const {
    const bool shown = Eventually([&] { return Shown() == alarms; });
    EXPECT_EQ(Shown(), alarms);
    return shown;
  }
};

TEST_F(Alarms, OfARoutedSlaveThatNoLongerAnswersItsClients) {
  const NullModem cable(LinkOf("drive"), FarEnd("drive"));
  auto slave = LibmodbusSlave::OnTty(FarEnd("drive"), kUnit);
  const auto daemon =
      StartGateway(Yaml({"{ units: 20, line: drive, alarms: { priority: high, delay: 1s } }"},
                        BareLine("drive", "timing: { reply: 100ms }")));
  const auto follower = Start({"alarms", "--follow", "--json", "--socket", socket()});
  ModbusClient client(port());
  EXPECT_EQ(client.Holding(kUnit, 999, 1).values, std::vector<std::uint16_t>{1999});
  EXPECT_THAT(Shown(), ElementsAre());
  EXPECT_EQ(Ask({"events"}).code, 4) << "it keeps no events";

  slave.reset();
  for (int time = 0; time < 3; ++time) {
    EXPECT_EQ(client.Holding(kUnit, 999, 1).exception, kNotAnswering);
  }
  ASSERT_TRUE(EventuallyShown({"drive unit-20 no answer to clients active high"}));
  const auto followed = [&](const std::string& state) {
    return Eventually([&] {
      return follower->Output().find("\"state\":\"" + state + "\"") != std::string::npos;
    });
  };
  EXPECT_TRUE(followed("active"));
  const Json alarm = All()[0];
  EXPECT_THAT(alarm["text"].get<std::string>(), HasSubstr("no answer to clients for 1s"));
  EXPECT_EQ(alarm["point"], "");
  EXPECT_EQ(Status()["events"]["alarms"]["active"], 1);
  EXPECT_THAT(daemon->Errors(),
              HasSubstr("line drive: device unit-20: alarm active, priority high"));
  EXPECT_THAT(Ask({"ack", "drive.unit-20"}).output, HasSubstr("1 alarm acknowledged"));
  EXPECT_TRUE(EventuallyShown({"drive unit-20 no answer to clients acknowledged high"}));

  slave = LibmodbusSlave::OnTty(FarEnd("drive"), kUnit);
  EXPECT_TRUE(Eventually([&] { return client.Holding(kUnit, 999, 1).exception == 0; }));
  EXPECT_TRUE(EventuallyShown({}));
  EXPECT_TRUE(followed("normal"));
  follower->Signal(SIGINT);
  EXPECT_EQ(follower->WaitForEnd(), 0);
}

TEST_F(Alarms, OfAPortAndADeviceAreKeptWithEventsAndGoWithTheConfiguration) {
  const auto yaml = [&](const std::string& line, const std::string& routes = {}) {
    return "gateway: { name: " + gateway() + ", socket: " + socket() +
           ", state: " + (directory() / "state").string() +
           " }\nevents: {}\nmodbus:\n  listen: { at: \"127.0.0.1:" + std::to_string(port()) +
           "\" }\n" + routes + "dds: { enabled: false }\nlines:\n" + line;
  };
  const std::string devices =
      "devices: [{ name: pump, address: 1, profile: mitsubishi-fr-d700, retries: 0 }], timing: { "
      "reply: 50ms }";
  const std::string both = BareLine("absent", "alarms: { delay: 0s }") +
                           BareLine("drive", "alarms: { priority: low, delay: 1s }, " + devices);
  const ScriptedSlave silent(LinkOf("drive"), Nothing);
  const std::vector<std::string> raised = {"absent  port down active medium",
                                           "drive pump no answer active low"};
  {
    const auto daemon = StartDaemon(yaml(both));
    ASSERT_TRUE(EventuallyShown(raised)) << daemon->Errors();
    daemon->Signal(SIGKILL);
    daemon->WaitForEnd();
  }
  const auto daemon = StartDaemon(yaml(both));
  EXPECT_TRUE(EventuallyShown(raised));
  std::this_thread::sleep_for(2s);
  const auto alarms = All();
  ASSERT_EQ(alarms.size(), 2U) << "none twice";
  EXPECT_EQ(Ask({"ack", "absent"}).code, 0);
  EXPECT_TRUE(EventuallyShown({"absent  port down acknowledged medium", raised[1]}));

  // Without the line, and with another delay for the device.
  Write("baudgate.yaml",
        yaml(BareLine("drive", "alarms: { priority: low, delay: 2s }, " + devices)));
  const Finished reload = Ask({"reload"});
  EXPECT_EQ(reload.code, 0) << reload.errors;
  EXPECT_TRUE(EventuallyShown({raised[1]}));
  EXPECT_EQ(All()[0]["seq"], alarms[1]["seq"]) << "it is the same as before";
}

/// The unit of docs/events.md, as systemd would start it, with a `curl` that keeps what it is
/// given.
TEST_F(Alarms, AreToldByTheServiceThatTheDocumentHas) {
  std::ifstream document(std::filesystem::path(SYSTEM_TEST_SOURCES) / "../../docs/events.md");
  std::string script;
  constexpr std::string_view kStart = "ExecStart=/bin/sh -c '";
  for (std::string line; std::getline(document, line);) {
    if (line.starts_with(kStart)) script = line.substr(kStart.size());
  }
  ASSERT_TRUE(script.ends_with("'"));
  script.pop_back();
  const auto replace = [&script](const std::string& what, const std::string& by) {
    ASSERT_NE(script.find(what), std::string::npos) << what;
    script.replace(script.find(what), what.size(), by);
  };
  replace("$$alarm", "$alarm");
  replace("/run/baudgate/baudgate.sock", socket());
  const auto tools = directory() / "tools";
  std::filesystem::create_directory(tools);
  std::filesystem::create_symlink(BAUDGATE_BINARY, tools / "baudgate");
  std::ofstream(tools / "curl") << "#!/bin/sh\ncat >> " << (directory() / "posted").string()
                                << "\n";
  std::filesystem::permissions(tools / "curl", std::filesystem::perms::owner_all);
  const auto daemon =
      StartGateway(Yaml({}, BareLine("absent", "alarms: { priority: high, delay: 0s }")), {});
  ASSERT_TRUE(EventuallyShown({"absent  port down active high"}));
  Child service({"/bin/sh", "-c", script}, directory(),
                {{"PATH", tools.string() + ":" + std::getenv("PATH")}});
  const auto posted = [&] {
    std::ifstream file(directory() / "posted");
    std::vector<std::string> states;
    for (std::string line; std::getline(file, line);) {
      const Json alarm = Json::parse(line, nullptr, false);
      states.push_back(alarm.value("name", "") + " " + alarm.value("state", ""));
    }
    return states;
  };
  EXPECT_TRUE(Eventually([&] { return posted().size() == 1; }));
  EXPECT_EQ(Ask({"ack", "absent"}).code, 0);
  EXPECT_TRUE(Eventually([&] { return posted().size() == 2; }));
  EXPECT_THAT(posted(), ElementsAre("port down active", "port down acknowledged"));
}

}  // namespace
}  // namespace baudgate::system_test
