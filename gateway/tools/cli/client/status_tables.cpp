// SPDX-License-Identifier: Apache-2.0
#include "gateway/tools/cli/client/status_tables.h"

#include <fmt/format.h>

#include <algorithm>
#include <functional>
#include <vector>

#include "gateway/base/shown.h"
#include "gateway/tools/cli/client/json_fields.h"

namespace baudgate {
namespace {

using Json = nlohmann::ordered_json;

/// "-" where nothing was counted.
std::string ShareText(std::uint64_t part, std::uint64_t whole) {
  if (whole == 0) return "-";
  return fmt::format("{:.1f} %", 100.0 * static_cast<double>(part) / static_cast<double>(whole));
}

bool IsAlive(const Json& device) {
  const std::string state = Text(device, "state");
  return state == "online" || state == "degraded";
}

bool IsEchoLost(const Json& line) {
  return line.contains("echo_lost_since") && !line.at("echo_lost_since").is_null();
}

void MostTroubleFirst(std::vector<TableRow>& rows) {
  std::ranges::stable_sort(rows, std::ranges::greater(), &TableRow::tone);
}

}  // namespace

std::string MillisecondsText(const Json& json) {
  return json.is_null() ? "-" : FormatAge(std::chrono::milliseconds(json.get<std::int64_t>()));
}

std::string RoundTripText(double us) {
  if (us < 9'950) return fmt::format("{:.1f} ms", us / 1e3);
  if (us < 999'500) return fmt::format("{:.0f} ms", us / 1e3);
  return fmt::format("{:.1f} s", us / 1e6);
}

std::string UseText(const Json& line) {
  return fmt::format("{:.0f} %", 100 * line.at("use").get<double>());
}

std::size_t Alive(const Json& line) {
  return static_cast<std::size_t>(std::ranges::count_if(line.at("devices"), IsAlive));
}

Tone ToneOfLine(const Json& line) {
  if (Text(line, "port_state") == "closed" || IsEchoLost(line)) return Tone::alarm;
  return line.at("advice").empty() ? Tone::plain : Tone::warning;
}

Tone ToneOfDevice(const Json& device) {
  const std::string state = Text(device, "state");
  if (state == "disabled") return Tone::faint;
  if (!IsAlive(device)) return Tone::alarm;
  return device.at("advice").empty() ? Tone::plain : Tone::warning;
}

std::string LineTable(const Json& lines, const TableView& view, Order order) {
  static const std::vector<TableColumn> kColumns = {
      {.title = "line"},
      {.title = "port"},
      {.title = "use", .right = true},
      {.title = "exchanges", .right = true},
      {.title = "no reply", .right = true},
      {.title = "corrupt", .right = true, .spare = true},
      {.title = "late", .right = true, .spare = true},
      {.title = "online", .right = true}};
  std::vector<TableRow> rows;
  for (const Json& line : lines) {
    const std::string port = Text(line, "port_state") + (IsEchoLost(line) ? ", no echo" : "");
    const Json& outcomes = line.at("outcomes");
    rows.push_back({{Text(line, "name"), port, UseText(line), NumberText(line, "exchanges"),
                     NumberText(outcomes, "no_reply"), NumberText(outcomes, "corrupt"),
                     NumberText(line, "late"),
                     fmt::format("{} of {}", Alive(line), line.at("devices").size())},
                    ToneOfLine(line)});
  }
  if (order == Order::trouble) MostTroubleFirst(rows);
  return RenderTable(kColumns, rows, view);
}

std::string DeviceTable(const Json& lines, const TableView& view, Order order) {
  static const std::vector<TableColumn> kColumns = {
      {.title = "device"},
      {.title = "state"},
      {.title = "last"},
      {.title = "answered", .right = true},
      {.title = "ok", .right = true},
      {.title = "mean", .right = true, .spare = true},
      {.title = "p99", .right = true},
      {.title = "retries", .right = true, .spare = true},
      {.title = "missed", .right = true, .spare = true}};
  std::vector<TableRow> rows;
  for (const Json& line : lines) {
    for (const Json& device : line.at("devices")) {
      const Json& trips = device.at("round_trips");
      const bool none = Number(trips, "count") == 0;
      rows.push_back({{Text(line, "name") + "." + Text(device, "name"), Text(device, "state"),
                       Text(device, "last_outcome"), MillisecondsText(device.at("age_ms")),
                       ShareText(Number(device.at("outcomes"), "ok"), Number(device, "exchanges")),
                       none ? "-" : RoundTripText(trips.at("mean_us").get<double>()),
                       none ? "-" : RoundTripText(trips.at("p99_us").get<double>()),
                       NumberText(device, "retries"), NumberText(device, "missed")},
                      ToneOfDevice(device)});
    }
  }
  if (order == Order::trouble) MostTroubleFirst(rows);
  return RenderTable(kColumns, rows, view);
}

}  // namespace baudgate
