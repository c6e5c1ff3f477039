// SPDX-License-Identifier: Apache-2.0
#include "gateway/records/events/own_alarms.h"

#include <algorithm>
#include <array>

#include "gateway/base/text.h"
#include "gateway/records/events/own_records.h"

namespace baudgate::events {
namespace {

constexpr std::array<std::string_view, kTroubles> kNames = {
    "no answer",           "wrong device",        "another device",
    "port down",           "ring open",           "no answer to clients",
    "server away",         "events are not kept", "writes are not recorded",
    "values are not kept", "certificate ends",    "receiver away",
    "values refused"};
constexpr std::string_view kUnit = "unit-";

const config::Route* RouteOf(const config::Config& config, std::string_view device) {
  if (!device.starts_with(kUnit)) return nullptr;
  const auto unit = ParseInteger<std::uint8_t>(device.substr(kUnit.size()));
  if (!unit) return nullptr;
  const auto& routes = config.modbus.routes;
  const auto route =
      std::ranges::find_if(routes, [&](const config::Route& one) { return one.Covers(*unit); });
  return route == routes.end() ? nullptr : &*route;
}

std::optional<config::AlarmSetting> OfRoute(const config::Config& config, std::string_view line,
                                            std::string_view device) {
  const config::Route* const route = RouteOf(config, device);
  if (route == nullptr || route->line != line) return std::nullopt;
  return route->alarms;
}

std::optional<config::AlarmSetting> OfServer(const config::Config& config,
                                             std::string_view server) {
  for (const config::Route& route : config.modbus.routes) {
    if (!route.line.empty() || HostAndPort(route.host, route.port) != server) continue;
    return route.alarms;
  }
  return std::nullopt;
}

}  // namespace

std::string_view Name(Trouble trouble) { return kNames[static_cast<std::size_t>(trouble)]; }

std::optional<Trouble> TroubleNamed(std::string_view name) {
  const auto found = std::ranges::find(kNames, name);
  if (found == kNames.end()) return std::nullopt;
  return static_cast<Trouble>(found - kNames.begin());
}

std::string UnitName(std::uint8_t unit) { return std::string(kUnit) + std::to_string(unit); }

std::string ServerOf(const config::Config& config, std::string_view unit) {
  const config::Route* const route = RouteOf(config, unit);
  if (route == nullptr || !route->line.empty()) return {};
  return HostAndPort(route->host, route->port);
}

std::optional<config::AlarmSetting> SettingOf(const config::Config& config, Trouble trouble,
                                              std::string_view line, std::string_view device) {
  if (trouble >= Trouble::events_lost) return config.alarms;
  if (trouble == Trouble::unit_silent) return OfRoute(config, line, device);
  if (trouble == Trouble::server_away) return OfServer(config, device);
  const auto its_line = std::ranges::find(config.lines, line, &config::Line::name);
  if (line.empty() || its_line == config.lines.end()) return std::nullopt;
  if (trouble >= Trouble::port_down) return its_line->alarms;
  const auto its = std::ranges::find(its_line->devices, device, &config::Device::name);
  if (its == its_line->devices.end()) return std::nullopt;
  return its->alarms;
}

namespace {

using Step = AlarmMark::Step;

std::string TextOf(Trouble trouble, Duration lasted, const std::string& why) {
  std::string text(Name(trouble));
  const bool has_time = lasted > Duration::zero() && trouble != Trouble::certificate_ends &&
                        trouble != Trouble::values_refused;
  if (has_time) text += " for " + FormatDuration(lasted);
  return why.empty() ? text : text + ": " + why;
}

}  // namespace

std::optional<config::AlarmSetting> OwnAlarms::SettingOf(const Key& key) const {
  return events::SettingOf(*config_, key.second, key.first.line, key.first.device);
}

/// True if the trouble exists and its alarm is enabled, so that other troubles need no alarm. A
/// stale trouble explains nothing: it may be over, and its end may never be reported.
bool OwnAlarms::Explains(const Key& key) const {
  const auto state = states_.find(key);
  const auto setting = SettingOf(key);
  return state != states_.end() && !state->second.stale && setting && setting->on();
}

/// True if the trouble must raise no alarm, because its device or line is not in use, or another
/// trouble explains it: a device depends on its line, a line on its port, a unit on its server.
bool OwnAlarms::IsExplained(const Key& key) const {
  const auto& [place, trouble] = key;
  if (unused_.contains(place)) return true;
  if (trouble == Trouble::unit_silent && place.line.empty()) {
    return Explains({{"", ServerOf(*config_, place.device)}, Trouble::server_away});
  }
  if (place.line.empty() || trouble == Trouble::port_down) return false;
  const Subject line{place.line, ""};
  if (unused_.contains(line) || Explains({line, Trouble::port_down})) return true;
  return trouble != Trouble::ring_open && Explains({line, Trouble::ring_open});
}

void OwnAlarms::Begin(Trouble trouble, const Subject& place, const std::string& why, Now now) {
  State& state = states_.try_emplace({place, trouble}, State{.since = now.instant}).first->second;
  state.why = why;
  state.stale = state.by_port = false;
}

/// Adds the event that ends the alarm. Adds nothing if the alarm was not raised and its end was
/// reported since the start. `answers` false: the trouble may last, but its alarm ends, for example
/// because its device is taken out of use.
void OwnAlarms::EndOf(const Key& key, Now now, Records& records, bool answers) {
  const auto state = states_.find(key);
  const bool raised = state != states_.end() && std::exchange(state->second.raised, false);
  const bool first = !over_.contains(key);
  if (answers) over_.insert(key);
  if (!raised && !first) return;
  records.push_back(OwnAlarmRecord(key.second, key.first.line, key.first.device,
                                   {.step = Step::clear, .first = true},
                                   std::string(Name(key.second)) + ", over", now.wall));
}

OwnAlarms::Records OwnAlarms::End(Trouble trouble, const Subject& place, Now now) {
  Records records;
  const Key key{place, trouble};
  const bool first = !over_.contains(key);
  EndOf(key, now, records);
  states_.erase(key);
  if (first && trouble == Trouble::no_answer) OnFirstAnswer(place, now, records);
  if (trouble != Trouble::port_down) return records;
  for (auto at = states_.begin(); at != states_.end();) {
    const bool by_it = at->second.by_port && at->first.first.line == place.line;
    if (by_it && at->second.raised) EndOf(at->first, now, records, false);
    at = by_it ? states_.erase(at) : std::next(at);
  }
  return records;
}

/// The device has answered for the first time since the start. This shows that the ring is closed,
/// and that the device is the configured one unless a wrong device is reported within kIdentified.
/// After a start, no line reports the end of these two troubles.
void OwnAlarms::OnFirstAnswer(const Subject& device, Now now, Records& records) {
  const Key ring{{device.line, ""}, Trouble::ring_open};
  const auto open = states_.find(ring);
  if (open == states_.end() || open->second.stale) {
    EndOf(ring, now, records);
    states_.erase(ring);
  }
  may_be_over_[{device, Trouble::wrong_device}] = now.instant + kIdentified;
}

OwnAlarms::Records OwnAlarms::Happen(Trouble trouble, const Subject& place, const std::string& why,
                                     Now now) {
  const auto setting = SettingOf({place, trouble});
  if (!setting || !setting->on()) return {};
  return {OwnAlarmRecord(trouble, place.line, place.device,
                         {.step = Step::pulse, .priority = setting->priority},
                         TextOf(trouble, {}, why), now.wall)};
}

OwnAlarms::Records OwnAlarms::SetInUse(const Subject& place, bool in_use, Now now) {
  Records records;
  if (in_use) {
    unused_.erase(place);
    return records;
  }
  unused_.insert(place);
  if (place.device.empty()) return records;
  for (const Trouble trouble : {Trouble::no_answer, Trouble::wrong_device}) {
    EndOf({place, trouble}, now, records, false);
  }
  return records;
}

/// While a port is down, its devices are not polled, so nothing reports that they do not answer. If
/// the alarm of the port is disabled, no_answer begins for each device of the line.
void OwnAlarms::BlameDevices() {
  for (const config::Line& line : config_->lines) {
    const auto down = states_.find({{line.name, ""}, Trouble::port_down});
    if (down == states_.end() || line.alarms.on()) continue;
    for (const config::Device& device : line.devices) {
      states_.try_emplace({{line.name, device.name}, Trouble::no_answer},
                          State{.since = down->second.since,
                                .why = "its port is down: " + down->second.why,
                                .by_port = true});
    }
  }
}

OwnAlarms::Records OwnAlarms::Look(Now now) {
  Records records;
  BlameDevices();
  for (auto& [key, state] : states_) {
    if (state.raised) continue;
    const auto setting = SettingOf(key);
    if (!setting || !setting->on()) continue;
    const bool explained = IsExplained(key);
    if (explained) state.since = now.instant;
    if (explained || now.instant - state.since < setting->delay) continue;
    state.raised = true;
    records.push_back(
        OwnAlarmRecord(key.second, key.first.line, key.first.device,
                       {.step = Step::raise, .priority = setting->priority, .first = true},
                       TextOf(key.second, setting->delay, state.why), now.wall));
  }
  for (auto at = may_be_over_.begin(); at != may_be_over_.end();) {
    if (at->second > now.instant) {
      ++at;
      continue;
    }
    const auto state = states_.find(at->first);
    if (state == states_.end() || state->second.stale) {
      EndOf(at->first, now, records);
      states_.erase(at->first);
    }
    at = may_be_over_.erase(at);
  }
  return records;
}

void OwnAlarms::Renew(std::shared_ptr<const config::Config> config,
                      const std::set<std::string>& begun) {
  config_ = std::move(config);
  const auto is_new = [&](const Key& key) {
    return begun.contains(key.first.line) && key.second != Trouble::unit_silent;
  };
  for (auto at = states_.begin(); at != states_.end();) {
    auto& [key, state] = *at;
    const auto setting = SettingOf(key);
    if (!setting || !setting->on()) state.raised = false;
    state.stale = state.stale || is_new(key);
    const bool gone = !setting || (is_new(key) && !state.raised);
    at = gone ? states_.erase(at) : std::next(at);
  }
  std::erase_if(over_, [&](const Key& key) { return is_new(key) || !SettingOf(key); });
  std::erase_if(may_be_over_, [&](const auto& one) { return is_new(one.first); });
  std::erase_if(unused_, [&](const Subject& place) { return begun.contains(place.line); });
}

}  // namespace baudgate::events
