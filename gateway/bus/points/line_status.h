// `LineStatus` is the state of a line without its devices: port, counters, round trips, use of the
// line time. Four parts write it: gateway/bus/counters/line_account.cpp (exchanges),
// gateway/lines/line_reporter.cpp and gateway/lines/line_port.cpp (port), and
// gateway/lines/port_loan.cpp (services). The point store contains it, and `baudgate status` shows
// it.
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
/// Part of the time that each use took, 0 to 1. The line was idle in the remaining time.
using LineShares = std::array<double, kLineUses>;

// `RecentTimes` stores when an event happened the last 64 times.
class RecentTimes {
 public:
  static constexpr std::size_t kKept = 64;

  void Add(Instant when) { times_[count_++ % kKept] = when; }
  /// Returns how often the event happened since `when`, at most kKept. If it happened again less
  /// than `apart` after a counted event, the repetition is not counted.
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

/// Counters of the exchanges of a line since the program started.
struct LineCounters {
  std::uint64_t exchanges = 0;
  std::array<std::uint64_t, kOutcomeCount> outcomes{};  ///< indexed by Outcome
  std::uint64_t bytes_in = 0;                           ///< without echoes that were removed
  std::uint64_t bytes_out = 0;
  std::uint64_t stray_bytes = 0;  ///< bytes that belong to no exchange
  /// Stray bytes since `babble_since`, including the rests of broken replies. `babble_since`: when
  /// a device last answered, or the port was opened.
  std::uint64_t babble = 0;
  Instant babble_since{};
  /// Late replies: bytes that came after an exchange without a reply or after the reply to a retry,
  /// and whole replies of one device during an exchange with another device.
  std::uint64_t late = 0;
  std::uint64_t collisions = 0;  ///< with `echo: verify`: the echo differed or was missing
  std::uint64_t echoes = 0;      ///< with `echo: off`: the request came back nevertheless
  std::uint32_t echoed = 0;  ///< the latest 32 exchanges, one bit each; 1: the request came back
  /// Connections to serial servers that began with Telnet commands.
  std::uint64_t negotiations = 0;
  std::uint64_t probes = 0;  ///< probes of absent devices
  Duration busy{};           ///< time in exchanges and in the silences after them
  TimeByUse spent{};         ///< busy time by use; the time of an exchange counts when it has ended
  RoundTrips round_trips;

  std::uint64_t Count(Outcome outcome) const { return outcomes[static_cast<std::size_t>(outcome)]; }
};

/// A network address at which clients can use the serial port, and the client that uses it.
struct PortService {
  struct Visit {
    std::string client;  ///< "10.0.0.7:40112"
    WallTime since{};
    /// If the port is lent to the client: when the client will lose the port. After the client has
    /// left: when it left.
    WallTime until{};
    std::uint64_t to_port = 0;
    std::uint64_t from_port = 0;
    std::string why;  ///< why the client lost the port; empty: the client has the port
  };
  std::string place;           ///< address at which clients connect, such as "127.0.0.1:4001"
  std::string mode;            ///< "raw" or "rfc2217"
  bool lent = false;           ///< true: the polls are paused while a client uses the port
  std::string trouble;         ///< why clients cannot connect; empty: clients can connect
  WallTime open_until{};       ///< end of `release --tcp`; the epoch: no limit
  std::optional<Visit> visit;  ///< the present client, or the last client
};

/// How working connections to a serial server ended, and what happened at the next connection.
struct ConnectionEnds {
  RecentTimes asked;  ///< the server ended the connection while a request was under way
  RecentTimes idle;   ///< the server ended the connection between requests
  /// The server refused the connection that followed a working connection.
  RecentTimes refused;
  /// The host did not answer when the line connected again after a working connection.
  RecentTimes unreachable;
  /// The server closed the connection that followed a working connection, before any answer.
  RecentTimes shut;
  Duration age{};           ///< how long the connections that ended last had been open
  std::uint32_t alike = 0;  ///< number of connections in a row that ended at about this age
};

struct LineStatus : LineCounters {
  enum class Port : std::uint8_t { closed, open, released } port = Port::closed;
  /// If open, such as "serial /dev/ttyUSB0 9600 7E1"; else why it is closed.
  std::string port_text;
  WallTime port_since{};  ///< when `port` last changed
  WallTime released_until{};
  /// A release of the port was requested by hand until this time, and a write under way ends first.
  /// The epoch: no release is requested.
  WallTime release_asked_until{};
  /// The port was closed, and is opened again, because no device behind it answered.
  bool silent = false;
  bool lent_to_client = false;  ///< the port is released to a network client, not by hand
  std::uint32_t times_lost = 0;
  RecentTimes losses;
  bool takes_no_data = false;  ///< the port was last lost because it accepted no data
  /// How often the settings were restored after another program had changed them.
  std::uint32_t restored = 0;
  /// Times at which a serial server ended a connection that was in use. The next request opens the
  /// connection again.
  RecentTimes drops;
  ConnectionEnds ends;
  /// Connections that a serial server ended between requests, as its settings require.
  std::uint64_t rests = 0;
  /// Errors since the port was opened, as its driver counts them; zero if the driver does not.
  std::uint32_t parity_errors = 0;
  std::uint32_t framing_errors = 0;
  std::uint32_t overruns = 0;
  std::optional<ModemLines> modem;  ///< the modem lines as read last; empty: the port has none
  std::vector<PortService> services;

  /// With `echo: verify`: since when the bus no longer echoes. Empty: the bus echoes, or the echo
  /// is not checked.
  std::optional<WallTime> cut_since;
  /// Busy part of the last full minute, 0 to 1; in the first minute, of the time so far.
  double use = 0;
  LineShares minute{};  ///< `use` divided by the use of the line time
  /// The longest time until it is noticed that an offline device answers again (formula:
  /// docs/timeouts.md). Empty: no device is offline.
  std::optional<Duration> notice_bound;
};

constexpr std::string_view Name(LineStatus::Port port) {
  constexpr std::string_view kNames[] = {"closed", "open", "released"};
  return kNames[static_cast<std::size_t>(port)];
}

/// The rows of a line in the status. In the JSON the fields of the port come before them
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
