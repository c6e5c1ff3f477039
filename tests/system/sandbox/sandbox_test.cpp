// Tests that the gateway works under the restrictions of its systemd unit, and that it does not
// work under stricter ones.
// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>
#include <signal.h>

#include <filesystem>

#include "tests/system/libmodbus_slave.h"
#include "tests/system/null_modem.h"
#include "tests/system/route_station.h"

namespace baudgate::system_test {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

constexpr int kForbidden = 128 + SIGSYS;
constexpr int kSandboxUnit = 1;

class Sandbox : public RouteStation {
 protected:
  /// Returns a configuration that makes the gateway use all the system calls that it ever needs.
  std::string Everything() const {
    std::string yaml =
        Yaml({"{ units: 20-21, line: drive }",
              "{ units: 50, server: \"localhost:" + std::to_string(server_) + "\" }"},
             Line("io", "dcon",
                  "address: 1, profile: icpdas-i-7024, unit: 1, poll: 100ms, "
                  "write: allow") +
                 BareLine("drive", "timing: { reply: 100ms }"),
             {"\"[::1]:" + std::to_string(port()) + "\"",
              "{ at: " + LinkOf("panel") + ", serial: 19200 8E1 }"});
    const std::string off = "dds: { enabled: false";
    yaml.replace(yaml.find(off), off.size(),
                 "dds: { enabled: true, domain: " + std::to_string(domain()));
    return yaml;
  }
  fs::path Unit(const std::string& more = {}) const {
    return Write("baudgate.service", ReadWholeFile(BAUDGATE_UNIT) + "[Service]\n" + more);
  }
  std::unique_ptr<Child> Run(const fs::path& unit, const std::string& yaml) const {
    auto environment = Environment();
    environment["BAUDGATE_DDS_SOCKET"] = (directory() / "dds.sock").string();
    return std::make_unique<Child>(
        std::vector<std::string>{SANDBOXED, unit.string(), BAUDGATE_BINARY, "run", "-c",
                                 Write("baudgate.yaml", yaml).string()},
        directory(), environment);
  }

  std::uint16_t server_ = FreePort();
  NullModem panel_{LinkOf("panel"), FarEnd("panel")};
  NullModem cable_{LinkOf("drive"), FarEnd("drive")};
  std::unique_ptr<LibmodbusSlave> slave_ = LibmodbusSlave::OnTcp(server_);
  ModbusClient client_{port()};
};

TEST_F(Sandbox, AllFunctionsWorkInTheSandbox) {
  const auto twin = StartTwin("io", "icpdas-i-7024", "1");
  const auto daemon = Run(Unit(), Everything());
  ASSERT_TRUE(EventuallyFloat(client_, kSandboxUnit, 0, 1.5F)) << daemon->Errors();
  EXPECT_EQ(client_.WriteRegisters(kSandboxUnit, 2, {0x40E4, 0}), kNoException);
  EXPECT_TRUE(EventuallyFloat(client_, kSandboxUnit, 2, 7.125F));
  EXPECT_TRUE(Eventually([&] { return client_.Holding(50, 0, 1).ok(); })) << "the server by name";
  EXPECT_FALSE(client_.Holding(20, 0, 1).ok()) << "nobody is on that line, but it was asked";
  EXPECT_TRUE(EventuallyLogged(*daemon, "listening for a master"));

  const std::string socket = (directory() / "gate.sock").string();
  EXPECT_EQ(Command({"status", "--json", "--socket", socket}).code, 0);
  EXPECT_THAT(Command({"writes", "--socket", socket}).output, HasSubstr("7.125"));
  EXPECT_EQ(Command({"release", "drive", "--for", "1s", "--socket", socket}).code, 0);
  const Child dds({fs::path(BAUDGATE_BINARY).parent_path() / "baudgate-dds", "--socket",
                   (directory() / "dds.sock").string()},
                  directory());
  EXPECT_TRUE(Eventually([&] { return Status()["dds"]["state"] == "up"; }));

  twin->Signal(SIGSTOP);
  EXPECT_TRUE(Eventually([&] {
    std::error_code error;
    return !fs::is_empty(directory() / "state/recordings", error) && !error;
  }));
  twin->Signal(SIGCONT);
  EXPECT_TRUE(EventuallyFloat(client_, kSandboxUnit, 0, 1.5F));
  daemon->Signal(SIGTERM);
  EXPECT_EQ(daemon->WaitForEnd(), 0) << daemon->Errors();
}

TEST_F(Sandbox, AForbiddenSystemCallEndsTheGateway) {
  const auto twin = StartTwin("io", "icpdas-i-7024", "1");
  for (const char* more :
       {"SystemCallFilter=~flock", "SystemCallFilter=~ioctl", "SystemCallFilter=~@network-io",
        "SystemCallFilter=~@io-event", "SystemCallFilter=~clone"}) {
    const auto daemon = Run(Unit(more), Everything());
    EXPECT_EQ(daemon->WaitForEnd(), kForbidden) << more << "\n" << daemon->Errors();
  }
}

/// AF_NETLINK is left out: only names with several addresses need it, which not every machine has.
TEST_F(Sandbox, EveryFamilyOfAddressesIsNeeded) {
  const auto twin = StartTwin("io", "icpdas-i-7024", "1");
  const std::string all = "RestrictAddressFamilies=AF_UNIX AF_INET AF_INET6 AF_NETLINK\n";
  const std::string text = ReadWholeFile(BAUDGATE_UNIT);
  ASSERT_THAT(text, HasSubstr(all));
  for (const std::string family : {"AF_UNIX", "AF_INET ", "AF_INET6"}) {
    std::string fewer = all;
    fewer.erase(fewer.find(family), family.size());
    std::string unit = text;
    unit.replace(unit.find(all), all.size(), fewer);
    const auto daemon = Run(Write("fewer.service", unit), Everything());
    EXPECT_EQ(daemon->WaitForEnd(), kForbidden) << "without " << family << daemon->Errors();
  }
}

}  // namespace
}  // namespace baudgate::system_test
