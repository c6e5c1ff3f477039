// A real line on a pty for a soak: shipped profile, real plugin, paced twins with fixed values that
// misbehave on demand, and a reader of the point store that knows the truth. Values and truth come
// from tests/protocols/runs/rig.h.
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

/// Remembers when frames left a twin that are damaged although their check value is good.
class WeakChecksums {
 public:
  WeakChecksums(const protocols::Setup& setup, const config::Options& options)
      : setup_(setup), options_(ParseOptions(*setup.protocol, options)) {}

  void OnDelivery(View request, View reply, View delivered);
  /// Whether such a frame can have been read by an exchange that ended at `read_at`.
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
  /// `world` runs in another thread until this line is gone. With `echoes` the bus brings every
  /// request back, and the line strips it.
  SoakLine(const protocols::Setup& setup, bool echoes, const std::string& port,
           asio::io_context& world);
  ~SoakLine();

  bool AllGood() const;
  /// Once all is good: that the store shows what the twins measure.
  void CompareWithTruth();
  /// All faults that a line has to bear, deaths on a schedule that fits into `time`.
  void BeginFaults(Duration time);
  void EndFaults();
  /// No usable value but the truth; a failure of the test otherwise.
  void Check();
  /// A line that has sent nothing since the last call is stuck.
  void ExpectProgress();
  void PrintSummary() const;
  /// So many faults have struck.
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
  std::vector<std::vector<std::uint64_t>> told_;  // seq of the wrong value that was told last
  std::vector<std::uint64_t> versions_;           // of each device at the last check
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
