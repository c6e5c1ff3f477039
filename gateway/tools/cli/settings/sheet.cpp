// SPDX-License-Identifier: Apache-2.0
#include "gateway/tools/cli/settings/sheet.h"

#include <algorithm>
#include <cmath>
#include <set>

#include "config/model/device.h"
#include "config/yaml/yaml_reader.h"
#include "config/yaml/yaml_source.h"
#include "gateway/base/text.h"

namespace baudgate::settings {
namespace {

using Json = tools::ControlClient::Json;

Setting SettingOf(const Json& json) {
  Setting setting;
  setting.point = tools::TextOf(json, "point");
  setting.item = tools::TextOf(json, "item");
  if (json.contains("value") && json["value"].is_string())
    setting.value = tools::TextOf(json, "value");
  setting.unit = tools::TextOf(json, "unit");
  if (json.contains("scale") && json["scale"].is_number()) setting.scale = json["scale"];
  setting.known = setting.value && json.value("known", false);
  setting.quality = tools::TextOf(json, "quality_text");
  if (json.contains("age_ms") && json["age_ms"].is_number_integer()) {
    setting.age = std::chrono::milliseconds(json["age_ms"].get<std::int64_t>());
  }
  setting.writable = json.value("writable", false);
  if (json.contains("resolution") && json["resolution"].is_number()) {
    setting.resolution = json["resolution"].get<double>();
  }
  return setting;
}

/// Returns the text in double quotes, in the syntax that JSON and YAML share.
std::string Quoted(const std::string& text) {
  return Json(text).dump(-1, ' ', false, Json::error_handler_t::replace);
}

std::string Row(const Setting& setting) {
  std::string row = "  - { point: " + Quoted(setting.point) + ", item: " + Quoted(setting.item);
  if (setting.value) row += ", value: " + Quoted(*setting.value);
  if (!setting.unit.empty()) row += ", unit: " + Quoted(setting.unit);
  if (setting.scale != 1) row += ", scale: " + FormatNumber(setting.scale);
  if (!setting.known) row += ", quality: " + Quoted(setting.quality);
  if (!setting.known && setting.age) row += ", age: " + FormatDuration(*setting.age);
  return row + " }\n";
}

}  // namespace

const Setting* Sheet::Find(const std::string& point) const {
  const auto found = std::ranges::find(settings, point, &Setting::point);
  return found == settings.end() ? nullptr : &*found;
}

std::optional<Duration> Sheet::oldest() const {
  std::optional<Duration> oldest;
  for (const Setting& setting : settings) {
    if (setting.known) oldest = std::max(oldest, setting.age);
  }
  return oldest;
}

int AskSheet(const std::string& socket, const std::string& target, Sheet& sheet,
             std::ostream& err) {
  Json answer;
  const Json request = {{"command", "settings"}, {"target", target}};
  if (const int code = tools::Ask(socket, request, answer, err); code != 0) return code;
  sheet = {};
  sheet.gateway = tools::TextOf(answer, "gateway");
  sheet.line = tools::TextOf(answer, "line");
  sheet.device = tools::TextOf(answer, "device");
  sheet.protocol = tools::TextOf(answer, "protocol");
  sheet.profile = tools::TextOf(answer, "profile");
  sheet.designation = tools::TextOf(answer, "designation");
  sheet.time = tools::TextOf(answer, "time");
  for (const Json& setting : answer.value("settings", Json::array())) {
    if (setting.is_object()) sheet.settings.push_back(SettingOf(setting));
  }
  return 0;
}

std::string ToYaml(const Sheet& sheet) {
  std::string text = "# Settings of a device, written by baudgate settings dump.\n";
  const auto add = [&text](const char* key, const std::string& value) {
    text += std::string(key) + ": " + Quoted(value) + "\n";
  };
  add("gateway", sheet.gateway);
  add("line", sheet.line);
  add("device", sheet.device);
  add("protocol", sheet.protocol);
  add("profile", sheet.profile);
  add("designation", sheet.designation);
  add("time", sheet.time);
  text += "settings:\n";
  for (const Setting& setting : sheet.settings) text += Row(setting);
  return text;
}

std::string ToJson(const Sheet& sheet) {
  Json json = {{"gateway", sheet.gateway}, {"line", sheet.line},
               {"device", sheet.device},   {"protocol", sheet.protocol},
               {"profile", sheet.profile}, {"designation", sheet.designation},
               {"time", sheet.time},       {"settings", Json::array()}};
  for (const Setting& setting : sheet.settings) {
    Json row = {{"point", setting.point}, {"item", setting.item}};
    if (setting.value) row["value"] = *setting.value;
    if (!setting.unit.empty()) row["unit"] = setting.unit;
    if (setting.scale != 1) row["scale"] = setting.scale;
    if (!setting.known) row["quality"] = setting.quality;
    if (!setting.known && setting.age) row["age"] = FormatDuration(*setting.age);
    json["settings"].push_back(std::move(row));
  }
  return json.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
}

namespace {

constexpr std::size_t kMostSettings = 10'000;

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
  map.Label("age");  // only people read the age
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
          problems.Error(setting.mark,
                         "'" + setting.point + "' is in the file twice; remove one of the two");
        }
      }
    }
    map.Finish();
  }
  if (problems.has_error()) return Error{Listed(problems)};
  return sheet;
}

