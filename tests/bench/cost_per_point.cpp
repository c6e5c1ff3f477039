// Benchmark: processor time that a changed point costs from the point store to the DDS writer, with
// 1,000 to 100,000 points.
// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <atomic>
#include <ctime>
#include <thread>

#include "gateway/bus/points/point_store.h"
#include "gateway/outputs/dds/publisher.h"
#include "tests/bench/bench.h"

namespace baudgate::bench {
namespace {

constexpr std::size_t kPointsPerDevice = 100;
constexpr std::uint64_t kUpdates = 500'000;
constexpr double kWanted = 1.5;

class CountingWriter final : public dds::SampleWriter {
 public:
  explicit CountingWriter(std::atomic<std::uint64_t>& written) : written_(written) {}
  dds::Sent Write(const dds::PointSample&) override {
    ++written_;
    return dds::Sent::yes;
  }
  dds::Sent Write(const dds::DeviceSample&) override { return dds::Sent::yes; }
  dds::Sent Write(const dds::GatewaySample&) override { return dds::Sent::yes; }
  bool WaitAcknowledged(Duration) override { return true; }
  dds::Subscribers subscribers() const override { return {.points = 1}; }

 private:
  std::atomic<std::uint64_t>& written_;
};

config::Config MakeConfig(std::size_t points) {
  config::Config config;
  config::Line line;
  line.name = "line";
  for (std::size_t d = 0; d < points / kPointsPerDevice; ++d) {
    config::Device device;
    device.name = fmt::format("device{}", d);
    for (std::size_t i = 0; i < kPointsPerDevice; ++i) {
      config::Point point;
      point.name = fmt::format("point{}", i);
      device.points.push_back(point);
    }
    line.devices.push_back(std::move(device));
  }
  config.lines.push_back(std::move(line));
  return config;
}

double ProcessSeconds() {
  timespec used{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &used);
  return static_cast<double>(used.tv_sec) + static_cast<double>(used.tv_nsec) / 1e9;
}

double RunOne(std::size_t points) {
  const config::Config config = MakeConfig(points);
  bus::PointStore store(config);
  std::atomic<std::uint64_t> written = 0;
  auto publisher =
      dds::DdsPublisher::Create(config, store, std::make_unique<CountingWriter>(written));
  if (!publisher) std::exit(4);
  while (written < points)
    std::this_thread::yield();  // the publisher sends the start-up image slowly, so it is not
                                // measured
  std::vector<bus::Sample> samples(kPointsPerDevice);
  const double began = ProcessSeconds();
  auto next = std::chrono::steady_clock::now();
  double value = 0;
  for (std::uint64_t updates = 0; updates < kUpdates; updates += kPointsPerDevice) {
    const auto device =
        static_cast<std::uint32_t>(updates / kPointsPerDevice) % store.device_count();
    value += 1;
    for (std::uint32_t i = 0; i < kPointsPerDevice; ++i) samples[i] = {i, value, Quality::good};
    store.Update(device, samples, ReadClocks(), 1ms);
    // One device each millisecond makes 100,000 points a second, like many lines together.
    next += std::chrono::milliseconds(1);
    std::this_thread::sleep_until(next);
  }
  const double used = ProcessSeconds() - began;
  return used / static_cast<double>(kUpdates) * 1e6;
}

}  // namespace

void RunCostPerPoint() {
  fmt::print("cost per changed point, store to writer (wanted: flat, dearest / cheapest <= {})\n",
             kWanted);
  std::vector<double> costs;
  for (const std::size_t points : {1'000U, 10'000U, 100'000U}) {
    costs.push_back(RunOne(points));
    fmt::print("  {:>6} points: {:.2f} us of processor time\n", points, costs.back());
  }
  const double ratio = Percentile(costs, 1) / Percentile(costs, 0);
  fmt::print("  dearest / cheapest: {:.2f}  {}\n", ratio, Verdict(ratio <= kWanted));
}

}  // namespace baudgate::bench
