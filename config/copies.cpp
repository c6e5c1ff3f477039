// SPDX-License-Identifier: Apache-2.0
#include "config/copies.h"

#include <yaml-cpp/yaml.h>

#include <set>
#include <string_view>
#include <vector>

#include "config/catalog/catalog.h"
#include "config/model/network.h"
#include "config/yaml/yaml_source.h"
#include "gateway/base/text.h"

namespace baudgate::config {

namespace {

constexpr const char* kMask = "***";
constexpr int kDeepest = 64;
constexpr std::size_t kMostText = 8 * 1024 * 1024;
/// A shorter secret is masked only as the value of its own key: a text such as "1" occurs in many
/// other places.
constexpr std::size_t kShortestCopy = 3;

class Masker {
 public:
  explicit Masker(const std::set<std::string>& secrets)
      : secrets_(secrets), names_(secrets.begin(), secrets.end()) {}

  /// Collects the values of secrets. Returns false if the document is endless or too large.
  bool Collect(const YAML::Node& node, bool secret, int depth = 0) {
    if (depth > kDeepest || ++seen_ > kMostText) return false;
    if (node.IsScalar() && secret && node.Scalar().size() >= kShortestCopy) {
      values_.insert(node.Scalar());
    }
    for (const auto& item : node) {
      const bool in_map = item.first.IsDefined();
      const YAML::Node& child = in_map ? item.second : item;
      const bool hidden = secret || (in_map && IsSecret(item.first));
      if (!Collect(child, hidden, depth + 1)) return false;
    }
    return true;
  }

  void Emit(const YAML::Node& node, YAML::Emitter& out) const {
    if (node.IsMap()) {
      EmitMap(node, out);
    } else if (node.IsSequence()) {
      out << YAML::BeginSeq;
      for (const auto& item : node) Emit(item, out);
      out << YAML::EndSeq;
    } else if (node.IsScalar()) {
      out << Shown(node.Scalar());
    } else {
      out << YAML::Null;
    }
  }

 private:
  /// Writes a map with masked secrets. YAML takes RET in "{ password: SEC,RET }" for a key without
  /// a value, so keys without a value that follow a secret are masked, too.
  void EmitMap(const YAML::Node& node, YAML::Emitter& out) const {
    bool behind_secret = false;
    out << YAML::BeginMap;
    for (const auto& entry : node) {
      const bool secret = IsSecret(entry.first);
      const bool rest = behind_secret && entry.second.IsNull();
      out << YAML::Key;
      if (rest || !entry.first.IsScalar()) {
        out << kMask;
      } else {
        out << Shown(entry.first.Scalar());
      }
      out << YAML::Value;
      if (secret) {
        out << kMask;
      } else {
        Emit(entry.second, out);
      }
      behind_secret = secret || rest;
    }
    out << YAML::EndMap;
  }

  bool IsSecret(const YAML::Node& key) const {
    if (!key.IsScalar()) return true;  // a key that is not a scalar may contain a secret
    return secrets_.contains(key.Scalar()) || !Nearest(key.Scalar(), names_).empty();
  }

  /// Returns the text with everything behind a secret word masked: "password:SECRET" (missing
  /// blank) and "pasword=SECRET" are single words in YAML.
  std::string Shown(const std::string& text) const {
    if (values_.contains(text)) return kMask;
    const std::string head = text.substr(0, text.find_first_of(":= \t"));
    if (head.size() < text.size() && !Nearest(head, names_).empty()) return head + kMask;
    const std::string lower = Lower(text);
    for (const std::string& secret : secrets_) {
      const auto at = lower.find(secret);
      if (at != std::string::npos && text.size() > at + secret.size()) {
        return text.substr(0, at + secret.size()) + kMask;
      }
    }
    return text;
  }

