// SPDX-License-Identifier: Apache-2.0
#include "gateway/records/events/lasting_facts.h"

namespace baudgate::events {
namespace {

/// A line that is restarted does not tell that these are over.
bool EndsUntold(OwnCode code) {
  return code == OwnCode::collisions || code == OwnCode::ring_open || code == OwnCode::wrong_device;
}

}  // namespace

LastingFacts::LastingFacts(const config::Config& config) { NoteUse(config); }

bool LastingFacts::IsNews(const Fact& fact, bool first) {
  if (!HasEnd(fact.code)) return true;
  const Key key{fact.code, fact.line, fact.device};
  if (fact.over) return lasting_.erase(key) > 0 || !first;
  // A wrong device may become another wrong one.
  return lasting_.insert(key).second || fact.code == OwnCode::wrong_device;
}

std::vector<Fact> LastingFacts::Renew(const config::Config& config,
                                      const std::set<std::string>& begun) {
  std::set<Place> places;
  for (const config::Line& line : config.lines) {
    places.emplace(line.name, "");
    for (const config::Device& device : line.devices) places.emplace(line.name, device.name);
  }
  std::erase_if(lasting_, [&](const Key& key) {
    return !places.contains({std::get<1>(key), std::get<2>(key)});
  });
  std::vector<Fact> ended;
  for (const auto& [code, line, device] : lasting_) {
    if (!begun.contains(line) || !EndsUntold(code)) continue;
    ended.push_back({.code = code,
                     .over = true,
                     .line = line,
                     .device = device,
                     .why = "a reload has restarted the line",
                     .unknown = true});
  }
  for (const auto& [line, device] : NoteUse(config)) {
    ended.push_back({.code = OwnCode::not_in_use,
                     .over = true,
                     .line = line,
                     .device = device,
                     .why = "by a reload"});
  }
  for (const Fact& fact : ended) lasting_.erase({fact.code, fact.line, fact.device});
  return ended;
}

/// If the configuration has changed `enabled` of a device, that holds. Otherwise the device stays
/// as it was set by hand. Returns the devices that were out of use and are in use now.
std::vector<LastingFacts::Place> LastingFacts::NoteUse(const config::Config& config) {
  const std::map<Place, bool> before = std::exchange(enabled_, {});
  std::vector<Place> in_use;
  for (const config::Line& line : config.lines) {
    for (const config::Device& device : line.devices) {
      const Place place{line.name, device.name};
      enabled_.emplace(place, device.enabled);
      const auto was = before.find(place);
      if (was != before.end() && was->second == device.enabled) continue;
      const Key key{OwnCode::not_in_use, line.name, device.name};
      if (!device.enabled) lasting_.insert(key);
      if (device.enabled && lasting_.contains(key)) in_use.push_back(place);
    }
  }
  return in_use;
}

}  // namespace baudgate::events
