// `Simulator` serves twins (simulated devices) on a pty or behind a TCP server. It answers requests
// as the real devices would, at a real bit rate if one is given. Used by `baudgate simulate`, the
// demo, system tests and benchmarks.
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

/// Devices of one bus with the same protocol. The options of the first device determine for the
/// whole group how received bytes are divided into requests.
struct TwinGroup {
  const protocols::Protocol* protocol = nullptr;
  std::vector<config::Device> devices;
};

struct SimulatorOptions {
  std::string link;  ///< path of the symbolic link to make to the pty; empty: no link
  /// The address of a TCP server, in place of a pty; port 0: any free port.
  std::optional<config::HostPort> listen;
  /// Serial settings that determine how long each character takes on the wire; empty: characters
  /// take no time.
  std::optional<config::SerialSettings> pace;
  /// True: if a reader has set the pty to another bit rate or format than the simulated devices
  /// have, reader and simulated devices receive what a UART would receive.
  bool strict = false;
  Duration think_time = 5ms;  ///< from the end of the request to the first byte of the reply
  std::vector<Fault> faults;  ///< the schedules of the faults begin when the simulator is created
  std::optional<EventSchedule>
      events;  ///< empty: simulated devices that send unasked raise events every 2 s
  /// Called with each request, the reply of the simulated devices (empty: no simulated device
  /// replies), and the bytes that are sent, which include late replies and an echo. Called on the
  /// thread of the io_context.
  std::function<void(View request, View reply, View delivered)> observer;
};

class Simulator {
 public:
  /// Creates one bus with these devices; without devices, no request is answered. `io` must outlive
  /// this object.
  static Result<std::unique_ptr<Simulator>> Create(asio::io_context& io,
                                                   std::vector<TwinGroup> groups,
                                                   const SimulatorOptions& options);
  static Result<std::unique_ptr<Simulator>> Create(asio::io_context& io,
                                                   const protocols::Protocol& protocol,
                                                   std::vector<config::Device> devices,
                                                   const SimulatorOptions& options);
  ~Simulator();

  /// Returns the value for `port:` of a line: a path, or for example "tcp://127.0.0.1:4001".
  const std::string& path() const;
  /// The number of answered requests, and the number of characters of these requests and replies.
  /// Thread-safe.
  std::uint64_t answered() const;
  std::uint64_t characters() const;
  /// Returns how often each fault has struck. To be called on the thread of the io_context.
  std::vector<FaultCount> fault_counts() const;
  /// Returns the numbers of raised and of refused events. To be called on the thread of the
  /// io_context.
  std::pair<std::uint64_t, std::uint64_t> event_counts() const;
  /// Replaces all faults. The counts and the schedules of the new faults start now. To be called on
  /// the thread of the io_context.
  void SetFaults(const std::vector<Fault>& faults);

 private:
  struct Impl;
  explicit Simulator(std::shared_ptr<Impl> impl);
  std::shared_ptr<Impl> impl_;
};

// `SimulateLine` makes the simulated devices of a whole line of a configuration, which can have
// several protocols and serial settings. Used by `baudgate simulate -c` and the demo.

/// Uses `link` or `listen`, faults, events and think time of `options`. `line` determines the bit
/// rate, and the serial settings that a reader must use.
Result<std::unique_ptr<Simulator>> SimulateLine(asio::io_context& io, const config::Line& line,
                                                const config::Catalog& catalog,
                                                SimulatorOptions options);

}  // namespace baudgate::tools
