// What clients ask of the Modbus server, and the results: one entry per client, serial master
// and route, for `baudgate status`. Written on the server's thread, read from any
// (gateway/outputs/control).
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "config/model/modbus.h"
#include "config/model/outputs.h"
#include "gateway/base/time.h"
#include "gateway/bus/points/counted.h"

namespace baudgate::modbus {

struct ClientStatus {
  std::uint64_t id = 0;  ///< RoutedRequest::client
  std::string peer;      ///< "10.0.0.7:40112", or the serial port of a master
  std::string listener;  ///< config::Listener::Address()
  config::Priority priority = config::Priority::normal;
  WallTime since{};
  WallTime last_request{};  ///< the epoch: none yet
  std::uint64_t requests = 0;
  std::uint64_t exceptions = 0;  ///< the slave's own included
  std::uint64_t bytes_in = 0;
  std::uint64_t bytes_out = 0;
  std::uint32_t outstanding = 0;  ///< requests not answered yet
};

/// A serial port at which a master is awaited, whether one is heard or not.
struct MasterStatus {
  std::string port;
  bool is_open = false;
  std::string text;              ///< what is open, or why it is not
  WallTime since{};              ///< of is_open
  std::uint64_t frames = 0;      ///< whole requests and replies, those of other slaves included
  std::uint64_t damaged = 0;     ///< what was heard and is no frame
  std::optional<Framing> other;  ///< damage was whole in this one; a request forgets it
  Framing expected = Framing::rtu;
  std::uint64_t echoes = 0;  ///< own replies that were heard and passed over; `echo` is off
  WallTime last_frame{};     ///< the epoch: none yet
};

/// How routed requests ended. requests == ok + refused + denied + no_reply + expired + busy +
/// dropped + broadcasts + those under way.
struct RouteCounters {
  std::uint64_t requests = 0;
  std::uint64_t ok = 0;
  std::uint64_t refused = 0;     ///< the slave answered an exception of its own
  std::uint64_t denied = 0;      ///< its listener does not permit it; 0x01
  std::uint64_t no_reply = 0;    ///< no good reply: silence, damage, port closed; 0x0B
  std::uint64_t expired = 0;     ///< waited beyond the deadline and was not sent; 0x0B
  std::uint64_t busy = 0;        ///< the queue was full; 0x06
  std::uint64_t dropped = 0;     ///< the client had left
  std::uint64_t broadcasts = 0;  ///< sent to all, never answered
  std::uint64_t shared = 0;      ///< of ok and refused: another's exchange answered it too
  Duration longest_wait{};       ///< in the queue
  Duration total_wait{};         ///< of ok and refused

  Duration MeanWait() const {
    const auto answered = static_cast<std::int64_t>(ok + refused);
    return answered == 0 ? Duration() : total_wait / answered;
  }
};

template <typename Visit>
void VisitFields(const RouteCounters*, Visit visit) {
  visit(bus::Counted<&RouteCounters::requests>{.label = "requests"});
  visit(bus::Counted<&RouteCounters::ok>{.label = "ok"});
  visit(bus::Counted<&RouteCounters::refused>{.label = "refused"});
  visit(bus::Counted<&RouteCounters::denied>());
  visit(bus::Counted<&RouteCounters::no_reply>{.label = "no reply"});
  visit(bus::Counted<&RouteCounters::expired>{.label = "too late"});
  visit(bus::Counted<&RouteCounters::busy>{.label = "queue full"});
  visit(bus::Counted<&RouteCounters::dropped>{.label = "client left"});
  visit(bus::Counted<&RouteCounters::broadcasts>());
  visit(bus::Counted<&RouteCounters::shared>());
  visit(bus::Counted<&RouteCounters::MeanWait>{.key = "mean_wait_us", .label = "mean wait"});
  visit(bus::Counted<&RouteCounters::longest_wait>{.key = "longest_wait_us"});
}

struct RouteStatus : RouteCounters {
  std::string units;         ///< "33-40"
  std::string target;        ///< "line drive", "server 10.0.0.9:502"
  std::string last_trouble;  ///< reason of the last request without a good reply
  WallTime last_trouble_at{};
  /// Replies of a server that came after their deadline and were dropped. Routes that lead to the
  /// same unit there count each other's.
  std::uint64_t late = 0;
  std::map<std::uint8_t, RouteCounters> by_unit;  ///< unit ids as clients ask for them
};

template <typename Visit>
void VisitFields(const RouteStatus*, Visit visit) {
  visit(bus::Counted<&RouteStatus::units>());
  visit(bus::Counted<&RouteStatus::target>());
  VisitFields(static_cast<const RouteCounters*>(nullptr), visit);
  visit(bus::Counted<&RouteStatus::last_trouble>());
  visit(bus::Counted<&RouteStatus::last_trouble_at>());
  visit(bus::Counted<&RouteStatus::late>());
}

/// A listener at which no client can come in; it is looked at again each second.
struct ClosedListener {
  std::string place;     ///< config::Listener::Address()
  std::string why;       ///< "address already in use; …"
  bool is_open = false;  ///< its address has left the machine
};

/// A client that spoke another framing than its listener.
struct OtherSpeaker {
  std::string listener;  ///< config::Listener::Address()
  std::string peer;      ///< the last
  Framing heard = Framing::tcp;
  Framing expected = Framing::tcp;
  std::uint64_t times = 0;
  WallTime last{};
};

/// Requests of all clients of a listener by what was asked and how it was answered.
struct FunctionCount {
  std::string listener;        ///< config::Listener::Address()
  std::uint8_t function = 0;   ///< 0: one that is in no standard
  std::uint8_t exception = 0;  ///< 0: none
  std::uint64_t requests = 0;
};

struct TrafficStatus {
  std::vector<ClientStatus> clients;  ///< connected now, by id
  std::vector<MasterStatus> masters;  ///< in the order in which they were configured
  std::vector<ClosedListener> closed;
  std::vector<OtherSpeaker> others;      ///< one for each listener where there were any
  std::vector<FunctionCount> functions;  ///< that were asked since the start
  /// In the order of the file that runs; after them one for broadcasts, if any.
  std::vector<RouteStatus> routes;
};

}  // namespace baudgate::modbus
