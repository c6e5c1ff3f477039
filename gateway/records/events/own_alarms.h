// Decides when a trouble of lines, devices, routes and disks is an alarm: when it has lasted for
// the delay of its setting, and nothing else explains it. Takes facts, returns events that raise
// and end alarms. No clock, no lock, no disk: gateway/daemon/event_path.h has them.
//
//   Begin(no_answer) … Look 29 s later       nothing
//                    … Look 30 s later       raised
//                    … End                   over
//   Begin(no_answer), End 29 s later         nothing was raised
//   Begin(port_down), Begin(no_answer)       port_down is raised; no_answer waits for the port, and
//                                            then for the whole of its delay
//   Begin(port_down), alarms of line: off    no_answer of each of its devices
//   End, the first since the start           over, if the kept alarm is not
//
// Trouble lists what may be wrong, and what its alarm is called.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "config/model/config.h"
#include "gateway/records/events/event_record.h"

namespace baudgate::events {

// What is wrong with the gateway's own lines, devices, routes and disks, as far as it is an alarm:
// how that alarm is called, and what the configuration says of it. docs/events.md has the names for
// users.
//
//   trouble       line    device          setting
//   no_answer     bay-1   feeder-1        of the device
//   port_down     bay-1                   of the line
//   unit_silent   drive   unit-51         of the route that leads the unit 51 to line drive
//   unit_silent           unit-70         of the route to a server elsewhere
//   server_away           10.0.0.9:502    likewise
//   events_lost                           of the gateway
//
enum class Trouble : std::uint8_t {
  no_answer,     ///< of a device
  wrong_device,  ///< it is not what it should be
  replaced,      ///< another one answers in its place; without an end
  port_down,     ///< of a line
  ring_open,
  unit_silent,  ///< behind a route, as its clients see it
  server_away,  ///< to which a route leads
  events_lost,  ///< of the gateway: events cannot be kept
  writes_lost,  ///< writes cannot be recorded
  values_lost,  ///< values cannot be kept
};
inline constexpr std::size_t kTroubles = 10;

/// "no answer": the name of the alarm, and how its text begins.
std::string_view Name(Trouble trouble);
/// Empty: it is the name of another alarm.
std::optional<Trouble> TroubleNamed(std::string_view name);

/// "unit-51": the device of an alarm of a routed unit, by the number that clients ask for.
std::string UnitName(std::uint8_t unit);

/// "10.0.0.9:502": the server to which this unit is routed; empty: to none.
std::string ServerOf(const config::Config& config, std::string_view unit);

/// The setting that counts; empty: the configuration has no such line, device or route.
std::optional<config::AlarmSetting> SettingOf(const config::Config& config, Trouble trouble,
                                              std::string_view line, std::string_view device);

class OwnAlarms {
 public:
  /// Within this time after a start an answering device has shown whether it is the right one.
  static constexpr Duration kIdentified = 30s;

  using Records = std::vector<EventRecord>;
  /// The line and device of the trouble; both empty: the gateway.
  struct Subject {
    std::string line{};
    std::string device{};
    auto operator<=>(const Subject&) const = default;
  };

  explicit OwnAlarms(std::shared_ptr<const config::Config> config) : config_(std::move(config)) {}

  /// The trouble exists; a second call may have another reason.
  void Begin(Trouble trouble, const Subject& place, const std::string& why, Now now);
  /// The trouble does not exist, whether it did before or not.
  Records End(Trouble trouble, const Subject& place, Now now);
  /// It has happened; it has no end.
  Records Happen(Trouble trouble, const Subject& place, const std::string& why, Now now);
  /// A device is taken out of use, or the port of a line is lent: no trouble of it counts.
  Records SetInUse(const Subject& place, bool in_use, Now now);
  /// Raises what has lasted long enough.
  Records Look(Now now);

  /// A reload. `begun`: lines that are new or restarted, of which nothing is known yet.
  void Renew(std::shared_ptr<const config::Config> config, const std::set<std::string>& begun);

 private:
  using Key = std::pair<Subject, Trouble>;
  struct State {
    Instant since{};  ///< since when it exists without another explanation
    std::string why{};
    bool raised = false;
    bool stale = false;    ///< of a line before a reload; not reported since
    bool by_port = false;  ///< of a device: only its port was reported
  };

  std::optional<config::AlarmSetting> SettingOf(const Key& key) const;
  bool IsExplained(const Key& key) const;
  bool Explains(const Key& key) const;
  void BlameDevices();
  void EndOf(const Key& key, Now now, Records& records, bool answers = true);
  void OnFirstAnswer(const Subject& device, Now now, Records& records);

  std::shared_ptr<const config::Config> config_;
  std::map<Key, State> states_;         // troubles that exist
  std::set<Key> over_;                  // troubles reported since the start as not existing
  std::map<Key, Instant> may_be_over_;  // over at this time, unless the trouble begins before
  std::set<Subject> unused_;
};

}  // namespace baudgate::events
