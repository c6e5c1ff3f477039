// SPDX-License-Identifier: Apache-2.0
#include "gateway/outputs/modbus/service/traffic_json.h"

#include <utility>

#include "gateway/outputs/modbus/service/diagnose_modbus.h"
#include "gateway/outputs/status/value_json.h"

namespace baudgate::control {
namespace {

using Json = nlohmann::ordered_json;

Json ClientJson(const modbus::ClientStatus& client, WallTime now) {
  return {{"peer", client.peer},
          {"listener", client.listener},
          {"priority", config::Name(client.priority)},
          {"since", TimeJson(client.since)},
          {"last_request", TimeJson(client.last_request)},
          {"age_ms", AgeJson(client.last_request, now)},
          {"requests", client.requests},
          {"exceptions", client.exceptions},
          {"bytes_in", client.bytes_in},
          {"bytes_out", client.bytes_out},
          {"outstanding", client.outstanding}};
}

Json MasterJson(const modbus::MasterStatus& master, WallTime now) {
  return {{"port", master.port},
          {"port_state", master.is_open ? "open" : "closed"},
          {"port_text", master.text},
          {"port_since", TimeJson(master.since)},
          {"frames", master.frames},
          {"damaged", master.damaged},
          {"echoes", master.echoes},
          {"last_frame", TimeJson(master.last_frame)},
          {"age_ms", AgeJson(master.last_frame, now)},
          {"advice", DiagnoseMaster(master, now)}};
}

Json RouteJson(const modbus::RouteStatus& route, Now now) {
  Json json;
  AddFields(route, now, json);
  json["advice"] = DiagnoseRoute(route, now.wall);
  Json& units = json["by_unit"] = Json::array();
  for (const auto& [unit, counters] : route.by_unit) {
    AddFields(counters, now, units.emplace_back(Json{{"unit", unit}}));
  }
  return json;
}

std::string SentenceOf(const modbus::ClosedListener& listener) {
  if (listener.is_open) return "no client reaches it: " + listener.why;
  return "is not open: " + listener.why + "; tried again each second";
}

}  // namespace

Json TrafficJson(const modbus::TrafficStatus& traffic, const std::string& line, Now now) {
  Json clients = Json::array();
  Json masters = Json::array();
  Json closed = Json::array();
  Json others = Json::array();
  Json routes = Json::array();
  if (line.empty()) {
    for (const modbus::ClosedListener& listener : traffic.closed) {
      closed.push_back({{"listener", listener.place}, {"advice", {SentenceOf(listener)}}});
    }
    for (const modbus::OtherSpeaker& other : traffic.others) {
      others.push_back({{"listener", other.listener},
                        {"peer", other.peer},
                        {"framing", Name(other.heard)},
                        {"times", other.times},
                        {"last", TimeJson(other.last)},
                        {"advice", {DiagnoseOther(other, now.wall)}}});
    }
    for (const modbus::ClientStatus& client : traffic.clients) {
      clients.push_back(ClientJson(client, now.wall));
    }
    for (const modbus::MasterStatus& master : traffic.masters) {
      masters.push_back(MasterJson(master, now.wall));
    }
  }
  for (const modbus::RouteStatus& route : traffic.routes) {
    if (line.empty() || route.target == "line " + line) routes.push_back(RouteJson(route, now));
  }
  return {{"clients", std::move(clients)},
          {"masters", std::move(masters)},
          {"closed", std::move(closed)},
          {"other_framing", std::move(others)},
          {"routes", std::move(routes)},
          {"labels", {{"route", LabelsJson<modbus::RouteCounters>()}}}};
}

}  // namespace baudgate::control
