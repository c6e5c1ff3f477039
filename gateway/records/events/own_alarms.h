// Decides when a trouble of lines, devices, routes and disks is an alarm: when it has lasted for
// the delay of its setting, and nothing else explains it. Takes facts, returns events that raise
// and end alarms. No clock, no lock, no disk: gateway/daemon/alarm_service.h has them.
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
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <memory>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "config/model/config.h"
#include "gateway/records/events/event_record.h"
#include "gateway/records/events/trouble.h"

namespace baudgate::events {

class OwnAlarms {
 public:
  /// Within this time after a start an answering device has shown whether it is the right one.
  static constexpr Duration kIdentified = 30s;

  using Records = std::vector<EventRecord>;
  /// The line and device of the trouble; both empty: the gateway.
  struct Place {
    std::string line{};
    std::string device{};
    auto operator<=>(const Place&) const = default;
  };

  explicit OwnAlarms(std::shared_ptr<const config::Config> config) : config_(std::move(config)) {}

  /// The trouble exists; a second call may have another reason.
  void Begin(Trouble trouble, const Place& place, const std::string& why, Now now);
  /// The trouble does not exist, whether it did before or not.
  Records End(Trouble trouble, const Place& place, Now now);
  /// It has happened; it has no end.
  Records Happen(Trouble trouble, const Place& place, const std::string& why, Now now);
  /// A device is taken out of use, or the port of a line is lent: no trouble of it counts.
  Records SetInUse(const Place& place, bool in_use, Now now);
  /// Raises what has lasted long enough.
  Records Look(Now now);

  /// A reload. `begun`: lines that are new or restarted, of which nothing is known yet.
  void Renew(std::shared_ptr<const config::Config> config, const std::set<std::string>& begun);

 private:
  using Key = std::pair<Place, Trouble>;
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
  void OnFirstAnswer(const Place& device, Now now, Records& records);

  std::shared_ptr<const config::Config> config_;
  std::map<Key, State> states_;         // troubles that exist
  std::set<Key> over_;                  // troubles reported since the start as not existing
  std::map<Key, Instant> may_be_over_;  // over at this time, unless the trouble begins before
  std::set<Place> unused_;
};

}  // namespace baudgate::events
