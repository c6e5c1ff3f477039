// `Residents` contains the twins (simulated devices) of one protocol on a bus, and their faults.
// Complete requests go in; replies with their times come out. No I/O:
// gateway/tools/simulate/twin_port.h carries the bytes over a pty or a connection.
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

/// The values that a simulated device measures: each point follows its `simulate:` entry, a slow
/// wave or a fixed value. A value that was written stays.
class SimulatedValues final : public protocols::TwinValues {
 public:
  /// `points` must outlive this object. `seed` shifts the waves, so that simulated devices have
  /// different values.
  SimulatedValues(const std::vector<config::Point>& points, std::uint32_t seed);
  Value Get(std::size_t point, Instant now) const override;
  void Set(std::size_t point, const Value& value) override;

 private:
  const std::vector<config::Point>& points_;
  std::uint32_t seed_;
  std::vector<Value> written_;
};

// `EventSchedule` tells when a simulated device raises events by itself, as the user writes it:
// "every:5s", "every:1s,count=3". The simulated device raises the on and off events of its
// profile's table in turn. No I/O.
struct EventSchedule {
  Duration every{};
  std::size_t count = 1;  ///< how many events are raised at a time
  /// True: the text of each event is its number, from 1, so that a test can find missing events.
  bool numbered = false;
};

/// The error text contains the permitted form.
Result<EventSchedule> ParseEventSchedule(std::string_view text);

class TwinEvents {
 public:
  TwinEvents(const EventSchedule& schedule, Now start) : schedule_(schedule), start_(start) {}

  /// Raises all events that are due. To be called before the simulated device answers a request.
  /// `device`: its configuration.
  void CatchUp(protocols::Twin& twin, const config::Device& device, Now now);

  std::uint64_t raised() const { return raised_; }
  std::uint64_t refused() const { return refused_; }

 private:
  protocols::DeviceEvent Next(const config::Device& device) const;

  const EventSchedule schedule_;
  const Now start_;
  std::uint64_t rounds_ = 0;
  std::uint64_t raised_ = 0;
  std::uint64_t refused_ = 0;
};

/// Returns the lowest number that is an address of this protocol and not of a device in `devices`.
/// Example: 3 for devices 1 and 2. Empty: addresses of the protocol are not numbers.
std::optional<std::string> FreeAddress(const protocols::Protocol& protocol,
                                       std::span<const config::Device> devices);

class Residents {
 public:
  struct Answer {
    Bytes reply;  ///< reply of the simulated device; empty: no simulated device answers
    std::vector<TimedPiece> heard;  ///< bytes that the master receives, changed by faults
    /// True: pieces of earlier replies that were not sent yet must be dropped.
    bool interrupts = false;
    config::SerialSettings serial;
  };

  /// `devices` must not be empty. `wire.serial` is for devices without serial settings.
  Residents(const protocols::Protocol& protocol, std::vector<config::Device> devices,
            const TwinWire& wire, const std::optional<EventSchedule>& events);
  Residents(const Residents&) = delete;
  Residents& operator=(const Residents&) = delete;

  const protocols::Protocol& protocol() const { return protocol_; }
  bool speaks_unasked() const;
  /// Returns the options of the first device. They determine how received bytes are divided into
  /// requests.
  const protocols::ParsedOptions& options() const { return options_; }
  const config::SerialSettings& serial() const { return SerialOf(*twins_.front()); }

  /// Returns the reply to one request. `end`: time of the last character of the request.
  Answer Hear(View request, Instant end);
  /// Returns the next message that a simulated device sends unasked; empty: there is no message
  /// now.
  Bytes Say(Now now);

  /// Replaces all faults. The counts and the schedules of the new faults start now.
  void SetFaults(const std::vector<Fault>& faults, Instant now);
  std::vector<FaultCount> fault_counts() const;
  /// Returns the numbers of raised and of refused events.
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
  Twins strangers_;  // these devices answer in place of the simulated devices, for the fault
                     // wrong_address
  std::optional<TwinFaults> faults_;
  bool was_dead_ = false;
};

}  // namespace baudgate::tools
