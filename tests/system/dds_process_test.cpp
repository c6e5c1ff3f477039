// Tests that Modbus and polling continue while the DDS process is killed or stopped.
// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>
#include <netinet/in.h>
#include <signal.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <set>
#include <sstream>

#include "gateway/base/bytes.h"
#include "gateway/base/text.h"
#include "tests/system/three_devices.h"

namespace baudgate::system_test {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;
using ::testing::Not;

class DdsProcess : public ThreeDevices {
 protected:
  pid_t Process() const { return ChildOf(*daemon); }

  template <typename Condition>
  ::testing::AssertionResult ReadsAreRightUntil(Condition until) {
    bool right = true;
    int reads = 0;
    const bool met = Eventually([&] {
      right = right && client.Float(kRelayUnit, 0) == 1.25F &&
              client.Float(kModuleUnit, 0) == 100.25F && client.Float(kMeterUnit, 0) == -61234.5F;
      ++reads;
      return !right || until();
    });
    if (right && met) return ::testing::AssertionSuccess();
    return ::testing::AssertionFailure() << (right ? "it did not come about" : "a read was wrong")
                                         << " after " << reads << " rounds\n"
                                         << daemon->Errors();
  }

  std::optional<std::uint64_t> SeqOf(const std::string& device, const std::string& point) const {
    const Finished watch = Command({"watch", "--domain", std::to_string(domain()), "--gateway",
                                    gateway(), "--json", "--once"});
    std::istringstream stream(watch.output);
    std::optional<std::uint64_t> seq;
    std::size_t points = 0;
    for (std::string line; std::getline(stream, line);) {
      const Json sample = Json::parse(line, nullptr, false);
      if (!sample.is_object()) continue;
      ++points;
      if (sample["device"] == device && sample["point"] == point && sample["quality"] == 0xC0) {
        seq = sample["seq"].get<std::uint64_t>();
      }
    }
    return points == points_ ? seq : std::nullopt;
  }

  Json DdsStatus() const { return Status().value("dds", Json()); }
  std::uint64_t Fragments() const {
    return DdsStatus().at("datagrams").at("refused").at("fragment").get<std::uint64_t>();
  }

  void Begin() {
    StartAll(WithSocket(Yaml(true)));
    const Finished map = Command({"map", "--json", "-c", (directory() / "baudgate.yaml").string()});
    points_ = Json::parse(map.output)["points"].size();
    ASSERT_TRUE(EventuallyLogged(*daemon, "dds: the process accepts samples"));
  }

