// SPDX-License-Identifier: Apache-2.0
#include "gateway/outputs/modbus/service/modbus_difference.h"

#include <algorithm>
#include <string_view>
#include <tuple>
#include <utility>

#include "config/model/fields.h"
#include "gateway/base/shown.h"
#include "gateway/base/text.h"

namespace baudgate::reload {

namespace {

using config::Listener;
using config::Modbus;
using config::Route;

std::string NameOf(const Route& route) {
  return route.Units() + " to " +
         (route.line.empty() ? HostAndPort(route.host, route.port) : route.line);
}

/// `Places` gives out each index of the running list at most once, so that two new entries cannot
/// match the same old entry.
class Places {
 public:
  explicit Places(std::size_t count) : free_(count, true) {}
  template <typename Fits>
  std::optional<std::size_t> Take(Fits fits) {
    for (std::size_t place = 0; place < free_.size(); ++place) {
      if (!free_[place] || !fits(place)) continue;
      free_[place] = false;
      return place;
    }
    return std::nullopt;
  }
  bool IsFree(std::size_t place) const { return free_[place]; }

 private:
  std::vector<bool> free_;
};

void CompareListeners(const std::vector<Listener>& running, const std::vector<Listener>& next,
                      std::vector<ListenerChange>& changes) {
  Places places(running.size());
  for (const Listener& is : next) {
    ListenerChange& change = changes.emplace_back();
    change.place = is.Address();
    change.was = places.Take([&](std::size_t at) { return running[at].Address() == is.Address(); });
    change.action = Action::added;
    if (!change.was) continue;
    change.what = DifferentKeys(running[*change.was], is);
    change.action = change.what.empty() ? Action::same : Action::restarted;
  }
  for (std::size_t at = 0; at < running.size(); ++at) {
    if (places.IsFree(at)) changes.push_back({running[at].Address(), Action::removed, {}, at});
  }
}

bool LeadsTheSame(Route was, const Route& is) {
  was.alarms = is.alarms;
  return Same(was, is);
}

void CompareRoutes(const std::vector<Route>& running, const std::vector<Route>& next,
                   std::vector<RouteChange>& changes) {
  Places places(running.size());
  for (const Route& is : next) {
    RouteChange& change = changes.emplace_back();
    change.route = NameOf(is);
    change.was = places.Take([&](std::size_t at) { return Same(running[at], is); });
    change.action = change.was ? Action::same : Action::added;
  }
  for (std::size_t i = 0; i < next.size(); ++i) {
    if (changes[i].was) continue;
    changes[i].was =
        places.Take([&](std::size_t at) { return LeadsTheSame(running[at], next[i]); });
    if (changes[i].was) changes[i].action = Action::in_place;
  }
  for (std::size_t i = 0; i < next.size(); ++i) {
    if (changes[i].was) continue;
    const auto was =
        places.Take([&](std::size_t at) { return NameOf(running[at]) == changes[i].route; });
    if (!was) continue;
    changes[i].action = Action::restarted;
    changes[i].what = DifferentKeys(running[*was], next[i]);
  }
  for (std::size_t at = 0; at < running.size(); ++at) {
    if (places.IsFree(at)) changes.push_back({NameOf(running[at]), Action::removed, {}, {}});
  }
}

bool IsAny(const std::string& host) { return host == "0.0.0.0" || host == "::"; }
bool IsIpv6(const std::string& host) { return host.find(':') != std::string::npos; }

/// True if `other` cannot be bound while `one` is open: if a socket listens on a port at one
/// address, Linux does not bind this port at "0.0.0.0" or "::", and vice versa. "::" includes IPv4;
/// "0.0.0.0" does not include IPv6.
bool Blocks(const Listener& one, const Listener& other) {
  if (one.is_serial() || other.is_serial() || one.port != other.port || one.port == 0) return false;
  if (one.host == "::" || other.host == "::") return true;
  return (IsAny(one.host) || IsAny(other.host)) && IsIpv6(one.host) == IsIpv6(other.host);
}

void FindBlocked(const std::vector<Listener>& running, const std::vector<Listener>& next,
                 ModbusDifference& difference) {
  for (std::size_t i = 0; i < next.size(); ++i) {
    if (difference.listeners[i].action != Action::added) continue;
    for (const ListenerChange& ends : difference.listeners) {
      if (ends.action != Action::removed || !Blocks(running[*ends.was], next[i])) continue;
      difference.restart.push_back("modbus.listen from " + ends.place + " to " + next[i].Address());
    }
  }
}

bool InOrder(const std::vector<RouteChange>& routes) {
  std::size_t next = 0;
  for (const RouteChange& route : routes) {
    if (!route.was) continue;
    if (*route.was < next) return false;
    next = *route.was;
  }
  return true;
}

std::string Lost(const ListenerChange& change) {
  if (!change.clients) return "; its clients are disconnected";
  if (*change.clients == 0) return {};
  if (*change.clients == 1) return "; its client is disconnected";
  return "; its " + Plural(*change.clients, "client") + " are disconnected";
}

}  // namespace

ModbusDifference CompareModbus(const Modbus& running, const Modbus& next) {
  ModbusDifference difference;
  if (!running.enabled || !next.enabled) return difference;
  CompareListeners(running.listen, next.listen, difference.listeners);
  CompareRoutes(running.routes, next.routes, difference.routes);
  difference.route_order = !InOrder(difference.routes);
  FindBlocked(running.listen, next.listen, difference);
  return difference;
}

std::string SentenceOf(const ListenerChange& change) {
  const std::string begin = "listener " + change.place + ": ";
  switch (change.action) {
    case Action::added:
      return begin + "is new";
    case Action::restarted:
      return begin + "changed settings: " + change.what + Lost(change);
    case Action::removed:
      return begin + "ends" + Lost(change);
    case Action::same:
    case Action::in_place:
      break;
  }
  return {};
}

std::string SentenceOf(const RouteChange& change) {
  const std::string begin = "route " + change.route + ": ";
  switch (change.action) {
    case Action::added:
      return begin + "is new";
    case Action::restarted:
      return begin + "restarts with changed " + change.what;
    case Action::removed:
      return begin + "ends";
    case Action::in_place:
      return begin + "continues, with changed alarms";
    case Action::same:
      break;
  }
  return {};
}

}  // namespace baudgate::reload
