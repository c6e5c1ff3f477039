// SPDX-License-Identifier: Apache-2.0
#include "config/dds_security.h"

#include <filesystem>

#include "gateway/base/spelling.h"

namespace baudgate::config {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kLongestPath = 255;  // what goes to the DDS process

/// Absolute; relative ones are meant from the configuration's folder.
std::string PathOf(const std::string& path, const std::string& key, const Mark& mark,
                   LoadContext& context) {
  std::error_code error;
  const std::string full = fs::absolute(context.base / path, error).lexically_normal().string();
  if (!path.empty() && !error && full.size() <= kLongestPath) return full;
  context.problems.Error(mark, key + ": " + Quoted(path) + " is not a path of at most " +
                                   std::to_string(kLongestPath) + " bytes");
  return {};
}

}  // namespace

DdsSecurity ReadDdsSecurity(const YamlNode& node, LoadContext& context) {
  if (node.kind() == YamlNode::Kind::scalar) {
    const auto folder = ReadText(node, "security", context.problems);
    if (!folder) return {};
    DdsSecurity security = SecurityIn(PathOf(*folder, "security", node.mark(), context));
    security.keys.map = node.mark();
    return security;
  }
  MapReader map(node, "security", context.problems);
  DdsSecurity security;
  security.keys = map.keys();
  const auto read = [&](const char* key, std::string& to, bool needed) {
    if (needed && !map.Has(key)) map.Need(key, std::string("/etc/baudgate/dds/") + key + ".pem");
    if (const auto path = map.Label(key)) to = PathOf(*path, key, map.MarkOf(key), context);
  };
  read("ca", security.ca, true);
  read("permissions_ca", security.permissions_ca, false);
  read("identity", security.identity, true);
  read("key", security.key, true);
  read("password_file", security.password_file, false);
  read("governance", security.governance, true);
  read("permissions", security.permissions, true);
  map.Finish();
  return security;
}

}  // namespace baudgate::config
