// `Simulator` serves twins on a pty or behind a TCP server. It answers requests as the real devices
// would, at a real bit rate if one is given. Used by `baudgate simulate`, the demo, system tests
// and benchmarks.
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

/// Devices of one bus with the same protocol. The options of the first device determine how
/// requests are cut from the bytes, for all devices of the group.
struct TwinGroup {
  const protocols::Protocol* protocol = nullptr;
  std::vector<config::Device> devices;
};

struct SimulatorOptions {
  std::string link;  ///< path of the link to the pty; empty: no link
  /// Address of a TCP server that is used instead of a pty; port 0: any free port.
  std::optional<config::HostPort> listen;
  /// Settings that determine the time of each character on the wire; empty: no delay.
  std::optional<config::SerialSettings> pace;
  /// If true, a reader that has set the pty to another bit rate or format receives what a UART
  /// would receive.
  bool strict = false;
  Duration think_time = 5ms;            ///< end of request to first byte of the reply
  std::vector<Fault> faults;            ///< their schedules begin when the simulator is created
  std::optional<EventSchedule> events;  ///< schedule of each twin
  /// Called with every request, the reply of the twins (empty: none), and the bytes that are sent,
  /// which include late replies and an echo. Called from the thread of the io_context.
  std::function<void(View request, View reply, View delivered)> observer;
};

class Simulator {
 public:
  /// Creates one bus with these devices; without devices, nothing answers. `io` must outlive the
  /// simulator.
  static Result<std::unique_ptr<Simulator>> Create(asio::io_context& io,
                                                   std::vector<TwinGroup> groups,
                                                   const SimulatorOptions& options);
  static Result<std::unique_ptr<Simulator>> Create(asio::io_context& io,
                                                   const protocols::Protocol& protocol,
                                                   std::vector<config::Device> devices,
                                                   const SimulatorOptions& options);
  ~Simulator();

  /// Returns the value for a line's `port:`, such as a path or "tcp://127.0.0.1:4001".
  const std::string& path() const;
  /// Return the number of answered requests, and of the characters of these exchanges, in both
  /// directions. Thread-safe.
  std::uint64_t answered() const;
  std::uint64_t characters() const;
  /// Returns how often each fault has struck. To be called from the thread of the io_context.
  std::vector<FaultCount> fault_counts() const;
  /// Returns the numbers of raised and of refused events. To be called from the thread of the
  /// io_context.
  std::pair<std::uint64_t, std::uint64_t> event_counts() const;
  /// Replaces all faults. Counts and schedules start again. To be called from the thread of the
  /// io_context.
  void SetFaults(const std::vector<Fault>& faults);

 private:
  struct Impl;
  explicit Simulator(std::shared_ptr<Impl> impl);
  std::shared_ptr<Impl> impl_;
};

// `SimulateLine` makes the twins of a whole line of a configuration, which may have several
// protocols and serial settings. Used by `baudgate simulate -c` and the demo.

/// `options` contains the place and the faults. The line determines the pace and the settings that
/// a reader must use.
Result<std::unique_ptr<Simulator>> SimulateLine(asio::io_context& io, const config::Line& line,
                                                const config::Catalog& catalog,
                                                SimulatorOptions options);

}  // namespace baudgate::tools
