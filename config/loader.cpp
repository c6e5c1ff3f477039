// SPDX-License-Identifier: Apache-2.0
#include "config/loader.h"

#include <algorithm>
#include <filesystem>

#include "config/catalog/option_values.h"
#include "config/checks/device_checks.h"
#include "config/checks/line_checks.h"
#include "config/checks/modbus_checks.h"
#include "config/checks/point_checks.h"
#include "config/devices.h"
#include "config/events.h"
#include "config/history.h"
#include "config/lines.h"
#include "config/outputs.h"
#include "config/profile.h"
#include "config/writing.h"
#include "config/yaml/yaml_reader.h"

namespace baudgate::config {
namespace {

Config ReadConfig(const YamlNode& root, LoadContext& context) {
  Config config;
  config.modbus = DefaultModbus();
  Problems& problems = context.problems;
  MapReader map(root, "the configuration", problems);
  if (root.kind() != YamlNode::Kind::map) return config;
  if (const auto node = map.Get("gateway")) context.pace = ReadGateway(*node, config, problems);
  context.alarms = config.alarms;
  if (const auto node = map.Get("events")) config.events = ReadEvents(*node, problems);
  context.events = config.events.given;
  const auto history = map.Get("history");
  const auto modbus = map.Get("modbus");
  ReadOutputs(map, config, context);
  const auto lines = map.Get("lines");
  if (lines) config.lines = ReadLines(*lines, context);
  map.Finish();
  ResolveInterlocks(config, problems);
  if (history) config.history = ReadHistory(*history, config, problems);
  if (config.remote_write.on && !config.history.on()) {
    problems.Warning(config.remote_write.mark,
                     "remote_write: sends nothing, because no values are stored; add history: { "
                     "points: [ \"*.*.*\" ] }");
  }
  if (modbus) config.modbus = ReadModbus(*modbus, config.lines, context);
  const bool to_server = std::ranges::any_of(
      config.modbus.routes, [](const Route& route) { return !route.host.empty(); });
  if (!lines && !to_server) map.Need("lines", "[ { name: bay-1, port: /dev/ttyUSB0, … } ]");
  CheckUse(config, problems);
  return config;
}

// Calls `read`, and reports exceptions as a problem. yaml-cpp throws on access as well as on
// parsing.
template <typename Read>
void Guarded(const std::string& file, Problems& problems, Read read) {
  try {
    read();
  } catch (const std::exception& error) {
    problems.Error({file, 0, 0}, "could not be read completely");
  }
}

RawProfile Complete(RawProfile raw, const protocols::Protocol& protocol, Problems& problems) {
  Device device;
  device.points = BuildPoints(raw.points, &protocol, problems);
  AssignIntervals(device, problems);
  raw.profile.points = device.points;
  ResolveRecords(raw.profile.records, device, problems);
  Device of_this_type = DeviceFromProfile(raw.profile, protocol, std::string(kOfThisType), "");
  of_this_type.mark = {raw.file, 1, 1};
  ResolveSentinels(of_this_type, &protocol, problems);
  CheckFaults(of_this_type, protocol, problems);
  return raw;
}

template <typename Read>
LoadedProfile Load(const std::string& file, const Catalog& catalog, Read read) {
  LoadedProfile loaded;
  Problems problems;
  AddSecrets(catalog, problems);
  Guarded(file, problems, [&] {
    if (auto raw = read(problems)) loaded.profile = std::move(raw->profile);
  });
  loaded.problems = problems.Sorted();
  return loaded;
}

}  // namespace

Loaded LoadText(const std::string& text, const std::string& name, const Catalog& catalog) {
  Loaded loaded;
  Problems problems;
  AddSecrets(catalog, problems);
  Guarded(name, problems, [&] {
    const auto root = ParseYaml(name, text, problems);
    if (!root) return;
    LoadContext context(catalog, std::filesystem::path(name).parent_path(), problems);
    loaded.config = ReadConfig(*root, context);
    if (problems.has_error()) return;
    for (const Line& line : loaded.config.lines) CheckLine(line, catalog, problems);
    CheckRoutes(loaded.config, catalog, problems);
    CheckOpenListeners(loaded.config, problems);
  });
  loaded.problems = problems.Sorted();
  return loaded;
}

Loaded LoadFile(const std::string& path, const Catalog& catalog) {
  const auto text = ReadWholeFile(path);
  if (text) return LoadText(*text, path, catalog);
  Loaded loaded;
  loaded.problems.push_back({{path, 0, 0}, text.error(), false});
  return loaded;
}

LoadedProfile LoadProfile(const std::string& profile, const protocols::Protocol& protocol,
                          const Catalog& catalog) {
  return Load(profile, catalog, [&](Problems& problems) -> std::optional<RawProfile> {
    const auto path = LocateProfile(profile, protocol, catalog, {});
    if (path) return Complete(ReadProfile(*path, protocol, problems), protocol, problems);
    problems.Error({profile, 0, 0}, "profile " + path.error());
    return std::nullopt;
  });
}

LoadedProfile LoadProfileText(const std::string& text, const std::string& file,
                              const std::string& name, const protocols::Protocol& protocol,
                              const Catalog& catalog) {
  return Load(file, catalog, [&](Problems& problems) -> std::optional<RawProfile> {
    return Complete(ReadProfileText(text, file, name, protocol, problems), protocol, problems);
  });
}

Device DeviceFromProfile(const Profile& profile, const protocols::Protocol& protocol,
                         std::string name, std::string address) {
  Device device;
  device.name = std::move(name);
  device.address = std::move(address);
  device.protocol = std::string(protocol.name);
  device.traits = &protocol.traits;
  device.profile = profile.name;
  device.title = profile.title;
  device.identity.names = profile.identity;
  device.timing = profile.pace.timing;
  device.retries = profile.pace.retries;
  Assign(device.poll, profile.pace.poll);
  Assign(device.slow, profile.pace.slow);
  Assign(device.daily, profile.pace.daily);
  Assign(device.word_order, profile.word_order);
  device.options = DefaultOptions(protocol);
  Override(device.options, profile.options);
  device.points = profile.points;
  Problems known;  // these problems were reported when the profile was read
  AssignIntervals(device, known);
  ResolveSentinels(device, &protocol, known);
  device.event_texts = profile.event_texts;
  device.never_old = IsNeverOld(protocol, device.options);
  return device;
}

}  // namespace baudgate::config
