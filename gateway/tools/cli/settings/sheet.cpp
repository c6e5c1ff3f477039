// SPDX-License-Identifier: Apache-2.0
#include "gateway/tools/cli/settings/sheet.h"

#include <algorithm>

#include "gateway/base/text.h"
#include "gateway/tools/cli/client/json_fields.h"

namespace baudgate::settings {
namespace {

using Json = ControlClient::Json;

Setting SettingOf(const Json& json) {
  Setting setting;
  setting.point = TextOf(json, "point");
  setting.item = TextOf(json, "item");
  if (json.contains("value") && json["value"].is_string()) setting.value = TextOf(json, "value");
  setting.unit = TextOf(json, "unit");
  if (json.contains("scale") && json["scale"].is_number()) setting.scale = json["scale"];
  setting.known = setting.value && json.value("known", false);
  setting.quality = TextOf(json, "quality_text");
  if (json.contains("age_ms") && json["age_ms"].is_number_integer()) {
    setting.age = std::chrono::milliseconds(json["age_ms"].get<std::int64_t>());
  }
  setting.writable = json.value("writable", false);
  if (json.contains("resolution") && json["resolution"].is_number()) {
    setting.resolution = json["resolution"].get<double>();
  }
  return setting;
}

/// In double quotes, where JSON and YAML agree.
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
  if (const int code = Ask(socket, request, answer, err); code != 0) return code;
  sheet = {};
  sheet.gateway = TextOf(answer, "gateway");
  sheet.line = TextOf(answer, "line");
  sheet.device = TextOf(answer, "device");
  sheet.protocol = TextOf(answer, "protocol");
  sheet.profile = TextOf(answer, "profile");
  sheet.designation = TextOf(answer, "designation");
  sheet.time = TextOf(answer, "time");
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

}  // namespace baudgate::settings
