// Benchmark: compares the delay from a reply's last byte to its sample in a DDS subscriber with the
// delay of a minimal program.
// SPDX-License-Identifier: Apache-2.0
#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <atomic>
#include <cmath>
#include <condition_variable>
#include <csignal>
#include <map>
#include <mutex>
#include <optional>
#include <thread>

#include "gateway/base/text.h"
#include "gateway/lines/line_runner.h"
#include "gateway/outputs/dds/fast/fast_writer.h"
#include "gateway/outputs/dds/fast/subscriber.h"
#include "gateway/outputs/dds/link/process_link.h"
#include "gateway/outputs/dds/publisher.h"
#include "gateway/outputs/dds/sample_writer.h"
#include "gateway/tools/simulate/pty.h"
#include "protocols/assembler.h"
#include "tests/bench/bench.h"
#include "transports/loop_thread.h"

namespace baudgate::bench {
namespace {

constexpr int kDomain = 111;
constexpr int kRounds = 9;
constexpr int kSamplesPerRound = 100;
constexpr auto kPeriod = std::chrono::milliseconds(10);
constexpr double kWanted = 1.3;
constexpr std::string_view kBare = "bare";
constexpr std::string_view kGateway = "gateway";

std::int64_t NowNs() { return std::chrono::steady_clock::now().time_since_epoch().count(); }

std::string Reply(int number) { return fmt::format(">+{:05d}.\r", number); }

void WriteAll(int descriptor, std::string_view text) {
  if (write(descriptor, text.data(), text.size()) != static_cast<ssize_t>(text.size()))
    std::exit(4);
}

class Subscriber {
 public:
  explicit Subscriber(const std::string& self) {
    int ends[2];
    if (pipe2(ends, O_CLOEXEC) != 0) std::exit(4);
    child_ = fork();
    if (child_ == 0) {
      dup2(ends[1], STDOUT_FILENO);
      execl(self.c_str(), "baudgate_bench", "be-delay-subscriber", nullptr);
      _exit(127);
    }
    close(ends[1]);
    stream_ = fdopen(ends[0], "r");
    thread_ = std::thread([this] { Run(); });
  }
  ~Subscriber() {
    kill(child_, SIGTERM);
    waitpid(child_, nullptr, 0);
    thread_.join();
    fclose(stream_);
  }

  std::optional<std::int64_t> Arrival(std::string_view source, int number) {
    std::unique_lock lock(mutex_);
    const auto key = std::pair(std::string(source), number);
    if (!arrived_.wait_for(lock, 2s, [&] { return arrivals_.contains(key); })) return std::nullopt;
    return arrivals_[key];
  }

 private:
  void Run() {
    char source[64];
    int number = 0;
    long long when = 0;
    while (fscanf(stream_, "%63s %d %lld", source, &number, &when) == 3) {
      const std::lock_guard lock(mutex_);
      arrivals_[{source, number}] = when;
      arrived_.notify_all();
    }
  }

  pid_t child_ = -1;
  FILE* stream_ = nullptr;
  std::thread thread_;
  std::mutex mutex_;
  std::condition_variable arrived_;
  std::map<std::pair<std::string, int>, std::int64_t> arrivals_;
};

std::unique_ptr<dds::SampleWriter> BareWriter() {
  auto writer = dds::CreateFastWriter({.domain = kDomain, .interfaces = {"127.0.0.1"}},
                                      {.points = 8, .devices = 1});
  if (!writer) std::exit(4);
  return std::move(*writer);
}

void WriteBare(dds::SampleWriter& writer, double number) {
  static dds::PointSample sample;
  sample.gateway = kBare;
  sample.device = "device";
  sample.point = "point";
  sample.quality = 192;
  sample.value = number;
  ++sample.seq;
  writer.Write(sample);
}

/// The minimal program whose delay is the limit: it passes each reply from a pty through a socket
/// to Fast DDS, with two threads.
class DirectPipeline {
 public:
  explicit DirectPipeline(const std::string& self) : pty_(std::move(*tools::Pty::Create())) {
    StartRelay(self);
    reader_ = open(pty_.slave_path().c_str(), O_RDONLY | O_NOCTTY);
    read_thread_ = std::thread([this] { Read(); });
    write_thread_ = std::thread([this] { Write(); });
  }
  ~DirectPipeline() {
    {
      const std::lock_guard lock(mutex_);
      stop_ = true;
    }
    handed_over_.notify_all();
    WriteAll(pty_.master(), "\r");
    read_thread_.join();
    write_thread_.join();
    close(reader_);
    close(socket_);
    waitpid(relay_, nullptr, 0);
  }

