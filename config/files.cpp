// SPDX-License-Identifier: Apache-2.0
#include "config/files.h"

#include "gateway/base/text.h"

namespace baudgate::config {
namespace {

std::string Example(const std::string& folder, const char* file) {
  return "/etc/baudgate/" + folder + "/" + file;
}

/// Reports each of `keys` that is present.
void RefuseEach(MapReader& map, std::initializer_list<const char*> keys, const std::string& why) {
  for (const std::string key : keys) map.Refuse(key, key + ": " + why);
}

}  // namespace

std::string ReadAbsolutePath(MapReader& map, const std::string& key, const std::string& example) {
  const auto path = map.Label(key);
  if (!path) return {};
  if (path->starts_with('/')) return *path;
  map.problems().Error(
      map.MarkOf(key),
      key + ": " + Quoted(*path) + " is not an absolute path; write for example " + example);
  return {};
}

TlsFiles ReadServerTls(MapReader& map, const std::string& folder) {
  const std::string example = Example(folder, "gateway.pem");
  const std::string key = Example(folder, "gateway.key");
  TlsFiles files{.certificate = ReadAbsolutePath(map, "certificate", example),
                 .key = ReadAbsolutePath(map, "key", key),
                 .authorities = ReadAbsolutePath(map, "client_ca", Example(folder, "ca.pem"))};
  if (map.Has("certificate")) {
    map.Need("key", key);
    return files;
  }
  for (const std::string other : {"key", "client_ca"}) {
    if (!map.Has(other)) continue;
    map.problems().Error(
        map.MarkOf(other),
        other + ": has no effect without certificate; add certificate: " + example);
  }
  return {};
}

TlsFiles ReadMutualTls(MapReader& map, bool on) {
  if (!on) {
    RefuseEach(map, {"certificate", "key", "ca", "roles"},
               "applies only to a listener with TLS; add protocol: tls, or remove the key");
    return {};
  }
  TlsFiles files;
  for (const auto& [key, file, path] :
       {std::tuple("certificate", "gateway.pem", &files.certificate),
        std::tuple("key", "gateway.key", &files.key),
        std::tuple("ca", "ca.pem", &files.authorities)}) {
    const std::string example = Example("modbus", file);
    if (map.Need(key, example)) *path = ReadAbsolutePath(map, key, example);
  }
  return files;
}

TlsFiles ReadClientTls(MapReader& map, bool on, const std::string& folder,
                       std::string_view scheme) {
  if (!on) {
    RefuseEach(
        map, {"ca", "certificate", "key"},
        "applies only to an address that begins with " + std::string(scheme) + "; remove the key");
    return {};
  }
  TlsFiles files;
  const std::string example = Example(folder, "ca.pem");
  if (map.Need("ca", example)) files.authorities = ReadAbsolutePath(map, "ca", example);
  if (map.Has("certificate") || map.Has("key")) {
    map.Need("certificate", Example(folder, "client.pem"));
    map.Need("key", Example(folder, "client.key"));
  }
  files.certificate = ReadAbsolutePath(map, "certificate", Example(folder, "client.pem"));
  files.key = ReadAbsolutePath(map, "key", Example(folder, "client.key"));
  return files;
}

}  // namespace baudgate::config
