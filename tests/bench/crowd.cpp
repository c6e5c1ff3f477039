// Benchmark: processor time of an exchange with 100 and 1,000 lines on tcp://. Each line has a
// device with a hundred points that are polled every second. Devices and gateway are child
// processes.
// SPDX-License-Identifier: Apache-2.0
#include <arpa/inet.h>
#include <fmt/format.h>
#include <malloc.h>
#include <netinet/tcp.h>
#include <signal.h>
#include <sys/epoll.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <map>
#include <memory>
#include <sstream>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "gateway/daemon/daemon.h"
#include "tests/bench/bench.h"

namespace baudgate::bench {
namespace {

namespace fs = std::filesystem;

constexpr int kMany = 1000;
constexpr int kFew = 100;
constexpr int kPointsPerLine = 100;
constexpr auto kSettle = std::chrono::seconds(15);
constexpr auto kMeasured = std::chrono::seconds(30);
constexpr double kWantedCore = 0.8;
constexpr double kWantedMib = 300;
constexpr int kWantedThreads = 16;
constexpr double kWantedRatio = 1.1;

std::string Yaml(const std::vector<int>& ports) {
  std::string yaml =
      "gateway: { name: crowd }\nmodbus: { enabled: false }\ndds: { enabled: false }\nlines:\n";
  for (std::size_t line = 0; line < ports.size(); ++line) {
    yaml += fmt::format(
        "  - name: line{0}\n    port: tcp://127.0.0.1:{1}\n    protocol: spabus\n    devices:\n"
        "      - name: relay{0}\n        address: 1\n        poll: 1s\n        points:{2}\n",
        line, ports[line], line == 0 ? " &points" : " *points");
    for (int i = 1; line == 0 && i <= kPointsPerLine; ++i) {
      yaml += fmt::format(
          "          - {{ name: v{0}, read: V{0}, type: float32, simulate: [0, 100] }}\n", i);
    }
  }
  return yaml;
}

/// The values never change, so each reply is computed only once.
struct StillValues final : protocols::TwinValues {
  Value Get(std::size_t point, Instant) const override { return static_cast<double>(point) / 2; }
  void Set(std::size_t, const Value&) override {}
};

class Slaves {
 public:
  explicit Slaves(const config::Catalog& catalog)
      : config_(Load(Yaml({1}), catalog)),
        twin_(catalog.FindProtocol("spabus")->make_twin(config_.lines[0].devices[0], values_)),
        epoll_(epoll_create1(EPOLL_CLOEXEC)) {}

  int Listen() {
    const int fd = socket(AF_INET, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0);
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    auto* plain = reinterpret_cast<sockaddr*>(&address);
    socklen_t size = sizeof address;
    if (bind(fd, plain, size) != 0 || listen(fd, 1) != 0 || getsockname(fd, plain, &size) != 0) {
      std::exit(4);
    }
    Watch(fd);
    listening_[fd] = true;
    return ntohs(address.sin_port);
  }

  [[noreturn]] void Run() {
    std::array<epoll_event, 256> events{};
    for (;;) {
      const int count = epoll_wait(epoll_, events.data(), static_cast<int>(events.size()), -1);
      for (int i = 0; i < count; ++i) {
        const int fd = events[static_cast<std::size_t>(i)].data.fd;
        if (listening_.contains(fd)) {
          Accept(fd);
        } else {
          Serve(fd);
        }
      }
    }
  }

 private:
  void Watch(int fd) {
    epoll_event event{};
    event.events = EPOLLIN;
    event.data.fd = fd;
    epoll_ctl(epoll_, EPOLL_CTL_ADD, fd, &event);
  }
  void Accept(int listener) {
    const int fd = accept4(listener, nullptr, nullptr, SOCK_NONBLOCK | SOCK_CLOEXEC);
    if (fd < 0) return;
    const int on = 1;
    setsockopt(fd, IPPROTO_TCP, TCP_NODELAY, &on, sizeof on);
    Watch(fd);
  }
  void Serve(int fd) {
    std::array<char, 4096> buffer{};
    const ssize_t count = read(fd, buffer.data(), buffer.size());
    if (count <= 0) {
      close(fd);
      return;
    }
    // The gateway sends each request in one piece and waits for its reply, so the buffer contains
    // one whole request.
    const std::string& reply = ReplyTo(std::string(buffer.data(), static_cast<std::size_t>(count)));
    if (!reply.empty() && write(fd, reply.data(), reply.size()) < 0) close(fd);
  }
  const std::string& ReplyTo(const std::string& request) {
    const auto known = replies_.find(request);
    if (known != replies_.end()) return known->second;
    const Bytes reply = twin_->Answer(ToBytes(request), Instant());
    return replies_[request] = std::string(reply.begin(), reply.end());
  }

  StillValues values_;
  const config::Config config_;
  const std::unique_ptr<protocols::Twin> twin_;
  const int epoll_;
  std::map<int, bool> listening_;
  std::map<std::string, std::string> replies_;
};

void Publish(const std::string& path, const std::string& text) {
  std::ofstream(path + ".new") << text;
  fs::rename(path + ".new", path);
}

void Await(const std::string& path) {
  while (!fs::exists(path)) std::this_thread::sleep_for(std::chrono::milliseconds(20));
}

struct Process {
  pid_t id = 0;

