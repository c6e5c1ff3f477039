// SPDX-License-Identifier: Apache-2.0
#include "gateway/tools/cli/client/traffic_view.h"

#include <fmt/format.h>

#include <cstdint>

#include "gateway/base/shown.h"
#include "gateway/tools/cli/client/control_client.h"

namespace baudgate::tools {
namespace {

using Json = nlohmann::ordered_json;

std::string VisitText(const Json& visit) {
  return fmt::format("{} since {}, {} bytes to the port, {} from it", Text(visit, "client"),
                     TextOf(visit, "since"), Number(visit, "to_port"), Number(visit, "from_port"));
}

/// Returns a text about a port that network clients can use. Example: "served at 127.0.0.1:4001
/// (raw): 10.0.0.7:40112 since …".
std::string ServiceText(const Json& service) {
  std::string text = fmt::format("{} at {} ({})", Text(service, "use"), Text(service, "at"),
                                 Text(service, "mode"));
  if (!Text(service, "trouble").empty()) return text + ": " + Text(service, "trouble");
  if (const std::string until = TextOf(service, "open_until"); !until.empty()) {
    text += " until " + until;
  }
  if (service.at("client").is_object()) return text + ": " + VisitText(service.at("client"));
  if (!service.at("last").is_object()) return text + ": no client yet";
  const Json& last = service.at("last");
  return text + ": no client is connected; the last client was " + VisitText(last) + ", until " +
         TextOf(last, "until") + ": " + Text(last, "why");
}

}  // namespace

std::string ControlLinesText(const Json& modem) {
  if (!modem.is_object()) return {};
  constexpr std::pair<const char*, const char*> kLines[] = {{"dtr", "DTR"}, {"rts", "RTS"},
                                                            {"cts", "CTS"}, {"dsr", "DSR"},
                                                            {"dcd", "DCD"}, {"ring", "RI"}};
  std::string text;
  for (const auto& [key, name] : kLines) {
    if (modem.value(key, false)) text += (text.empty() ? "" : " ") + std::string(name);
  }
  return text.empty() ? "no control line is on" : text;
}

std::vector<std::pair<std::string, std::string>> PortFacts(const Json& line) {
  std::vector<std::pair<std::string, std::string>> facts;
  const std::string lines = ControlLinesText(line.value("modem", Json()));
  if (!lines.empty()) facts.emplace_back("lines", lines);
  for (const Json& service : line.value("services", Json::array())) {
    facts.emplace_back("clients", ServiceText(service));
  }
  return facts;
}

namespace {

using Json = nlohmann::ordered_json;

std::string AgeText(const Json& json) {
  const Json& age = json.at("age_ms");
  return age.is_null() ? "-" : FormatAge(std::chrono::milliseconds(age.get<std::int64_t>()));
}

std::string Milliseconds(const Json& json, const char* key) {
  return fmt::format("{:.1f} ms", json.at(key).get<double>() / 1e3);
}

/// Returns the number of requests that failed, but not by a fault of the client.
std::uint64_t Failed(const Json& route) {
  return Number(route, "no_reply") + Number(route, "expired") + Number(route, "busy");
}

/// `labels` contains the title of each counter. Counters after the fourth, except times, are left
/// out if they do not fit.
std::string RouteTable(const Json& routes, const Json& labels, const TableView& view) {
  constexpr std::size_t kSpare = 6;
  std::vector<TableColumn> columns = {{.title = "units"}, {.title = "route to"}};
  for (const auto& [key, label] : labels.items()) {
    const bool spare = columns.size() >= kSpare && !key.ends_with("_us");
    columns.push_back({.title = label, .right = true, .spare = spare});
  }
  std::vector<TableRow> rows;
  const auto add = [&](const std::string& units, const std::string& target, const Json& of) {
    TableRow row{{units, target}, Failed(of) > 0 ? Tone::warning : Tone::plain};
    for (const auto& [key, label] : labels.items()) {
      row.cells.push_back(key.ends_with("_us") ? Milliseconds(of, key.c_str())
                                               : NumberText(of, key.c_str()));
    }
    rows.push_back(std::move(row));
  };
  for (const Json& route : routes) {
    add(Text(route, "units"), Text(route, "target"), route);
    const Json& units = route.at("by_unit");
    if (units.size() < 2) continue;
    for (const Json& unit : units) add("  " + NumberText(unit, "unit"), "", unit);
  }
  return RenderTable(columns, rows, view);
}

std::string MasterTable(const Json& masters, const TableView& view) {
  static const std::vector<TableColumn> kColumns = {{.title = "master on"},
                                                    {.title = "port"},
                                                    {.title = "frames", .right = true},
                                                    {.title = "damaged", .right = true},
                                                    {.title = "last"}};
  std::vector<TableRow> rows;
  for (const Json& master : masters) {
    const bool open = Text(master, "port_state") == "open";
    const Tone well = master.at("advice").empty() ? Tone::plain : Tone::warning;
    rows.push_back({{Text(master, "port"), Text(master, "port_state"), NumberText(master, "frames"),
                     NumberText(master, "damaged"), AgeText(master)},
                    open ? well : Tone::alarm});
  }
  return RenderTable(kColumns, rows, view);
}

std::string ClientTable(const Json& clients, const TableView& view) {
  static const std::vector<TableColumn> kColumns = {
      {.title = "client"},
      {.title = "on"},
      {.title = "priority"},
      {.title = "requests", .right = true},
      {.title = "exceptions", .right = true},
      {.title = "waiting", .right = true},
      {.title = "bytes in", .right = true, .spare = true},
      {.title = "bytes out", .right = true, .spare = true},
      {.title = "last"}};
  std::vector<TableRow> rows;
  for (const Json& client : clients) {
    rows.push_back({{Text(client, "peer"), Text(client, "listener"), Text(client, "priority"),
                     NumberText(client, "requests"), NumberText(client, "exceptions"),
                     NumberText(client, "outstanding"), NumberText(client, "bytes_in"),
                     NumberText(client, "bytes_out"), AgeText(client)},
                    Tone::plain});
  }
  return RenderTable(kColumns, rows, view);
}

}  // namespace

std::string RenderTraffic(const Json& modbus, const TableView& view) {
  const Json& routes = PartOf(modbus, "routes");
  const Json& masters = PartOf(modbus, "masters");
  const Json& clients = PartOf(modbus, "clients");
  std::string text;
  if (!routes.empty()) text += "\n" + RouteTable(routes, modbus.at("labels").at("route"), view);
  if (!masters.empty()) text += "\n" + MasterTable(masters, view);
  if (!clients.empty()) text += "\n" + ClientTable(clients, view);
  return text;
}

}  // namespace baudgate::tools
