// SPDX-License-Identifier: Apache-2.0
#include "gateway/outputs/web/points_json.h"

#include <fmt/format.h>

#include <cmath>
#include <iterator>
#include <set>
#include <utility>

#include "config/model/point.h"
#include "gateway/base/text.h"
#include "gateway/outputs/status/status_json.h"
#include "gateway/outputs/status/value_json.h"

namespace baudgate::web {
namespace {

using Json = nlohmann::ordered_json;

bool Fits(const config::Line& line, const config::Device& device, const config::Point& point,
          const std::string& text) {
  if (text.empty()) return true;
  const std::string name = Lower(line.name + "." + device.name + "." + point.name);
  return name.find(text) != std::string::npos ||
         Lower(*point.description).find(text) != std::string::npos;
}

/// Returns what the configuration allows. "none": a point that can only be written, and must not
/// be.
std::string_view AccessWord(const config::Point& point) {
  const auto access = config::AllowedAccess(point);
  if (!access) return "none";
  switch (*access) {
    case config::Access::read:
      return "read";
    case config::Access::write:
      return "write";
    default:
      return "read_write";
  }
}

/// Adds what a client needs once to show values of the point, and to offer writing; members that
/// do not apply are left out.
void AddDescription(const config::Point& point, Json& json) {
  if (point.access == config::Access::write) json["write_only"] = true;
  if (point.precision) json["precision"] = *point.precision;
  for (const config::StateText& state : *point.states) {
    json["states"][std::to_string(state.value)] = state.text;
  }
  const config::Writing& writing = point.writing;
  if (writing.allowed && writing.select) json["select"] = true;
  if (writing.min) json["min"] = writing.min->ToDouble();
  if (writing.max) json["max"] = writing.max->ToDouble();
  if (writing.step) json["step"] = writing.step->ToDouble();
  for (const config::PointEvent& event : point.events) {
    if (event.on == config::PointEvent::On::change) continue;
    json["events"].push_back({{"on", config::Name(event.on)},
                              {"value", event.value.ToDouble()},
                              {"alarm", config::Name(event.alarm)}});
  }
}

Json PointJson(const bus::DeviceRecord& record, std::size_t index, std::uint32_t id, bool kept,
               Now now) {
  const config::Point& point = record.device->points[index];
  Json json = {{"id", id}, {"line", record.line->name}, {"device", record.device->name}};
  Json status = status::PointJson(record, index, now.instant);
  json["point"] = std::move(status["point"]);
  json["unit"] = std::move(status["unit"]);
  json["type"] = config::Name(point.type);
  json["description"] = *point.description;
  json["access"] = AccessWord(point);
  json["group"] = config::Name(point.group);
  AddDescription(point, json);
  if (kept) json["kept"] = true;
  for (const char* key : {"value", "shown", "quality", "quality_text", "age_ms"}) {
    json[key] = std::move(status[key]);
  }
  return json;
}

void AppendValue(const Value& value, std::string& out) {
  auto to = std::back_inserter(out);
  if (const auto* number = std::get_if<double>(&value)) {
    if (std::isfinite(*number)) {
      fmt::format_to(to, "{}", *number);
    } else {
      out += "null";
    }
  } else if (const auto* whole = std::get_if<std::int64_t>(&value)) {
    fmt::format_to(to, "{}", *whole);
  } else if (const auto* counter = std::get_if<std::uint64_t>(&value)) {
    fmt::format_to(to, "{}", *counter);
  } else if (const auto* flag = std::get_if<bool>(&value)) {
    out += *flag ? "true" : "false";
  } else if (const auto* text = std::get_if<std::string>(&value)) {
    out += JsonText(*text);
  } else {
    out += "null";
  }
}

}  // namespace

PointNumbers::PointNumbers(const bus::PointStore& store) {
  std::uint32_t next = 0;
  for (std::uint32_t device = 0; device < store.device_count(); ++device) {
    first_.push_back(next);
    next += static_cast<std::uint32_t>(store.point_count(device));
  }
}

Json PointsJson(const bus::PointStore& store, const PointFilter& filter,
                const config::History& history, Now now) {
  const PointNumbers numbers(store);
  const std::string text = Lower(filter.text);
  std::set<std::pair<std::uint32_t, std::uint32_t>> kept;
  for (const config::HistoryPoint& one : history.points) kept.emplace(one.device, one.point);
  Json points = Json::array();
  for (std::uint32_t device = 0; device < store.device_count(); ++device) {
    if (store.gone(device) || (filter.device && *filter.device != device)) continue;
    bus::DeviceRecord record;
    if (!store.Read(device, [&](const bus::DeviceRecord& held) { record = held; })) continue;
    if (!filter.line.empty() && record.line->name != filter.line) continue;
    for (std::size_t i = 0; i < record.points.size(); ++i) {
      const config::Point& point = record.device->points[i];
      if (!Fits(*record.line, *record.device, point, text)) continue;
      const auto index = static_cast<std::uint32_t>(i);
      points.push_back(
          PointJson(record, i, numbers.Of(device, index), kept.contains({device, index}), now));
    }
  }
  return {{"time", FormatWallTime(now.wall)}, {"points", std::move(points)}};
}

void AppendRow(const bus::DeviceRecord& record, std::size_t point, std::uint32_t id, Instant now,
               std::string& out) {
  const bus::PointRecord& its = record.points[point];
  const Quality quality = QualityAt(record, point, now);
  fmt::format_to(std::back_inserter(out), "[{},", id);
  AppendValue(its.value, out);
  fmt::format_to(std::back_inserter(out), ",{},{},", quality.word(),
                 JsonText(status::QualityText(record.device->points[point], quality)));
  if (its.read_at) {
    fmt::format_to(
        std::back_inserter(out), "{}",
        std::chrono::floor<std::chrono::milliseconds>(its.source_time).time_since_epoch().count());
  } else {
    out += "null";
  }
  out += "," + JsonText(config::ShownText(record.device->points[point], its.value)) + "],";
}

std::string JsonText(std::string_view text) {
  return Json(text).dump(-1, ' ', false, Json::error_handler_t::replace);
}

nlohmann::ordered_json MapJson(const config::Device& device) {
  using Json = nlohmann::ordered_json;
  Json registers = Json::array();
  for (const config::Point& point : device.points) {
    if (!device.unit || !point.modbus) continue;
    registers.push_back({{"point", point.name},
                         {"table", config::TableName(point)},
                         {"read_functions", config::ReadFunctions(point)},
                         {"write_functions", config::WriteFunctions(point)},
                         {"address", *point.modbus},
                         {"count", config::PlacesOf(point)},
                         {"type", config::Name(point.type)},
                         {"unit", point.unit},
                         {"access", AccessWord(point)}});
  }
  return {{"unit", device.unit ? Json(*device.unit) : Json(nullptr)},
          {"registers", std::move(registers)}};
}

}  // namespace baudgate::web