  std::size_t points_ = 0;
};

TEST_F(DdsProcess, AnOccupiedDiscoveryPortIsReportedUntilItIsFree) {
  const int port = 7400 + 250 * domain();
  const int other = ::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  sockaddr_in at{};
  at.sin_family = AF_INET;
  at.sin_port = htons(static_cast<std::uint16_t>(port));
  ASSERT_EQ(::bind(other, reinterpret_cast<const sockaddr*>(&at), sizeof at), 0);
  const std::string taken = "another program has UDP port " + std::to_string(port);
  Begin();
  const auto advice = [&] { return DdsStatus().value("advice", Json::array()).dump(); };
  EXPECT_TRUE(Eventually([&] { return advice().find(taken) != std::string::npos; })) << advice();
  EXPECT_TRUE(EventuallyLogged(*daemon, taken));
  ::close(other);
  EXPECT_TRUE(EventuallyLogged(*daemon, std::to_string(port) + " is free now: DDS restarts"));
  EXPECT_TRUE(Eventually([&] { return advice() == "[]"; })) << advice();
  EXPECT_TRUE(Eventually([&] { return SeqOf("io-1", "input_1").has_value(); }));
}

TEST_F(DdsProcess, AKilledProcessIsRestartedWithAllPoints) {
  Begin();
  std::optional<std::uint64_t> before;
  ASSERT_TRUE(Eventually([&] { return (before = SeqOf("io-1", "input_1")).has_value(); }));
  pid_t process = Process();
  for (const int signal : {SIGKILL, SIGSEGV, SIGABRT}) {
    ::kill(process, signal);
    EXPECT_TRUE(ReadsAreRightUntil([&] {
      const pid_t now = Process();
      return now != 0 && now != process;
    }));
    process = Process();
    std::optional<std::uint64_t> after;
    EXPECT_TRUE(Eventually([&] { return (after = SeqOf("io-1", "input_1")).has_value(); }));
    EXPECT_GT(after, before) << "seq goes on";
    before = after;
  }
  EXPECT_THAT(daemon->Errors(),
              HasSubstr("dds: the process was ended by signal 9; the gateway starts it "));
  EXPECT_THAT(daemon->Errors(),
              HasSubstr("dds: the process was ended by signal 11; the gateway starts it "));
  daemon->Signal(SIGTERM);
  EXPECT_EQ(daemon->WaitForEnd(10s), 0);
  EXPECT_FALSE(fs::exists("/proc/" + std::to_string(process)));
}

TEST_F(DdsProcess, AStoppedProcessIsReportedAndReplacedAndBlocksNoRead) {
  Begin();
  const pid_t process = Process();
  ::kill(process, SIGSTOP);
  EXPECT_TRUE(ReadsAreRightUntil([&] {
    return daemon->Errors().find("dds: the process does not read") != std::string::npos;
  }));
  EXPECT_EQ(Process(), process);
  // The process stays stopped. It is replaced after ten seconds without a sign of life.
  EXPECT_TRUE(ReadsAreRightUntil([&] { return Process() != 0 && Process() != process; }));
  EXPECT_THAT(
      daemon->Errors(),
      HasSubstr("dds: the process read no messages of the gateway for 10s; the gateway starts it"));
  EXPECT_TRUE(Eventually([&] { return SeqOf("relay-1", "current_l3").has_value(); }));
}

TEST_F(DdsProcess, AStoppedProcessDoesNotDelayTheEndOfTheGateway) {
  Begin();
  const pid_t process = Process();
  ::kill(process, SIGSTOP);
  daemon->Signal(SIGTERM);
  EXPECT_EQ(daemon->WaitForEnd(5s), 0);
  EXPECT_FALSE(fs::exists("/proc/" + std::to_string(process)));
}

/// Sends the datagram of CVE-2023-50716, a fragment with inline QoS and no payload, which ends Fast
/// DDS 2.9.1 with "free(): invalid pointer".
void SendHostileDatagram(int domain) {
  const Bytes datagram = *ParseHex(
      "52 54 50 53 02 03 01 0F 00 01 02 03 04 05 06 07 08 09 0A 0B "  // RTPS, vendor id of Fast DDS
      "16 03 24 00 00 00 1C 00 00 01 00 C7 00 01 00 C2 00 00 00 00 01 00 00 00 "
      "01 00 00 00 01 00 40 00 40 00 00 00 01 00 00 00");
  const int sender = ::socket(AF_INET, SOCK_DGRAM, 0);
  sockaddr_in to{};
  to.sin_family = AF_INET;
  to.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  for (int participant = 0; participant < 10; ++participant) {
    to.sin_port = htons(static_cast<std::uint16_t>(7400 + 250 * domain + 10 + 2 * participant));
    ::sendto(sender, datagram.data(), datagram.size(), 0, reinterpret_cast<const sockaddr*>(&to),
             sizeof to);
  }
  ::close(sender);
}

TEST_F(DdsProcess, AHostileDatagramEndsNeitherGatewayNorWatch) {
  Begin();
  const auto watch =
      Start({"watch", "--domain", std::to_string(domain()), "--gateway", gateway(), "--json"});
  const auto samples = [&] {
    const std::string text = watch->Output();
    return std::count(text.begin(), text.end(), '\n');
  };
  ASSERT_TRUE(Eventually([&] { return samples() > 0; }));
  for (int i = 0; i < 3; ++i) {
    SendHostileDatagram(domain());
    const auto before = samples();
    EXPECT_TRUE(ReadsAreRightUntil([&] { return samples() > before; }));
  }
  EXPECT_TRUE(watch->Running());
  EXPECT_TRUE(Eventually([&] { return Fragments() >= 3; })) << DdsStatus();
  ::kill(Process(), SIGKILL);
  ASSERT_TRUE(Eventually([&] { return DdsStatus().at("times_lost") == 1; }));
  EXPECT_GE(Fragments(), 3U) << "the next process goes on counting";
  EXPECT_TRUE(Eventually([&] { return SeqOf("relay-1", "current_l3").has_value(); }));
  watch->Signal(SIGTERM);
  EXPECT_EQ(watch->WaitForEnd(), 0);
}

TEST_F(DdsProcess, AKilledDaemonLeavesNoGoodValueAndNoProcess) {
  Begin();
  const auto watch =
      Start({"watch", "--domain", std::to_string(domain()), "--gateway", gateway(), "--json"});
  const auto samples = [&](std::uint16_t quality) {
    std::multiset<std::string> found;
    std::istringstream lines(watch->Output());
    for (std::string line; std::getline(lines, line);) {
      const Json sample = Json::parse(line, nullptr, false);
      if (sample.is_object() && sample.value("quality", 0) == quality) {
        found.insert(sample["device"].get<std::string>() + "." +
                     sample["point"].get<std::string>());
      }
    }
    return found;
  };
  ASSERT_TRUE(Eventually([&] { return samples(0xC0).contains("io-1.input_1"); }));
  const pid_t process = Process();
  daemon->Signal(SIGKILL);
  EXPECT_TRUE(Eventually([&] { return samples(0x08).size() >= points_; })) << watch->Output();
  EXPECT_EQ(samples(0x08).count("io-1.input_1"), 1U) << "once";
  EXPECT_TRUE(Eventually([&] { return ::kill(process, 0) != 0; }));
}

/// Each rename creates some hundred new names, so unused names must be freed.
TEST_F(DdsProcess, RenamedDevicesDisappearAfterAReload) {
  Begin();
  std::string yaml = WithSocket(Yaml(true));
  std::string name = "meter-1";
  for (int round = 0; round < 6; ++round) {
    const std::string next = "renamed-" + std::to_string(round);
    for (std::size_t at = 0; (at = yaml.find(name, at)) != std::string::npos; at += next.size()) {
      yaml.replace(at, name.size(), next);
    }
    Write("baudgate.yaml", yaml);
    const Finished reload = Ask({"reload"});
    ASSERT_EQ(reload.code, 0) << reload.output << reload.errors;
    name = next;
  }
  EXPECT_TRUE(Eventually([&] { return SeqOf(name, "voltage_l1").has_value(); })) << "and no others";
  const Finished devices = Command({"watch", "--domain", std::to_string(domain()), "--gateway",
                                    gateway(), "--json", "--seconds", "3"});
  EXPECT_THAT(devices.output, HasSubstr("\"" + name + "\""));
  EXPECT_THAT(devices.output, Not(HasSubstr("\"meter-1\"")));
  EXPECT_THAT(devices.output, Not(HasSubstr("\"renamed-4\"")));
}

TEST_F(DdsProcess, AProcessStartedSeparatelyConnectsToTheSocket) {
  const std::string socket = (directory() / "dds.sock").string();
  const std::string program = fs::path(BAUDGATE_BINARY).parent_path() / "baudgate-dds";
  const auto start = [&] {
    return std::make_unique<Child>(std::vector<std::string>{program, "--socket", socket},
                                   directory());
  };
  auto process = start();
  ASSERT_TRUE(EventuallyLogged(*process, "waits for the gateway"));
  StartTwins();
  const auto file = Write("baudgate.yaml", Yaml(true));
  daemon = Start({"run", "-c", file.string()}, {{"BAUDGATE_DDS_SOCKET", socket}});
  const Finished map = Command({"map", "--json", "-c", file.string()});
  points_ = Json::parse(map.output)["points"].size();
  EXPECT_TRUE(Eventually([&] { return SeqOf("io-1", "input_1").has_value(); }));
  EXPECT_EQ(Process(), 0) << "the gateway has started one itself";

  process->Signal(SIGKILL);
  ASSERT_TRUE(process->WaitForEnd());
  EXPECT_TRUE(EventuallyLogged(*daemon, "dds: the process closed the link"));
  process = start();
  EXPECT_TRUE(Eventually([&] { return SeqOf("io-1", "input_1").has_value(); }));

  daemon->Signal(SIGTERM);
  EXPECT_EQ(daemon->WaitForEnd(10s), 0);
  EXPECT_FALSE(fs::exists(socket));
  EXPECT_TRUE(process->Running()) << "it waits for the next gateway";
  process->Signal(SIGTERM);
  EXPECT_EQ(process->WaitForEnd(), 0);
}

}  // namespace
}  // namespace baudgate::system_test
