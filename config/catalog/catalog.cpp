// SPDX-License-Identifier: Apache-2.0
#include "config/catalog/catalog.h"

#include <algorithm>

#include "config/model/network.h"
#include "gateway/base/text.h"

namespace baudgate::config {

namespace fs = std::filesystem;

bool IsProfilePath(const std::string& profile) {
  return profile.find('/') != std::string::npos || profile.ends_with(".yaml");
}

const protocols::Protocol* Catalog::FindProtocol(const std::string& name) const {
  const auto found = protocols.find(name);
  return found == protocols.end() ? nullptr : found->second;
}

Status Catalog::HasProtocols() const {
  if (!protocols.empty()) return {};
  std::string looked;
  for (const auto& folder : module_dirs) looked += (looked.empty() ? "" : ", ") + folder.string();
  return Error{"no protocol is installed; modules were looked for in " +
               (looked.empty() ? "no folder" : looked) +
               ": install the package again, or set $BAUDGATE_MODULES to the folder that holds "
               "'protocols' and 'profiles'"};
}

Result<const protocols::Protocol*> Catalog::NeedProtocol(const std::string& name,
                                                         const std::string& port) const {
  if (const protocols::Protocol* protocol = FindProtocol(name)) return protocol;
  const std::vector<std::string_view> installed = ProtocolNames();
  const protocols::Protocol* meant = MeantProtocol(name, port);
  return Error{Quoted(name) + " is not installed;" +
               (meant == nullptr ? "" : " did you mean " + Quoted(meant->name) + "?") +
               " installed: " + (installed.empty() ? "none" : Join(installed))};
}

const protocols::Protocol* Catalog::MeantProtocol(const std::string& name,
                                                  const std::string& port) const {
  const bool server = IsNetworkPort(port) && port.ends_with(":502");
  const protocols::Protocol* meant = nullptr;
  for (const auto& [its_name, protocol] : protocols) {
    const auto names = Split(protocol->also_called, ' ');
    if (name.empty() || std::ranges::find(names, Lower(name)) == names.end()) continue;
    if (meant == nullptr || protocol->tcp == server) meant = protocol;
  }
  if (meant != nullptr) return meant;
  return FindProtocol(std::string(Nearest(name, ProtocolNames())));
}

std::vector<protocols::ForeignRule> Catalog::ForeignRules() const {
  std::vector<protocols::ForeignRule> rules;
  for (const auto& [name, protocol] : protocols) {
    if (protocol->foreign != nullptr) rules.push_back(protocol->foreign);
  }
  return rules;
}

const protocols::Protocol* Catalog::FramesOf(modbus::Framing framing) const {
  if (framing == modbus::Framing::tcp) return nullptr;
  const auto found = std::ranges::find_if(protocols, [framing](const auto& one) {
    return one.second->carrier != nullptr && one.second->carrier->framing == framing;
  });
  return found == protocols.end() ? nullptr : found->second;
}

std::vector<std::string> Catalog::ProfileOwners(const std::string& protocol) const {
  std::vector<std::string> owners = {protocol};
  const protocols::Protocol* descriptor = FindProtocol(protocol);
  if (descriptor != nullptr && !descriptor->profiles_of.empty()) {
    owners.emplace_back(descriptor->profiles_of);
  }
  return owners;
}

std::optional<fs::path> Catalog::FindProfile(const std::string& protocol,
                                             const std::string& name) const {
  for (const std::string& owner : ProfileOwners(protocol)) {
    for (const fs::path& dir : profile_dirs) {
      fs::path path = dir / owner / (name + ".yaml");
      std::error_code error;
      if (fs::is_regular_file(path, error)) return path;
    }
  }
  return std::nullopt;
}

std::vector<ProfileFile> Catalog::Profiles(const std::string& protocol) const {
  const std::vector<std::string> owners = ProfileOwners(protocol);
  std::map<std::pair<std::string, std::string>, fs::path> found;
  for (const fs::path& dir : profile_dirs) {
    std::error_code error;
    for (fs::directory_iterator folder(dir, error), end; !error && folder != end;
         folder.increment(error)) {
      const std::string owner = folder->path().filename().string();
      if (!protocol.empty() && std::ranges::find(owners, owner) == owners.end()) continue;
      std::error_code inner;
      for (fs::directory_iterator file(folder->path(), inner); !inner && file != end;
           file.increment(inner)) {
        if (file->path().extension() != ".yaml") continue;
        found.emplace(std::make_pair(owner, file->path().stem().string()), file->path());
      }
    }
  }
  std::vector<ProfileFile> profiles;
  for (const auto& [key, path] : found) {
    const auto& [owner, name] = key;
    const bool hidden = !protocol.empty() && owner != protocol && found.contains({protocol, name});
    if (!hidden) profiles.push_back({owner, name, path});
  }
  return profiles;
}

std::vector<std::string_view> Catalog::ProtocolNames() const {
  std::vector<std::string_view> names;
  for (const auto& [name, protocol] : protocols) names.push_back(name);
  return names;
}

void AddSecrets(const Catalog& catalog, Problems& problems) {
  for (const auto& [name, protocol] : catalog.protocols) {
    for (const protocols::OptionSpec& spec : protocol->options) {
      if (spec.secret) problems.AddSecret(spec.name);
    }
  }
}

}  // namespace baudgate::config
