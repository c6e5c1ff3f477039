// `OwnAlarms` decides when a trouble of a line, device, route or disk raises an alarm: when it has
// lasted for the configured delay and no other alarm explains it. It accepts facts, and returns
// events that raise and end alarms. No clock, no lock, no disk: gateway/records/event_path.h
// provides these.
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

// Trouble is a fault of a line, device, route or disk that can raise an alarm. docs/events.md lists
// the names of the alarms. In the table, `line` and `device` are the members of OwnAlarms::Subject,
// and `setting` is the part of the configuration that contains the AlarmSetting.
//
//   trouble       line    device          setting
//   no_answer     bay-1   feeder-1        the device
//   port_down     bay-1                   the line
//   unit_silent   drive   unit-51         the route that maps unit 51 to line drive
//   unit_silent           unit-70         the route to a remote server
//   server_away           10.0.0.9:502    the route to this server
//   events_lost                           the gateway
//   receiver_away         remote_write    the gateway; `device` is the name of the outlet
enum class Trouble : std::uint8_t {
  no_answer,
  wrong_device,  ///< the device is not of the configured kind
  replaced,      ///< another device answers at its address; this event has no end
  port_down,
  ring_open,
  unit_silent,
  server_away,
  events_lost,
  writes_lost,
  values_lost,
  certificate_ends,  ///< in 30 days or less, or it has ended
  receiver_away,     ///< values wait for the receiver of an outlet
  values_refused,    ///< the receiver of an outlet has refused values
};
inline constexpr std::size_t kTroubles = 13;

/// Returns the name of the alarm, such as "no answer". The alarm's text begins with the name.
std::string_view Name(Trouble trouble);
std::optional<Trouble> TroubleNamed(std::string_view name);

/// Returns the device name of a routed unit: "unit-51". `unit`: the number that clients address.
std::string UnitName(std::uint8_t unit);

/// Returns the server to which a unit is routed: "10.0.0.9:502". Empty: the unit is not routed to a
/// server.
std::string ServerOf(const config::Config& config, std::string_view unit);

/// Returns the alarm setting of the trouble; nothing if the configuration has no such line, device
/// or route.
std::optional<config::AlarmSetting> SettingOf(const config::Config& config, Trouble trouble,
                                              std::string_view line, std::string_view device);

class OwnAlarms {
 public:
  /// A device is the configured one if it has answered for this time without a report of a wrong
  /// device.
  static constexpr Duration kIdentified = 30s;

  using Records = std::vector<EventRecord>;
  /// The line and device that the trouble is about; both empty: the gateway. For routes and servers
  /// see Trouble.
  struct Subject {
    std::string line{};
    std::string device{};
    auto operator<=>(const Subject&) const = default;
  };

  explicit OwnAlarms(std::shared_ptr<const config::Config> config) : config_(std::move(config)) {}

  /// Reports that the trouble exists. A second call can pass another reason.
  void Begin(Trouble trouble, const Subject& place, const std::string& why, Now now);
  Records End(Trouble trouble, const Subject& place, Now now);
  Records Happen(Trouble trouble, const Subject& place, const std::string& why, Now now);
  /// Takes a device, or a line whose port is lent, out of use or back into use. Troubles of a
  /// subject that is not in use raise no alarm. Alarms of a device that is taken out of use end.
  Records SetInUse(const Subject& place, bool in_use, Now now);
  /// Returns the events that raise alarms whose trouble has lasted for its delay, and that end
  /// wrong_device alarms of correct devices. To be called from time to time.
  Records Look(Now now);

  /// Applies a reload. `begun`: lines that are new or restarted, so the state of their troubles is
  /// not known yet.
  void Renew(std::shared_ptr<const config::Config> config, const std::set<std::string>& begun);

 private:
  using Key = std::pair<Subject, Trouble>;
  struct State {
    Instant since{};
    std::string why{};
    bool raised = false;
    bool stale = false;    ///< reported before a reload of the line, and not again since
    bool by_port = false;  ///< derived from port_down of the line, not reported for the device
  };

  std::optional<config::AlarmSetting> SettingOf(const Key& key) const;
  bool IsExplained(const Key& key) const;
  bool Explains(const Key& key) const;
  void BlameDevices();
  void EndOf(const Key& key, Now now, Records& records, bool answers = true);
  void OnFirstAnswer(const Subject& device, Now now, Records& records);

  std::shared_ptr<const config::Config> config_;
  std::map<Key, State> states_;
  std::set<Key> over_;  // troubles that were reported since the start as not existing
  std::map<Key, Instant> may_be_over_;  // when the trouble counts as over, unless it begins before
  std::set<Subject> unused_;
};

}  // namespace baudgate::events
