// SPDX-License-Identifier: Apache-2.0
#include "config/trial_config.h"

#include <yaml-cpp/yaml.h>

#include <set>

#include "config/catalog/catalog.h"
#include "config/model/network.h"

namespace baudgate::config {
namespace {

constexpr std::uint16_t kFirstFreePort = 1024;
constexpr std::uint16_t kAbovePrivileged = 1000;

class Trial {
 public:
  explicit Trial(const TrialPlaces& places) : places_(places) {}

  std::string Rewrite(YAML::Node root) {
    ReadLines(root["lines"]);
    MoveOutputs(root);
    MoveGateway(root);
    YAML::Emitter out;
    out << root;
    return std::string(out.c_str()) + "\n";
  }

  std::vector<std::string> left_out;

 private:
  void ReadLines(YAML::Node lines) {
    for (std::size_t i = 0; i < lines.size(); ++i) {
      YAML::Node line = lines[i];
      line["port"] = places_.ports.at(i);
      line.remove("parity");  // a pty carries every format, and switches no direction
      KeepFormat(line);
      for (const char* server : {"serial_server", "lend"}) {
        if (line[server] && line[server].IsMap()) MoveKey(line[server], "at");
      }
      if (line["devices"]) ReadDevices(line["devices"]);
    }
  }

  static void KeepFormat(YAML::Node map) {
    map.remove("rs485");
    if (map["serial"] && map["serial"].IsMap()) {
      map["serial"].remove("rs485");
      map["serial"].remove("software_parity");
    }
  }

  void ReadDevices(YAML::Node devices) {
    for (auto device : devices) {
      KeepFormat(device);
      if (!device["profile"]) continue;
      const std::filesystem::path profile = device["profile"].Scalar();
      if (!IsProfilePath(profile.string()) || profile.is_absolute()) continue;
      device["profile"] = (places_.profiles / profile).lexically_normal().string();
    }
  }

  void MoveOutputs(YAML::Node root) {
    if (root["modbus"]) {
      if (root["modbus"]["listen"]) MoveListeners(root["modbus"]);
      if (root["modbus"]["routes"]) KeepOwnRoutes(root["modbus"]);
    }
    if (root["web"]) {
      MoveKey(root["web"], "listen");
      root["web"].remove("allow");
    }
    if (YAML::Node dds = root["dds"]) {
      dds.remove("peers");
      dds.remove("discovery_servers");
      dds.remove("interfaces");  // which leaves loopback
    }
    for (const char* kept : {"events", "history"}) {
      if (root[kept] && root[kept].IsMap()) root[kept].remove("directory");
    }
  }

  void MoveGateway(YAML::Node root) {
    YAML::Node gateway = root["gateway"];
    if (!gateway || gateway.IsNull()) gateway = root["gateway"] = YAML::Node(YAML::NodeType::Map);
    const std::string name = gateway["name"] ? gateway["name"].Scalar() : "baudgate";
    gateway["name"] = name + "-trial";
    gateway["state"] = places_.state.string();
    gateway.remove("socket");
    gateway.remove("recordings");
  }

  /// "0.0.0.0:502" becomes "127.0.0.1:1502", or the next port that is not given away yet.
  std::string OnLoopback(const std::string& at) {
    const auto place = ParseHostPort(at);
    std::uint16_t port = place ? place->port : kFirstFreePort;
    if (port < kFirstFreePort) port = static_cast<std::uint16_t>(port + kAbovePrivileged);
    while (!given_.insert(port).second) ++port;
    return "127.0.0.1:" + std::to_string(port);
  }

  void MoveKey(YAML::Node map, const char* key) {
    if (map[key] && map[key].IsScalar()) map[key] = OnLoopback(map[key].Scalar());
  }

  bool IsSerial(const YAML::Node& listener) {
    const YAML::Node at = listener.IsMap() ? listener["at"] : listener;
    if (!at || !at.IsScalar() || !at.Scalar().starts_with("/")) return false;
    left_out.push_back("the listener at " + at.Scalar() + ": its master needs a real port");
    return true;
  }

  void MoveListeners(YAML::Node modbus) {
    const YAML::Node listen = modbus["listen"];
    YAML::Node moved(YAML::NodeType::Sequence);
    const auto add = [&](const YAML::Node& one) {
      if (IsSerial(one)) return;
      if (!one.IsMap()) return moved.push_back(OnLoopback(one.Scalar()));
      YAML::Node copy = YAML::Clone(one);
      copy.remove("allow");  // nobody but this machine comes
      MoveKey(copy, "at");
      moved.push_back(copy);
    };
    if (listen.IsSequence()) {
      for (const auto& one : listen) add(one);
    } else {
      add(listen);
    }
    if (moved.size() == 0) {
      modbus.remove("listen");
    } else {
      modbus["listen"] = moved;
    }
  }

  /// A trial sends nothing to servers elsewhere.
  void KeepOwnRoutes(YAML::Node modbus) {
    YAML::Node kept(YAML::NodeType::Sequence);
    for (const auto& route : modbus["routes"]) {
      if (!route["server"]) {
        kept.push_back(route);
        continue;
      }
      left_out.push_back("the route to server " + route["server"].Scalar() +
                         ": nothing says which registers it has");
    }
    modbus["routes"] = kept;
  }

  const TrialPlaces& places_;
  std::set<std::uint16_t> given_;
};

}  // namespace

Result<TrialConfig> MakeTrialConfig(const std::string& yaml, const TrialPlaces& places) try {
  Trial trial(places);
  std::string text = trial.Rewrite(YAML::Load(yaml));
  return TrialConfig{std::move(text), std::move(trial.left_out)};
} catch (const std::exception& error) {
  return Error{std::string("it cannot be copied: ") + error.what()};
}

}  // namespace baudgate::config
