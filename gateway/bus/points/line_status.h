// `LineStatus` is the state of a line without its devices: port, counters, round trips, use of the
// line time. Its writers are gateway/bus/counters/line_account.cpp (exchanges),
// gateway/lines/line_reporter.cpp and gateway/lines/line_port.cpp (port), and
// gateway/lines/port_loan.cpp (loans of the port to clients). The point store contains it, and
// `baudgate status` shows it.
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
  routes,   ///< answered requests of clients of transparent routes
  writes,   ///< answered writes, and the reads after them
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
/// The part of the time that each LineUse took, 0 to 1. The line was idle in the rest.
using LineShares = std::array<double, kLineUses>;

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
  std::array<std::uint64_t, kOutcomeCount> outcomes{};
  std::uint64_t bytes_in = 0;  ///< without the echoes of own requests
  std::uint64_t bytes_out = 0;
  std::uint64_t stray_bytes = 0;  ///< bytes that belong to no exchange
  /// Stray bytes and rests of broken replies since `babble_since`: when a device last answered, or
  /// the port was opened.
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
  std::uint64_t probes = 0;
  Duration busy{};    ///< time in exchanges and in the silences after them
  TimeByUse spent{};  ///< busy time by use; the time of an exchange counts when it has ended
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
  WallTime open_until{};       ///< when `baudgate release --tcp` ends; the epoch: no limit
  std::optional<Visit> visit;  ///< the present client, or the last client
};

/// How connections to a serial server ended, and what happened at the next connection. Here a
/// connection has worked if a device has answered over it.
struct ConnectionEnds {
  /// The server ended the connection while a request was under way. The connection had worked, or
  /// the server had read the request.
  RecentTimes asked;
  /// The server ended a connection that had worked, between requests.
  RecentTimes idle;
  /// The server refused the connection after one that had worked.
  RecentTimes refused;
  /// The host did not answer when the line connected again, after a connection that had worked.
  RecentTimes unreachable;
  /// The server closed the connection before any answer and without reading a request, after a
  /// connection that had worked.
  RecentTimes shut;
  Duration age{};  ///< how long the last ended connection that had worked was open
  /// Connections in a row that had worked, and were open for about the same time.
  std::uint32_t alike = 0;
};

struct LineStatus : LineCounters {
  enum class Port : std::uint8_t { closed, open, released } port = Port::closed;
  /// If open: the port, such as "serial /dev/ttyUSB0 9600 7E1"; else why it is not open.
  std::string port_text;
  WallTime port_since{};
  WallTime released_until{};
  /// The port will be released until this time, as a user has requested, when the write under way
  /// has ended. The epoch: no release is requested.
  WallTime release_asked_until{};
  /// The port was closed because no device behind it answered, and is being opened again.
  bool silent = false;
  /// the port is released to a network client, not by `baudgate release`
  bool lent_to_client = false;
  std::uint32_t times_lost = 0;
  RecentTimes losses;
  bool takes_no_data = false;  ///< the port was lost because it accepted no more bytes
  /// How often the serial settings were restored after another program had changed them.
  std::uint32_t restored = 0;
  /// When a serial server ended a connection while the line used it. The next request opens the
  /// connection again.
  RecentTimes drops;
  ConnectionEnds ends;
  /// Connections that a serial server ended between requests, as its settings require.
  std::uint64_t rests = 0;
  /// Errors since the port was opened, as its driver counts them; zero if the driver does not.
  std::uint32_t parity_errors = 0;
  std::uint32_t framing_errors = 0;
  std::uint32_t overruns = 0;
  std::optional<ModemLines> modem;  ///< as read last; empty: the port has no modem lines
  std::vector<PortService> services;

  /// With `echo: verify`: since when the bus no longer echoes. Empty: the bus echoes, or the echo
  /// is not checked.
  std::optional<WallTime> cut_since;
  /// The part of the last full minute in which the line was busy, 0 to 1. In the first minute: the
  /// part of the time so far.
  double use = 0;
  LineShares minute{};  ///< the part of each LineUse in `use`
  /// The longest time until the gateway notices that an offline device answers again (formula:
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
      .help = "Time of exchanges and of the silences after them, by purpose."});
  visit(Counted<&LineStatus::round_trips>{.metric = "baudgate_exchange_duration_seconds",
                                          .help = "Round trips of exchanges with a good reply."});
}

}  // namespace baudgate::bus
