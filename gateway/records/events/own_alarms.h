// `OwnAlarms` decides when a trouble of a line, device, route or disk raises an alarm: when it has
// lasted for the configured delay and no other alarm explains it. Takes facts, and returns events
// that raise and end alarms. No clock, no lock, no disk: gateway/records/event_path.h provides
// these.
//
//   Begin(no_answer) … Look 29 s later       nothing
//                    … Look 30 s later       the alarm is raised
//                    … End                   the alarm ends
//   Begin(no_answer), End 29 s later         nothing was raised
//   Begin(port_down), Begin(no_answer)       port_down is raised; no_answer waits until the port is
//                                            open, and then for its whole delay
//   Begin(port_down), alarms of line: off    no_answer of each of its devices is raised
//   End, the first since the start           the alarm ends if it is active in the file
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

// A trouble of lines, devices, routes or disks that may raise an alarm. docs/events.md has the
// names of the alarms. `line` and `device` are the Subject, `setting` is the part of the
// configuration with the AlarmSetting.
//
//   trouble       line    device          setting
//   no_answer     bay-1   feeder-1        the device
//   port_down     bay-1                   the line
//   unit_silent   drive   unit-51         the route that maps unit 51 to line drive
//   unit_silent           unit-70         the route to a remote server
//   server_away           10.0.0.9:502    the route to this server
//   events_lost                           the gateway
enum class Trouble : std::uint8_t {
  no_answer,
  wrong_device,  ///< the device is not of the configured kind
  replaced,      ///< another device answers in its place; has no end
  port_down,
  ring_open,
  unit_silent,  ///< a unit behind a route does not answer requests of clients
  server_away,  ///< the server of a route cannot be reached
  events_lost,  ///< events cannot be stored
  writes_lost,  ///< writes cannot be recorded
  values_lost,  ///< values cannot be stored
};
inline constexpr std::size_t kTroubles = 10;

/// Returns the name of the alarm: "no answer". The alarm's text begins with it.
std::string_view Name(Trouble trouble);
/// Returns nothing if `name` is that of another kind of alarm.
std::optional<Trouble> TroubleNamed(std::string_view name);

/// Returns the device name of a routed unit: "unit-51". `unit`: the number that clients ask for.
std::string UnitName(std::uint8_t unit);

/// Returns the server of a routed unit: "10.0.0.9:502"; empty: none.
std::string ServerOf(const config::Config& config, std::string_view unit);

/// Returns the setting that applies; nothing if the configuration has no such line, device or
/// route.
std::optional<config::AlarmSetting> SettingOf(const config::Config& config, Trouble trouble,
                                              std::string_view line, std::string_view device);

class OwnAlarms {
 public:
  /// A device that has answered for this time without a report of a wrong device is the right one.
  static constexpr Duration kIdentified = 30s;

  using Records = std::vector<EventRecord>;
  /// Line and device of the trouble; both empty: the gateway. For routes and servers see Trouble.
  struct Subject {
    std::string line{};
    std::string device{};
    auto operator<=>(const Subject&) const = default;
  };

  explicit OwnAlarms(std::shared_ptr<const config::Config> config) : config_(std::move(config)) {}

  /// Reports that the trouble exists. A second call may pass another reason.
  void Begin(Trouble trouble, const Subject& place, const std::string& why, Now now);
  /// Reports that the trouble does not exist, whether it existed before or not.
  Records End(Trouble trouble, const Subject& place, Now now);
  /// Reports a trouble that has no end.
  Records Happen(Trouble trouble, const Subject& place, const std::string& why, Now now);
  /// Takes a device, or a line whose port is lent, out of use or back into use. Troubles of an
  /// unused subject raise no alarm.
  Records SetInUse(const Subject& place, bool in_use, Now now);
  /// Returns the events of troubles that have lasted for their delay. To be called from time to
  /// time.
  Records Look(Now now);

  /// Applies a reload. `begun`: lines that are new or restarted, whose state is not known yet.
  void Renew(std::shared_ptr<const config::Config> config, const std::set<std::string>& begun);

 private:
  using Key = std::pair<Subject, Trouble>;
  struct State {
    Instant since{};  ///< since when the trouble exists without another explanation
    std::string why{};
    bool raised = false;
    bool stale = false;    ///< from before a reload of the line; not reported again since
    bool by_port = false;  ///< derived from port_down of the line, not reported for the device
  };

  std::optional<config::AlarmSetting> SettingOf(const Key& key) const;
  bool IsExplained(const Key& key) const;
  bool Explains(const Key& key) const;
  void BlameDevices();
  void EndOf(const Key& key, Now now, Records& records, bool answers = true);
  void OnFirstAnswer(const Subject& device, Now now, Records& records);

  std::shared_ptr<const config::Config> config_;
  std::map<Key, State> states_;  // troubles that exist
  std::set<Key> over_;           // troubles reported since the start as not existing
  std::map<Key, Instant>
      may_be_over_;  // when the trouble counts as over if it does not begin before
  std::set<Subject> unused_;
};

}  // namespace baudgate::events
