// SPDX-License-Identifier: Apache-2.0
#include "gateway/outputs/status/settings_json.h"

#include <algorithm>

#include "gateway/base/spelling.h"
#include "gateway/base/text.h"
#include "gateway/bus/points/ageing.h"
#include "gateway/outputs/status/json_time.h"

namespace baudgate::control {
namespace {

/// It can be read, and its protocol calls it a setting.
bool IsSetting(const config::Device& device, const config::Point& point) {
  const auto is_setting = device.traits->is_setting;
  return is_setting && point.access != config::Access::write && is_setting(point);
}

/// What the relay itself holds where a number stands for "out of use": 999. Nothing, where several
/// numbers could be meant.
Value SentinelOf(const config::Point& point, Quality quality) {
  if (quality.reason != Reason::sentinel) return {};
  const auto means = [&](const config::Sentinel& one) { return one.quality.code == quality.code; };
  if (std::ranges::count_if(point.sentinels, means) != 1) return {};
  const Decimal raw = std::ranges::find_if(point.sentinels, means)->value;
  return (raw * point.scale + point.offset).ToDouble();
}

/// The least by which two values of it can differ; null: not known.
Json ResolutionOf(const config::Point& point) {
  const bool whole = point.type != config::Type::float32 && point.type != config::Type::float64;
  if (point.type == config::Type::string || (!whole && !point.writing.decimals)) return nullptr;
  return Abs(point.scale).Shifted(whole ? 0 : -*point.writing.decimals).ToDouble();
}

Json SettingJson(const DeviceRecord& record, std::size_t index, Now now) {
  const config::Point& point = record.device->points[index];
  const Quality quality = QualityAt(record, index, now.instant);
  const Value sentinel = SentinelOf(point, quality);
  // The store keeps the last value of a point that is bad now.
  const Value& held = record.points[index].value;
  const Value value = HasValue(sentinel) ? sentinel : IsBad(quality) ? Value() : held;
  const auto age = AgeAt(record, index, now.instant);
  Json json;
  json["point"] = point.name;
  json["item"] = point.read;
  json["value"] = HasValue(value) ? Json(ToText(value)) : Json(nullptr);
  json["unit"] = point.unit;
  json["scale"] = point.scale.ToDouble();
  json["resolution"] = ResolutionOf(point);
  json["known"] = HasValue(value) && (IsGood(quality) || HasValue(sentinel));
  json["quality"] = quality.word();
  json["quality_text"] = Name(quality);
  json["age_ms"] = age ? Json(*age / 1ms) : Json(nullptr);
  json["writable"] = point.access == config::Access::read_write;
  return json;
}

/// What the relay calls itself; null: not known.
Json DesignationOf(const DeviceRecord& record, Now now) {
  const auto& points = record.device->points;
  const std::string_view designation = record.device->traits->designation;
  const auto found = std::ranges::find(points, designation, &config::Point::read);
  if (designation.empty() || found == points.end()) return nullptr;
  const auto index = static_cast<std::size_t>(found - points.begin());
  const auto* text = std::get_if<std::string>(&record.points[index].value);
  if (text == nullptr || !IsGood(QualityAt(record, index, now.instant))) return nullptr;
  return std::string(Trim(*text));
}

}  // namespace

Result<Json> SettingsJson(const config::Config& config, const PointStore& store, Target target,
                          Now now) {
  DeviceRecord record;  // a copy: the line must not wait
  store.Read(*target.device, [&](const DeviceRecord& held) { record = held; });
  const config::Device& device = *record.device;
  Json settings = Json::array();
  for (std::size_t i = 0; i < device.points.size(); ++i) {
    if (IsSetting(device, device.points[i])) settings.push_back(SettingJson(record, i, now));
  }
  if (settings.empty()) {
    return Error{
        config::Quoted(device.name) +
        " has no settings that the gateway knows of: its protocol or its profile has none"};
  }
  Json json;
  json["gateway"] = config.name;
  json["line"] = config.lines[target.line].name;
  json["device"] = device.name;
  json["protocol"] = device.protocol;
  json["profile"] = device.profile;
  json["designation"] = DesignationOf(record, now);
  json["trouble"] = record.status.trouble;
  json["time"] = TimeJson(now.wall);
  json["settings"] = std::move(settings);
  return json;
}

}  // namespace baudgate::control
