// Twins on a pty, or behind a TCP server: requests that come from the master's side are answered as
// the real devices would, at a real bit rate if one is given. For `baudgate simulate`, the demo,
// system tests and benchmarks. SimulateLine makes the twins of a whole line of a configuration.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <asio/io_context.hpp>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "config/catalog/catalog.h"
#include "config/model/device.h"
#include "config/model/line.h"
#include "config/model/network.h"
#include "gateway/base/result.h"
#include "gateway/tools/simulate/residents.h"
#include "gateway/tools/simulate/twin_faults.h"
#include "protocols/protocol.h"

namespace baudgate::tools {

/// Devices of one bus that speak one protocol, with requests that one frame rule finds: the options
/// of the first device count for all.
struct TwinGroup {
  const protocols::Protocol* protocol = nullptr;
  std::vector<config::Device> devices;
};

struct SimulatorOptions {
  std::string link;  ///< where the pty is linked; empty: its own name only
  /// In place of a pty a TCP server there; port 0: one that is free.
  std::optional<config::HostPort> listen;
  /// Characters take their time on the wire; empty: as fast as the machine.
  std::optional<config::SerialSettings> pace;
  /// A reader that sets the pty to another bit rate or parity gets what a UART would make of it.
  bool strict = false;
  Duration think_time = 5ms;  ///< end of request to first byte of the reply
  std::vector<Fault> faults;  ///< their schedules count from the creation of the simulator
  std::optional<EventSchedule> events;  ///< of each twin
  /// Hears every request, what the twins answer (empty: nothing) and what of it goes out: held
  /// back replies and an echo included. Called from the thread of the io_context.
  std::function<void(View request, View reply, View delivered)> observer;
};

class Simulator {
 public:
  /// One bus with these devices on it; none at all: nothing answers. The io_context outlives the
  /// simulator.
  static Result<std::unique_ptr<Simulator>> Create(asio::io_context& io,
                                                   std::vector<TwinGroup> groups,
                                                   const SimulatorOptions& options);
  static Result<std::unique_ptr<Simulator>> Create(asio::io_context& io,
                                                   const protocols::Protocol& protocol,
                                                   std::vector<config::Device> devices,
                                                   const SimulatorOptions& options);
  ~Simulator();

  /// What a line's `port:` is set to: a path, or "tcp://127.0.0.1:4001".
  const std::string& path() const;
  /// Requests answered so far, and the characters of those exchanges, both ways. From any thread.
  std::uint64_t answered() const;
  std::uint64_t characters() const;
  /// How often each fault has struck. From the thread of the io_context.
  std::vector<FaultCount> fault_counts() const;
  /// Events that the twins have raised, and those that were lost because a register was full. From
  /// the thread of the io_context.
  std::pair<std::uint64_t, std::uint64_t> event_counts() const;
  /// From now on these and no others; counts and schedules start again. From the thread of the
  /// io_context.
  void SetFaults(const std::vector<Fault>& faults);

 private:
  struct Impl;
  explicit Simulator(std::shared_ptr<Impl> impl);
  std::shared_ptr<Impl> impl_;
};

// The twins of a whole line of a configuration: devices of several protocols, and settings of their
// own. For `baudgate simulate -c` and the demo.

/// `options` say where, and how they misbehave; the line says at which pace, and which settings a
/// reader has to make.
Result<std::unique_ptr<Simulator>> SimulateLine(asio::io_context& io, const config::Line& line,
                                                const config::Catalog& catalog,
                                                SimulatorOptions options);

}  // namespace baudgate::tools
