// SPDX-License-Identifier: Apache-2.0
#include "gateway/tools/cli/live/bridge.h"

#include "config/model/network.h"
#include "gateway/base/exit_code.h"
#include "gateway/base/text.h"
#include "gateway/tools/cli/live/port_config.h"
#include "gateway/tools/cli/live/run.h"
#include "gateway/tools/cli/live/scratch_directory.h"

namespace baudgate {
namespace {

constexpr std::uint16_t kUsualPort = 1502;

/// "0.0.0.0:1502" of "0.0.0.0".
Result<config::HostPort> Place(const std::string& listen) {
  if (ParseInteger<std::uint16_t>(listen)) {
    return Error{"--listen: " + listen + " is a port without an address; write 127.0.0.1:" +
                 listen + " for this machine alone, or 0.0.0.0:" + listen + " with --allow"};
  }
  const auto place = config::ParseServer(listen, kUsualPort);
  if (!place) return Error{"--listen: " + place.error()};
  if (!config::IsIpAddress(place->host)) {
    return Error{"--listen: " + place->host + " is no IP address of this machine"};
  }
  return place;
}

bool IsLocal(const config::HostPort& place) {
  return config::IsLoopback(config::ReachOf(place.host));
}

std::string Yaml(const BridgeOptions& options, const config::HostPort& place,
                 const ScratchDirectory& scratch) {
  std::string serial;
  for (const std::string& word : options.serial) serial += (serial.empty() ? "" : " ") + word;
  std::string allow;
  for (const std::string& network : options.allow) {
    allow += (allow.empty() ? "" : ", ") + YamlText(network);
  }
  const bool bracketed = place.host.find(':') != std::string::npos;
  const std::string at =
      (bracketed ? "[" + place.host + "]" : place.host) + ":" + std::to_string(place.port);
  std::string yaml = "gateway:\n  name: bridge-" + NameOfPort(options.port) + "\n";
  yaml += "  state: " + YamlText((scratch.path() / "state").string()) + "\n";
  yaml += "modbus:\n  listen:\n    - at: " + YamlText(at) + "\n";
  if (!allow.empty()) yaml += "      allow: [" + allow + "]\n";
  if (options.read_only) yaml += "      permit: read\n";
  yaml += "  routes: [ { units: \"1-247\", line: bus } ]\n";
  yaml += "dds: { enabled: false }\n";
  yaml += "lines:\n  - name: bus\n    port: " + YamlText(options.port) + "\n";
  yaml += "    protocol: " + YamlText(options.protocol) + "\n";
  if (!serial.empty()) yaml += "    serial: " + YamlText(serial) + "\n";
  return yaml;
}

}  // namespace

int RunBridge(const BridgeOptions& options, const config::Catalog& catalog, std::ostream& err) {
  const auto place = Place(options.listen);
  if (!place) {
    err << "baudgate: " << place.error() << '\n';
    return kExitUsage;
  }
  if (options.allow.empty() && !IsLocal(*place)) {
    err << "baudgate: --listen " << options.listen
        << " lets everybody write to the bus, because Modbus knows no password; say who may come, "
           "for example --allow 10.0.0.0/24\n";
    return kExitUsage;
  }
  const ScratchDirectory scratch("bridge");
  if (scratch.path().empty()) {
    err << "baudgate: no temporary directory can be made\n";
    return kExitCanNot;
  }
  auto config = PortConfig(Yaml(options, *place, scratch), catalog);
  if (!config) {
    err << "baudgate: " << config.error() << '\n';
    return kExitBadConfiguration;
  }
  return Serve(std::move(*config), std::nullopt, catalog);
}

}  // namespace baudgate
