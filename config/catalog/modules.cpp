// SPDX-License-Identifier: Apache-2.0
#include "config/catalog/modules.h"

#include <dlfcn.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>

#include "gateway/base/text.h"
#include "gateway/base/trusted_file.h"
#include "protocols/entry.h"

namespace baudgate::config {

namespace fs = std::filesystem;

namespace {

fs::path BinaryDirectory() {
  std::error_code error;
  const fs::path binary = fs::read_symlink("/proc/self/exe", error);
  return error ? fs::path() : binary.parent_path();
}

/// Returns the folders that contain `protocols/` or `profiles/`, in the order of the search.
std::vector<fs::path> Roots(const char* installed) {
  std::vector<fs::path> roots;
  if (const char* given = std::getenv("BAUDGATE_MODULES"); given != nullptr) {
    for (const std::string_view part : Split(given, ':')) {
      if (!part.empty()) roots.emplace_back(part);
    }
  }
  roots.push_back(BinaryDirectory());
  roots.emplace_back(installed);
  return roots;
}

template <typename Function>
Function Find(void* handle, const char* symbol) {
  return reinterpret_cast<Function>(dlsym(handle, symbol));
}

Result<const protocols::Protocol*> LoadModule(const fs::path& path) {
  // Checked before dlopen, because loading a module already runs its code.
  if (const std::string why = WhyNotTrusted(path); !why.empty()) return Error{why};
  void* handle = dlopen(path.c_str(), RTLD_NOW | RTLD_LOCAL);
  if (handle == nullptr) return Error{std::string("cannot load module: ") + dlerror()};
  const auto entry = Find<decltype(&baudgate_protocol)>(handle, "baudgate_protocol");
  if (entry == nullptr)
    return Error{path.string() +
                 " is not a protocol module of baudgate; remove the file from this folder"};
  // Modules of older releases have no tag. Except for this symbol, nothing of a module is used
  // before its tag has been compared.
  const auto tag = Find<decltype(&baudgate_protocol_abi)>(handle, "baudgate_protocol_abi");
  const std::string theirs = tag == nullptr ? "an older release of baudgate" : tag();
  if (theirs != protocols::kContractTag) {
    return Error{path.string() + " was built for " + theirs +
                 ", but this gateway needs modules for " + protocols::kContractTag +
                 "; build the module together with the gateway, or install both from one release"};
  }
  return entry();
}

}  // namespace

Modules LoadModules() {
  Modules modules;
  for (const fs::path& root : Roots(BAUDGATE_INSTALLED_MODULES)) {
    std::error_code error;
    std::vector<fs::path> files;
    modules.catalog.module_dirs.push_back(root / "protocols");
    for (const auto& entry : fs::directory_iterator(root / "protocols", error)) {
      if (entry.path().extension() == ".so") files.push_back(entry.path());
    }
    std::sort(files.begin(), files.end());
    for (const fs::path& file : files) {
      if (modules.catalog.protocols.contains(file.stem().string())) continue;
      const auto protocol = LoadModule(file);
      if (protocol) {
        modules.catalog.protocols.emplace(std::string((*protocol)->name), *protocol);
      } else {
        modules.refused.push_back(protocol.error());
      }
    }
  }
  for (const fs::path& profiles : ProfileFolders(Roots(BAUDGATE_INSTALLED_DATA))) {
    std::error_code error;
    if (fs::is_directory(profiles, error)) modules.catalog.profile_dirs.push_back(profiles);
  }
  return modules;
}

std::vector<fs::path> ProfileFolders(const std::vector<fs::path>& roots) {
  constexpr std::size_t kShipped = 2;  // the last roots: beside the binary, and the install path
  std::vector<fs::path> folders;
  for (std::size_t i = 0; i < roots.size(); ++i) {
    if (i + kShipped == roots.size()) folders.emplace_back(kLocalProfiles);
    folders.push_back(roots[i] / "profiles");
  }
  return folders;
}

}  // namespace baudgate::config
