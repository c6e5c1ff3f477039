// SPDX-License-Identifier: Apache-2.0
#include "config/migration.h"

#include "config/yaml/yaml_source.h"

namespace baudgate::config {
namespace {

bool IsProfile(const YamlNode& root) {
  const YAML::Node& map = root.yaml();
  return map.IsMap() && map["points"].IsDefined() && !map["lines"].IsDefined();
}

/// For a comparison of two texts.
std::string Meaning(const YamlNode& root) { return YAML::Dump(root.yaml()); }

void Rewrite(const YamlNode& root, std::string_view protocol, Migration& migration,
             Problems& problems) {
  migration.kind = IsProfile(root) ? FileKind::profile : FileKind::configuration;
  migration.changes = ApplyRenames(root, migration.kind, protocol);
  migration.after = RewriteText(migration.before, migration.changes, problems);
  if (problems.has_error()) return;
  const auto again = ParseYaml(root.source()->name(), migration.after, problems);
  if (again && Meaning(*again) == Meaning(root)) return;
  problems.Error({root.source()->name(), 0, 0},
                 "can not be rewritten safely; change by hand what 'baudgate check' warns of");
}

}  // namespace

Migration MigrateFile(const std::string& path, std::string_view protocol) {
  Migration migration;
  Problems problems;
  auto text = ReadWholeFile(path);
  migration.readable = text.ok();
  if (text) {
    migration.before = std::move(*text);
    if (const auto root = ParseYaml(path, migration.before, problems)) {
      Rewrite(*root, protocol, migration, problems);
    }
  } else {
    problems.Error({path, 0, 0}, text.error());
  }
  migration.problems = problems.Sorted();
  return migration;
}

}  // namespace baudgate::config
