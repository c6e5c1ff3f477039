// Catalog holds the installed protocol modules and device profiles. modules.h fills the catalog;
// the loader reads it, and so do the commands that list modules and profiles.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "config/model/problem.h"
#include "gateway/base/result.h"
#include "protocols/protocol.h"

namespace baudgate::config {

/// Profiles of this machine, which win over those that are shipped.
inline constexpr const char* kLocalProfiles = "/etc/baudgate/profiles";

/// A profile file: <dir>/<protocol>/<name>.yaml.
struct ProfileFile {
  std::string
      protocol;  ///< whose folder it stands in; others may use it, see Protocol::profiles_of
  std::string name;
  std::filesystem::path path;
};

/// Whether `profile:` means a file and not a name in the catalog: "./mine.yaml", "types/mine".
bool IsProfilePath(const std::string& profile);

struct Catalog {
  std::map<std::string, const protocols::Protocol*>
      protocols;                                    ///< by name; the pointers live for ever
  std::vector<std::filesystem::path> module_dirs;   ///< where protocols were looked for
  std::vector<std::filesystem::path> profile_dirs;  ///< the first hit wins

  /// Null when no module of that name is installed.
  const protocols::Protocol* FindProtocol(const std::string& name) const;
  /// The error says which are installed, and which of them is meant.
  Result<const protocols::Protocol*> NeedProtocol(const std::string& name,
                                                  const std::string& port = {}) const;
  /// The installed protocol that a wrong name most likely means: a misspelt one, or what people
  /// call it (Protocol::also_called). Null: none is near.
  const protocols::Protocol* MeantProtocol(const std::string& name,
                                           const std::string& port = {}) const;
  /// The protocol that has the frames of this framing. Null when it is not installed, and for
  /// Modbus TCP, which needs none.
  const protocols::Protocol* FramesOf(modbus::Framing framing) const;
  /// How their messages are known on lines of other protocols.
  std::vector<protocols::ForeignRule> ForeignRules() const;
  /// The folders that hold profiles of the protocol: its own, then that of Protocol::profiles_of.
  std::vector<std::string> ProfileOwners(const std::string& protocol) const;
  /// In the protocol's own folder first. Nothing when no directory has it.
  std::optional<std::filesystem::path> FindProfile(const std::string& protocol,
                                                   const std::string& name) const;
  /// Those that one protocol can use, or all when it is empty: by protocol and name, without hidden
  /// duplicates.
  std::vector<ProfileFile> Profiles(const std::string& protocol = {}) const;
  std::vector<std::string_view> ProtocolNames() const;
  /// The error: no protocol is installed at all, and where it was looked for.
  Status HasProtocols() const;
};

/// From now on no problem shows the value of an option that its protocol calls secret.
void AddSecrets(const Catalog& catalog, Problems& problems);

}  // namespace baudgate::config
