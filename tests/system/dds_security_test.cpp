// Tests DDS Security with the whole program and the files of `certs dds`.
// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>
#include <netinet/in.h>
#include <signal.h>
#include <sys/socket.h>
#include <unistd.h>

#include "gateway/base/time.h"
#include "gateway/outputs/pki/demo_pki.h"
#include "tests/system/three_devices.h"

namespace baudgate::system_test {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;
using ::testing::Not;

class DdsSecurity : public ThreeDevices {
 protected:
  std::string Pki(const std::string& file = {}) const {
    return (directory() / "pki" / file).string();
  }
  std::string SecuredYaml() const {
    std::string yaml = Yaml(true);
    const std::string enabled = "dds: { enabled: true,";
    // A relative path starts at the folder of the configuration, not at that of the DDS process.
    return yaml.replace(yaml.find(enabled), enabled.size(),
                        enabled + " security: pki/" + gateway() + ",");
  }
  void MakeCertificates(int subscribers) const {
    const Finished certs = Command({"certs", "dds", Pki(), "--gateway", gateway(), "--subscribers",
                                    std::to_string(subscribers)});
    ASSERT_EQ(certs.code, 0) << certs.errors;
  }
  std::vector<std::string> Watch(const std::string& folder) const {
    std::vector<std::string> words = {"watch",     "--domain", std::to_string(domain()),
                                      "--gateway", gateway(),  "--json"};
    if (!folder.empty()) words.insert(words.end(), {"--security", Pki(folder)});
    return words;
  }
  Json DdsStatus() const {
    const Finished status = Command({"status", "--json", "--socket",
                                     (directory() / "baudgate" / (gateway() + ".sock")).string()});
    return Json::parse(status.output, nullptr, false).value("dds", Json());
  }
};

TEST_F(DdsSecurity, OnlyASubscriberWithACertificateReceivesValues) {
  MakeCertificates(1);
  StartTwins();
  daemon = StartDaemon(SecuredYaml());
  const auto open = Start(Watch(""));
  const auto watch = Start(Watch("subscriber-1"));
  EXPECT_TRUE(Eventually([&] {
    return watch->Output().find("\"point\":\"current_l3\",\"value\":63") != std::string::npos;
  })) << watch->Errors()
      << daemon->Errors();
  EXPECT_EQ(open->Output(), "");
  EXPECT_TRUE(open->Running());
  const Finished check = Command({"check", "-c", (directory() / "baudgate.yaml").string()});
  EXPECT_EQ(check.code, 0) << check.errors;
  EXPECT_THAT(check.output, HasSubstr("  security   CN=" + gateway() + ", until 20"));
}

TEST_F(DdsSecurity, NothingIsPublishedUntilTheSecurityFilesAreValid) {
  MakeCertificates(1);
  const fs::path key = Pki(gateway() + "/key.pem");
  fs::rename(key, Pki("away"));
  StartTwins();
  daemon = StartDaemon(SecuredYaml());
  ASSERT_TRUE(EventuallyLogged(*daemon, "dds: the process did not start: dds: security: key: "));
  EXPECT_TRUE(EventuallyFloat(client, kModuleUnit, 0, 100.25F)) << "lines and Modbus run";
  EXPECT_THAT(DdsStatus().dump(), HasSubstr(key.string() + " cannot be read: No such file"));
  const Finished check = Command({"check", "-c", (directory() / "baudgate.yaml").string()});
  EXPECT_EQ(check.code, 3);
  EXPECT_THAT(check.errors, HasSubstr("baudgate.yaml:3:"));
  EXPECT_THAT(check.errors, HasSubstr("error: key: " + key.string() + " cannot be read"));
  const auto open = Start(Watch(""));
  const auto watch = Start(Watch("subscriber-1"));
  fs::rename(Pki("away"), key);
  EXPECT_TRUE(Eventually([&] { return !watch->Output().empty(); })) << watch->Errors();
  EXPECT_EQ(open->Output(), "") << "it was never open";
}

TEST_F(DdsSecurity, AnExpiredIdentityReceivesNoValues) {
  MakeCertificates(1);
  constexpr Duration kShort = 8s;  // enough for the start on a busy machine
  const auto begun = ReadClocks();
  const auto made = pki::WriteDemoPki({Pki(), {}, 1, 0, kShort}, begun.wall);
  ASSERT_TRUE(made.ok()) << made.error();
  const auto expired = Start(Watch("subscriber-2"));
  ASSERT_TRUE(Eventually([&] { return ReadClocks().instant > begun.instant + kShort + 1s; }));
  ASSERT_TRUE(expired->Running()) << expired->Errors();
  StartTwins();
  daemon = StartDaemon(SecuredYaml());
  const auto watch = Start(Watch("subscriber-1"));
  ASSERT_TRUE(Eventually([&] { return !watch->Output().empty(); })) << watch->Errors();
  EXPECT_EQ(expired->Output(), "");
  EXPECT_TRUE(expired->Running());
}

class Discovery : public ThreeDevices {
 protected:
  std::unique_ptr<Child> StartServer() const {
    auto server = Start({"discovery-server", "--listen", At()});
    EXPECT_TRUE(EventuallyLogged(*server, "waits for DDS participants at " + At()));
    return server;
  }
  std::string At() const { return "127.0.0.1:" + std::to_string(server_port_); }

