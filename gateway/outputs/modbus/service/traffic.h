// `TrafficStatus` contains the counters of the Modbus server for `baudgate status`: an entry for
// each client, serial master and route. It is a copy, so any thread can read it.
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
  std::uint64_t id = 0;  ///< the client's number, as in RoutedRequest::client
  std::string peer;      ///< e.g. "10.0.0.7:40112", or the serial port of a master
  std::string listener;  ///< address of the listener (config::Listener::Address())
  config::Priority priority = config::Priority::normal;
  WallTime since{};
  WallTime last_request{};  ///< the epoch: there was no request yet
  std::uint64_t requests = 0;
  std::uint64_t exceptions = 0;  ///< replies that were exceptions, including those of slaves
  std::uint64_t bytes_in = 0;
  std::uint64_t bytes_out = 0;
  std::uint32_t outstanding = 0;
};

/// The state of a serial port that waits for a master, also while no master is connected.
struct MasterStatus {
  std::string port;
  bool is_open = false;
  std::string text;           ///< describes the open port; if it is not open, the reason
  WallTime since{};           ///< the time of the last change of is_open
  std::uint64_t frames = 0;   ///< whole requests and replies, including those of other slaves
  std::uint64_t damaged = 0;  ///< sequences of received bytes that were not a frame
  /// The framing (RTU or ASCII, not `expected`) in which damaged bytes were a whole request.
  /// Nothing after the next good frame.
  std::optional<Framing> other;
  Framing expected = Framing::rtu;
  std::uint64_t echoes = 0;  ///< own replies that were received and ignored, although `echo` is off
  WallTime last_frame{};     ///< the epoch: there was no frame yet
};

/// Counts how routed requests ended. requests == ok + refused + denied + no_reply + expired + busy
/// + dropped + broadcasts + pending requests. A listener with `errors: silent` does not send the
/// exceptions 0x0B and 0x06.
struct RouteCounters {
  std::uint64_t requests = 0;
  std::uint64_t ok = 0;
  std::uint64_t refused = 0;  ///< the slave answered with an exception
  std::uint64_t denied = 0;   ///< the listener does not permit the request; the client got 0x01
  /// No good reply came (silence, damage, port closed); the client got 0x0B.
  std::uint64_t no_reply = 0;
  /// The request waited beyond its deadline and was not sent; the client got 0x0B.
  std::uint64_t expired = 0;
  std::uint64_t busy = 0;     ///< the queue was full; the client got 0x06
  std::uint64_t dropped = 0;  ///< the client has left, or no longer waits for the reply
  /// requests that were sent to all slaves of a line and get no reply
  std::uint64_t broadcasts = 0;
  /// Requests among ok and refused that share the exchange of an identical request of another
  /// client.
  std::uint64_t shared = 0;
  Duration longest_wait{};
  Duration total_wait{};  ///< sum of the times in the queue, of the requests in ok and refused

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
  std::string units;         ///< units of the route, e.g. "33-40"
  std::string target;        ///< target of the route, e.g. "line drive" or "server 10.0.0.9:502"
  std::string last_trouble;  ///< reason why the last failed request got no good reply
  WallTime last_trouble_at{};
  /// Replies of a server that came after their deadline and were dropped. If several routes lead to
  /// one unit of a server, a late reply is counted for each route.
  std::uint64_t late = 0;
  std::map<std::uint8_t, RouteCounters> by_unit;  ///< counters by the unit that clients address
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

struct ClosedListener {
  std::string place;  ///< address of the listener (config::Listener::Address())
  std::string why;
  bool is_open = false;  ///< true: the port is open, but this machine no longer has its address
};

/// Clients of one listener that used another framing than the listener.
struct OtherSpeaker {
  std::string listener;  ///< address of the listener (config::Listener::Address())
  std::string peer;      ///< address of the last client that used another framing
  Framing heard = Framing::tcp;
  Framing expected = Framing::tcp;
  std::uint64_t times = 0;
  WallTime last{};
};

/// The number of requests with one function and one exception, of all clients of a listener.
struct FunctionCount {
  std::string listener;        ///< address of the listener (config::Listener::Address())
  std::uint8_t function = 0;   ///< function code; 0: a function that is not in the standard
  std::uint8_t exception = 0;  ///< exception code; 0: no exception
  std::uint64_t requests = 0;
};

struct TrafficStatus {
  std::vector<ClientStatus> clients;  ///< clients that are connected now, sorted by id
  std::vector<MasterStatus> masters;  ///< in the order in which their ports were added
  std::vector<ClosedListener> closed;
  /// One entry for each listener that had clients with another framing.
  std::vector<OtherSpeaker> others;
  std::vector<FunctionCount> functions;  ///< functions that were used since the start
  /// The routes in the order of the running file; after them an entry for broadcasts, if there were
  /// any.
  std::vector<RouteStatus> routes;
};

}  // namespace baudgate::modbus
