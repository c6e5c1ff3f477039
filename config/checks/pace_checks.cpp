// SPDX-License-Identifier: Apache-2.0
#include "config/checks/pace_checks.h"

#include <optional>

namespace baudgate::config {
namespace {

std::string Shown(int retries) { return std::to_string(retries); }
std::string Shown(Duration time) { return FormatDuration(time); }

}  // namespace

void CheckPaces(const Paces& paces, const std::string& device, const Mark& mark,
                Problems& problems) {
  const auto warn = [&](const std::string& what, const std::string& whose, const std::string& why) {
    problems.Warning(mark, "device '" + device + "': " + what + " of the " + whose +
                               " does not count: its profile says " + why +
                               "; write it at the device to use it");
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

}  // namespace baudgate::config