  std::int64_t Feed(int number) {
    const std::int64_t now = NowNs();
    WriteAll(pty_.master(), Reply(number));
    return now;
  }

 private:
  void Read() {
    std::string line;
    char buffer[64];
    while (!stop_) {
      const ssize_t count = read(reader_, buffer, sizeof buffer);
      if (count <= 0) return;
      line.append(buffer, static_cast<std::size_t>(count));
      if (line.back() != '\r') continue;
      if (line.size() > 3) {
        const std::lock_guard lock(mutex_);
        number_ = std::atof(line.c_str() + 1);
        pending_ = true;
        handed_over_.notify_one();
      }
      line.clear();
    }
  }
  void Write() {
    std::unique_lock lock(mutex_);
    while (true) {
      handed_over_.wait(lock, [this] { return pending_ || stop_; });
      if (stop_) return;
      pending_ = false;
      const double number = number_;
      lock.unlock();
      if (send(socket_, &number, sizeof number, 0) < 0) std::exit(4);
      lock.lock();
    }
  }

  void StartRelay(const std::string& self) {
    int ends[2];
    if (socketpair(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC, 0, ends) != 0) std::exit(4);
    socket_ = ends[0];
    relay_ = fork();
    if (relay_ == 0) {
      dup2(ends[1], STDIN_FILENO);
      execl(self.c_str(), "baudgate_bench", "be-delay-relay", nullptr);
      _exit(127);
    }
    close(ends[1]);
  }

  tools::Pty pty_;
  int reader_ = -1;
  int socket_ = -1;
  pid_t relay_ = -1;
  std::mutex mutex_;
  std::condition_variable handed_over_;
  std::atomic<bool> stop_ = false;
  bool pending_ = false;
  double number_ = 0;
  std::thread read_thread_;
  std::thread write_thread_;
};

class GatewayPipeline {
 public:
  explicit GatewayPipeline(const config::Catalog& catalog)
      : pty_(std::move(*tools::Pty::Create())),
        config_(
            Load(fmt::format(
                     "gateway: {{ name: {} }}\nmodbus: {{ enabled: false }}\n"
                     "dds: {{ domain: {} }}\nlines:\n"
                     "  - {{ name: line, port: {}, serial: 115200 8N1, protocol: dcon, devices: [\n"
                     "      {{ name: device, address: 1, poll: 10ms, timing: {{ quiet: 0ms }}, "
                     "points: [\n"
                     "        {{ name: point, read: \"#0\", type: float64 }} ] }} ] }}\n",
                     kGateway, kDomain, pty_.slave_path()),
                 catalog)),
        store_(config_) {
    auto publisher = dds::DdsPublisher::Create(config_, store_, MakeWriter());
    if (!publisher) std::exit(4);
    publisher_ = std::move(*publisher);
    const protocols::Protocol& protocol = *catalog.FindProtocol("dcon");
    runner_ = std::make_unique<lines::LineRunner>(
        loop_.io(), store_.line(0), 0,
        [&](const std::string&) -> const protocols::Protocol& { return protocol; }, store_);
    loop_.Start();
    twin_ = std::thread([this] { BeTwin(); });
    runner_->Start();
  }
  ~GatewayPipeline() {
    runner_->Stop();
    publisher_->Stop();
    stop_ = true;
    twin_.join();
  }

  std::int64_t Feed(int number) {
    std::unique_lock lock(mutex_);
    number_ = number;
    answered_at_ = 0;
    answered_.wait(lock, [this] { return answered_at_ != 0; });
    return answered_at_;
  }

 private:
  void BeTwin() {
    char buffer[64];
    std::string request;
    while (!stop_) {
      pollfd ready{pty_.master(), POLLIN, 0};
      poll(&ready, 1, 100);
      const ssize_t count = read(pty_.master(), buffer, sizeof buffer);
      if (count > 0) request.append(buffer, static_cast<std::size_t>(count));
      if (request.empty() || request.back() != '\r') continue;
      // At 115200 bit/s the 5 characters of the request take less than 2 ms. The reply must not
      // come before their end.
      std::this_thread::sleep_for(std::chrono::milliseconds(2));
      Answer(request);
      request.clear();
    }
  }

  void Answer(const std::string& request) {
    if (request != "#010\r") return WriteAll(pty_.master(), "!017017\r");
    const std::lock_guard lock(mutex_);
    const std::int64_t now = NowNs();
    WriteAll(pty_.master(), Reply(number_));
    if (answered_at_ == 0) {
      answered_at_ = now;
      answered_.notify_all();
    }
  }

