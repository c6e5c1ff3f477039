// Does a device that fails now and then lose single requests, or is it away for some time and comes
// back? Losses hit one exchange like another; outages put failures together. Pure.
//
//   o x o o x o x x o o o o x o     losses: failures stand as chance puts them
//   o o o o o x x x x o o o o o     an outage: by chance they would hardly ever stand so
//
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <optional>
#include <span>

#include "gateway/base/time.h"
#include "gateway/bus/points/failure_runs.h"

namespace baudgate::control {

/// How all exchanges ended that the runs stand for.
struct FailureTally {
  double failed = 0;
  double answered = 0;
  double runs = 0;
  double longest = 0;  ///< failures in a row
};

FailureTally TallyOf(const FailureRuns& failures);

struct Absences {
  std::size_t times = 0;             ///< it has come back
  Duration length{};                 ///< of one, on the average; about
  std::optional<Duration> period{};  ///< from one beginning to the next, where that is regular
};

/// Nothing: single losses, or it has been away once and is so still.
std::optional<Absences> FindAbsences(const FailureRuns& failures);
/// Again and again both fail in a row at the same time.
bool AreAwayTogether(const FailureRuns& one, const FailureRuns& other);

/// Failures of one device that stand where another one fails as well.
struct Coincidences {
  std::size_t all = 0;  ///< failures of the one, repeats apart
  std::size_t together = 0;
  double expected = 0;  ///< so many would be together by chance

  bool AreNoChance() const;
  void Add(const Coincidences& more) {
    all += more.all;
    together += more.together;
    expected += more.expected;
  }
};
Coincidences CoincidencesOf(const FailureRuns& one, const FailureRuns& other);

/// From one failure of any of them to the next, where these come regularly and strike several
/// devices, or now one and now another: an outage that they share may be as short as one request.
std::optional<Duration> SharedPeriod(std::span<const FailureRuns* const> devices);
/// It is silent now, and no longer than its failures have lasted before.
bool IsUsualSilence(const FailureRuns& failures, Instant now);

}  // namespace baudgate::control
