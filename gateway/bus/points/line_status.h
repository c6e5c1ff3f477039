// `LineStatus` is the state of a line without its devices: port, counters, round trips, line use.
// Written by gateway/bus/counters/line_account.cpp (exchanges), gateway/lines/line_reporter.cpp and
// gateway/lines/line_port.cpp (port), and gateway/lines/port_loan.cpp (services); stored in
// gateway/bus/points/point_store.h; shown by `baudgate status`. `LineUse` (use of the line time)
// and `RecentTimes` (times of events) are parts of it.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "gateway/base/bytes.h"
#include "gateway/base/outcome.h"
#include "gateway/base/time.h"
#include "gateway/bus/points/device_status.h"

namespace baudgate::bus {

enum class LineUse : std::uint8_t {
  polls,  ///< answered exchanges that read
  probes,
  routes,   ///< answered exchanges of clients of routes
  writes,   ///< answered writes, with the reads after them
  silence,  ///< exchanges without a good reply
  drains,   ///< silence that the line keeps after an exchange
};
inline constexpr std::size_t kLineUses = 6;

constexpr std::string_view Name(LineUse use) {
  constexpr std::string_view kNames[kLineUses] = {"polls",  "probes",  "routes",
                                                  "writes", "silence", "drains"};
  return kNames[static_cast<std::size_t>(use)];
}

using TimeByUse = std::array<Duration, kLineUses>;
/// Parts of a time by use, each 0 to 1. In the remaining time the line was idle.
using LineShares = std::array<double, kLineUses>;

// The latest times of an event. Bounded memory.
class RecentTimes {
 public:
  static constexpr std::size_t kKept = 64;

  void Add(Instant when) { times_[count_++ % kKept] = when; }
  /// Returns how often the event happened since `when`, at most kKept. An event that comes less
  /// than `apart` after a counted event belongs to the same trouble and is not counted.
  std::size_t Since(Instant when, Duration apart = {}) const {
    std::size_t found = 0;
    Instant counted{};
    for (std::size_t i = count_ - std::min(count_, kKept); i < count_; ++i) {
      const Instant one = times_[i % kKept];
      if (one < when || (found > 0 && one - counted < apart)) continue;
      counted = one;
      ++found;
    }
    return found;
  }

 private:
  std::array<Instant, kKept> times_{};
  std::size_t count_ = 0;
};

/// Counters of exchanges since the start; bounded by their types only.
struct LineCounters {
  std::uint64_t exchanges = 0;
  std::array<std::uint64_t, kOutcomeCount> outcomes{};  ///< indexed by Outcome
  std::uint64_t bytes_in = 0;                           ///< without removed echoes
  std::uint64_t bytes_out = 0;
  std::uint64_t stray_bytes = 0;  ///< bytes that belong to no exchange
  /// Stray bytes since the last answer or the opening of the port, including rests of broken
  /// replies. `babble_since`: the time of that answer or opening.
  std::uint64_t babble = 0;
  Instant babble_since{};
  /// Late replies: bytes after an exchange without a reply, or with the reply to a repetition; and
  /// whole replies of one device in the exchange of another device.
  std::uint64_t late = 0;
  std::uint64_t collisions = 0;  ///< `echo: verify`: the echo differed or was missing
  std::uint64_t echoes = 0;      ///< `echo: off`: the request itself came back
  std::uint32_t echoed = 0;      ///< echoes in the latest 32 exchanges, one bit each
  /// Connections that began as Telnet, and on which devices answer.
  std::uint64_t negotiations = 0;
  std::uint64_t probes = 0;  ///< probes of absent devices
  Duration busy{};           ///< time in exchanges and drains
  TimeByUse spent{};         ///< busy time by use; an exchange counts when it has ended
  RoundTrips round_trips;