  long Descriptors() const {
    const fs::directory_iterator all(fmt::format("/proc/{}/fd", id));
    return std::distance(fs::begin(all), fs::end(all));
  }
  Totals Ask(const std::string& directory) const {
    fs::remove(directory + "/totals");
    kill(id, SIGUSR1);
    Await(directory + "/totals");
    Totals totals;
    std::ifstream(directory + "/totals") >> totals.exchanges >> totals.failed >> totals.missed;
    return totals;
  }
  void End() const {
    kill(id, SIGTERM);
    waitpid(id, nullptr, 0);
  }
};

Process Spawn(const std::string& self, const char* role, const std::string& directory, int lines) {
  const std::string count = std::to_string(lines);
  const pid_t child = fork();
  if (child == 0) {
    execl(self.c_str(), "baudgate_bench", role, directory.c_str(), count.c_str(), nullptr);
    _exit(127);
  }
  return {child};
}

struct Figures {
  double per_second = 0;
  double cores = 0;
  double cost_us = 0;
  double mib = 0;
  double threads = 0;
  long descriptors = 0;
  std::uint64_t failed = 0;
  std::uint64_t missed = 0;
  double slave_cores = 0;
};

Figures Measure(const std::string& self, int lines) {
  const std::string directory = fmt::format("{}/crowd{}", Scratch(), lines);
  fs::create_directory(directory);
  const Process slaves = Spawn(self, "be-crowd-slaves", directory, lines);
  Await(directory + "/ports");
  const Process gateway = Spawn(self, "be-crowd-gateway", directory, lines);
  Await(directory + "/ready");
  std::this_thread::sleep_for(kSettle);
  const Totals before = gateway.Ask(directory);
  const double cpu_before = CpuSeconds(gateway.id);
  const double slaves_before = CpuSeconds(slaves.id);
  const auto began = std::chrono::steady_clock::now();
  std::this_thread::sleep_for(kMeasured);
  const double seconds =
      std::chrono::duration<double>(std::chrono::steady_clock::now() - began).count();
  const double cpu = CpuSeconds(gateway.id) - cpu_before;
  Figures figures;
  figures.slave_cores = (CpuSeconds(slaves.id) - slaves_before) / seconds;
  const Totals after = gateway.Ask(directory);
  const auto exchanges = static_cast<double>(after.exchanges - before.exchanges);
  figures.per_second = exchanges / seconds;
  figures.cores = cpu / seconds;
  figures.cost_us = 1e6 * cpu / exchanges;
  figures.mib = StatusOf(gateway.id, "VmRSS") / 1024;
  figures.threads = StatusOf(gateway.id, "Threads");
  figures.descriptors = gateway.Descriptors();
  figures.failed = after.failed - before.failed;
  figures.missed = after.missed - before.missed;
  gateway.End();
  slaves.End();
  fmt::print(
      "  {:>4} lines: {:>6.0f} exchanges a second, {} failed, {} periods missed; {:.2f} cores, "
      "{:.1f} us an exchange; {:.0f} MiB, {:.0f} threads, {} descriptors (devices: {:.2f} cores)\n",
      lines, figures.per_second, figures.failed, figures.missed, figures.cores, figures.cost_us,
      figures.mib, figures.threads, figures.descriptors, figures.slave_cores);
  return figures;
}

}  // namespace

int BeCrowdSlaves(const config::Catalog& catalog, int argc, char** argv) {
  if (argc < 2) return 2;
  Slaves slaves(catalog);
  std::string ports;
  for (int i = 0; i < std::atoi(argv[1]); ++i) ports += fmt::format("{}\n", slaves.Listen());
  Publish(std::string(argv[0]) + "/ports", ports);
  slaves.Run();
}

int BeCrowdGateway(const config::Catalog& catalog, int argc, char** argv) {
  if (argc < 2) return 2;
  const std::string directory = argv[0];
  sigset_t signals{};
  sigemptyset(&signals);
  sigaddset(&signals, SIGUSR1);
  sigaddset(&signals, SIGTERM);
  // Threads that start later block these signals, too.
  pthread_sigmask(SIG_BLOCK, &signals, nullptr);
  std::vector<int> ports;
  std::ifstream file(directory + "/ports");
  for (int port = 0; file >> port;) ports.push_back(port);
  config::Config config = Load(Yaml(ports), catalog);
  malloc_trim(0);  // returns the parser's memory to the system, as the real program does
  daemon::Daemon daemon(std::move(config), catalog);
  if (const Status status = daemon.Start(); !status) {
    fmt::print(stderr, "{}\n", status.error());
    return 4;
  }
  Publish(directory + "/ready", "");
  for (int signal = 0; sigwait(&signals, &signal) == 0 && signal == SIGUSR1;) {
    const Totals totals = Sum(daemon.store());
    Publish(directory + "/totals",
            fmt::format("{} {} {}\n", totals.exchanges, totals.failed, totals.missed));
  }
  daemon.Stop();
  return 0;
}

void RunCrowd(const std::string& self) {
  fmt::print("crowd: lines on tcp:// with {} SPA points each at 1 s, no DDS\n", kPointsPerLine);
  const Figures few = Measure(self, kFew);
  const Figures many = Measure(self, kMany);
  const double ratio = many.cost_us / few.cost_us;
  const std::uint64_t missed = few.missed + many.missed;
  fmt::print("  missed periods: {}  {}\n", missed, Verdict(missed == 0));
  fmt::print("  processor: {:.2f} cores (wanted: below {})  {}\n", many.cores, kWantedCore,
             Verdict(many.cores < kWantedCore));
  fmt::print("  an exchange of {} lines to one of {}: {:.2f} (wanted: at most {})  {}\n", kMany,
             kFew, ratio, kWantedRatio, Verdict(ratio <= kWantedRatio));
  fmt::print("  resident: {:.0f} MiB (wanted: below {:.0f})  {}\n", many.mib, kWantedMib,
             Verdict(many.mib < kWantedMib));
  fmt::print("  threads: {:.0f} (wanted: at most {})  {}\n", many.threads, kWantedThreads,
             Verdict(many.threads <= kWantedThreads));
}

}  // namespace baudgate::bench
