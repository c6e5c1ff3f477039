// SPDX-License-Identifier: Apache-2.0
#include "gateway/outputs/mqtt/discovery.h"

#include <algorithm>
#include <array>
#include <nlohmann/json.hpp>
#include <string_view>
#include <utility>

#include "gateway/base/version.h"

namespace baudgate::mqtt {
namespace {

using Json = nlohmann::ordered_json;

constexpr std::string_view kRoot = "homeassistant/";

struct Unit {
  std::string_view unit;   ///< as in the configuration
  std::string_view shown;  ///< as Home Assistant writes it
  std::string_view device_class;
};
constexpr std::array<Unit, 33> kUnits = {{
    {"A", "A", "current"},          {"mA", "mA", "current"},
    {"V", "V", "voltage"},          {"mV", "mV", "voltage"},
    {"kV", "kV", "voltage"},        {"W", "W", "power"},
    {"kW", "kW", "power"},          {"MW", "MW", "power"},
    {"VA", "VA", "apparent_power"}, {"var", "var", "reactive_power"},
    {"Wh", "Wh", "energy"},         {"kWh", "kWh", "energy"},
    {"MWh", "MWh", "energy"},       {"Hz", "Hz", "frequency"},
    {"kHz", "kHz", "frequency"},    {"degC", "°C", "temperature"},
    {"°C", "°C", "temperature"},    {"K", "K", "temperature"},
    {"Pa", "Pa", "pressure"},       {"hPa", "hPa", "pressure"},
    {"kPa", "kPa", "pressure"},     {"mbar", "mbar", "pressure"},
    {"bar", "bar", "pressure"},     {"ms", "ms", "duration"},
    {"s", "s", "duration"},         {"min", "min", "duration"},
    {"h", "h", "duration"},         {"mm", "mm", "distance"},
    {"m", "m", "distance"},         {"g", "g", "weight"},
    {"kg", "kg", "weight"},         {"m/s", "m/s", "speed"},
    {"lx", "lx", "illuminance"},
}};

bool IsNumber(const config::Point& point) {
  return point.type != config::Type::boolean && point.type != config::Type::string &&
         point.time_type == config::TimeType::none;
}

std::string_view ComponentOf(const config::Mqtt& settings, const config::Point& point) {
  const bool is_bool = point.type == config::Type::boolean;
  const bool written = settings.commands && point.writing.allowed && !point.writing.select;
  if (point.access == config::Access::write) return written && is_bool ? "button" : "";
  if (written && is_bool) return "switch";
  if (written && IsNumber(point)) return "number";
  return is_bool ? "binary_sensor" : "sensor";
}

void AddUnit(const config::Point& point, bool is_sensor, Json& json) {
  if (point.unit.empty()) return;
  const auto known = std::ranges::find(kUnits, point.unit, &Unit::unit);
  json["unit_of_measurement"] = known == kUnits.end() ? point.unit : std::string(known->shown);
  const bool energy = known != kUnits.end() && known->device_class == "energy";
  if (known != kUnits.end()) json["device_class"] = known->device_class;
  if (is_sensor) json["state_class"] = energy ? "total_increasing" : "measurement";
}

void AddLimits(const config::Point& point, Json& json) {
  // Home Assistant assumes 1 to 100 if there are no limits.
  constexpr double kWidest = 1e9;
  const config::IntegerRange range = config::RangeOf(point);
  const bool real = point.type == config::Type::float32 || point.type == config::Type::float64;
  const double scale = point.scale.ToDouble();
  const auto end = [&](double raw) {
    const double value = real ? raw : raw * scale + point.offset.ToDouble();
    return std::clamp(value, -kWidest, kWidest);
  };
  const double low = real ? -kWidest : end(static_cast<double>(range.lowest));
  const double high = real ? kWidest : end(static_cast<double>(range.highest));
  json["min"] = point.writing.min ? point.writing.min->ToDouble() : std::min(low, high);
  json["max"] = point.writing.max ? point.writing.max->ToDouble() : std::max(low, high);
  json["step"] = point.writing.step ? point.writing.step->ToDouble() : real ? 0.001 : 1;
  json["mode"] = "box";
}

}  // namespace

std::optional<Entity> EntityOf(const config::Mqtt& settings, const Topics& topics,
                               const std::string& gateway, const config::Line& line,
                               const config::Device& device, const config::Point& point) {
  const std::string_view component = ComponentOf(settings, point);
  if (component.empty()) return std::nullopt;
  const bool plain = settings.payload == config::Mqtt::Payload::value;
  const std::string topic = topics.Of(line.name, device.name, point.name);
  const std::string value = plain ? "value" : "value_json.value";
  const bool is_bool = point.type == config::Type::boolean;
  Json json;
  json["name"] = point.description->empty() ? point.name : *point.description;
  json["unique_id"] = EntityId(gateway) + device.name + "--" + point.name;
  json["object_id"] = gateway + "_" + device.name + "_" + point.name;
  Json available = Json::array();
  available.push_back({{"topic", topics.Own("status")}});
  if (component != "button") {
    json["state_topic"] = topic;
    json["value_template"] = "{{ " + value + (is_bool ? " | string | lower }}" : " }}");
    available.push_back(
        {{"topic", topic},
         {"value_template", plain ? "{{ 'offline' if value == 'unavailable' else 'online' }}"
                                  : "{{ 'online' if value_json.quality == 'good' else 'offline' "
                                    "}}"}});
    json["availability_mode"] = "all";
  }
  json["availability"] = std::move(available);
  if (component == "button") {
    json["command_topic"] = topic + "/set";
    json["payload_press"] = "true";
  } else if (component == "switch" || component == "binary_sensor") {
    json["payload_on"] = "true";
    json["payload_off"] = "false";
  }
  if (component == "switch" || component == "number") json["command_topic"] = topic + "/set";
  if (component == "number") AddLimits(point, json);
  if (IsNumber(point) && component != "button") AddUnit(point, component == "sensor", json);
  json["device"] = {{"identifiers", {EntityId(gateway) + device.name}},
                    {"name", device.name},
                    {"model", device.profile.empty() ? device.protocol : device.profile}};
  json["origin"] = {{"name", "baudgate"}, {"sw_version", kVersion}};
  return Entity{std::string(kRoot) + std::string(component) + "/" + gateway + "/" + device.name +
                    "--" + point.name + "/config",
                json.dump(-1, ' ', false, Json::error_handler_t::replace)};
}

bool IsEntityTopic(const std::string& topic) { return topic.starts_with(kRoot); }

std::string EntityId(const std::string& gateway) { return "baudgate--" + gateway + "--"; }

std::string EntityFilter(const std::string& gateway) {
  return std::string(kRoot) + "+/" + gateway + "/+/config";
}

}  // namespace baudgate::mqtt