  std::uint64_t Count(Outcome outcome) const { return outcomes[static_cast<std::size_t>(outcome)]; }
};

/// A place where network clients can use the port, and the client that uses it.
struct PortService {
  struct Visit {
    std::string client;  ///< "10.0.0.7:40112"
    WallTime since{};
    /// While the client has a lent port: when it will lose the port. Afterwards: when it left.
    WallTime until{};
    std::uint64_t to_port = 0;  ///< number of bytes to the port
    std::uint64_t from_port = 0;
    std::string why;  ///< why the client no longer has the port; empty: it has the port
  };
  std::string place;           ///< "127.0.0.1:4001"
  std::string mode;            ///< "raw", "rfc2217"
  bool lent = false;           ///< the client uses the port in place of the polls
  std::string trouble;         ///< why clients cannot connect; empty: they can
  WallTime open_until{};       ///< end of `release --tcp`; the epoch: no limit
  std::optional<Visit> visit;  ///< the present client, or the last one
};

/// How connections to a server that have worked ended, and what followed.
struct ConnectionEnds {
  RecentTimes asked;        ///< the server ended the connection with a request under way
  RecentTimes idle;         ///< the server ended the connection with no request under way
  RecentTimes refused;      ///< after the end the server accepted no connection at the port
  RecentTimes unreachable;  ///< after the end no host answered
  RecentTimes shut;  ///< after the end the server closed the next connection before any answer
  Duration age{};    ///< age of the connections that ended last
  std::uint32_t alike = 0;  ///< how many connections in a row had about this age
};

struct LineStatus : LineCounters {
  enum class Port : std::uint8_t { closed, open, released } port = Port::closed;
  std::string port_text;  ///< open: "serial /dev/ttyUSB0 9600 7E1"; else why it is closed
  WallTime port_since{};  ///< when `port` last changed
  WallTime released_until{};
  /// Set by hand, while a write under way ends first; else the epoch.
  WallTime release_asked_until{};
  bool silent = false;  ///< closed to be opened again, because no device behind the port answered
  bool lent_to_client = false;   ///< the port is released to a client over the network, not by hand
  std::uint32_t times_lost = 0;  ///< how often the open port was lost
  RecentTimes losses;
  bool takes_no_data = false;  ///< the cause of the last loss was that the port accepted no data
  std::uint32_t restored = 0;  ///< how often another program has changed the settings of the port
  /// When a server ended a connection that was in use; the connection was opened again.
  RecentTimes drops;
  ConnectionEnds ends;
  /// Connections that a server ended between requests, because of its settings.
  std::uint64_t rests = 0;
  /// Errors that the driver has counted since the port was opened; zero if it does not count them.
  std::uint32_t parity_errors = 0;
  std::uint32_t framing_errors = 0;
  std::uint32_t overruns = 0;
  std::optional<ModemLines> modem;  ///< as read last; empty: the port has no modem lines
  std::vector<PortService> services;

  /// Since when the bus no longer echoes (`echo: verify`); empty: it echoes, or need not.
  std::optional<WallTime> cut_since;
  double use = 0;       ///< busy part of the last full minute, or of the first minute so far
  LineShares minute{};  ///< `use`, divided by LineUse
  /// The longest time until the return of an absent device is noticed; empty: no device is absent
  /// (docs/timeouts.md has the formula).
  std::optional<Duration> notice_bound;
};

constexpr std::string_view Name(LineStatus::Port port) {
  constexpr std::string_view kNames[] = {"closed", "open", "released"};
  return kNames[static_cast<std::size_t>(port)];
}

/// The fields of the port come before these rows in the JSON
/// (gateway/outputs/status/status_json.cpp).
template <typename Visit>
void VisitFields(const LineStatus*, Visit visit) {
  visit(NotInJson<&LineStatus::port>{.metric = "baudgate_line_up",
                                     .help = "1 while the port of the line is open, else 0."});
  visit(Counted<&LineStatus::times_lost>());
  visit(Counted<&LineStatus::cut_since>{.key = "echo_lost_since"});
  visit(Counted<&LineStatus::use>());
  visit(Counted<&LineStatus::minute>());
  visit(Counted<&LineStatus::exchanges>());
  visit(Counted<&LineStatus::outcomes>());
  visit(Counted<&LineStatus::bytes_in>());
  visit(Counted<&LineStatus::bytes_out>());
  visit(Counted<&LineStatus::stray_bytes>());
  visit(Counted<&LineStatus::late>{.label = "late", .place = -2});
  visit(Counted<&LineStatus::collisions>{.label = "collisions"});
  visit(Counted<&LineStatus::echoes>{.label = "echoes", .place = -1});
  visit(Counted<&LineStatus::probes>());
  visit(Counted<&LineStatus::busy>{.key = "busy_ms"});
  visit(Counted<&LineStatus::parity_errors>{.label = "parity errors"});
  visit(Counted<&LineStatus::framing_errors>{.label = "framing errors"});
  visit(Counted<&LineStatus::overruns>{.label = "overruns"});
  visit(Counted<&LineStatus::notice_bound>{.key = "notice_bound_ms"});
  visit(NotInJson<&LineStatus::spent>{
      .metric = "baudgate_line_busy_seconds_total",
      .help = "Time in exchanges and in the silences after them, by what for."});
  visit(Counted<&LineStatus::round_trips>{.metric = "baudgate_exchange_duration_seconds",
                                          .help = "Round trips of exchanges with a good reply."});
}

}  // namespace baudgate::bus
