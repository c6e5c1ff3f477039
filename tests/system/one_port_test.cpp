// Tests `baudgate bridge` and `baudgate read --port`, which open a port themselves, and the
// tutorial of docs/new-device.md.
// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>
#include <signal.h>

#include <filesystem>
#include <fstream>

#include "tests/system/station.h"

namespace baudgate::system_test {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

class OnePort : public Station {
 protected:
  std::unique_ptr<Child> StartDrive() const {
    return StartTwin("drive", "mitsubishi-fr-d700", "20", {"--baud", "19200 8E1"});
  }
  std::string Local() const { return "127.0.0.1:" + std::to_string(port()); }
};

TEST_F(OnePort, ABridgeForwardsRequests) {
  const auto twin = StartDrive();
  const auto bridge = Start({"bridge", LinkOf("drive"), "19200", "8E1", "--listen", Local()});
  ASSERT_TRUE(EventuallyLogged(*bridge, "runs")) << bridge->Errors();
  ModbusClient client(port());
  EXPECT_TRUE(Eventually([&] { return client.Holding(20, 200, 1).ok(); })) << bridge->Errors();
  bridge->Signal(SIGINT);
  EXPECT_EQ(bridge->WaitForEnd(), 0);
  EXPECT_FALSE(std::filesystem::exists(directory() / "state")) << "nothing of it stays";
}

TEST_F(OnePort, ABridgeReportsWrongArguments) {
  const Finished open = Command({"bridge", LinkOf("x"), "19200", "8E1", "--listen", "0.0.0.0"});
  EXPECT_EQ(open.code, kUsage);
  EXPECT_THAT(open.errors, HasSubstr("--allow 10.0.0.0/24"));
  EXPECT_EQ(Command({"bridge", LinkOf("x"), "--listen", "here"}).code, kUsage);
  const Finished serial = Command({"bridge", LinkOf("x"), "19200", "8X1", "--listen", Local()});
  EXPECT_EQ(serial.code, kBadConfiguration);
  EXPECT_THAT(serial.errors, HasSubstr("8X1"));
  EXPECT_EQ(Command({"bridge", "ttyUSB0", "--listen", Local()}).code, kBadConfiguration);
  EXPECT_EQ(Command({"bridge"}).code, kUsage);
}

TEST_F(OnePort, ReadShowsADeviceWithoutAConfiguration) {
  const auto twin = StartDrive();
  const auto read = [&](std::vector<std::string> more) {
    std::vector<std::string> words = {
        "read",     "--port",   LinkOf("drive"), "--profile", "mitsubishi-fr-d700",
        "--serial", "19200 8E1"};
    words.insert(words.end(), more.begin(), more.end());
    return Command(words);
  };
  const Finished all = read({"--address", "20"});
  EXPECT_EQ(all.code, 0) << all.errors;
  EXPECT_THAT(all.output, HasSubstr("output_frequency"));
  EXPECT_THAT(all.output, HasSubstr("good"));
  const Finished one = read({"--address", "20", "output_frequency", "--json"});
  EXPECT_EQ(one.code, 0) << one.errors;
  const Json json = Json::parse(one.output, nullptr, false);
  ASSERT_FALSE(json.is_discarded()) << one.output;
  ASSERT_EQ(json["points"].size(), 1U) << one.output;
  EXPECT_EQ(json["points"][0]["unit"], "Hz");

  const Finished silent = read({"--address", "21"});
  EXPECT_EQ(silent.code, 1) << silent.output;
  EXPECT_THAT(silent.errors,
              AllOf(HasSubstr("15 03"), HasSubstr("at 19200 8E1, and no byte came back"),
                    HasSubstr("'baudgate scan " + LinkOf("drive") + "'")));
  EXPECT_EQ(read({"--address", "20", "no_such"}).code, kUsage);
  EXPECT_EQ(read({"--address", "300"}).code, kBadConfiguration);
  EXPECT_EQ(read({"--address", "20", "--option", "hole"}).code, kUsage);
  EXPECT_EQ(read({"--address", "20", "--option", "block=5", "output_frequency"}).code, 0);
  const Finished option = read({"--address", "20", "--option", "hol=5"});
  EXPECT_EQ(option.code, kBadConfiguration);
  EXPECT_THAT(option.errors, HasSubstr("hol"));
  EXPECT_EQ(Command({"read"}).code, kUsage);
  EXPECT_EQ(Command({"read", "--port", LinkOf("x")}).code, kUsage);
  const Finished closed = Command(
      {"read", "--port", LinkOf("none"), "--profile", "mitsubishi-fr-d700", "--address", "1"});
  EXPECT_EQ(closed.code, kCannotOpen) << closed.output;
}

std::string BlocksOf(const std::string& file) {
  std::ifstream page(file);
  std::string script = "set -e\n";
  for (std::string line; std::getline(page, line);) {
    if (!line.starts_with("    ")) continue;
    line.erase(0, 4);
    const bool shown = line.starts_with("point ") || line.starts_with("voltage_l1 ") ||
                       line.starts_with("meters.main.") || line == "…";
    if (!shown && !line.starts_with("sudo ")) script += line + "\n";
  }
  return script;
}

std::string Replace(std::string text, const std::string& what, const std::string& with) {
  for (std::size_t at = 0; (at = text.find(what, at)) != std::string::npos; at += with.size()) {
    text.replace(at, what.size(), with);
  }
  return text;
}

TEST_F(OnePort, TheTutorialForNewDevicesCanBePasted) {
  std::string script = BlocksOf("docs/new-device.md");
  ASSERT_THAT(script, HasSubstr("profiles --new"));
  script = Replace(script, "baudgate write ", "baudgate write --socket " + LinkOf("s") + " ");
  script = Replace(script, "baudgate ", BAUDGATE_BINARY " ");
  script = Replace(script, "/tmp/em1", LinkOf("em1"));
  script = Replace(script, "-p 1502", "-p " + std::to_string(port()));
  script = Replace(script, "lines:\n",
                   "gateway: { name: " + gateway() + ", state: " + LinkOf("state") +
                       ", socket: " + LinkOf("s") + " }\nmodbus: { listen: \"" + Local() +
                       "\" }\ndds: { enabled: false }\nlines:\n");
  script += "kill %1 %2\n";
  const Finished done = RunToEnd({"/bin/bash", "-c", script}, directory(), Environment(), 60s);
  EXPECT_EQ(done.code, 0) << script << done.output << done.errors;
  EXPECT_THAT(done.output, HasSubstr("modbus_rtu/acme-em1, 6 points"));
  EXPECT_THAT(done.output, HasSubstr("voltage_l1          230.4"));
  EXPECT_THAT(done.output, HasSubstr("[0]: \t230.4"));
  EXPECT_THAT(done.output, HasSubstr("display_brightness: 60 written, and read back"));
}

}  // namespace
}  // namespace baudgate::system_test
