// SPDX-License-Identifier: Apache-2.0
#include <set>

#include "config/yaml/yaml_reader.h"
#include "config/yaml/yaml_source.h"
#include "gateway/tools/cli/settings/sheet.h"

namespace baudgate::settings {
namespace {

constexpr std::size_t kMostSettings = 10'000;

/// The text of a key that has to be there; it may be empty.
void Need(config::MapReader& map, std::string_view key, std::string& target) {
  if (map.Need(key, "\"…\"")) config::Assign(target, map.Label(key));
}

Setting ReadSetting(const config::YamlNode& node, config::Problems& problems) {
  Setting setting;
  setting.mark = node.mark();
  config::MapReader map(node, "a setting", problems);
  Need(map, "point", setting.point);
  Need(map, "item", setting.item);
  setting.value = map.Label("value");
  config::Assign(setting.unit, map.Label("unit"));
  if (const auto scale = map.Number("scale")) setting.scale = scale->ToDouble();
  config::Assign(setting.quality, map.Label("quality"));
  map.Label("age");  // for people
  setting.known = setting.value && setting.quality.empty();
  map.Finish();
  return setting;
}

std::string Listed(const config::Problems& problems) {
  std::string text;
  for (const config::Problem& problem : problems.Sorted()) {
    text += (text.empty() ? "" : "\n") + config::ToString(problem);
  }
  return text;
}

}  // namespace

Result<Sheet> ReadSheet(const std::string& path) {
  auto content = config::ReadWholeFile(path);
  if (!content) return Error{path + ": error: " + content.error()};
  config::Problems problems;
  Sheet sheet;
  if (const auto root = config::ParseYaml(path, std::move(*content), problems)) {
    sheet.mark = root->mark();
    config::MapReader map(*root, "a file of settings", problems);
    Need(map, "gateway", sheet.gateway);
    Need(map, "line", sheet.line);
    Need(map, "device", sheet.device);
    Need(map, "protocol", sheet.protocol);
    Need(map, "profile", sheet.profile);
    Need(map, "designation", sheet.designation);
    Need(map, "time", sheet.time);
    if (const auto list = map.Need("settings", "[{ point: …, item: S21, value: 1 }]")) {
      std::set<std::string> names;
      for (const auto& node : config::ReadList(*list, "settings", kMostSettings, problems)) {
        sheet.settings.push_back(ReadSetting(node, problems));
        const Setting& setting = sheet.settings.back();
        if (!names.insert(setting.point).second) {
          problems.Error(setting.mark, "'" + setting.point + "' stands here for the second time");
        }
      }
    }
    map.Finish();
  }
  if (problems.has_error()) return Error{Listed(problems)};
  return sheet;
}

}  // namespace baudgate::settings
