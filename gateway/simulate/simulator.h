// Twins on a pty: requests that come from the master's side are answered as the real devices would,
// at a real bit rate if one is given. For `baudgate simulate`, the demo, system tests and
// benchmarks.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <asio/io_context.hpp>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "config/model/device.h"
#include "gateway/base/result.h"
#include "gateway/simulate/twin_events.h"
#include "gateway/simulate/twin_faults.h"
#include "protocols/protocol.h"

namespace baudgate {

/// What a twin measures: each point follows its `simulate:` entry, a slow wave or a fixed value.
class SimulatedValues final : public TwinValues {
 public:
  /// `points` outlives the values; `seed` shifts the waves of one twin against those of another.
  SimulatedValues(const std::vector<config::Point>& points, std::uint32_t seed);
  Value Get(std::size_t point, Instant now) const override;
  void Set(std::size_t point, const Value& value) override;

 private:
  const std::vector<config::Point>& points_;
  std::uint32_t seed_;
  std::vector<Value> written_;
};

/// The lowest number that is an address of this protocol and none of `devices`'. Devices 1 and
/// 2: 3. Nothing where addresses are no numbers.
std::optional<std::string> FreeAddress(const Protocol& protocol,
                                       std::span<const config::Device> devices);

struct SimulatorOptions {
  std::string link;  ///< where the pty is linked; empty: its own name only
  /// Characters take their time on the wire; nothing: as fast as the machine.
  std::optional<config::SerialSettings> pace;
  Duration think_time = 5ms;  ///< end of request to first byte of the reply
  std::vector<Fault> faults;  ///< their schedules count from the creation of the simulator
  std::optional<EventSchedule> events;  ///< of each twin
  /// Hears every request, what the twins answer (empty: nothing) and what of it goes out: held
  /// back replies and an echo included. Called from the thread of the io_context.
  std::function<void(View request, View reply, View delivered)> observer;
};

class Simulator {
 public:
  /// One bus with `devices` on it, which are copied. The io_context outlives the simulator.
  static Result<std::unique_ptr<Simulator>> Create(asio::io_context& io, const Protocol& protocol,
                                                   std::vector<config::Device> devices,
                                                   const SimulatorOptions& options);
  ~Simulator();

  /// What a line's `port:` is set to.
  const std::string& path() const;
  /// Requests answered so far, and the characters of those exchanges, both ways. From any thread.
  std::uint64_t answered() const;
  std::uint64_t characters() const;
  /// How often each fault has struck. From the thread of the io_context.
  std::vector<FaultCount> fault_counts() const;
  /// Events that the twins have raised, and those that were lost because a register was full. From
  /// the thread of the io_context.
  std::pair<std::uint64_t, std::uint64_t> event_counts() const;
  /// From now on these and no others; counts and schedules begin anew. From the thread of the
  /// io_context.
  void SetFaults(const std::vector<Fault>& faults);

 private:
  struct Impl;
  explicit Simulator(std::shared_ptr<Impl> impl);
  std::shared_ptr<Impl> impl_;
};

}  // namespace baudgate
