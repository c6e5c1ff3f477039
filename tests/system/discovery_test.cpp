// `baudgate discovery-server` with a real gateway and subscribers that have no multicast: they find
// each other by it, and go on without it.
// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>
#include <netinet/in.h>
#include <signal.h>
#include <sys/socket.h>
#include <unistd.h>

#include "tests/system/three_devices.h"

namespace baudgate::system_test {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

class Discovery : public ThreeDevices {
 protected:
  std::unique_ptr<Child> StartServer() const {
    auto server = Start({"discovery-server", "--listen", At()});
    EXPECT_TRUE(EventuallyLogged(*server, "announce themselves at " + At()));
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

  /// Whether a new subscriber finds the gateway.
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

TEST_F(Discovery, TheServerSaysWhyItCanNotBegin) {
  const auto server = StartServer();
  const Finished second = Command({"discovery-server", "--listen", At()});
  EXPECT_EQ(second.code, 4);
  EXPECT_THAT(second.errors, HasSubstr("discovery-server: " + At() + " cannot be opened: "));
  EXPECT_THAT(second.errors, HasSubstr("does another discovery server run here?"));
  EXPECT_EQ(Command({"discovery-server", "--listen", "192.0.2.1:11811"}).code, 4);
  const Finished name = Command({"discovery-server", "--listen", "plant"});
  EXPECT_EQ(name.code, 2);
  EXPECT_THAT(name.errors, HasSubstr("'plant' has no port; write for example plant:11811"));
}

TEST_F(Discovery, WatchAsksMachinesOnly) {
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
  EXPECT_THAT(nobody.errors, HasSubstr("asks nobody"));
}

}  // namespace
}  // namespace baudgate::system_test
