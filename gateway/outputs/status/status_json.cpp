// SPDX-License-Identifier: Apache-2.0
#include "gateway/outputs/status/status_json.h"

#include <fmt/format.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <vector>

#include "gateway/base/shown.h"
#include "gateway/base/system_trouble.h"
#include "gateway/base/text.h"
#include "gateway/bus/points/point_store.h"
#include "gateway/diagnosis/causes/diagnose.h"
#include "gateway/outputs/status/records_json.h"
#include "gateway/outputs/status/value_json.h"

namespace baudgate::status {

using Json = nlohmann::ordered_json;

namespace {

/// If fewer descriptors than this are left, the status contains an advice. For comparison: opening
/// a database takes three.
constexpr std::size_t kFew = 4;

}  // namespace

Json FilesJson(const FilesState& state) {
  Json advice = Json::array();
  if (state.limit != 0 && state.open + kFew > state.limit) {
    advice.push_back(
        fmt::format("{} of at most {} files are open, so opening another file may fail: {}",
                    state.open, state.limit, SystemTrouble(EMFILE)));
  }
  for (const std::string& trouble : state.troubles) advice.push_back(trouble);
  return {{"open", state.open},
          {"limit", state.limit == 0 ? Json(nullptr) : Json(state.limit)},
          {"advice", std::move(advice)}};
}

std::string PutAsideAdvice(const std::filesystem::path& folder,
                           const std::vector<std::string>& files) {
  if (files.empty()) return {};
  const std::string first = (folder / files.front()).string();
  const std::string more = files.size() == 1 ? "" : fmt::format(" (and {} more)", files.size() - 1);
  return fmt::format(
      "{}{} was damaged and put aside, so its data is missing in answers of the gateway: save the "
      "data with 'sqlite3 {} .recover', then move the file away",
      first, more, first);
}

namespace {

std::int64_t InMilliseconds(Duration duration) { return duration / 1ms; }

Json SinceJson(std::optional<Duration> age) {
  return age ? Json(InMilliseconds(*age)) : Json(nullptr);
}

/// Returns why a device is in maintenance, so that people expect no values of it: "disabled" or
/// "lent" (its port); empty: it is not.
std::string_view MaintenanceOf(const bus::LineStatus& line, const bus::DeviceStatus& device) {
  if (device.state == bus::DeviceState::disabled) return "disabled";
  return line.port == bus::LineStatus::Port::released ? "lent" : "";
}

Json WordJson(std::string_view word) { return word.empty() ? Json(nullptr) : Json(word); }

/// Counts the points of a device. `count` is the sum of good, uncertain and bad: points that are
/// never read, and points of a device in maintenance, are counted apart.
Json PointsJson(const bus::DeviceRecord& record, bool maintained, Instant now) {
  std::size_t good = 0;
  std::size_t uncertain = 0;
  std::size_t bad = 0;
  std::size_t write_only = 0;
  std::size_t maintenance = 0;
  for (std::size_t i = 0; i < record.points.size(); ++i) {
    if (record.device->points[i].access == config::Access::write) {
      ++write_only;
    } else if (maintained) {
      ++maintenance;
    } else {
      const Quality quality = QualityAt(record, i, now);
      ++(IsGood(quality) ? good : IsUncertain(quality) ? uncertain : bad);
    }
  }
  return {{"count", good + uncertain + bad}, {"good", good},
          {"uncertain", uncertain},          {"bad", bad},
          {"write_only", write_only},        {"maintenance", maintenance}};
}

/// Returns the numbers of devices by state, and of points, over the lines.
Json SumsJson(const Json& lines) {
  Json devices = {{"count", 0},   {"online", 0},     {"degraded", 0},
                  {"offline", 0}, {"never_seen", 0}, {"maintenance", 0}};
  Json points = {{"count", 0}, {"good", 0},       {"uncertain", 0},
                 {"bad", 0},   {"write_only", 0}, {"maintenance", 0}};
  const auto add = [](Json& to, const Json& number) {
    to = to.get<std::size_t>() + number.get<std::size_t>();
  };
  for (const Json& line : lines) {
    for (const Json& device : line["devices"]) {
      std::string state = device["state"];
      if (!device["maintenance"].is_null()) state = "maintenance";
      std::ranges::replace(state, ' ', '_');
      add(devices["count"], 1);
      add(devices[state], 1);
      for (auto& [key, sum] : points.items()) add(sum, device["points"][key]);
    }
  }
  return {{"devices", std::move(devices)}, {"points", std::move(points)}};
}

Json ValuesJson(const bus::DeviceRecord& record, Instant now) {
  Json values = Json::array();
  for (std::size_t i = 0; i < record.points.size(); ++i) {
    values.push_back(PointJson(record, i, now));
  }
  return values;
}

struct View {
  const GatewayInfo& info;
  Now now;
  bool with_values = false;
};

Json DeviceJson(const bus::LineStatus& line, const bus::DeviceRecord& record,
                std::span<const bus::DeviceRecord> devices, const View& view) {
  Json json;
  json["name"] = record.device->name;
  json["address"] = record.device->address;
  json["protocol"] = record.device->protocol;
  json["profile"] = record.device->profile;
  json["unit"] = record.device->unit ? Json(*record.device->unit) : Json(nullptr);
  AddFields(record.status, view.now, json);
  const std::string_view maintenance = MaintenanceOf(line, record.status);
  json["maintenance"] = WordJson(maintenance);
  json["state_text"] = maintenance.empty()     ? std::string(Name(record.status.state))
                       : maintenance == "lent" ? "in maintenance: port lent"
                                               : "in maintenance: disabled";
  json["disabled"] = nullptr;
  if (!record.status.disabled_by.empty()) {
    json["disabled"] = {{"by", record.status.disabled_by},
                        {"since", TimeJson(record.status.disabled_since)}};
  }
  json["points"] = PointsJson(record, !maintenance.empty(), view.now.instant);
  if (view.with_values) json["values"] = ValuesJson(record, view.now.instant);
  json["advice"] = diagnosis::DiagnoseDevice(line, record, devices, view.now, view.info.started);
  return json;
}

std::optional<WallTime> StuckSince(std::uint32_t line, const View& view) {
  return view.info.stuck_since ? view.info.stuck_since(line) : std::nullopt;
}

/// Returns the only advice that is shown while the thread of a line hangs, because everything else
/// about the line is out of date.
std::string ExplainHang(const config::Line& line, WallTime since) {
  return "its thread has hung since " + FormatWallTime(since) + ": the driver of " + line.port +
         " does not return from a call; unplug the adapter, or restart the gateway";
}

Json ModemJson(const std::optional<ModemLines>& lines) {
  if (!lines) return nullptr;
  return {{"dtr", lines->dtr}, {"rts", lines->rts}, {"cts", lines->cts},
          {"dsr", lines->dsr}, {"dcd", lines->dcd}, {"ring", lines->ring}};
}

Json ServiceJson(const bus::PortService& service) {
  Json json = {{"at", service.place},
               {"mode", service.mode},
               {"use", service.lent ? "lent" : "served"},
               {"trouble", service.trouble},
               {"open_until", TimeJson(service.open_until)},
               {"client", nullptr},
               {"last", nullptr}};
  if (!service.visit) return json;
  const bus::PortService::Visit& visit = *service.visit;
  const bool over = !visit.why.empty();
  json[over ? "last" : "client"] = {
      {"client", visit.client},         {"since", TimeJson(visit.since)},
      {"until", TimeJson(visit.until)}, {"to_port", visit.to_port},
      {"from_port", visit.from_port},   {"why", over ? Json(visit.why) : Json(nullptr)}};
  return json;
}

Json LineJson(const config::Config& config, const bus::PointStore& store, Target target,
              const View& view) {
  const config::Line& line = config.lines[target.line];
  const bus::LineStatus status = store.ReadLine(target.line);
  const std::uint32_t first = config::FirstDevice(config, target.line);
  // The records are copied, so that the line waits for their locks only briefly.
  std::vector<bus::DeviceRecord> records(line.devices.size());
  for (std::uint32_t i = 0; i < records.size(); ++i) {
    store.Read(first + i, [&](const bus::DeviceRecord& held) { records[i] = held; });
  }
  // A missing device means that a reload has removed the line since `config` was taken.
  if (!std::ranges::all_of(records, [](const auto& one) { return one.device != nullptr; })) {
    records.clear();
  }
  Json devices = Json::array();
  for (std::uint32_t i = 0; i < records.size(); ++i) {
    if (target.device && first + i != *target.device) continue;
    devices.push_back(DeviceJson(status, records[i], records, view));
  }
  Json json;
  json["name"] = line.name;
  json["protocol"] = line.protocol;
  json["port"] = line.port;
  json["serial"] = line.tcp ? Json(nullptr) : Json(line.serial.ToString());
  json["port_state"] = Name(status.port);
  json["port_text"] = status.port_text;
  json["port_since"] = TimeJson(status.port_since);
  json["released_until"] = status.port == bus::LineStatus::Port::released
                               ? TimeJson(status.released_until)
                               : Json(nullptr);
  json["maintenance"] = WordJson(status.port == bus::LineStatus::Port::released ? "lent" : "");
  json["modem"] = ModemJson(status.modem);
  Json& services = json["services"] = Json::array();
  for (const bus::PortService& service : status.services) services.push_back(ServiceJson(service));
  const auto stuck = StuckSince(target.line, view);
  json["stuck_since"] = stuck ? TimeJson(*stuck) : Json(nullptr);
  AddFields(status, view.now, json);
  json["advice"] =
      stuck ? Json::array({ExplainHang(line, *stuck)})
            : Json(diagnosis::DiagnoseLine(line, status, records, view.now, view.info.started));
  json["devices"] = std::move(devices);
  return json;
}

Json ReloadJson(const ReloadState& state, WallTime now) {
  std::optional<Duration> left;
  if (state.confirm_until) left = std::max(Duration{}, Duration(*state.confirm_until - now));
  Json advice = Json::array();
  if (state.confirm_until) {
    advice.push_back("is on trial: the previous configuration comes back at " +
                     FormatWallTime(*state.confirm_until) + " unless you run 'baudgate confirm'");
  }
  if (!state.not_the_file.empty()) advice.push_back(state.not_the_file);
  if (!state.file_changed.empty()) advice.push_back(state.file_changed);
  if (!state.not_kept.empty()) {
    advice.push_back(
        "the confirmed configuration could not be saved, so the next start may use another "
        "configuration: " +
        state.not_kept);
  }
  return {{"file", state.file},
          {"folder", state.folder},
          {"applied", TimeJson(state.applied)},
          {"confirm_until", state.confirm_until ? TimeJson(*state.confirm_until) : Json(nullptr)},
          {"confirm_left_ms", left ? Json(InMilliseconds(*left)) : Json(nullptr)},
          {"not_the_file", state.not_the_file},
          {"file_changed", state.file_changed},
          {"not_kept", state.not_kept},
          {"advice", std::move(advice)}};
}

}  // namespace

/// Returns a point. `age_ms` is the age of the point's reading. (A device's age is that of its last
/// good exchange.)
Json PointJson(const bus::DeviceRecord& record, std::size_t index, Instant now) {
  const config::Point& point = record.device->points[index];
  const Quality quality = QualityAt(record, index, now);
  return {{"point", point.name},
          {"value", ValueJson(record.points[index].value)},
          {"shown", config::ShownText(point, record.points[index].value)},
          {"unit", point.unit},
          {"quality", quality.word()},
          {"quality_text", QualityText(point, quality)},
          {"age_ms", SinceJson(AgeAt(record, index, now))}};
}

Json StatusJson(const config::Config& config, const bus::PointStore& store, const GatewayInfo& info,
                const std::optional<Target>& target, Now now) {
  const View view{info, now, target && target->device};
  Json json;
  json["gateway"] = config.name;
  json["version"] = info.version;
  json["time"] = FormatWallTime(now.wall);
  json["uptime_ms"] = InMilliseconds(now.instant - info.started);
  Json& lines = json["lines"] = Json::array();
  for (std::uint32_t line = 0; line < config.lines.size(); ++line) {
    if (target ? target->line != line : config.lines[line].name.empty()) continue;
    lines.push_back(LineJson(config, store, target.value_or(Target{line}), view));
  }
  json["sums"] = SumsJson(lines);
  json["labels"] = {{"line", LabelsJson<bus::LineStatus>()},
                    {"device", LabelsJson<bus::DeviceStatus>()}};
  if (info.outputs != nullptr) {
    const outputs::Output::Wish wish{target ? config.lines[target->line].name : std::string(), now};
    for (const auto& output : *info.outputs) {
      if (auto section = output->Section(wish)) json[std::string(output->name())] = *section;
    }
  }
  json["audit"] = info.audit ? AuditJson(info.audit->state()) : Json(nullptr);
  json["events"] = info.events ? EventsJson(info.events->state()) : Json(nullptr);
  json["history"] = info.history ? HistoryJson(info.history->state()) : Json(nullptr);
  json["configuration"] = info.reload ? ReloadJson(info.reload(), now.wall) : Json(nullptr);
  json["files"] = info.files ? FilesJson(info.files()) : Json(nullptr);
  return json;
}

namespace {

bool IsSetting(const config::Device& device, const config::Point& point) {
  const auto is_setting = device.traits->is_setting;
  return is_setting && point.access != config::Access::write && is_setting(point);
}

/// Returns the scaled value of the sentinel that gives this quality, e.g. 999 for "out of use";
/// nothing if the quality comes from no sentinel, or if several sentinels give it.
Value SentinelOf(const config::Point& point, Quality quality) {
  if (quality.reason != Reason::sentinel) return {};
  const auto means = [&](const config::Sentinel& one) { return one.quality.code == quality.code; };
  if (std::ranges::count_if(point.sentinels, means) != 1) return {};
  const Decimal raw = std::ranges::find_if(point.sentinels, means)->value;
  return (raw * point.scale + point.offset).ToDouble();
}

/// Returns the smallest difference between two values of the point; null: the difference is not
/// known.
Json ResolutionOf(const config::Point& point) {
  const bool whole = point.type != config::Type::float32 && point.type != config::Type::float64;
  if (point.type == config::Type::string || (!whole && !point.writing.decimals)) return nullptr;
  return Abs(point.scale).Shifted(whole ? 0 : -*point.writing.decimals).ToDouble();
}

Json SettingJson(const bus::DeviceRecord& record, std::size_t index, Now now) {
  const config::Point& point = record.device->points[index];
  const Quality quality = QualityAt(record, index, now.instant);
  const Value sentinel = SentinelOf(point, quality);
  // A bad point has no value here, although the store contains its last value.
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

/// Returns the name that is stored in the device itself; null: the name is not known.
Json DesignationOf(const bus::DeviceRecord& record, Now now) {
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

Result<Json> SettingsJson(const config::Config& config, const bus::PointStore& store, Target target,
                          Now now) {
  // The record is copied, so that the line waits for its lock only briefly.
  bus::DeviceRecord record;
  if (!store.Read(*target.device, [&](const bus::DeviceRecord& held) { record = held; })) {
    return Error{"a reload has removed this device"};
  }
  const config::Device& device = *record.device;
  Json settings = Json::array();
  for (std::size_t i = 0; i < device.points.size(); ++i) {
    if (IsSetting(device, device.points[i])) settings.push_back(SettingJson(record, i, now));
  }
  if (settings.empty()) {
    return Error{Quoted(device.name) +
                 " has no settings: neither its protocol nor its profile defines any"};
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

}  // namespace baudgate::status
