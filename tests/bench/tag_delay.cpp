// Benchmark: delay from an RFID tag's last byte to its stored event in a DDS subscriber.
// SPDX-License-Identifier: Apache-2.0
#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <condition_variable>
#include <map>
#include <mutex>
#include <thread>

#include "gateway/daemon/daemon.h"
#include "gateway/outputs/dds/fast/subscriber.h"
#include "gateway/tools/simulate/pty.h"
#include "tests/bench/bench.h"

namespace baudgate::bench {
namespace {

constexpr int kDomain = 113;
constexpr int kTags = 200;
constexpr auto kPeriod = std::chrono::milliseconds(50);
constexpr double kWantedMs = 20;
constexpr double kFsyncMs = 5;

using Clock = std::chrono::steady_clock;

double MillisecondsSince(Clock::time_point start) {
  return std::chrono::duration<double, std::milli>(Clock::now() - start).count();
}

/// Measures fsync. It overwrites the same pages each time, as a database log does.
class Fsyncs {
 public:
  Fsyncs()
      : file_(open((Scratch() + "/fsync").c_str(), O_CREAT | O_WRONLY | O_CLOEXEC, 0600)),
        page_(4096, 'x') {
    for (off_t page = 0; page < kPages; ++page) Write(page);
    fsync(file_);
  }
  ~Fsyncs() { close(file_); }
  Fsyncs(const Fsyncs&) = delete;
  Fsyncs& operator=(const Fsyncs&) = delete;

  void Measure() {
    Write(next_++ % kPages);
    const auto start = Clock::now();
    fdatasync(file_);
    times.push_back(MillisecondsSince(start));
  }

  std::vector<double> times;

 private:
  static constexpr off_t kPages = 64;

  void Write(off_t page) {
    const auto size = static_cast<ssize_t>(page_.size());
    if (pwrite(file_, page_.data(), page_.size(), page * size) != size) std::exit(4);
  }

  const int file_;
  const std::vector<char> page_;
  off_t next_ = 0;
};

class Arrivals {
 public:
  void Add(std::string_view tag) {
    const std::lock_guard lock(mutex_);
    at_.emplace(tag, Clock::now());
    arrived_.notify_all();
  }
  std::optional<Clock::time_point> Wait(const std::string& tag) {
    std::unique_lock lock(mutex_);
    if (!arrived_.wait_for(lock, 5s, [&] { return at_.contains(tag); })) return std::nullopt;
    return at_[tag];
  }

 private:
  std::mutex mutex_;
  std::condition_variable arrived_;
  std::map<std::string, Clock::time_point> at_;
};

std::string Digits(int tag) { return fmt::format("{:010X}", tag); }

}  // namespace

void RunTagDelay(const config::Catalog& catalog) {
  Fsyncs fsyncs;
  auto pty = tools::Pty::Create();
  if (!pty) std::exit(4);
  daemon::Daemon daemon(
      Load(fmt::format("gateway: {{ name: bench-tags }}\nmodbus: {{ enabled: false }}\n"
                       "dds: {{ domain: {} }}\nevents: {{}}\nlines:\n"
                       "  - name: gate\n    port: {}\n    protocol: reader\n    devices:\n"
                       "      - {{ name: gate, address: 1, profile: olimex-mod-rfid125 }}\n",
                       kDomain, pty->path()),
           catalog),
      catalog);
  Arrivals arrivals;
  dds::SubscriberOptions options;
  options.participant.domain = kDomain;
  dds::SubscriberCallbacks callbacks;
  callbacks.on_point = [](const auto&, const auto&) {};
  callbacks.on_point_gone = [](const auto&, auto) {};
  callbacks.on_device = [](const auto&, const auto&) {};
  callbacks.on_device_gone = [](const auto&, auto) {};
  callbacks.on_gateways = [](int) {};
  callbacks.on_publisher_left = [](const auto&) {};
  callbacks.on_rejected = [](std::uint64_t) {};
  callbacks.on_event = [&](const dds::EventSample& event, const dds::Origin&) {
    const std::string_view text = event.text;
    if (text.size() >= 10) arrivals.Add(text.substr(text.size() - 10));
  };
  const auto subscriber = dds::DdsSubscriber::Create(options, callbacks);
  if (!subscriber || !daemon.Start()) std::exit(4);
  std::vector<double> delays;
  int lost = 0;
  for (int tag = 1; tag <= kTags + 1; ++tag) {
    const std::string frame = "\r\n-" + Digits(tag) + "\r\n>";
    const auto sent = Clock::now();
    if (write(pty->master(), frame.data(), frame.size()) < 0) std::exit(4);
    const auto arrived = arrivals.Wait(Digits(tag));
    if (tag > 1) {  // during the first tag, the DDS participants are still discovering each other
      if (!arrived) ++lost;
      if (arrived) {
        delays.push_back(std::chrono::duration<double, std::milli>(*arrived - sent).count());
      }
    }
    std::this_thread::sleep_for(kPeriod / 2);
    fsyncs.Measure();
    std::this_thread::sleep_for(kPeriod / 2);
  }
  daemon.Stop();
  const double p99 = Percentile(delays, 0.99);
  const double slow_fsync = Percentile(fsyncs.times, 0.99);
  fmt::print(
      "tag to DDS subscriber: median {:.2f} ms, 99 % below {:.2f} ms, worst {:.2f} ms, {} of {} "
      "lost; "
      "wanted below {} ms: {}\n",
      Median(delays), p99, Percentile(delays, 1), lost, kTags, kWantedMs,
      Verdict(lost == 0 && p99 < kWantedMs));
  fmt::print("  one fsync there: median {:.2f} ms, 99 % below {:.2f} ms{}\n", Median(fsyncs.times),
             slow_fsync, slow_fsync <= kFsyncMs ? "" : "; the figure is for disks of at most 5 ms");
}

}  // namespace baudgate::bench
