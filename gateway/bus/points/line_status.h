// What the gateway knows of a line apart from its devices: port, counters, round trips, line use.
// Written by gateway/bus/counters/line_account.cpp (exchanges), gateway/lines/line_reporter.cpp and
// gateway/lines/line_port.cpp (port), and gateway/lines/port_loan.cpp (services), held by
// gateway/bus/points/point_store.h, shown by `baudgate status`. LineUse and RecentTimes are parts
// of LineStatus: what the time of the line goes to, and when something happened.
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

// What the time of a line goes to.
enum class LineUse : std::uint8_t {
  polls,    ///< answered exchanges that read
  probes,   ///< answered probes
  routes,   ///< answered ones of clients
  writes,   ///< answered ones, with the reads after them
  silence,  ///< exchanges without a good reply
  drains,   ///< silence that is kept after an exchange
};
inline constexpr std::size_t kLineUses = 6;

constexpr std::string_view Name(LineUse use) {
  constexpr std::string_view kNames[kLineUses] = {"polls",  "probes",  "routes",
                                                  "writes", "silence", "drains"};
  return kNames[static_cast<std::size_t>(use)];
}

/// Times by use.
using TimeByUse = std::array<Duration, kLineUses>;
/// Parts of a time, each 0 to 1; for the rest the line was idle.
using LineShares = std::array<double, kLineUses>;

// When something happened, the latest times. Bounded memory.
class RecentTimes {
 public:
  static constexpr std::size_t kKept = 64;

  void Add(Instant when) { times_[count_++ % kKept] = when; }
  /// How often since then, at most kKept. What comes sooner than `apart` behind one that counts is
  /// the same trouble.
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
  std::uint64_t bytes_in = 0;                           ///< without the echo that was taken out
  std::uint64_t bytes_out = 0;
  std::uint64_t stray_bytes = 0;  ///< that belong to no exchange
  /// Stray bytes since the last answer, the rests of broken replies among them; and since when.
  std::uint64_t babble = 0;
  Instant babble_since{};
  /// Late replies: bytes after an exchange without a reply, or with the reply to a repetition; and
  /// whole replies of one device in the exchange of another.
  std::uint64_t late = 0;
  std::uint64_t collisions = 0;    ///< echo: verify: the echo differed or was missing
  std::uint64_t echoes = 0;        ///< echo: off: the request itself came back
  std::uint32_t echoed = 0;        ///< the same of the latest 32 exchanges, one bit each
  std::uint64_t negotiations = 0;  ///< connections that began as Telnet, and devices answer there
  std::uint64_t probes = 0;        ///< of absent devices
  Duration busy{};                 ///< in exchanges and drains
  TimeByUse spent{};               ///< of that, by use; an exchange counts when it has ended
  RoundTrips round_trips;

  std::uint64_t Count(Outcome outcome) const { return outcomes[static_cast<std::size_t>(outcome)]; }
};

/// Where network clients can have the port, and which one has it.
struct PortService {
  /// One client that has the port, or has had it.
  struct Visit {
    std::string client;  ///< "10.0.0.7:40112"
    WallTime since{};
    WallTime until{};  ///< while it has a lent port: when it loses it; afterwards: when it left
    std::uint64_t to_port = 0;  ///< bytes, as below
    std::uint64_t from_port = 0;
    std::string why;  ///< why it has the port no more; empty: it has it
  };
  std::string place;           ///< "127.0.0.1:4001"
  std::string mode;            ///< "raw", "rfc2217"
  bool lent = false;           ///< a client takes the place of the polls
  std::string trouble;         ///< why clients cannot connect; empty: they can
  WallTime open_until{};       ///< of `release --tcp`; the epoch: no limit
  std::optional<Visit> visit;  ///< the present one, or the last
};

/// How connections to a server ended, and what followed. Those that have worked.
struct ConnectionEnds {
  RecentTimes asked;        ///< the server ended it with a request under way
  RecentTimes idle;         ///< and with none
  RecentTimes refused;      ///< behind its end nothing took connections at the port
  RecentTimes unreachable;  ///< behind its end no host answered
  RecentTimes shut;         ///< behind its end the server ended the next one before any answer
  Duration age{};           ///< of the connections that ended last
  std::uint32_t alike = 0;  ///< how many in a row were about as old as that
};

struct LineStatus : LineCounters {
  enum class Port : std::uint8_t { closed, open, released } port = Port::closed;
  std::string port_text;  ///< open: "serial /dev/ttyUSB0 9600 7E1"; else why it is closed
  WallTime port_since{};  ///< when `port` last changed
  WallTime released_until{};
  WallTime release_asked_until{};  ///< by hand, while a write under way ends first; else the epoch
  bool silent = false;             ///< closed to be opened again: no device behind it answered
  bool lent_to_client = false;     ///< released: to a client over the network, not by hand
  std::uint32_t times_lost = 0;    ///< how often the open port was lost
  RecentTimes losses;              ///< when
  bool takes_no_data = false;      ///< that was why, the last time
  std::uint32_t restored = 0;  ///< how often another program has changed the settings of the port
  RecentTimes drops;  ///< when a server ended a connection that was in use; it was opened again
  ConnectionEnds ends;
  std::uint64_t rests = 0;  ///< connections that a server ended between requests, by its settings
  /// Errors that the driver counts since the port was opened; zero where it does not.
  std::uint32_t parity_errors = 0;
  std::uint32_t framing_errors = 0;
  std::uint32_t overruns = 0;
  std::optional<ModemLines> modem;  ///< as seen last; empty: the port has none
  std::vector<PortService> services;

  /// Since when the bus no longer echoes (`echo: verify`); empty: it does, or need not.
  std::optional<WallTime> cut_since;
  double use = 0;       ///< part of the last full minute, or of the first, that the line was busy
  LineShares minute{};  ///< what that was
  /// The longest until the return of an absent device is noticed; empty: none is absent
  /// (docs/timeouts.md has the formula).
  std::optional<Duration> notice_bound;
};

constexpr std::string_view Name(LineStatus::Port port) {
  constexpr std::string_view kNames[] = {"closed", "open", "released"};
  return kNames[static_cast<std::size_t>(port)];
}

/// What the JSON has of the port stands before these rows (gateway/outputs/status/status_json.cpp).
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
