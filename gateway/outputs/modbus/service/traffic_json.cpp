// SPDX-License-Identifier: Apache-2.0
#include "gateway/outputs/modbus/service/traffic_json.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "gateway/base/shown.h"
#include "gateway/outputs/status/value_json.h"

namespace baudgate::modbus {
namespace {

using Sentences = std::vector<std::string>;

/// Trouble of a route that is older than this is not reported.
constexpr Duration kRecentTrouble = 10min;
constexpr std::size_t kMostUnits = 8;
constexpr const char* kCheckWire = "check bit rate, parity and wiring";

/// Returns a sentence about an open port without frames; empty: the last frame, or the opening of
/// the port, was less than kSilentMaster ago.
std::string Silence(const modbus::MasterStatus& master, WallTime now) {
  const bool never = master.last_frame == WallTime{};
  const Duration silent = now - (never ? master.since : master.last_frame);
  if (silent < kSilentMaster) return {};
  if (!never)
    return fmt::format("no request has come for {}: does the master still poll?",
                       FormatAge(silent));
  if (master.damaged == 0) {
    return fmt::format("no byte has come for {}: does the master poll, and are A and B swapped?",
                       FormatAge(silent));
  }
  return fmt::format("bytes arrive, but no complete request has come for {}: {} ({})",
                     FormatAge(silent), kCheckWire, master.text);
}

std::uint64_t Answered(const modbus::RouteCounters& unit) { return unit.ok + unit.refused; }

/// Returns sentences about units that have never answered. The advice depends on whether another
/// unit of the route has answered.
Sentences DeadUnits(const modbus::RouteStatus& route) {
  const auto good = std::ranges::find_if(
      route.by_unit, [](const auto& unit) { return Answered(unit.second) > 0; });
  Sentences found;
  for (const auto& [number, unit] : route.by_unit) {
    if (Answered(unit) > 0 || unit.no_reply == 0 || found.size() == kMostUnits) continue;
    const std::string right =
        good == route.by_unit.end()
            ? "if no unit of " + route.target + " answers, check port, wiring, bit rate and parity"
            : fmt::format("{} works, because unit {} answers", route.target, good->first);
    found.push_back(
        fmt::format("unit {} has never answered ({}; last failure of the route: {}): check its "
                    "power, address and wiring; {}",
                    number, Plural(unit.requests, "request"), route.last_trouble, right));
  }
  return found;
}

std::string Failures(const modbus::RouteStatus& route, WallTime now) {
  const std::uint64_t failed = route.no_reply + route.expired + route.busy;
  std::string text =
      fmt::format("{} of {} requests had no good reply, the last {} ago: {}", failed,
                  route.requests, FormatAge(now - route.last_trouble_at), route.last_trouble);
  if (2 * route.busy > failed)
    return text +
           "; clients send more requests than the line can carry: let the clients poll less often";
  if (2 * route.expired > failed) {
    return text +
           "; the line is too busy: let clients poll less often, or raise the route's deadline";
  }
  return text + "; check power and wiring of the units";
}

}  // namespace

Sentences DiagnoseMaster(const modbus::MasterStatus& master, WallTime now) {
  if (!master.is_open) {
    return {fmt::format("port closed for {}: {}; the gateway tries again until the port opens",
                        FormatAge(now - master.since), master.text)};
  }
  if (master.other) {
    return {"the requests of the master are not understood: " +
            ExplainOther(*master.other, master.expected)};
  }
  Sentences found;
  if (master.echoes > 0) {
    found.push_back(fmt::format(
        "the adapter has echoed {} of the gateway's own replies: set 'echo: strip' at the listener",
        master.echoes));
  }
  const std::string silence = Silence(master, now);
  const auto heard = static_cast<double>(master.frames + master.damaged);
  if (!silence.empty()) {
    found.push_back(silence);
  } else if (heard > 0 && static_cast<double>(master.damaged) / heard >= kNotableDamage) {
    found.push_back(fmt::format("{} of {} frames were damaged and not answered: {} ({})",
                                master.damaged, master.frames + master.damaged, kCheckWire,
                                master.text));
  }
  return found;
}

std::string DiagnoseOther(const modbus::OtherSpeaker& other, WallTime now) {
  return fmt::format("client {} was disconnected{}, {} ago: {}", other.peer,
                     other.times == 1 ? "" : fmt::format(" ({} times)", other.times),
                     FormatAge(now - other.last), ExplainOther(other.heard, other.expected));
}

Sentences DiagnoseRoute(const modbus::RouteStatus& route, WallTime now) {
  Sentences found;
  if (now - route.last_trouble_at <= kRecentTrouble) {
    found = DeadUnits(route);
    if (found.empty()) found.push_back(Failures(route, now));
  }
  if (route.late > 0) {
    found.push_back(fmt::format(
        "{} replies came after their deadline and were dropped: raise the route's deadline",
        route.late));
  }
  return found;
}

namespace {

using Json = nlohmann::ordered_json;

Json ClientJson(const modbus::ClientStatus& client, WallTime now) {
  return {{"peer", client.peer},
          {"listener", client.listener},
          {"priority", config::Name(client.priority)},
          {"since", status::TimeJson(client.since)},
          {"last_request", status::TimeJson(client.last_request)},
          {"age_ms", status::AgeJson(client.last_request, now)},
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
          {"port_since", status::TimeJson(master.since)},
          {"frames", master.frames},
          {"damaged", master.damaged},
          {"echoes", master.echoes},
          {"last_frame", status::TimeJson(master.last_frame)},
          {"age_ms", status::AgeJson(master.last_frame, now)},
          {"advice", DiagnoseMaster(master, now)}};
}

Json RouteJson(const modbus::RouteStatus& route, Now now) {
  Json json;
  status::AddFields(route, now, json);
  json["advice"] = DiagnoseRoute(route, now.wall);
  Json& units = json["by_unit"] = Json::array();
  for (const auto& [unit, counters] : route.by_unit) {
    status::AddFields(counters, now, units.emplace_back(Json{{"unit", unit}}));
  }
  return json;
}

std::string SentenceOf(const modbus::ClosedListener& listener) {
  if (listener.is_open) return "no client can reach this listener: " + listener.why;
  return "is not open: " + listener.why + "; the gateway tries again each second";
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
                        {"last", status::TimeJson(other.last)},
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
          {"labels", {{"route", status::LabelsJson<modbus::RouteCounters>()}}}};
}

}  // namespace baudgate::modbus
