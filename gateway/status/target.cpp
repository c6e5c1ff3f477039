// SPDX-License-Identifier: Apache-2.0
#include "gateway/status/target.h"

#include <string>
#include <vector>

#include "gateway/base/spelling.h"

namespace baudgate::control {
namespace {

using config::DidYouMean;
using config::Join;
using config::Quoted;

template <typename Named>
std::vector<std::string_view> NamesOf(const std::vector<Named>& all) {
  std::vector<std::string_view> names;
  for (const Named& one : all) names.push_back(one.name);
  return names;
}

Error NoSuchLine(const config::Config& config, std::string_view name) {
  for (const config::Line& line : config.lines) {
    for (const config::Device& device : line.devices) {
      if (device.name != name) continue;
      return {Quoted(name) + " is a device of line '" + line.name + "': write " + line.name + "." +
              device.name};
    }
  }
  const auto names = NamesOf(config.lines);
  return {"there is no line " + Quoted(name) + ";" + DidYouMean(name, names) +
          " lines: " + Join(names)};
}

}  // namespace

Result<Target> FindDevice(const config::Config& config, std::uint32_t line, std::string_view name) {
  const auto& devices = config.lines[line].devices;
  for (std::size_t slot = 0; slot < devices.size(); ++slot) {
    if (devices[slot].name != name) continue;
    return Target{line, config::FirstDevice(config, line) + static_cast<std::uint32_t>(slot)};
  }
  const auto names = NamesOf(devices);
  return Error{"line '" + config.lines[line].name + "' has no device " + Quoted(name) + ";" +
               DidYouMean(name, names) + " its devices: " + Join(names)};
}

Result<Target> FindTarget(const config::Config& config, std::string_view text) {
  const auto dot = text.find('.');
  const std::string_view name = text.substr(0, dot);
  for (std::uint32_t line = 0; line < config.lines.size(); ++line) {
    if (config.lines[line].name != name) continue;
    if (dot == std::string_view::npos) return Target{line};
    return FindDevice(config, line, text.substr(dot + 1));
  }
  return NoSuchLine(config, name);
}

}  // namespace baudgate::control
