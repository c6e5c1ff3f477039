// The members of what is configured, for comparison: whoever adds one to a struct has to name it
// here, or this does not compile. Places in the file are left out.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <string_view>
#include <tuple>
#include <utility>
#include <vector>

#include "config/model/config.h"

namespace baudgate::reload {

template <typename... Members>
struct Named {
  std::array<std::string_view, sizeof...(Members)> names;
  std::tuple<const Members&...> values;
};

template <typename... Members>
auto Name(std::array<std::string_view, sizeof...(Members)> names, const Members&... members) {
  return Named<Members...>{names, std::tie(members...)};
}

inline auto MembersOf(const config::Options& its) { return Name({"options"}, its.all()); }

inline auto MembersOf(const config::Rs485& its) {
  const auto& [enabled, before, after, high, receive] = its;
  return Name({"enabled", "delay_before_send", "delay_after_send", "rts_active_high",
               "receive_while_sending"},
              enabled, before, after, high, receive);
}

inline auto MembersOf(const config::SerialSettings& its) {
  const auto& [baud, data, parity, stop, software, rtscts, low_latency, rs485] = its;
  return Name({"baud", "data_bits", "parity", "stop_bits", "software_parity", "rtscts",
               "low_latency", "rs485"},
              baud, data, parity, stop, software, rtscts, low_latency, rs485);
}

inline auto MembersOf(const config::Sentinel& its) {
  const auto& [value, quality] = its;
  return Name({"value", "quality"}, value, quality);
}

inline auto MembersOf(const config::OnFault& its) {
  const auto& [kind, value] = its;
  return Name({"kind", "value"}, kind, value);
}

inline auto MembersOf(const config::Simulate& its) {
  const auto& [low, high, text] = its;
  return Name({"low", "high", "text"}, low, high, text);
}

/// By name, not by number.
inline auto MembersOf(const config::AllowWhen& its) {
  const auto& [point, is, only, device, index, mark] = its;
  return Name({"point", "is", "for"}, point, is, only);
}

inline auto MembersOf(const config::Writing& its) {
  const auto& [allowed, min, max, step, decimals, select, select_time, allow_when] = its;
  return Name({"write", "min", "max", "step", "decimals", "select", "select_time", "allow_when"},
              allowed, min, max, step, decimals, select, select_time, allow_when);
}

inline auto MembersOf(const config::PointEvent& its) {
  const auto& [on, value, hysteresis, delay, text, alarm, normal, record] = its;
  return Name({"on", "value", "hysteresis", "delay", "text", "alarm", "normal", "record"}, on,
              value, hysteresis, delay, text, alarm, normal, record);
}

inline auto MembersOf(const config::EventText& its) {
  const auto& [channel, code, state, text, alarm, until, record] = its;
  return Name({"channel", "code", "state", "text", "alarm", "until", "record"}, channel, code,
              state, text, alarm, until, record);
}

inline auto MembersOf(const config::Record& its) {
  const auto& [name, points] = its;
  return Name({"name", "points"}, name, points);
}

inline auto MembersOf(const config::Identity& its) {
  const auto& [names, others, ignore] = its;
  return Name({"names", "others", "identity"}, names, others, ignore);
}

inline auto MembersOf(const config::Point& its) {
  const auto& [name, read, write, type, length, unit, access, writing, group, modbus, table, scale,
               offset, sentinels, on_fault, jump, recheck, deadband, events, simulate, description,
               mark] = its;
  return Name({"name",     "read",  "write",   "type",     "length", "unit",     "access",
               "write",    "group", "modbus",  "table",    "scale",  "offset",   "sentinels",
               "on_fault", "jump",  "recheck", "deadband", "events", "simulate", "description"},
              name, read, write, type, length, unit, access, writing, group, modbus, table, scale,
              offset, sentinels, jump, on_fault, recheck, deadband, events, simulate, description);
}

inline auto MembersOf(const config::Device& its) {
  const auto& [name, address, protocol, profile, title, unit, enabled, trust_order, poll, slow,
               daily, max_age, dead_age, on_bad, word_order, retries, timing, serial, identity,
               options, points, events, point_events, event_texts, records, mark] = its;
  return Name(
      {"name",        "address",      "protocol",    "profile", "title",    "unit",     "enabled",
       "trust_order", "poll",         "slow",        "daily",   "max_age",  "dead_age", "on_bad",
       "word_order",  "retries",      "timing",      "serial",  "identity", "options",  "points",
       "events",      "point_events", "event texts", "records"},
      name, address, protocol, profile, title, unit, enabled, trust_order, poll, slow, daily,
      max_age, dead_age, on_bad, word_order, retries, timing, serial, identity, options, points,
      events, point_events, event_texts, records);
}

inline auto MembersOf(const config::Line& its) {
  const auto& [name, port, serial, protocol, tcp, timing, retries, echo, pipeline, options, devices,
               mark] = its;
  return Name({"name", "port", "serial", "protocol", "protocol", "timing", "retries", "echo",
               "pipeline", "options", "devices"},
              name, port, serial, protocol, tcp, timing, retries, echo, pipeline, options, devices);
}

inline auto MembersOf(const config::Network& its) {
  const auto& [text, bytes, prefix] = its;
  return Name({"network"}, text);
}

inline auto MembersOf(const config::ClientPriority& its) {
  const auto& [from, priority] = its;
  return Name({"from", "priority"}, from, priority);
}

inline auto MembersOf(const config::FunctionPriority& its) {
  const auto& [codes, priority] = its;
  return Name({"codes", "priority"}, codes, priority);
}

inline auto MembersOf(const config::Listener& its) {
  const auto& [host, port, path, serial, echo, protocol, allow, permit, priority, clients,
               functions, errors, broadcast, holes, max_clients, idle_timeout, mark] = its;
  return Name(
      {"host", "port", "path", "serial", "echo", "protocol", "allow", "write", "priority",
       "clients", "functions", "errors", "broadcast", "holes", "max_clients", "idle_timeout"},
      host, port, path, serial, echo, protocol, allow, permit, priority, clients, functions, errors,
      broadcast, holes, max_clients, idle_timeout);
}

/// By name, not by number.
inline auto MembersOf(const config::Route& its) {
  const auto& [first, last, line, line_index, host, port, remap, deadline, mark] = its;
  return Name({"units", "units", "line", "host", "port", "remap", "deadline"}, first, last, line,
              host, port, remap, deadline);
}

inline auto MembersOf(const config::Modbus& its) {
  const auto& [enabled, listen, routes] = its;
  return Name({"enabled", "listen", "routes"}, enabled, listen, routes);
}

inline auto MembersOf(const config::DdsSecurity& its) {
  const auto& [ca, permissions_ca, identity, key, password, governance, permissions, keys] = its;
  return Name(
      {"ca", "permissions_ca", "identity", "key", "password_file", "governance", "permissions"}, ca,
      permissions_ca, identity, key, password, governance, permissions);
}

inline auto MembersOf(const config::Dds& its) {
  const auto& [enabled, domain, interfaces, shared_memory, multicast, peers, servers, profiles,
               process, heartbeat, security, write] = its;
  return Name({"enabled", "domain", "interfaces", "shared_memory", "multicast", "peers",
               "discovery_servers", "profiles", "process", "heartbeat", "security", "write"},
              enabled, domain, interfaces, shared_memory, multicast, peers, servers, profiles,
              process, heartbeat, security, write);
}

inline auto MembersOf(const config::Events& its) {
  const auto& [given, directory] = its;
  return Name({"events", "directory"}, given, directory);
}

/// Without its device and point, which are numbers.
inline auto MembersOf(const config::HistoryPoint& its) {
  const auto& [device, point, every, deadband, max_gap, swinging_door] = its;
  return Name({"every", "deadband", "max_gap", "swinging_door"}, every, deadband, max_gap,
              swinging_door);
}

/// Without its points, which are compared by name.
inline auto MembersOf(const config::History& its) {
  const auto& [directory, limit, keep, points] = its;
  return Name({"directory", "limit", "keep"}, directory, limit, keep);
}

/// Without lines and history, of which more is said.
inline auto MembersOf(const config::Config& its) {
  const auto& [name, recordings, state, events, history, audit, socket, modbus, dds, lines] = its;
  return Name({"gateway.name", "gateway.recordings", "gateway.state", "events", "gateway.audit",
               "gateway.socket", "modbus", "dds"},
              name, recordings, state, events, audit, socket, modbus, dds);
}

template <typename T>
concept HasMembers = requires(const T& its) {
  MembersOf(its);
};

template <typename T>
bool Same(const T& a, const T& b);

template <typename T>
bool Same(const std::vector<T>& a, const std::vector<T>& b) {
  if (a.size() != b.size()) return false;
  for (std::size_t i = 0; i < a.size(); ++i) {
    if (!Same(a[i], b[i])) return false;
  }
  return true;
}

template <typename T>
bool Same(const std::optional<T>& a, const std::optional<T>& b) {
  return a.has_value() == b.has_value() && (!a || Same(*a, *b));
}

/// Calls `tell` with the name of each member that differs.
template <typename T, typename Tell>
void EachDifferent(const T& a, const T& b, Tell tell) {
  const auto of_a = MembersOf(a);
  const auto of_b = MembersOf(b);
  [&]<std::size_t... At>(std::index_sequence<At...>) {
    const auto look = [&](std::string_view name, const auto& one, const auto& other) {
      if (!Same(one, other)) tell(name);
    };
    (look(of_a.names[At], std::get<At>(of_a.values), std::get<At>(of_b.values)), ...);
  }
  (std::make_index_sequence<of_a.names.size()>());
}

template <typename T>
bool Same(const T& a, const T& b) {
  if constexpr (HasMembers<T>) {
    bool same = true;
    EachDifferent(a, b, [&same](std::string_view) { same = false; });
    return same;
  } else {
    return a == b;
  }
}

}  // namespace baudgate::reload
