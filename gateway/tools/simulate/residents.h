// The twins of one protocol on a bus, and their faults: whole requests go in, what is said and when
// comes out. Sans-I/O; gateway/tools/simulate/twin_port.h carries it over a pty or a connection.
// SimulatedValues is what the devices measure, and TwinEvents raises events.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "config/model/device.h"
#include "config/model/point.h"
#include "gateway/base/result.h"
#include "gateway/base/time.h"
#include "gateway/tools/simulate/twin_faults.h"
#include "protocols/protocol.h"
#include "protocols/twin.h"

namespace baudgate::tools {

// What the twins of simulated devices measure.

/// What a twin measures: each point follows its `simulate:` entry, a slow wave or a fixed value.
class SimulatedValues final : public protocols::TwinValues {
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

// Events that a twin raises by itself, as the user writes them: "every:5s", "every:1s,count=3".
// They are those of its profile's table that go on and off, one after the other. Sans-I/O, as
// twin_faults.h.
struct EventSchedule {
  Duration every{};
  std::size_t count = 1;  ///< at a time
  /// Each says its number, from 1 on, so that a test can tell which are missing.
  bool numbered = false;
};

/// An error says what may stand there.
Result<EventSchedule> ParseEventSchedule(std::string_view text);

class TwinEvents {
 public:
  TwinEvents(const EventSchedule& schedule, Now start) : schedule_(schedule), start_(start) {}

  /// Raises what has become due: before each request that the twin answers. `device`: the twin's.
  void CatchUp(protocols::Twin& twin, const config::Device& device, Now now);

  std::uint64_t raised() const { return raised_; }
  std::uint64_t refused() const { return refused_; }  ///< there was no room in its register

 private:
  protocols::DeviceEvent Next(const config::Device& device) const;

  const EventSchedule schedule_;
  const Now start_;
  std::uint64_t rounds_ = 0;
  std::uint64_t raised_ = 0;
  std::uint64_t refused_ = 0;
};

/// The lowest number that is an address of this protocol and none of `devices`'. Devices 1 and
/// 2: 3. Nothing where addresses are no numbers.
std::optional<std::string> FreeAddress(const protocols::Protocol& protocol,
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
  Residents(const protocols::Protocol& protocol, std::vector<config::Device> devices,
            const TwinWire& wire, const std::optional<EventSchedule>& events);
  Residents(const Residents&) = delete;
  Residents& operator=(const Residents&) = delete;

  const protocols::Protocol& protocol() const { return protocol_; }
  bool speaks_unasked() const;
  /// The rule for requests gets these, the options of the first device.
  const protocols::ParsedOptions& options() const { return options_; }
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
    std::unique_ptr<protocols::Twin> twin;
    std::optional<TwinEvents> events{};
  };
  using Twins = std::vector<std::unique_ptr<Resident>>;
  struct Reply {
    Bytes bytes;
    const Resident* speaker = nullptr;
  };

  static Twins MakeTwins(const protocols::Protocol& protocol, std::vector<config::Device> devices,
                         std::uint32_t seed);
  static Reply ReplyOf(const Twins& twins, View request, Instant now);
  const config::SerialSettings& SerialOf(const Resident& resident) const;
  Twins MakeStrangers() const;
  bool IsDead(Instant now);
  void RaiseEvents(Now now);

  const protocols::Protocol& protocol_;
  const TwinWire wire_;
  const protocols::ParsedOptions options_;
  Twins twins_;
  Twins strangers_;  // who answer in place of the twins, for the fault wrong_address
  std::optional<TwinFaults> faults_;
  bool was_dead_ = false;
};

}  // namespace baudgate::tools
