// Benchmark of loads for which other gateways have published results: 100,000 floats that change
// every second and 10,000 that change every 100 ms, from ten Modbus TCP servers, with 100 writes
// during the run.
// SPDX-License-Identifier: Apache-2.0
#include <arpa/inet.h>
#include <fmt/format.h>
#include <netinet/tcp.h>
#include <signal.h>
#include <sys/epoll.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>
#include <numeric>
#include <optional>
#include <sstream>
#include <string>
#include <thread>
#include <vector>

#include "gateway/base/bytes.h"
#include "gateway/base/time.h"
#include "tests/bench/bench.h"
#include "tests/support/raw_client.h"

namespace baudgate::bench {
namespace {

namespace fs = std::filesystem;
using Clock = std::chrono::steady_clock;

constexpr int kServers = 10;
constexpr std::size_t kFloatsOfRequest = 62;
constexpr std::size_t kWritable = 10;  // the last points of each device are writable
constexpr int kWrites = 100;
constexpr std::uint16_t kPort = 15998;
constexpr auto kSettle = std::chrono::seconds(8);
constexpr auto kMeasured = std::chrono::seconds(20);
constexpr auto kBetweenWrites = std::chrono::milliseconds(50);
constexpr double kWantedCore = 0.07;
constexpr double kWantedMib = 100;
constexpr double kWantedRatio = 1.2;
constexpr double kWantedMean = 10;     // ms
constexpr double kWantedLongest = 50;  // ms

struct Plant {
  const char* name;
  int units = 1;  ///< on each server
  std::size_t points = 1000;
  int period_ms = 1000;