  const std::set<std::string>& secrets_;
  const std::vector<std::string_view> names_;
  std::set<std::string> values_;
  std::size_t seen_ = 0;
};

}  // namespace

std::set<std::string> SecretKeys(const Catalog& catalog) {
  std::set<std::string> keys;
  for (const auto& [name, protocol] : catalog.protocols) {
    for (const protocols::OptionSpec& spec : protocol->options) {
      if (spec.secret) keys.emplace(spec.name);
    }
  }
  return keys;
}

Result<std::string> MaskedConfig(const std::string& yaml, const std::set<std::string>& secrets) {
  Problems problems;
  const auto root = ParseYaml("configuration", yaml, problems);
  if (!root)
    return Error{"the configuration is not valid YAML, so its secrets cannot be found and hidden"};
  Masker masker(secrets);
  if (!masker.Collect(root->yaml(), false))
    return Error{
        "an alias (*) in the configuration refers to itself, so the secrets cannot be found and "
        "hidden"};
  YAML::Emitter out;
  masker.Emit(root->yaml(), out);
  return std::string(out.c_str()) + "\n";
}

namespace {

constexpr std::uint16_t kFirstFreePort = 1024;
constexpr std::uint16_t kAbovePrivileged = 1000;
/// The sections that a trial keeps.
const std::set<std::string> kSections = {"gateway", "lines",  "modbus", "web",
                                         "dds",     "events", "history"};

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
      RemoveTls(line);
      line.remove("parity");  // a pty supports every format and has no direction to switch
      KeepFormat(line);
      for (const char* server : {"serial_server", "lend"}) {
        if (!line[server] || !line[server].IsMap()) continue;
        MoveKey(line[server], "at");
        RemoveTls(line[server]);
      }
      if (line["devices"]) ReadDevices(line["devices"]);
    }
  }

  /// Removes the keys that name files of TLS: the trial does not use TLS, because its user perhaps
  /// must not read the private keys.
  static void RemoveTls(YAML::Node map) {
    for (const char* key : {"certificate", "key", "ca", "client_ca"}) map.remove(key);
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
      RemoveTls(root["web"]);
    }
    if (YAML::Node dds = root["dds"]) {
      dds.remove("peers");
      dds.remove("discovery_servers");
      dds.remove("interfaces");  // the default is loopback
    }
    for (const char* kept : {"events", "history"}) {
      if (root[kept] && root[kept].IsMap()) root[kept].remove("directory");
    }
    std::vector<std::string> others;
    for (const auto& section : root) {
      if (!kSections.contains(section.first.Scalar())) others.push_back(section.first.Scalar());
    }
    for (const std::string& section : others) {
      root.remove(section);
      left_out.push_back(section + ": a simulation cannot run this section");
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

  /// Returns an address on loopback that the trial does not use yet: "127.0.0.1:1502" for
  /// "0.0.0.0:502", with the next free port number if 1502 is used.
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
    left_out.push_back("the listener at " + at.Scalar() +
                       ": a simulation opens no real serial port");
    return true;
  }

  void MoveListeners(YAML::Node modbus) {
    const YAML::Node listen = modbus["listen"];
    YAML::Node moved(YAML::NodeType::Sequence);
    const auto add = [&](const YAML::Node& one) {
      if (IsSerial(one)) return;
      if (!one.IsMap()) return moved.push_back(OnLoopback(one.Scalar()));
      YAML::Node copy = YAML::Clone(one);
      copy.remove("allow");  // only this machine can connect
      MoveKey(copy, "at");
      RemoveTls(copy);
      copy.remove("protocol");
      copy.remove("roles");
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

  /// Removes routes to servers, because a trial must not send anything to other machines.
  void KeepOwnRoutes(YAML::Node modbus) {
    YAML::Node kept(YAML::NodeType::Sequence);
    for (const auto& route : modbus["routes"]) {
      if (!route["server"]) {
        kept.push_back(route);
        continue;
      }
      left_out.push_back("the route to server " + route["server"].Scalar() +
                         ": a simulation sends nothing to other machines, and it cannot simulate "
                         "the registers of this server");
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
  return Error{std::string("the configuration cannot be copied: ") + error.what()};
}

}  // namespace baudgate::config
