// SPDX-License-Identifier: Apache-2.0
#include "config/checks/device_checks.h"

#include <optional>
#include <set>

#include "gateway/base/text.h"

namespace baudgate::config {

namespace {

std::string Shown(int retries) { return std::to_string(retries); }
std::string Shown(Duration time) { return FormatDuration(time); }

}  // namespace

void CheckPaces(const Paces& paces, const std::string& device, const Mark& mark,
                Problems& problems) {
  const auto warn = [&](const std::string& what, const std::string& whose, const std::string& why) {
    problems.Warning(mark, "device '" + device + "': " + what + " of the " + whose +
                               " has no effect, because the device's profile sets " + why +
                               "; set the key at the device to override the profile");
  };
  const auto compare = [&](const char* key, const auto& own, const auto& profile,
                           const auto& line) {
    if (own || !profile || !line || *profile == *line) return;
    warn(std::string(key) + " " + Shown(*line), "line or gateway", Shown(*profile));
  };
  compare("poll", paces.device.poll, paces.profile.poll, paces.line.poll);
  compare("slow", paces.device.slow, paces.profile.slow, paces.line.slow);
  compare("daily", paces.device.daily, paces.profile.daily, paces.line.daily);
  compare("retries", paces.device.retries, paces.profile.retries, paces.line.retries);
  const Timing used = MergeDevice(paces.device.timing, paces.profile.timing, paces.line.timing);
  for (std::size_t i = 0; i < kNamedTimes.size(); ++i) {
    const auto& [name, time] = kNamedTimes[i];
    const auto& line = paces.line.timing.*time;
    if (paces.device.timing.*time || !line || !(used.*time) || *line == *(used.*time)) continue;
    const bool longer = paces.profile.timing.*time && *(used.*time) > *line;
    warn("timing." + std::string(name) + " " + Shown(*line),
         std::string(Name(paces.line.timing.from[i])),
         Shown(*(used.*time)) +
             (longer && name != "quiet" && name != "drain" ? ", which is longer" : ""));
  }
}

namespace {

/// Returns "device 'feeder-1'", "device" if the device has no name, or "a device of this type" for
/// kOfThisType.
std::string Called(const Device& device) {
  if (device.name == kOfThisType) return "a device of this type";
  return device.name.empty() ? "device" : "device '" + device.name + "'";
}

/// Warns of groups that are read at longer intervals than max_age.
void CheckSeldomGroups(const Device& device, const Keys& keys, Problems& problems) {
  std::set<Group> told;
  for (const Point& point : device.points) {
    const Duration period = PeriodOf(device, point.group);
    const std::optional<Duration> max_age = MaxAgeOf(device, point.group);
    if (!max_age || *max_age >= period || !told.insert(point.group).second) continue;
    const std::string shorter = "max_age: " + FormatDuration(*max_age) + " is shorter than ";
    problems.Warning(
        keys.MarkOf("max_age"),
        point.group == Group::slow
            ? shorter + "slow (" + FormatDuration(period) +
                  "), so slow points will often be uncertain; set max_age longer than slow"
            : shorter + "poll of point '" + point.name + "' (" + FormatDuration(period) +
                  "), so the point will often be uncertain; set max_age longer than this poll");
  }
}

/// `unasked`: the device sends without requests and is not polled.
void CheckAges(const Device& device, bool unasked, const Keys& keys, Problems& problems) {
  const std::optional<Duration> limit = MaxAgeOf(device, Group::fast);
  if (!limit) {
    if (!device.dead_age) return;
    return problems.Error(keys.MarkOf("dead_age"),
                          "dead_age: has no effect without max_age, because this device sends "
                          "without requests; set max_age too");
  }
  const Duration max_age = *limit;
  if (max_age < device.poll && !unasked) {
    problems.Error(keys.MarkOf("max_age"),
                   "max_age: " + FormatDuration(max_age) + " is shorter than poll (" +
                       FormatDuration(device.poll) +
                       "), so every value would soon be uncertain; set max_age to poll or more");
  }
  if (device.dead_age && *device.dead_age < max_age) {
    problems.Error(keys.MarkOf("dead_age"),
                   "dead_age: " + FormatDuration(*device.dead_age) + " is shorter than max_age (" +
                       FormatDuration(max_age) + "); set it to max_age or more");
  }
  if (!unasked && max_age >= device.poll) CheckSeldomGroups(device, keys, problems);
}

void CheckDoubts(const Device& device, const protocols::Protocol& protocol, const Keys& keys,
                 Problems& problems) {
  if (!protocol.doubts) return;
  for (const protocols::ConfigRemark& doubt : protocol.doubts(device)) {
    if (doubt.point >= device.points.size()) {
      problems.Warning(keys.MarkOf("address"), Called(device) + ": address " + doubt.text);
      continue;
    }
    const Point& point = device.points[doubt.point];
    problems.Warning(point.mark, Called(device) + ": point '" + point.name + "' " + doubt.text);
  }
}

}  // namespace

void CheckFaults(const Device& device, const protocols::Protocol& protocol, Problems& problems) {
  if (protocol.faults == nullptr) return;
  // After other errors, parts of the description may be missing, so faults that concern the whole
  // device are not reported.
  const bool known = !problems.has_error();
  for (const protocols::ConfigRemark& fault : protocol.faults(device)) {
    if (fault.point >= device.points.size()) {
      if (!known) continue;
      problems.Error(device.mark, Called(device) + " " + fault.text);
      continue;
    }
    const Point& point = device.points[fault.point];
    problems.Error(point.mark, "point '" + point.name + "' " + fault.text);
  }
}

void LineAddresses::Add(const Device& device, const protocols::Protocol& protocol, const Mark& mark,
                        Problems& problems) {
  const std::string& address = device.address;
  const Result<std::string> canonical = protocol.canonical_address(address);
  if (!canonical) {
    problems.Error(mark, "address: " + canonical.error());
    return;
  }
  const auto [first, is_new] =
      owners_.try_emplace({&protocol, *canonical}, Owner{device.name, address});
  if (is_new) return;
  const auto& [name, spelling] = first->second;
  problems.Warning(mark, "address: " + Quoted(address) + " is also the address of device '" + name +
                             "' on this line" +
                             (spelling == address ? "" : ", written there as " + Quoted(spelling)) +
                             "; give each device its own address");
}

void CheckDevice(const Device& device, const protocols::Protocol* protocol, const Keys& keys,
                 Problems& problems) {
  if (!keys.Has("profile") && !keys.Has("points")) {
    problems.Warning(
        device.mark,
        Called(device) + " has no points, so nothing is read from it; add a profile or points");
  }
  CheckAges(device, protocol && SpeaksUnasked(*protocol, device.options), keys, problems);
  if (!protocol) return;
  const Status status = protocol->check_device ? protocol->check_device(device) : Status();
  if (!status) problems.Error(device.mark, Called(device) + ": " + status.error());
  CheckFaults(device, *protocol, problems);
  CheckDoubts(device, *protocol, keys, problems);
}

}  // namespace baudgate::config