  std::size_t all() const { return kServers * static_cast<std::size_t>(units) * points; }
  double exchanges() const {
    const std::size_t queries = (points + kFloatsOfRequest - 1) / kFloatsOfRequest;
    return static_cast<double>(kServers * units) * static_cast<double>(queries) * 1000 / period_ms;
  }
};

constexpr Plant kSlow{"100,000 floats at 1 s", 10, 1000, 1000};
constexpr Plant kFast{"10,000 floats at 100 ms", 1, 1000, 100};
constexpr Plant kLarge{"100,000 floats at 1 s, 10,000 in each device", 1, 10'000, 1000};

struct Outputs {
  const char* name;
  bool modbus = false;
  bool dds = false;
  bool history = false;
};

std::uint16_t WordAt(const std::uint8_t* at) {
  return static_cast<std::uint16_t>(at[0] << 8 | at[1]);
}

/// Ten Modbus TCP servers in one loop of another process. Their floats change every second, except
/// floats that were written.
class Servers {
 public:
  Servers()
      : answered_(static_cast<std::atomic<std::uint64_t>*>(
            mmap(nullptr, sizeof(std::atomic<std::uint64_t>), PROT_READ | PROT_WRITE,
                 MAP_SHARED | MAP_ANONYMOUS, -1, 0))) {
    for (int i = 0; i < kServers; ++i) Listen();
    process_ = fork();
    if (process_ == 0) Run();
    for (const int listener : listeners_) close(listener);
  }
  ~Servers() {
    kill(process_, SIGKILL);
    waitpid(process_, nullptr, 0);
    munmap(answered_, sizeof *answered_);
  }
  Servers(const Servers&) = delete;
  Servers& operator=(const Servers&) = delete;

  const std::vector<int>& ports() const { return ports_; }
  std::uint64_t answered() const { return *answered_; }

 private:
  struct Client {
    std::size_t server = 0;
    Bytes held;
  };
  using Place = std::array<std::size_t, 3>;

  void Listen() {
    const int fd = socket(AF_INET, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0);
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    auto* plain = reinterpret_cast<sockaddr*>(&address);
    socklen_t size = sizeof address;
    if (bind(fd, plain, size) != 0 || listen(fd, 16) != 0 || getsockname(fd, plain, &size) != 0) {
      std::exit(4);
    }
    listeners_.push_back(fd);
    ports_.push_back(ntohs(address.sin_port));
  }

  [[noreturn]] void Run() {
    prctl(PR_SET_PDEATHSIG, SIGKILL);
    const int set = epoll_create1(EPOLL_CLOEXEC);
    const auto watch = [set](int fd) {
      epoll_event event{};
      event.events = EPOLLIN;
      event.data.fd = fd;
      epoll_ctl(set, EPOLL_CTL_ADD, fd, &event);
    };
    for (const int listener : listeners_) watch(listener);
    std::array<epoll_event, 64> events{};
    for (;;) {
      const int count = epoll_wait(set, events.data(), static_cast<int>(events.size()), -1);
      for (int i = 0; i < count; ++i) {
        const int fd = events[static_cast<std::size_t>(i)].data.fd;
        const auto listener = std::ranges::find(listeners_, fd);
        if (listener == listeners_.end()) {
          Serve(fd);
          continue;
        }
        const int client = accept4(fd, nullptr, nullptr, SOCK_CLOEXEC);
        const int on = 1;
        setsockopt(client, IPPROTO_TCP, TCP_NODELAY, &on, sizeof on);
        clients_[client].server = static_cast<std::size_t>(listener - listeners_.begin());
        watch(client);
      }
    }
  }

  void Serve(int fd) {
    std::array<std::uint8_t, 4096> buffer{};
    const ssize_t count = read(fd, buffer.data(), buffer.size());
    if (count <= 0) {
      clients_.erase(fd);
      close(fd);
      return;
    }
    Client& client = clients_[fd];
    client.held.insert(client.held.end(), buffer.begin(), buffer.begin() + count);
    while (client.held.size() >= 12) {
      const std::size_t size = 6U + WordAt(client.held.data() + 4);
      if (client.held.size() < size) break;
      const Bytes reply = ReplyTo(client.server, client.held);
      client.held.erase(client.held.begin(),
                        client.held.begin() + static_cast<std::ptrdiff_t>(size));
      if (write(fd, reply.data(), reply.size()) < 0) return;
      ++*answered_;
    }
  }

  Bytes ReplyTo(std::size_t server, const Bytes& request) {
    const std::size_t unit = request[6];
    const std::size_t first = WordAt(request.data() + 8);
    const std::size_t count = WordAt(request.data() + 10);
    Bytes reply(request.begin(), request.begin() + 8);
    if (request[7] == 0x10) {
      for (std::size_t i = 0; i < count; ++i) {
        written_[{server, unit, first + i}] = WordAt(request.data() + 13 + 2 * i);
      }
      reply.insert(reply.end(), request.begin() + 8, request.begin() + 12);
    } else {
      const auto second = static_cast<std::uint16_t>(time(nullptr));
      reply.push_back(static_cast<std::uint8_t>(2 * count));
      for (std::size_t i = 0; i < count; ++i) {
        const std::size_t address = first + i;
        const auto changing = static_cast<std::uint16_t>(second * 8 + address);
        AppendWord(reply, address % 2 == 0 ? std::uint16_t{0x4248} : changing);
      }
      const auto end = written_.lower_bound({server, unit, first + count});
      for (auto at = written_.lower_bound({server, unit, first}); at != end; ++at) {
        const std::size_t place = 9 + 2 * (at->first[2] - first);
        reply[place] = static_cast<std::uint8_t>(at->second >> 8);
        reply[place + 1] = static_cast<std::uint8_t>(at->second);
      }
    }
    reply[4] = static_cast<std::uint8_t>((reply.size() - 6) >> 8);
    reply[5] = static_cast<std::uint8_t>(reply.size() - 6);
    return reply;
  }
  static void AppendWord(Bytes& bytes, std::uint16_t word) {
    bytes.push_back(static_cast<std::uint8_t>(word >> 8));
    bytes.push_back(static_cast<std::uint8_t>(word));
  }

  std::atomic<std::uint64_t>* answered_;
  std::vector<int> listeners_;
  std::vector<int> ports_;
  std::map<int, Client> clients_;
  std::map<Place, std::uint16_t> written_;
  pid_t process_ = 0;
};

std::string Write(const Plant& plant, const Outputs& outputs, const std::vector<int>& ports,
                  const std::string& folder) {
  std::string profile = "device: PLC of the bench\npoints:\n";
  for (std::size_t i = 0; i < plant.points; ++i) {
    const bool writable = i + kWritable >= plant.points;
    profile += fmt::format("  - {{ name: v{0}, read: holding {1} float32, type: float32{2}{3} }}\n",
                           i, 2 * i, outputs.modbus ? fmt::format(", modbus: {}", 2 * i) : "",
                           writable ? ", access: rw" : "");
  }
  std::ofstream(folder + "/plc.yaml") << profile;
  std::string yaml = fmt::format(
      "gateway: {{ name: rivals, state: {0}/state, socket: {0}/control }}\n"
      "modbus: {1}\ndds: {2}\n{3}lines:\n",
      folder,
      outputs.modbus ? fmt::format("{{ listen: \"127.0.0.1:{}\" }}", kPort) : "{ enabled: false }",
      outputs.dds ? "{ domain: 113 }" : "{ enabled: false }",
      outputs.history ? "history: { points: [ \"*.*.*\" ] }\n" : "");
  for (std::size_t line = 0; line < ports.size(); ++line) {
    yaml += fmt::format(
        "  - name: line-{}\n    port: tcp://127.0.0.1:{}\n    protocol: modbus_tcp\n    devices:\n",
        line, ports[line]);
    for (int unit = 1; unit <= plant.units; ++unit) {
      yaml += fmt::format(
          "      - {{ name: plc-{0}-{1}, address: {1}, profile: {2}/plc.yaml, poll: {3}ms, write: "
          "allow{4} }}\n",
          line, unit, folder, plant.period_ms,
          outputs.modbus ? fmt::format(", unit: {}", static_cast<int>(line) * plant.units + unit)
                         : "");
    }
  }
  std::ofstream(folder + "/gateway.yaml") << yaml;
  return folder + "/gateway.yaml";
}

double Mib(pid_t process, const std::string& key) { return StatusOf(process, key) / 1024; }

std::optional<pid_t> ChildOf(pid_t process) {
  for (const auto& thread : fs::directory_iterator(fmt::format("/proc/{}/task", process))) {
    std::ifstream file(thread.path() / "children");
    if (pid_t child = 0; file >> child) return child;
  }
  return std::nullopt;
}

/// Runs the program `baudgate` from the folder of this program, or the program that the environment
/// variable BAUDGATE names.
class Gateway {
 public:
  explicit Gateway(const std::string& file) {
    const char* const other = std::getenv("BAUDGATE");
    const std::string program =
        other != nullptr ? other : fs::read_symlink("/proc/self/exe").parent_path() / "baudgate";
    process_ = fork();
    if (process_ != 0) return;
    prctl(PR_SET_PDEATHSIG, SIGTERM);
    if (std::freopen((file + ".log").c_str(), "w", stderr) == nullptr) _exit(126);
    execl(program.c_str(), "baudgate", "run", "-c", file.c_str(), nullptr);
    _exit(127);
  }
  ~Gateway() {
    kill(process_, SIGTERM);
    waitpid(process_, nullptr, 0);
  }
  Gateway(const Gateway&) = delete;
  Gateway& operator=(const Gateway&) = delete;

  pid_t process() const { return process_; }

 private:
  pid_t process_ = 0;
};

class Reader {
 public:
  explicit Reader(const Plant& plant)
      : units_(kServers * plant.units), thread_([this] { Run(); }) {}
  ~Reader() {
    stop_ = true;
    thread_.join();
  }
  std::uint64_t answered() const { return answered_; }
  std::uint64_t refused() const { return refused_; }

 private:
  void Run() {
    const RawClient client(kPort);
    auto next = Clock::now();
    while (!stop_) {
      for (int unit = 1; unit <= units_ && !stop_; ++unit) {
        for (int at = 0; at < 2000; at += 124) {
          const int count = std::min(124, 2000 - at);
          const auto byte = [](int value) { return static_cast<std::uint8_t>(value); };
          client.Send(
              Bytes{0, 1, 0, 0, 0, 6, byte(unit), 4, byte(at >> 8), byte(at), 0, byte(count)});
          const Bytes reply = client.ReceiveFrame();
          if (reply.empty()) return;
          ++(reply[7] == 4 ? answered_ : refused_);
        }
      }
      next = std::max(next + std::chrono::seconds(1), Clock::now());
      std::this_thread::sleep_until(next);
    }
  }

  const int units_;
  std::atomic<bool> stop_ = false;
  std::atomic<std::uint64_t> answered_ = 0;
  std::atomic<std::uint64_t> refused_ = 0;
  std::thread thread_;
};

struct Writes {
  std::vector<double> ms;
  int failed = 0;
};

Writes WriteMeanwhile(const Plant& plant, const std::string& folder) {
  Writes writes;
  const RawClient client(folder + "/control");
  for (int i = 0; i < kWrites; ++i) {
    const int line = i % kServers;
    const int unit = 1 + i / kServers % plant.units;
    const std::size_t point = plant.points - 1 - static_cast<std::size_t>(i) % kWritable;
    const nlohmann::json request = {
        {"command", "write"},
        {"target", fmt::format("line-{0}.plc-{0}-{1}.v{2}", line, unit, point)},
        {"value", fmt::format("{}.5", i)},
        {"confirm", true}};
    const auto began = Clock::now();
    client.Send(request.dump() + "\n");
    const auto line_of_answer = client.ReceiveLine();
    writes.ms.push_back(std::chrono::duration<double, std::milli>(Clock::now() - began).count());
    const auto answer = nlohmann::json::parse(line_of_answer.value_or("{}"), nullptr, false);
    if (answer.value("end", "") != "ok") {
      if (writes.failed++ == 0) fmt::print(stderr, "  {}\n", line_of_answer.value_or("no answer"));
    }
    std::this_thread::sleep_for(kBetweenWrites);
  }
  return writes;
}

struct Figures {
  double cores = 0;
  double mib = 0;
  double cost_us = 0;
};

Figures Measure(const Plant& plant, const Outputs& outputs, bool writes) {
  static int runs = 0;
  const std::string folder = fmt::format("{}/rivals{}", Scratch(), ++runs);
  fs::create_directory(folder);
  const Servers servers;
  const Gateway gateway(Write(plant, outputs, servers.ports(), folder));
  std::this_thread::sleep_for(kSettle);
  std::optional<Reader> reader;
  if (outputs.modbus) reader.emplace(plant);
  const auto child = ChildOf(gateway.process());
  const auto child_cpu = [&] { return child ? CpuSeconds(*child) : 0.0; };
  const std::uint64_t answered = servers.answered();
  const double cpu = CpuSeconds(gateway.process());
  const double its_cpu = child_cpu();
  const auto began = Clock::now();
  std::this_thread::sleep_for(kMeasured);
  const double seconds = std::chrono::duration<double>(Clock::now() - began).count();
  const auto exchanges = static_cast<double>(servers.answered() - answered);
  Figures figures;
  figures.cores = (CpuSeconds(gateway.process()) - cpu) / seconds;
  figures.cost_us = 1e6 * figures.cores * seconds / exchanges;
  figures.mib = Mib(gateway.process(), "VmRSS");
  fmt::print(
      "  {:<44} {:<10} {:>5.0f} of {:.0f} exchanges a second; {:>5.1f} % of a core ({:.0f} us an "
      "exchange), {:.0f} MiB (anonymous {:.0f})",
      plant.name, outputs.name, exchanges / seconds, plant.exchanges(), 100 * figures.cores,
      figures.cost_us, figures.mib, Mib(gateway.process(), "RssAnon"));
  if (child) {
    fmt::print("; baudgate-dds {:.1f} %, {:.0f} MiB", 100 * (child_cpu() - its_cpu) / seconds,
               Mib(*child, "VmRSS"));
  }
  if (reader) {
    fmt::print("; a client reads {:.0f} times a second, {} refused",
               static_cast<double>(reader->answered()) / seconds, reader->refused());
  }
  fmt::print("\n");
  std::fflush(stdout);
  if (!writes) return figures;
  const Writes made = WriteMeanwhile(plant, folder);
  const double mean = std::accumulate(made.ms.begin(), made.ms.end(), 0.0) / kWrites;
  const double longest = Percentile(made.ms, 1);
  fmt::print(
      "    {} writes meanwhile, {} failed: {:.1f} / {:.1f} / {:.1f} ms (shortest, mean, longest; "
      "wanted: mean {:.0f}, longest {:.0f})  {}\n",
      kWrites, made.failed, Percentile(made.ms, 0), mean, longest, kWantedMean, kWantedLongest,
      Verdict(made.failed == 0 && mean <= kWantedMean && longest <= kWantedLongest));
  return figures;
}

}  // namespace

void RunRivals() {
  fmt::print(
      "rivals: Modbus TCP servers, floats in contiguous registers, all changing each second\n");
  constexpr Outputs kNone{.name = "none"};
  constexpr Outputs kSome[] = {{.name = "modbus", .modbus = true},
                               {.name = "dds", .dds = true},
                               {.name = "history", .history = true},
                               {.name = "all", .modbus = true, .dds = true, .history = true}};
  const Figures plain = Measure(kSlow, kNone, true);
  const Figures large = Measure(kLarge, kNone, false);
  for (const Outputs& outputs : kSome) Measure(kSlow, outputs, outputs.history);
  Measure(kFast, kNone, true);
  for (const Outputs& outputs : kSome) Measure(kFast, outputs, outputs.history);
  fmt::print("  processor: {:.1f} % of a core (wanted: at most {:.0f} %)  {}\n", 100 * plain.cores,
             100 * kWantedCore, Verdict(plain.cores <= kWantedCore));
  fmt::print("  resident: {:.0f} MiB (wanted: at most {:.0f})  {}\n", plain.mib, kWantedMib,
             Verdict(plain.mib <= kWantedMib));
  const double ratio = large.cost_us / plain.cost_us;
  fmt::print(
      "  an exchange with a device of 10,000 points to one of 1,000: {:.2f} (wanted: at most {})  "
      "{}\n",
      ratio, kWantedRatio, Verdict(ratio <= kWantedRatio));
}

}  // namespace baudgate::bench