namespace {

/// The largest relative difference of equal values, which is the precision of a float32.
constexpr double kSame = 1e-6;

Error Wrong(const config::Mark& mark, const std::string& message) {
  return Error{config::ToString({mark, message})};
}

bool IsNear(double a, double b) {
  return std::abs(a - b) <= kSame * std::max(std::abs(a), std::abs(b));
}

std::string UnitOf(const Setting& setting) {
  const std::string unit = setting.unit.empty() ? "no unit" : setting.unit;
  if (setting.scale == 1) return unit;
  return unit + " (" + FormatNumber(setting.scale) + " times the value of the device)";
}

}  // namespace

bool IsSameValue(const std::string& a, const std::string& b, std::optional<double> resolution) {
  const auto one = ParseDecimal(a);
  const auto other = ParseDecimal(b);
  if (!one || !other) return a == b;
  if (resolution && std::abs(*one - *other) >= *resolution / 2) return false;
  const bool whole = *one == std::trunc(*one) && *other == std::trunc(*other);
  return whole ? *one == *other : IsNear(*one, *other);
}

Status CheckFit(const Sheet& file, const Sheet& now) {
  const auto quoted = [](const std::string& text) { return baudgate::Quoted(text); };
  if (file.protocol != now.protocol || file.profile != now.profile) {
    return Wrong(file.mark, "this file is of a " + file.protocol + " device with profile " +
                                quoted(file.profile) + ", but " + now.target() + " is a " +
                                now.protocol + " device with profile " + quoted(now.profile) +
                                "; choose the file of this device");
  }
  if (file.designation.empty()) {
    return Wrong(file.mark,
                 "designation: the file does not name the device from which it was read; dump the "
                 "settings again");
  }
  if (now.designation.empty()) {
    return Wrong(
        file.mark,
        now.target() +
            " has not sent its designation yet, or does not answer; see 'baudgate status " +
            now.target() + "'");
  }
  if (config::SpokenName(file.designation) != config::SpokenName(now.designation)) {
    return Wrong(file.mark, "this file is of a " + quoted(file.designation) + ", but " +
                                now.target() + " is a " + quoted(now.designation) +
                                "; choose the file of this device");
  }
  for (const Setting& filed : file.settings) {
    const Setting* const here = now.Find(filed.point);
    if (here == nullptr) {
      return Wrong(filed.mark, now.target() + " has no setting " + quoted(filed.point) +
                                   "; remove this row from the file");
    }
    if (here->item != filed.item) {
      return Wrong(filed.mark, quoted(filed.point) + " is item " + filed.item +
                                   " in this file, but item " + here->item + " of " + now.target() +
                                   "; dump the settings again");
    }
    if (here->unit != filed.unit || !IsNear(here->scale, filed.scale)) {
      return Wrong(
          filed.mark,
          quoted(filed.point) + " is in " + UnitOf(filed) + " in this file, but in " +
              UnitOf(*here) + " of " + now.target() +
              ": its `ratios` or `scale` have changed; set them back, or dump the settings again");
    }
  }
  return {};
}

Comparison Compare(const Sheet& file, const Sheet& now) {
  Comparison comparison;
  for (const Setting& filed : file.settings) {
    const Setting* const here = now.Find(filed.point);
    if (here == nullptr) continue;  // CheckFit reports this setting
    if (!filed.known) {
      comparison.open.push_back(filed.point + " (" + filed.item + ") has no value in the file");
    } else if (!here->known) {
      ++comparison.unread;
      comparison.open.push_back(filed.point + " (" + filed.item +
                                ") has no value now: " + here->quality);
    } else if (!IsSameValue(*filed.value, *here->value, here->resolution)) {
      comparison.different.push_back({&filed, here});
    }
  }
  for (const Setting& here : now.settings) {
    if (file.Find(here.point) == nullptr) {
      comparison.open.push_back(here.point + " (" + here.item + ") is not in the file");
    }
  }
  return comparison;
}

}  // namespace baudgate::settings
