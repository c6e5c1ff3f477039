// `Catalog` contains the installed protocol modules and device profiles. modules.h fills it; the
// loader and the commands that list modules and profiles read it.
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

/// The folder for profiles of this machine, which take precedence over the shipped profiles.
inline constexpr const char* kLocalProfiles = "/etc/baudgate/profiles";

/// A profile file: <dir>/<protocol>/<name>.yaml.
struct ProfileFile {
  /// The protocol whose folder contains the file. Other protocols can use the profile as well
  /// (Protocol::profiles_of).
  std::string protocol;
  std::string name;
  std::filesystem::path path;
};

/// True if `profile` is a file path ("./mine.yaml", "types/mine") and not a name in the catalog.
bool IsProfilePath(const std::string& profile);

struct Catalog {
  /// Key: name. The pointers stay valid for the life of the program.
  std::map<std::string, const protocols::Protocol*> protocols;
  std::vector<std::filesystem::path> module_dirs;
  /// The folders of profiles; the first folder that contains a file takes precedence.
  std::vector<std::filesystem::path> profile_dirs;

  const protocols::Protocol* FindProtocol(const std::string& name) const;
  /// Returns the protocol with this name. The error names the installed protocols and the one that
  /// MeantProtocol returns for `name` and `port`.
  Result<const protocols::Protocol*> NeedProtocol(const std::string& name,
                                                  const std::string& port = {}) const;
  /// Returns the installed protocol that an unknown name most likely stands for: one with a similar
  /// name, or with this alternative name (Protocol::also_called). `port` decides between several
  /// protocols with the alternative name. Returns null if no name is similar.
  const protocols::Protocol* MeantProtocol(const std::string& name,
                                           const std::string& port = {}) const;
  /// Returns the protocol whose frames have this serial framing; null if it is not installed.
  /// Returns null for Modbus TCP, whose frames need no protocol module.
  const protocols::Protocol* FramesOf(modbus::Framing framing) const;
  /// Returns the rules that recognise messages of each protocol on lines of other protocols.
  std::vector<protocols::ForeignRule> ForeignRules() const;
  /// Returns the folders with profiles for the protocol: its own, then that of
  /// Protocol::profiles_of.
  std::vector<std::string> ProfileOwners(const std::string& protocol) const;
  /// Returns the profile's file; the protocol's own folder takes precedence. Returns nothing if no
  /// folder contains the profile.
  std::optional<std::filesystem::path> FindProfile(const std::string& protocol,
                                                   const std::string& name) const;
  /// Returns the profiles that one protocol can use, or all if `protocol` is empty, sorted by
  /// protocol and name. If several files have one name, only the file that FindProfile returns is
  /// listed.
  std::vector<ProfileFile> Profiles(const std::string& protocol = {}) const;
  std::vector<std::string_view> ProtocolNames() const;
  /// Returns an error with the searched folders if no protocol is installed.
  Status HasProtocols() const;
};

/// Registers the names of all secret options in `problems`, so that no message shows their values.
void AddSecrets(const Catalog& catalog, Problems& problems);

}  // namespace baudgate::config