  std::shared_ptr<dds::SampleWriter> MakeWriter() {
    dds::ProcessLinkOptions options;
    options.open.participant = dds::ParticipantOf(config_.dds);
    options.open.room = {.points = 1, .devices = 1};
    auto link = dds::ProcessLink::Create(options, {});
    if (!link) std::exit(4);
    link_ = std::move(*link);
    return link_->writer();
  }

  tools::Pty pty_;
  config::Config config_;
  bus::PointStore store_;
  std::unique_ptr<dds::ProcessLink> link_;
  std::unique_ptr<dds::DdsPublisher> publisher_;
  transports::LoopThread loop_{"line"};
  std::unique_ptr<lines::LineRunner> runner_;
  std::mutex mutex_;
  std::condition_variable answered_;
  int number_ = 0;
  std::int64_t answered_at_ = -1;
  std::atomic<bool> stop_ = false;
  std::thread twin_;
};

template <typename Pipeline>
std::vector<double> Measure(Pipeline& pipeline, std::string_view source, Subscriber& subscriber,
                            int& number, int count) {
  std::vector<double> delays;
  for (int i = 0; i < count; ++i) {
    number = number % 90000 + 1;
    const std::int64_t sent = pipeline.Feed(number);
    if (const auto arrived = subscriber.Arrival(source, number)) {
      delays.push_back(static_cast<double>(*arrived - sent) / 1e3);
    }
    std::this_thread::sleep_for(kPeriod);
  }
  return delays;
}

}  // namespace

int BeDelaySubscriber(int, char**) {
  dds::SubscriberOptions options;
  options.participant.domain = kDomain;
  dds::SubscriberCallbacks callbacks;
  callbacks.on_point = [](const dds::PointSample& sample, const dds::Origin&) {
    const std::int64_t now = NowNs();
    if (std::isnan(sample.value)) return;
    fmt::print("{} {} {}\n", sample.gateway, std::lround(sample.value), now);
    std::fflush(stdout);
  };
  const auto subscriber = dds::DdsSubscriber::Create(options, callbacks);
  if (!subscriber) return 4;
  pause();
  return 0;
}

namespace {

struct Delays {
  std::vector<double> limit;
  std::vector<double> ours;
  std::vector<double> ratios;
};

Delays Compare(const config::Catalog& catalog, const std::string& self) {
  Subscriber subscriber(self);
  DirectPipeline direct(self);
  GatewayPipeline gateway(catalog);
  int number = 0;
  Measure(direct, kBare, subscriber, number, 20);
  Measure(gateway, kGateway, subscriber, number, 20);
  Delays delays;
  for (int round = 0; round < kRounds; ++round) {
    const auto first = Measure(direct, kBare, subscriber, number, kSamplesPerRound);
    const auto second = Measure(gateway, kGateway, subscriber, number, kSamplesPerRound);
    delays.limit.insert(delays.limit.end(), first.begin(), first.end());
    delays.ours.insert(delays.ours.end(), second.begin(), second.end());
    delays.ratios.push_back(Median(second) / Median(first));
  }
  return delays;
}

void Print(const Delays& delays) {
  fmt::print("    bare pipeline: median {:.0f} us, p99 {:.0f} us ({} samples)\n",
             Median(delays.limit), Percentile(delays.limit, 0.99), delays.limit.size());
  fmt::print("    gateway:       median {:.0f} us, p99 {:.0f} us ({} samples)\n",
             Median(delays.ours), Percentile(delays.ours, 0.99), delays.ours.size());
  const double ratio = Median(delays.ratios);
  fmt::print("    ratio of medians, median of {} rounds: {:.2f} ({:.2f} to {:.2f})  {}\n", kRounds,
             ratio, Percentile(delays.ratios, 0), Percentile(delays.ratios, 1),
             Verdict(ratio <= kWanted));
}

}  // namespace

void RunAddedDelay(const config::Catalog& catalog, const std::string& self) {
  fmt::print(
      "added delay, last byte of the reply to the sample in another process "
      "(wanted: median <= {} x a bare pipeline of the same hops)\n",
      kWanted);
  Print(Compare(catalog, self));
}

int BeDelayRelay(int, char**) {
  const auto writer = BareWriter();
  double number = 0;
  while (recv(STDIN_FILENO, &number, sizeof number, 0) == sizeof number) {
    WriteBare(*writer, number);
  }
  return 0;
}

}  // namespace baudgate::bench
