// `SoakLine` is a real line on a pty for a soak, with paced simulated devices that misbehave on
// demand. It compares the point store with the true values (tests/protocols/runs/rig.h).
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <asio/io_context.hpp>
#include <cstdint>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "gateway/lines/line_runner.h"
#include "gateway/tools/simulate/simulator.h"
#include "tests/protocols/runs/rig.h"
#include "transports/loop_thread.h"

namespace baudgate {

class WeakChecksums {
 public:
  WeakChecksums(const protocols::Setup& setup, const config::Options& options)
      : setup_(setup), options_(ParseOptions(*setup.protocol, options)) {}

  void OnDelivery(View request, View reply, View delivered);
  /// Returns true if an exchange that ended at `read_at` may have received a damaged frame with a
  /// valid check value.
  bool MayHaveReached(Instant read_at, Duration longest_exchange) const;
  std::size_t count() const;

 private:
  const protocols::Setup& setup_;
  const protocols::ParsedOptions options_;
  mutable std::mutex mutex_;
  std::vector<Instant> deliveries_;
};

class SoakLine {
 public:
  /// `world` must run in another thread for the lifetime of this object. `echoes`: the bus echoes,
  /// and the line removes the echo.
  SoakLine(const protocols::Setup& setup, bool echoes, const std::string& port,
           asio::io_context& world);
  ~SoakLine();

  bool AllGood() const;
  void CompareWithTruth();
  /// Starts all faults that a line must tolerate. Device deaths are scheduled within `time`.
  void BeginFaults(Duration time);
  void EndFaults();
  void Check();
  void ExpectProgress();
  void PrintSummary() const;
  std::uint64_t struck() const;
  const std::string& name() const { return setup_.name; }

 private:
  void LearnTruth(const protocols::Setup& setup);
  std::vector<tools::Fault> Standing() const;
  void CheckPoint(const bus::DeviceRecord& record, std::uint32_t device, std::size_t point,
                  Instant now);

  protocols::Setup setup_;
  bool echoes_;
  asio::io_context& world_;
  config::Config config_;
  std::vector<std::vector<Value>> truth_;
  std::vector<std::vector<std::uint64_t>> told_;
  std::vector<std::uint64_t> versions_;
  std::unique_ptr<bus::PointStore> store_;
  std::unique_ptr<WeakChecksums> weak_;
  std::unique_ptr<tools::Simulator> simulator_;
  transports::LoopThread loop_{"line"};
  std::unique_ptr<lines::LineRunner> runner_;
  std::vector<tools::FaultCount> struck_;
  std::uint64_t exchanges_ = 0;
  std::size_t excused_ = 0;
  std::size_t wrong_ = 0;
};

}  // namespace baudgate
