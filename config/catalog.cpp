// SPDX-License-Identifier: Apache-2.0
#include "config/catalog.h"

namespace baudgate::config {

namespace fs = std::filesystem;

const Protocol* Catalog::FindProtocol(const std::string& name) const {
  const auto found = protocols.find(name);
  return found == protocols.end() ? nullptr : found->second;
}

std::optional<fs::path> Catalog::FindProfile(const std::string& protocol,
                                             const std::string& name) const {
  for (const fs::path& dir : profile_dirs) {
    fs::path path = dir / protocol / (name + ".yaml");
    std::error_code error;
    if (fs::is_regular_file(path, error)) return path;
  }
  return std::nullopt;
}

std::vector<ProfileFile> Catalog::Profiles(const std::string& protocol) const {
  std::map<std::pair<std::string, std::string>, fs::path> found;
  for (const fs::path& dir : profile_dirs) {
    std::error_code error;
    for (fs::directory_iterator folder(dir, error), end; !error && folder != end;
         folder.increment(error)) {
      const std::string owner = folder->path().filename().string();
      if (!protocol.empty() && owner != protocol) continue;
      std::error_code inner;
      for (fs::directory_iterator file(folder->path(), inner); !inner && file != end;
           file.increment(inner)) {
        if (file->path().extension() != ".yaml") continue;
        found.emplace(std::make_pair(owner, file->path().stem().string()), file->path());
      }
    }
  }
  std::vector<ProfileFile> profiles;
  for (const auto& [key, path] : found) profiles.push_back({key.first, key.second, path});
  return profiles;
}

std::vector<std::string_view> Catalog::ProtocolNames() const {
  std::vector<std::string_view> names;
  for (const auto& [name, protocol] : protocols) names.push_back(name);
  return names;
}

}  // namespace baudgate::config