  std::string YamlWithServer() const {
    std::string yaml = Yaml(true);
    const std::string enabled = "dds: { enabled: true,";
    yaml.replace(yaml.find(enabled), enabled.size(),
                 enabled + " multicast: false, discovery_servers: [\"" + At() + "\"],");
    return yaml;
  }

  bool IsSeen() const {
    const Finished watch =
        Command({"watch", "--domain", std::to_string(domain()), "--gateway", gateway(), "--once",
                 "--no-multicast", "--discovery-server", At()});
    return watch.code == 0 && watch.output.find("frequency") != std::string::npos;
  }

  void SendNonsense() const {
    const int socket = ::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
    sockaddr_in to{};
    to.sin_family = AF_INET;
    to.sin_port = htons(server_port_);
    to.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    for (int i = 0; i < 100; ++i) {
      ::sendto(socket, "nonsense", 8, 0, reinterpret_cast<const sockaddr*>(&to), sizeof to);
    }
    ::close(socket);
  }

  const std::uint16_t server_port_ = FreePort();
};

TEST_F(Discovery, GatewayAndSubscribersFindEachOther) {
  auto server = StartServer();
  StartAll(YamlWithServer());
  EXPECT_TRUE(Eventually([&] { return IsSeen(); })) << "a subscriber of the same kind";
  const Child cyclone({CYCLONE_SUBSCRIBER, "--domain", std::to_string(domain()), "--peer", At(),
                       "--count", "100000", "--seconds", "600"},
                      directory());
  const auto lines = [&] { return cyclone.Output().size(); };
  EXPECT_TRUE(Eventually([&] {
    return cyclone.Output().find("meter-1 frequency 50.03125 192 Hz\n") != std::string::npos;
  })) << "one of another maker";

  SendNonsense();
  EXPECT_TRUE(EventuallyLogged(*server, "refused not RTPS from 127.0.0.1:"));
  server->Signal(SIGKILL);
  server->WaitForEnd();
  const std::size_t before = lines();
  EXPECT_TRUE(Eventually([&] { return lines() > before; })) << "who has met goes on";
  EXPECT_FALSE(IsSeen()) << "without the server nobody is found: there is no multicast";

  server = StartServer();
  EXPECT_TRUE(Eventually([&] { return IsSeen(); })) << "it begins anew, with nothing";
  server->Signal(SIGTERM);
  EXPECT_EQ(server->WaitForEnd(), 0);
  EXPECT_THAT(server->Errors(), Not(HasSubstr("refused"))) << server->Errors();
}

TEST_F(Discovery, TheServerReportsWhyItCannotStart) {
  const auto server = StartServer();
  const Finished second = Command({"discovery-server", "--listen", At()});
  EXPECT_EQ(second.code, 4);
  EXPECT_THAT(second.errors, HasSubstr("discovery-server: " + At() + " cannot be opened: "));
  EXPECT_THAT(second.errors, HasSubstr("does another discovery server run on this machine?"));
  EXPECT_EQ(Command({"discovery-server", "--listen", "192.0.2.1:11811"}).code, 4);
  const Finished name = Command({"discovery-server", "--listen", "plant"});
  EXPECT_EQ(name.code, 2);
  EXPECT_THAT(name.errors, HasSubstr("'plant' has no port; write for example plant:11811"));
}

TEST_F(Discovery, WatchAcceptsOnlyUnicastAddresses) {
  for (const char* group : {"239.255.0.1", "240.0.0.1", "0.0.0.0"}) {
    for (const auto& [option, ask] : {std::pair("--peer", std::string(group)),
                                      std::pair("--discovery-server", group + At().substr(9))}) {
      const Finished watch = Command({"watch", "--seconds", "1", option, ask});
      EXPECT_EQ(watch.code, 2) << option << " " << ask;
      EXPECT_THAT(watch.errors, HasSubstr(group));
      EXPECT_THAT(watch.errors, HasSubstr("write for example 10.0.0.7"));
    }
  }
  const Finished nobody = Command({"watch", "--no-multicast", "--seconds", "1"});
  EXPECT_EQ(nobody.code, 2);
  EXPECT_THAT(nobody.errors, HasSubstr("needs --peer or --discovery-server"));
}

}  // namespace
}  // namespace baudgate::system_test
