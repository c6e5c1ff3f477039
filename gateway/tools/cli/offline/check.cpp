// SPDX-License-Identifier: Apache-2.0
#include "gateway/tools/cli/offline/check.h"

#include <algorithm>
#include <nlohmann/json.hpp>
#include <optional>
#include <utility>

#include "config/checks/line_checks.h"
#include "config/loader.h"
#include "gateway/base/exit_code.h"
#include "gateway/base/shown.h"
#include "gateway/base/whole_file.h"
#include "gateway/daemon/reload/trial.h"
#include "gateway/records/disk/state_folder.h"
#include "gateway/tools/cli/offline/certs.h"
#include "gateway/tools/cli/offline/check_parts.h"
#include "gateway/tools/terminal/tables.h"

namespace baudgate::tools {
namespace {

/// Returns a warning if this configuration waits for confirmation or was rolled back
/// (docs/reload.md). Empty: neither is true, or this user cannot read the state folder.
std::optional<config::Problem> WhyTakenBack(const std::string& file, const config::Config& config) {
  const auto folder = StateFolderOf(records::StatePlaces::Here(config.state), config.name);
  const reload::KeptConfigs kept(folder / reload::KeptConfigs::kFolder);
  const auto text = ReadWhole(file);
  if (!text || !kept.IsUnconfirmed(*text)) return std::nullopt;
  const std::string copy = kept.confirmed_file().string();
  const std::string why = kept.trial() == reload::KeptConfigs::Trial::running
                              ? "is on trial: the gateway goes back to the confirmed configuration "
                                "unless you run 'baudgate confirm'"
                              : "is not in use: " + kept.why_taken_back() + "; " + copy +
                                    " runs until you change this file (to compare: diff " + copy +
                                    " " + file + ")";
  return config::Problem{{file, 0, 0}, why, true};
}

using Json = nlohmann::ordered_json;

std::size_t ServedPoints(const config::Device& device) {
  if (!device.unit) return 0;
  return static_cast<std::size_t>(
      std::count_if(device.points.begin(), device.points.end(),
                    [](const config::Point& point) { return point.modbus.has_value(); }));
}

std::string Describe(const config::Dds& dds, bool events) {
  if (!dds.enabled) return "off";
  std::string text = "domain " + std::to_string(dds.domain) + " on " +
                     Joined(dds.interfaces, [](const std::string& address) { return address; });
  const auto same = [](const std::string& one) { return one; };
  if (!dds.multicast) text += ", no multicast";
  if (!dds.peers.empty()) text += ", peers " + Joined(dds.peers, same);
  if (!dds.discovery_servers.empty()) {
    text += ", discovery servers " + Joined(dds.discovery_servers, [](const config::HostPort& at) {
              return at.host + ":" + std::to_string(at.port);
            });
  }
  text += "; topics baudgate/points, baudgate/devices, baudgate/gateways";
  if (events) text += ", baudgate/events, baudgate/alarms";
  return text + (dds.write ? "; write: allow: everybody in the domain can write the points that "
                             "devices allow, with topic baudgate/write"
                           : "; write: deny");
}

std::string Describe(const config::PortServer& server) {
  return server.Address() + ", " + std::string(Name(server.mode)) +
         (server.tls.on() ? " with TLS" : "") + ", for " + Whom(server.allow);
}

std::string Describe(const config::Line& line) {
  std::string text = "line " + line.name + ": " + line.port;
  if (!line.is_network()) text += ", " + line.serial.ToString();
  if (line.serial.software_parity) text += " (software parity)";
  if (line.serial_server) return text + ", served at " + Describe(*line.serial_server);
  text += ", " + line.protocol + ", " + Plural(line.devices.size(), "device");
  if (!line.lend) return text;
  return text + ", can be lent at " + Describe(*line.lend) + ", " +
         FormatDuration(line.lend->time) + " at most";
}

std::vector<std::string> Row(const config::Device& device) {
  const std::size_t served = ServedPoints(device);
  return {device.name,
          device.address,
          device.protocol,
          device.profile,
          device.unit ? std::to_string(*device.unit) : "none",
          std::to_string(device.points.size()),
          std::to_string(served),
          FormatDuration(device.poll),
          FormatDuration(device.slow),
          device.enabled ? "" : "disabled"};
}

/// Devices with equal times are printed together.
void PrintTimes(const config::Line& line, const config::Catalog& catalog, std::ostream& out) {
  std::vector<std::pair<std::string, std::vector<std::string>>> groups;
  for (const config::Device& device : line.devices) {
    const protocols::Protocol& protocol = *catalog.FindProtocol(device.protocol);
    const std::string text = TimesText(TimesInForce(line, device, protocol));
    auto group = std::ranges::find(groups, text, [](const auto& one) { return one.first; });
    if (group == groups.end()) group = groups.insert(groups.end(), {text, {}});
    group->second.push_back(device.name);
  }
  for (const auto& [times, names] : groups) {
    const auto same = [](const std::string& name) { return name; };
    out << "  times" << (groups.size() > 1 ? " of " + Joined(names, same) : "") << ": " << times
        << '\n';
  }
}

/// Prints the cost of reading points twice, which protocols with weak checksums need.
void PrintRechecks(const config::Line& line, const config::Catalog& catalog, std::ostream& out) {
  std::size_t points = 0;
  std::size_t jumps = 0;
  std::size_t always = 0;
  config::Round round;
  for (const config::Device& device : line.devices) {
    const protocols::Protocol& protocol = *catalog.FindProtocol(device.protocol);
    const auto bus = MakeBus(protocol);
    const config::Round fast = RoundOf(config::Group::fast, line, device, protocol, bus.get());
    round.requests += fast.requests;
    round.time += fast.time;
    for (const config::Point& point : device.points) {
      ++points;
      if (point.recheck == config::Recheck::jump) ++jumps;
      if (point.recheck == config::Recheck::always) ++always;
    }
  }
  const auto print = [&](std::size_t count, const char* what, const char* when) {
    if (count == 0) return;
    out << "  recheck: " << count << " of " << points << " points accept a " << what
        << " only if a second reading agrees";
    if (round.requests > 0) {
      const auto each = round.time / static_cast<int>(round.requests);
      out << "; this costs one request (about "
          << FormatDuration(std::chrono::ceil<std::chrono::milliseconds>(each)) << ") for each "
          << when;
    }
    out << '\n';
  };
  print(jumps, "jump", "jump");
  print(always, "reading", "poll");
}

void PrintSummary(const config::Config& config, const config::Catalog& catalog,
                  const std::string& security, std::ostream& out) {
  out << "gateway " << config.name << '\n';
  if (!config.modbus.enabled) out << "modbus off\n";
  for (const config::Listener& listener : config.modbus.listen) {
    if (config.modbus.enabled) PrintListener(listener, out);
  }
  out << "dds " << Describe(config.dds, records::KeepsEvents(config)) << '\n';
  if (!security.empty()) out << "  security   " << security << '\n';
  PrintMqtt(config, out);
  PrintWeb(config, out);
  if (records::NeedsState(config, catalog)) {
    out << "state " << StateFolderOf(records::StatePlaces::Here(config.state), config.name).string()
        << (records::CanWrite(config) ? ": files that the gateway uses again after a restart, and "
                                        "a record of every write\n"
                                      : ": files that the gateway uses again after a restart\n");
    PrintEvents(config, out);
    PrintOfMeters(config, out);
    PrintHistory(config, out);
    PrintOutlets(config, out);
  }
  out << "reload applies all settings except gateway (its alarms are applied), modbus.enabled, ";
  VisitFields(&config, [&](auto field) {
    if constexpr (requires { (config.*field.member).kReloads; }) {
      if (!(config.*field.member).kReloads) out << field.key << ", ";
    }
  });
  out << "events and history.directory: these need a restart\n";
  for (const config::Line& line : config.lines) {
    out << '\n' << Describe(line) << '\n';
    if (line.devices.empty()) continue;
    TextTable table({"device", "address", "protocol", "profile", "unit", "points", "on Modbus",
                     "poll", "slow", "note"});
    for (const config::Device& device : line.devices) table.Add(Row(device));
    table.PrintAligned(out, "  ");
    PrintTimes(line, catalog, out);
    PrintRechecks(line, catalog, out);
    PrintWrites(line, out);
  }
  if (config.modbus.enabled) PrintRouteTable(config, out);
}

Json ToJson(const config::Config& config) {
  Json lines = Json::array();
  for (const config::Line& line : config.lines) {
    Json devices = Json::array();
    for (const config::Device& device : line.devices) {
      Json one = {{"name", device.name},         {"address", device.address},
                  {"protocol", device.protocol}, {"profile", device.profile},
                  {"title", device.title},       {"enabled", device.enabled}};
      one["unit"] = device.unit ? Json(*device.unit) : Json();
      one["points"] = device.points.size();
      one["points_on_modbus"] = ServedPoints(device);
      one["writes"] = WritesJson(device);
      one["events"] = device.events;
      one["point_events"] = device.point_events;
      devices.push_back(std::move(one));
    }
    lines.push_back({{"name", line.name},
                     {"port", line.port},
                     {"serial", line.tcp ? Json() : Json(line.serial.ToString())},
                     {"protocol", line.protocol},
                     {"devices", std::move(devices)}});
  }
  Json units = Json::array();
  for (const UnitRow& row : UnitRows(config)) {
    units.push_back({{"units", row.units}, {"target", row.target}, {"deadline", row.deadline}});
  }
  return {{"gateway", config.name},    {"modbus", ModbusJson(config.modbus)},
          {"units", std::move(units)}, {"history", HistoryJson(config)},
          {"web", WebJson(config)},    {"lines", std::move(lines)}};
}

Json ToJson(const std::vector<config::Problem>& problems) {
  Json list = Json::array();
  for (const config::Problem& problem : problems) {
    list.push_back({{"file", problem.mark.file},
                    {"line", problem.mark.line},
                    {"column", problem.mark.column},
                    {"severity", problem.warning ? "warning" : "error"},
                    {"message", problem.message}});
  }
  return list;
}

void PrintVerdict(const std::string& file, const config::Loaded& loaded, std::ostream& out) {
  std::size_t devices = 0;
  std::size_t points = 0;
  for (const config::Line& line : loaded.config.lines) {
    devices += line.devices.size();
    for (const config::Device& device : line.devices) points += device.points.size();
  }
  out << file << ": good: " << Plural(loaded.config.lines.size(), "line") << ", "
      << Plural(devices, "device") << ", " << Plural(points, "point");
  if (!loaded.problems.empty()) out << ", " << Plural(loaded.problems.size(), "warning");
  out << '\n';
}

}  // namespace

void PrintProblems(const std::vector<config::Problem>& problems, std::ostream& err) {
  for (const config::Problem& problem : problems) err << config::ToString(problem) << '\n';
}

int RunCheck(const std::string& file, const config::Catalog& catalog, std::ostream& out,
             std::ostream& err, bool json) {
  config::Loaded loaded = config::LoadFile(file, catalog);
  std::string security;
  if (loaded.ok()) security = CheckDdsSecurity(loaded.config, ReadClocks().wall, loaded.problems);
  if (loaded.ok()) CheckSecurityFiles(loaded.config, ReadClocks().wall, loaded.problems);
  if (loaded.ok()) {
    if (auto taken_back = WhyTakenBack(file, loaded.config)) {
      loaded.problems.push_back(*std::move(taken_back));
    }
  }
  if (json) {
    Json result = {{"file", file}, {"ok", loaded.ok()}, {"problems", ToJson(loaded.problems)}};
    if (loaded.ok()) result["summary"] = ToJson(loaded.config);
    out << result.dump(2, ' ', false, Json::error_handler_t::replace) << '\n';
    return loaded.ok() ? kExitDone : kExitBadConfiguration;
  }
  PrintProblems(loaded.problems, err);
  if (!loaded.ok()) {
    const auto errors = std::count_if(loaded.problems.begin(), loaded.problems.end(),
                                      [](const config::Problem& p) { return !p.warning; });
    err << file << ": bad: " << Plural(static_cast<std::size_t>(errors), "error") << '\n';
    return kExitBadConfiguration;
  }
  PrintVerdict(file, loaded, out);
  PrintSummary(loaded.config, catalog, security, out);
  return kExitDone;
}

}  // namespace baudgate::tools
