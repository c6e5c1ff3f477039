// The twins of one protocol on a bus, and their faults: whole requests go in, what is said and when
// comes out. Sans-I/O; gateway/tools/simulate/twin_port.h carries it over a pty or a connection.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "config/model/device.h"
#include "gateway/tools/simulate/simulated_values.h"
#include "gateway/tools/simulate/twin_events.h"
#include "gateway/tools/simulate/twin_faults.h"
#include "protocols/protocol.h"

namespace baudgate {

/// The lowest number that is an address of this protocol and none of `devices`'. Devices 1 and
/// 2: 3. Nothing where addresses are no numbers.
std::optional<std::string> FreeAddress(const Protocol& protocol,
                                       std::span<const config::Device> devices);

class Residents {
 public:
  /// What becomes of one request.
  struct Answer {
    Bytes reply;                    ///< what a twin answers; empty: none does
    std::vector<TimedPiece> heard;  ///< what of it reaches the master, faults included
    /// The reply ends what was being said: nobody is interested in it any more.
    bool interrupts = false;
    config::SerialSettings serial;  ///< of the twin that speaks
  };

  /// At least one device, which are copied. `wire` is that of devices without settings of their
  /// own.
  Residents(const Protocol& protocol, std::vector<config::Device> devices, const TwinWire& wire,
            const std::optional<EventSchedule>& events);
  Residents(const Residents&) = delete;
  Residents& operator=(const Residents&) = delete;

  const Protocol& protocol() const { return protocol_; }
  bool speaks_unasked() const;
  /// The rule for requests gets these, the options of the first device.
  const ParsedOptions& options() const { return options_; }
  const config::SerialSettings& serial() const { return SerialOf(*twins_.front()); }

  /// `end`: of the request.
  Answer Hear(View request, Instant end);
  /// The next message that a twin sends by itself; empty: there is none now.
  Bytes Say(Now now);

  /// From now on these and no others; counts and schedules start again.
  void SetFaults(const std::vector<Fault>& faults, Instant now);
  std::vector<FaultCount> fault_counts() const;
  /// Events that were raised, and those that were lost because a register was full.
  std::pair<std::uint64_t, std::uint64_t> event_counts() const;

 private:
  struct Resident {
    config::Device device;
    std::unique_ptr<SimulatedValues> values;
    std::unique_ptr<Twin> twin;
    std::optional<TwinEvents> events{};
  };
  using Twins = std::vector<std::unique_ptr<Resident>>;
  struct Reply {
    Bytes bytes;
    const Resident* speaker = nullptr;
  };

  static Twins MakeTwins(const Protocol& protocol, std::vector<config::Device> devices,
                         std::uint32_t seed);
  static Reply ReplyOf(const Twins& twins, View request, Instant now);
  const config::SerialSettings& SerialOf(const Resident& resident) const;
  Twins MakeStrangers() const;
  bool IsDead(Instant now);
  void RaiseEvents(Now now);

  const Protocol& protocol_;
  const TwinWire wire_;
  const ParsedOptions options_;
  Twins twins_;
  Twins strangers_;  // who answer in place of the twins, for the fault wrong_address
  std::optional<TwinFaults> faults_;
  bool was_dead_ = false;
};

}  // namespace baudgate
