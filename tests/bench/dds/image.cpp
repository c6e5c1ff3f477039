// Benchmark: time and processor use until a late subscriber has 5,000 points that change every
// second.
// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <csignal>
#include <fstream>
#include <mutex>
#include <set>
#include <thread>

#include "config/model/config.h"
#include "gateway/bus/points/point_store.h"
#include "gateway/outputs/dds/fast/fast_writer.h"
#include "gateway/outputs/dds/fast/subscriber.h"
#include "gateway/outputs/dds/publisher.h"
#include "tests/bench/dds/bench.h"

namespace baudgate::bench {
namespace {

constexpr int kDomain = 65;
constexpr std::uint32_t kDevices = 50;
constexpr std::uint32_t kPointsEach = 100;
constexpr std::size_t kPoints = std::size_t{kDevices} * kPointsEach;
constexpr int kRounds = 5;
constexpr auto kWatched = std::chrono::seconds(5);

config::Config MakeConfig() {
  config::Config config;
  config.name = "image";
  config.dds.domain = kDomain;
  config::Line line;
  line.name = "line";
  for (std::uint32_t d = 0; d < kDevices; ++d) {
    config::Device device;
    device.name = fmt::format("device{}", d);
    for (std::uint32_t p = 0; p < kPointsEach; ++p) {
      config::Point point;
      point.name = fmt::format("point{}", p);
      device.points.push_back(point);
    }
    line.devices.push_back(std::move(device));
  }
  config.lines.push_back(std::move(line));
  return config;
}

void ChangeAll(bus::PointStore& store, const std::atomic<bool>& stop) {
  Instant next = ReadClocks().instant;
  for (std::uint64_t round = 0; !stop; ++round) {
    for (std::uint32_t device = 0; device < kDevices && !stop; ++device) {
      std::vector<bus::Sample> samples;
      for (std::uint32_t point = 0; point < kPointsEach; ++point) {
        samples.push_back({point, static_cast<double>(round), Quality::good});
      }
      store.Update(device, samples, ReadClocks(), 5ms);
      next += Duration(1s) / kDevices;
      std::this_thread::sleep_until(next);
    }
  }
}

double OwnProcessor() { return ProcessorOf(::getpid()); }

}  // namespace

/// Prints the seconds until all points are received, and the share of a core used in the next 5 s.
int BeLateSubscriber(const std::vector<std::string>&) {
  std::mutex mutex;
  std::set<std::pair<std::string, std::string>> known;
  std::uint64_t samples = 0;
  std::atomic<double> whole_after = -1;
  const Instant begun = ReadClocks().instant;
  const double used = OwnProcessor();
  dds::SubscriberOptions options;
  options.participant.domain = kDomain;
  dds::SubscriberCallbacks callbacks;
  callbacks.on_point = [&](const dds::PointSample& sample, const auto&...) {
    const std::lock_guard lock(mutex);
    ++samples;
    if (known.size() < kPoints && known.emplace(sample.device, sample.point).second &&
        known.size() == kPoints) {
      whole_after = std::chrono::duration<double>(ReadClocks().instant - begun).count();
    }
  };
  {
    const auto subscriber = dds::DdsSubscriber::Create(options, callbacks);
    if (!subscriber) return 4;
    std::this_thread::sleep_until(begun + kWatched);
    const double share = (OwnProcessor() - used) / std::chrono::duration<double>(kWatched).count();
    const std::lock_guard lock(mutex);
    fmt::print("  image of {} points after {:.2f} s; {:.2f} of a core; {:.0f} samples a second\n",
               known.size(), whole_after.load(), share, static_cast<double>(samples) / 5);
    fmt::print("    in {} takes, {} refused\n", (*subscriber)->counters().takes,
               (*subscriber)->counters().refused);
  }
  return 0;
}

void RunImage() {
  fmt::print("image: {} points, all changing once a second, {} late subscribers one by one\n",
             kPoints, kRounds);
  std::fflush(stdout);
  const config::Config config = MakeConfig();
  bus::PointStore store(config);
  auto writer = dds::CreateFastWriter(config, store);
  if (!writer) std::exit(4);
  const auto publisher = dds::DdsPublisher::Create(config, store, std::move(*writer));
  if (!publisher) std::exit(4);
  std::atomic<bool> stop = false;
  std::thread changing([&] { ChangeAll(store, stop); });
  std::this_thread::sleep_for(3s);
  const double alone = OwnProcessor();
  std::this_thread::sleep_for(5s);
  fmt::print("  publisher without subscribers: {:.2f} of a core\n", (OwnProcessor() - alone) / 5);
  for (int round = 0; round < kRounds; ++round) {
    std::fflush(stdout);
    const double before = OwnProcessor();
    const pid_t child = Start({"be-late-subscriber"});
    ::waitpid(child, nullptr, 0);
    fmt::print("    publisher meanwhile: {:.2f} of a core\n", (OwnProcessor() - before) / 5);
  }
  stop = true;
  changing.join();
}

}  // namespace baudgate::bench
