// SPDX-License-Identifier: Apache-2.0
#include "gateway/tools/cli/ports/ports.h"

#include <fmt/format.h>

#include <sstream>

#include "gateway/base/port_holders.h"
#include "gateway/base/shown.h"
#include "gateway/tools/cli/client/control_client.h"
#include "gateway/tools/cli/client/port_text.h"
#include "gateway/tools/cli/ports/found_ports.h"
#include "gateway/tools/terminal/text_table.h"

namespace baudgate {
namespace {

using Json = nlohmann::ordered_json;

constexpr char kNoPorts[] =
    "This machine has no serial port. Plug an adapter in; if none appears, `sudo dmesg | tail` "
    "shows what the kernel reports. Serial servers in the network need no port: "
    "port: tcp://HOST:PORT.\n";
/// FTDI adapters begin with 16 ms, which is long between two frames.
constexpr int kShortLatency = 1;

struct Row {
  FoundPort port;
  std::vector<std::string> held_by;
  bool ours = false;  ///< the gateway has it
  Json modem;         ///< of ours: its control lines; null: not known
  std::vector<std::string> advice;
};

Json Gateway(const PortsPlace& place) { return place.status ? place.status() : Json(); }

/// "line bay of substation-7 (open: DTR RTS CTS)".
void AddOurs(const PortsPlace& place, const Json& status, Row& row) {
  const std::string gateway = status.value("gateway", "the gateway");
  const auto add = [&](const Json& user, const std::string& what) {
    if (PortNameOf(place.root, user.value("port", "")) != row.port.name) return;
    const std::string state = user.value("port_state", "");
    const std::string lines = ControlLinesText(user.value("modem", Json()));
    row.held_by.push_back(
        fmt::format("{} of {} ({}{})", what, gateway, state, lines.empty() ? "" : ": " + lines));
    row.ours = row.ours || state == "open";
    if (user.contains("modem")) row.modem = user.at("modem");
    if (state == "closed") row.advice.push_back(what + ": " + user.value("port_text", ""));
  };
  for (const Json& line : status.value("lines", Json::array())) {
    add(line, "line " + line.value("name", ""));
  }
  const Json modbus = status.value("modbus", Json::object());
  for (const Json& master : modbus.value("masters", Json::array())) add(master, "a Modbus master");
}

void AddPrograms(const PortHolders& holders, Row& row) {
  const auto found = holders.by_port.find(row.port.name);
  if (found == holders.by_port.end()) return;
  for (const PortHolders::Program& program : found->second) {
    if (row.ours && program.name == "baudgate") continue;
    row.held_by.push_back(fmt::format("{} (pid {})", program.name, program.pid));
  }
}

void AddAdvice(const PortsPlace& place, Row& row) {
  const FoundPort& port = row.port;
  if (const auto file = ReadPortFile(place.root, port.path())) {
    for (const Person& person : place.people) {
      if (!MayUse(person, *file)) row.advice.push_back(HowToMend(person, *file));
    }
  }
  if (port.twin) {
    row.advice.push_back(fmt::format(
        "another adapter here has the same serial number {}: only names by place tell them apart",
        port.serial));
  }
  if (port.latency_ms.value_or(0) > kShortLatency && !row.ours) {
    row.advice.push_back(fmt::format(
        "the adapter holds bytes back for up to {} ms: the gateway ends that while it has the port "
        "(low_latency); for others: echo 1 | sudo tee /sys/class/tty/{}/device/latency_timer",
        *port.latency_ms, port.name));
  }
}

std::vector<Row> Look(const PortsPlace& place, const PortHolders& holders) {
  const Json status = Gateway(place);
  std::vector<Row> rows;
  for (FoundPort& port : FindPorts(place.root)) {
    Row& row = rows.emplace_back(Row{std::move(port), {}, false, {}, {}});
    if (status.is_object()) AddOurs(place, status, row);
    AddPrograms(holders, row);
    AddAdvice(place, row);
  }
  return rows;
}

std::string Joined(const std::vector<std::string>& texts) {
  std::string all;
  for (const std::string& text : texts) all += (all.empty() ? "" : ", ") + text;
  return all;
}

Json TextOrNull(const std::string& text) { return text.empty() ? Json(nullptr) : Json(text); }

Json ToJson(const Row& row) {
  const FoundPort& port = row.port;
  Json usb;
  if (port.is_usb()) {
    usb = {{"at", port.at},
           {"vendor", port.vendor},
           {"product", port.product},
           {"maker", TextOrNull(port.maker)},
           {"model", TextOrNull(port.model)},
           {"serial", TextOrNull(port.serial)},
           {"interface", TextOrNull(port.interface)}};
  }
  return {{"port", port.path()},
          {"driver", TextOrNull(port.driver)},
          {"usb", std::move(usb)},
          {"names", port.links},
          {"latency_ms", port.latency_ms ? Json(*port.latency_ms) : Json(nullptr)},
          {"held_by", row.held_by},
          {"modem", row.modem},
          {"advice", row.advice}};
}

std::string AdapterText(const FoundPort& port) {
  if (!port.is_usb()) return {};
  const std::string name = port.model.empty() ? port.maker : port.model;
  return fmt::format("{}:{}{}{}", port.vendor, port.product, name.empty() ? "" : " ", name);
}

void PrintTable(const std::vector<Row>& rows, std::ostream& out) {
  config::TextTable table({"port", "driver", "adapter", "held by", "name that stays"});
  for (const Row& row : rows) {
    table.Add({row.port.path(), row.port.driver, AdapterText(row.port), Joined(row.held_by),
               row.port.links.empty() ? "" : row.port.links.front()});
  }
  table.PrintAligned(out);
  const char* before = "\n";
  for (const Row& row : rows) {
    for (const std::string& advice : row.advice) {
      out << std::exchange(before, "") << row.port.name << ": " << advice << '\n';
    }
  }
}

}  // namespace

int ShowPorts(bool json, const PortsPlace& place, std::ostream& out) {
  const PortHolders holders = FindHolders(place.root);
  const std::vector<Row> rows = Look(place, holders);
  if (json) {
    Json ports = Json::array();
    for (const Row& row : rows) ports.push_back(ToJson(row));
    const Json all = {{"ports", std::move(ports)}, {"all_holders_seen", holders.all_seen}};
    out << all.dump(2, ' ', false, Json::error_handler_t::replace) << '\n';
    return 0;
  }
  if (rows.empty()) {
    out << kNoPorts;
    return 0;
  }
  PrintTable(rows, out);
  if (!holders.all_seen) out << "\nPrograms of other users are seen with sudo only.\n";
  return 0;
}

int RunPorts(const PortsOptions& options, std::ostream& out) {
  PortsPlace place;
  place.people = PeopleHere();
  place.status = [&options] {
    Json status;
    std::ostringstream ignored;  // that none runs is no trouble
    if (Ask(options.socket, {{"command", "status"}}, status, ignored) != 0) return Json();
    return status;
  };
  return ShowPorts(options.json, place, out);
}

}  // namespace baudgate
