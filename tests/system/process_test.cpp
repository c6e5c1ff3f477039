// Tests the daemon as a process: start, readiness, stop, crash, and the messages of a failed start.
// SPDX-License-Identifier: Apache-2.0
#include <fcntl.h>
#include <gmock/gmock.h>
#include <signal.h>
#include <sys/stat.h>
#include <unistd.h>

#include <filesystem>
#include <iterator>
#include <sstream>

#include "tests/support/raw_client.h"
#include "tests/system/notify_socket.h"
#include "tests/system/station.h"

namespace baudgate::system_test {
namespace {

using ::testing::ContainsRegex;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;

class Process : public Station {
 protected:
  Process() { PinProfile("dcon", "owen-mv110-8a", "module", {{"input_1", "100.25"}}); }
  std::string Yaml() const {
    return Head() + Line("io", "dcon", "address: 1, profile: module, unit: 1, poll: 100ms");
  }
  bool PortRefuses() const { return !RawClient(port()).connected(); }

  ModbusClient client{port()};
};

TEST_F(Process, NotifiesTheServiceManagerWhenItsPortAnswersAndWhenItStops) {
  const NotifySocket notify(directory() / "notify");
  ASSERT_TRUE(notify.bound());
  const auto file = Write("baudgate.yaml", Yaml());
  const auto daemon =
      Start({"run", "-c", file.string()}, {{"NOTIFY_SOCKET", (directory() / "notify").string()}});
  const std::string ready = notify.Receive();
  EXPECT_TRUE(client.Input(0, 9000, 1).ok()) << "ready, but its port does not answer";
  EXPECT_THAT(ready, HasSubstr("READY=1"));
  EXPECT_THAT(ready, HasSubstr("STATUS=Modbus TCP on 127.0.0.1:" + std::to_string(port())));
  EXPECT_THAT(notify.Receive(MSG_DONTWAIT), IsEmpty());

  daemon->Signal(SIGTERM);
  EXPECT_THAT(notify.Receive(), HasSubstr("STOPPING=1"));
  EXPECT_EQ(daemon->WaitForEnd(10s), 0);
}

TEST_F(Process, IsNeverReadyWhenItsPortIsTaken) {
  const auto first = StartDaemon(Yaml());
  const NotifySocket notify(directory() / "notify");
  ASSERT_TRUE(notify.bound());
  std::string yaml = Yaml();
  yaml.replace(yaml.find(gateway()), gateway().size(), "another");
  const auto second = Start({"run", "-c", Write("second.yaml", yaml).string()},
                            {{"NOTIFY_SOCKET", (directory() / "notify").string()}});
  EXPECT_EQ(second->WaitForEnd(), kCannotOpen);
  EXPECT_THAT(second->Errors(), HasSubstr("127.0.0.1:" + std::to_string(port())));
  EXPECT_THAT(second->Errors(), HasSubstr("in use"));
  EXPECT_THAT(notify.Receive(MSG_DONTWAIT), Not(HasSubstr("READY")));
  EXPECT_TRUE(client.Input(0, 9000, 1).ok()) << "the first one goes on";
}

TEST_F(Process, StopsInOrderOnSigtermAndSigint) {
  const auto twin = StartTwin("io", "module", "1");
  for (const int signal : {SIGTERM, SIGINT}) {
    const auto daemon = StartDaemon(Yaml());
    ASSERT_TRUE(EventuallyFloat(client, 1, 0, 100.25F));
    daemon->Signal(signal);
    EXPECT_EQ(daemon->WaitForEnd(10s), 0);
    EXPECT_TRUE(PortRefuses());
    EXPECT_THAT(daemon->Errors(), HasSubstr("baudgate stops"));
  }
}

/// SIGHUP is also sent when a terminal closes, so a reload of the same file must change nothing.
TEST_F(Process, OtherSignalsDoNotEndTheGateway) {
  const auto daemon = StartDaemon(Yaml());
  for (const int signal : {SIGUSR1, SIGUSR2, SIGXFSZ, SIGHUP}) daemon->Signal(signal);
  EXPECT_TRUE(EventuallyLogged(*daemon, "reload by SIGHUP: nothing has changed"));
  EXPECT_TRUE(client.Input(0, 9000, 1).ok());
  daemon->Signal(SIGTERM);
  EXPECT_EQ(daemon->WaitForEnd(10s), 0);
}

/// The reader of the log is stalled (Ctrl-S in a terminal, `docker logs`), so the log is full.
TEST_F(Process, StartsRunsAndStopsWhenItsLogIsNotRead) {
  const std::string fifo = (directory() / "log").string();
  ASSERT_EQ(::mkfifo(fifo.c_str(), 0600), 0);
  const int reader = ::open(fifo.c_str(), O_RDWR | O_NONBLOCK | O_CLOEXEC);
  ASSERT_GE(reader, 0);
  const std::string filler(4096, '#');
  while (::write(reader, filler.data(), filler.size()) > 0) continue;

  const auto twin = StartTwin("io", "module", "1");
  const std::string file = Write("baudgate.yaml", Yaml()).string();
  Child daemon({"/bin/sh", "-c", "exec \"$@\" 2>" + fifo, "sh", BAUDGATE_BINARY, "run", "-c", file},
               directory(), Environment());
  EXPECT_TRUE(EventuallyFloat(client, 1, 0, 100.25F));
  daemon.Signal(SIGTERM);
  EXPECT_EQ(daemon.WaitForEnd(10s), 0);
  ::close(reader);
}

TEST_F(Process, ReplacesClosedStandardDescriptorsByDevNull) {
  const auto twin = StartTwin("io", "module", "1");
  const std::string file = Write("baudgate.yaml", Yaml()).string();
  Child daemon(
      {"/bin/sh", "-c", "exec \"$@\" 0<&- 1>&- 2>&-", "sh", BAUDGATE_BINARY, "run", "-c", file},
      directory(), Environment());
  EXPECT_TRUE(EventuallyFloat(client, 1, 0, 100.25F));
  const std::filesystem::path files = "/proc/" + std::to_string(daemon.id()) + "/fd";
  for (const char* standard : {"0", "1", "2"}) {
    EXPECT_EQ(std::filesystem::read_symlink(files / standard), "/dev/null") << standard;
  }
  daemon.Signal(SIGTERM);
  EXPECT_EQ(daemon.WaitForEnd(10s), 0);
}

TEST_F(Process, AsPidOneEndsOnSignalsAndReapsOrphans) {
  // Root needs no user namespace, and a chroot forbids it.
  std::vector<std::string> apart = {"unshare", "-p", "-f", "--kill-child"};
  if (::geteuid() != 0) apart.emplace_back("-r");
  std::vector<std::string> trial = apart;
  trial.emplace_back("true");
  if (RunToEnd(trial, directory()).code != 0) {
    GTEST_SKIP() << "this user may not make process namespaces; root may";
  }
  const auto twin = StartTwin("io", "module", "1");
  const std::string file = Write("baudgate.yaml", Yaml()).string();
  const std::string first = (directory() / "first").string();
  // The shell is process 1. It starts a child, which becomes an orphan at once, and is then
  // replaced by the daemon.
  std::vector<std::string> command = apart;
  command.insert(command.end(),
                 {"/bin/sh", "-c", "(sh -c 'sleep 0.2; : > " + first + "' &) ; exec \"$@\"", "sh",
                  BAUDGATE_BINARY, "run", "-c", file});
  Child outside(command, directory(), Environment());
  EXPECT_TRUE(EventuallyFloat(client, 1, 0, 100.25F));
  ASSERT_TRUE(Eventually([&] { return std::filesystem::exists(first); }));
  const auto children_of = [](pid_t parent) {
    const std::string id = std::to_string(parent);
    std::istringstream text(ReadWholeFile("/proc/" + id + "/task/" + id + "/children"));
    return std::vector<pid_t>(std::istream_iterator<pid_t>(text), {});
  };
  const std::vector<pid_t> inits = children_of(outside.id());
  ASSERT_EQ(inits.size(), 1u);
  EXPECT_TRUE(Eventually([&] { return children_of(inits[0]).size() == 1; })) << "an orphan is left";
  ::kill(inits[0], SIGTERM);
  EXPECT_EQ(outside.WaitForEnd(10s), 0);
}

TEST_F(Process, StopsWhileDevicesAreSilentAndPortsAreAbsent) {
  const auto twin = StartTwin("io", "module", "1");
  twin->Signal(SIGSTOP);
  const auto daemon =
      StartDaemon(Yaml() + Line("gone", "spabus", "address: 1, profile: spaj140c, unit: 2"));
  ASSERT_TRUE(EventuallyQuality(client, 2, 0, 0x08));
  daemon->Signal(SIGTERM);
  EXPECT_EQ(daemon->WaitForEnd(10s), 0);
}

TEST_F(Process, StartsAgainAtOnceAfterItWasKilled) {
  const auto twin = StartTwin("io", "module", "1");
  auto daemon = StartDaemon(Yaml());
  for (int life = 0; life < 3; ++life) {
    ASSERT_TRUE(EventuallyFloat(client, 1, 0, 100.25F));
    // The client's connection is open, so the kernel still uses this port after the kill.
    daemon->Signal(SIGKILL);
    EXPECT_EQ(daemon->WaitForEnd(), 128 + SIGKILL);
    daemon = StartDaemon(Yaml());
  }
  EXPECT_TRUE(EventuallyFloat(client, 1, 0, 100.25F));
}

/// systemd-socket-activate does what systemd does with baudgate.socket: it listens, and starts the
/// program when the first client connects.
TEST_F(Process, ServesTheSocketThatSystemdHasOpened) {
  const auto twin = StartTwin("io", "module", "1");
  const std::string file = Write("baudgate.yaml", Yaml()).string();
  const std::uint16_t foreign = FreePort();
  std::vector<std::string> words = {"systemd-socket-activate",
                                    "-l127.0.0.1:" + std::to_string(port()),
                                    "-l127.0.0.1:" + std::to_string(foreign)};
  for (const auto& [name, value] : Environment()) words.push_back("-E" + name + "=" + value);
  for (const std::string& word :
       {std::string(BAUDGATE_BINARY), std::string("run"), std::string("-c"), file}) {
    words.push_back(word);
  }
  Child daemon(words, directory());
  ASSERT_TRUE(Eventually([&] { return !PortRefuses(); })) << "somebody listens, if not we";
  EXPECT_TRUE(EventuallyFloat(client, 1, 0, 100.25F)) << daemon.Errors();
  EXPECT_THAT(daemon.Errors(), HasSubstr("127.0.0.1:" + std::to_string(port()) +
                                         ": the socket was passed by systemd"));
  EXPECT_THAT(daemon.Errors(), HasSubstr("a socket at 127.0.0.1:" + std::to_string(foreign) +
                                         ", which is not in modbus.listen; the gateway closes it"));
  EXPECT_FALSE(RawClient(foreign).connected());
  daemon.Signal(SIGTERM);
  EXPECT_EQ(daemon.WaitForEnd(10s), 0);
}

TEST_F(Process, DoesNotStartOnABadConfiguration) {
  const auto file =
      Write("bad.yaml", "modbus: { listen: \"127.0.0.1:" + std::to_string(port()) +
                            "\" }\n"
                            "lines:\n"
                            "  - name: io\n"
                            "    port: /dev/ttyS0\n"
                            "    protocol: dcon\n"
                            "    serial: 9600 9X1\n"
                            "    devices:\n"
                            "      - { name: a, address: 256, unit: 1, colour: red }\n");
  const auto daemon = Start({"run", "-c", file.string()});
  EXPECT_EQ(daemon->WaitForEnd(), kBadConfiguration);
  const std::string errors = daemon->Errors();
  EXPECT_THAT(errors, HasSubstr(file.string() + ":6:13: "));
  EXPECT_THAT(errors, ContainsRegex("bad.yaml:8:[0-9]+: .*256"));
  EXPECT_THAT(errors, ContainsRegex("bad.yaml:8:[0-9]+: .*colour"));
  EXPECT_TRUE(PortRefuses());
  EXPECT_THAT(daemon->Output(), IsEmpty());
}

TEST_F(Process, NamesTheConfigurationThatItCannotRead) {
  const auto daemon = Start({"run", "-c", LinkOf("nowhere.yaml")});
  EXPECT_EQ(daemon->WaitForEnd(), kBadConfiguration);
  EXPECT_THAT(daemon->Errors(), HasSubstr("nowhere.yaml"));
}

}  // namespace
}  // namespace baudgate::system_test
