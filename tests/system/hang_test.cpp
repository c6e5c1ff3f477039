// Tests threads of the running gateway that hang, as in a driver call that does not return.
// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>
#include <signal.h>
#include <sys/ptrace.h>
#include <sys/syscall.h>
#include <sys/wait.h>

#include <fstream>

#include "gateway/base/text.h"
#include "tests/system/notify_socket.h"
#include "tests/system/station.h"

namespace baudgate::system_test {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

constexpr Duration kWatchdog = 2s;

/// Stops a thread at its next system call that waits for events. Elsewhere it could hold a lock,
/// which a hanging driver call never does.
class HeldThread {
 public:
  HeldThread(const Child& process, const std::string& name) : id_(Find(process, name)) {
    if (id_ == 0 || ::ptrace(PTRACE_SEIZE, id_, nullptr, PTRACE_O_TRACESYSGOOD) != 0) return;
    ::ptrace(PTRACE_INTERRUPT, id_, nullptr, nullptr);
    held_ = Stopped();
    while (held_ && !BeforeItWaits()) {
      ::ptrace(PTRACE_SYSCALL, id_, nullptr, nullptr);
      held_ = Stopped();
    }
  }
  ~HeldThread() {
    if (held_) ::ptrace(PTRACE_DETACH, id_, nullptr, nullptr);
  }
  HeldThread(const HeldThread&) = delete;
  HeldThread& operator=(const HeldThread&) = delete;

  bool held() const { return held_; }
  bool EndsWithItsProcess() {
    int status = 0;
    const bool ended = Eventually(
        [&] { return ::waitpid(id_, &status, __WALL | WNOHANG) == id_ && !WIFSTOPPED(status); });
    held_ = held_ && !ended;
    return ended;
  }

 private:
  bool Stopped() const {
    int status = 0;
    return ::waitpid(id_, &status, __WALL) == id_ && WIFSTOPPED(status);
  }
  bool BeforeItWaits() const {
    __ptrace_syscall_info call{};
    return ::ptrace(PTRACE_GET_SYSCALL_INFO, id_, sizeof call, &call) > 0 &&
           call.op == PTRACE_SYSCALL_INFO_ENTRY && Waits(static_cast<long>(call.entry.nr));
  }
  static bool Waits(long call) {
#ifdef SYS_epoll_wait  // missing on arm64
    if (call == SYS_epoll_wait) return true;
#endif
    return call == SYS_epoll_pwait || call == SYS_rt_sigtimedwait;
  }
  static pid_t Find(const Child& process, const std::string& name) {
    const fs::path tasks = "/proc/" + std::to_string(process.id()) + "/task";
    for (const auto& task : fs::directory_iterator(tasks)) {
      std::ifstream file(task.path() / "comm");
      std::string found;
      std::getline(file, found);
      if (found == name) return std::stoi(task.path().filename());
    }
    return 0;
  }

  pid_t id_;
  bool held_ = false;
};

class Hang : public Station {
 protected:
  Hang() : notify_(directory() / "notify") {}

  void Begin(bool dds = false) {
    std::string yaml = WithSocket(Head(dds));
    for (const char* line : {"bay", "io"}) {
      twins_.push_back(StartTwin(line, "icpdas-i-7024", "1"));
      yaml += Line(line, "dcon",
                   std::string("address: 1, profile: icpdas-i-7024, poll: 100ms, write: allow, ") +
                       (line == std::string("io") ? "unit: 1" : "unit: 2"));
    }
    const auto limit = kWatchdog / 1us;
    daemon_ = Start({"run", "-c", Write("baudgate.yaml", yaml).string()},
                    {{"NOTIFY_SOCKET", (directory() / "notify").string()},
                     {"WATCHDOG_USEC", std::to_string(limit)}});
    ASSERT_TRUE(EventuallyFloat(client_, 1, 0, 1.5F)) << daemon_->Errors();
    ASSERT_TRUE(EventuallyFloat(client_, 2, 0, 1.5F)) << daemon_->Errors();
  }
  Json LineStatus(const std::string& line) const { return Status(line).at("lines").at(0); }
  bool SignsOfLife() const {
    while (!notify_.Receive(MSG_DONTWAIT).empty()) {
    }
    return notify_.Receive() == "WATCHDOG=1";
  }

  const NotifySocket notify_;
  ModbusClient client_{port()};
  std::vector<std::unique_ptr<Child>> twins_;
  std::unique_ptr<Child> daemon_;
};

TEST_F(Hang, AHangingLineDoesNotDisturbTheOtherLines) {
  Begin();
  {
    const HeldThread held(*daemon_, "line io");
    ASSERT_TRUE(held.held());
    ASSERT_TRUE(EventuallyLogged(*daemon_, "line io: its thread hangs: a call of the driver of " +
                                               LinkOf("io") + " does not return"));
    const Json io = LineStatus("io");
    EXPECT_TRUE(io["stuck_since"].is_string()) << io;
    EXPECT_THAT(io["advice"].dump(), HasSubstr("its thread has hung since"));
    const Json bay = LineStatus("bay");
    EXPECT_TRUE(bay["stuck_since"].is_null()) << bay;
    const auto before = bay["exchanges"].get<int>();
    EXPECT_TRUE(Eventually([&] { return LineStatus("bay")["exchanges"].get<int>() > before + 5; }));
    EXPECT_EQ(client_.WriteRegisters(1, 2, {0, 0}), kNotAnswering) << "refused at once";
    EXPECT_EQ(client_.WriteRegisters(2, 2, {0, 0}), kNoException);
    EXPECT_TRUE(SignsOfLife());
    EXPECT_TRUE(SignsOfLife());
  }
  EXPECT_TRUE(EventuallyLogged(*daemon_, "line io: its thread runs again"));
  EXPECT_TRUE(Eventually([&] { return LineStatus("io")["stuck_since"].is_null(); }));
  EXPECT_TRUE(EventuallyFloat(client_, 1, 0, 1.5F));
  EXPECT_EQ(client_.WriteRegisters(1, 2, {0, 0}), kNoException);
}

TEST_F(Hang, TheGatewayStopsWithoutALineThatHangs) {
  Begin(true);
  const auto watch =
      Start({"watch", "--domain", std::to_string(domain()), "--gateway", gateway(), "--json"});
  const auto last_quality = [&](const std::string& device) {
    int quality = -1;
    const std::string output = watch->Output();
    for (const std::string_view line : Split(output, '\n')) {
      const Json sample = Json::parse(line, nullptr, false);
      if (sample.is_object() && sample.value("device", "") == device &&
          sample.value("point", "") == "output_0" && sample.contains("quality")) {
        quality = sample["quality"].get<int>();
      }
    }
    return quality;
  };
  ASSERT_TRUE(Eventually([&] { return last_quality("io-1") == 0xC0; })) << watch->Errors();
  HeldThread held(*daemon_, "line io");
  ASSERT_TRUE(held.held());
  daemon_->Signal(SIGTERM);
  EXPECT_TRUE(held.EndsWithItsProcess());
  EXPECT_EQ(daemon_->WaitForEnd(), 0) << daemon_->Errors();
  EXPECT_THAT(daemon_->Errors(),
              HasSubstr("line io: the driver of the port does not return from a call"));
  EXPECT_TRUE(Eventually([&] { return last_quality("io-1") == 8; }));
  EXPECT_TRUE(Eventually([&] { return last_quality("bay-1") == 8; }));
}

class HangingThread : public Hang, public testing::WithParamInterface<const char*> {};

TEST_P(HangingThread, StopsTheSignOfLifeUntilItRunsAgain) {
  Begin();
  EXPECT_TRUE(SignsOfLife());
  {
    const HeldThread held(*daemon_, GetParam());
    ASSERT_TRUE(held.held());
    std::this_thread::sleep_for(kWatchdog / 4);
    while (!notify_.Receive(MSG_DONTWAIT).empty()) {
    }
    std::this_thread::sleep_for(kWatchdog / 2);
    EXPECT_EQ(notify_.Receive(MSG_DONTWAIT), "");
    if (GetParam() != std::string("baudgate")) {
      EXPECT_TRUE(EventuallyLogged(*daemon_, std::string(GetParam()) + ": its thread hangs"));
    }
  }
  EXPECT_TRUE(SignsOfLife()) << "it was not too late";
}

INSTANTIATE_TEST_SUITE_P(Threads, HangingThread,
                         testing::Values("baudgate", "modbus", "control", "lines 1"),
                         [](const auto& one) {
                           std::string name = one.param;
                           std::erase(name, ' ');
                           return name;
                         });

}  // namespace
}  // namespace baudgate::system_test
