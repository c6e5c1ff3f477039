// The order of jobs on a line, without starvation: writes before reads, clients of high priority
// before others, devices that answer before those that fail; each with a limit.
// gateway/bus/jobs/chooser.cpp asks for the order and takes the first kind that has something to
// send.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "gateway/base/time.h"

namespace baudgate {

class Turns {
 public:
  enum class Choice : std::uint8_t {
    urgent,       ///< short routed writes, writes to points, and the reads that follow them
    parked,       ///< a job that waits for its device: see ParkedJobs
    probe,        ///< has a budget of its own, so it may go before the polls
    poll,         ///< the schedule's next query
    routed_high,  ///< requests of transparent routes, by priority
    routed_normal,
    routed_low,
  };

  struct Waiting {
    bool short_write = false;      ///< of a route
    bool routed = false;           ///< anything of a route
    std::size_t high_clients = 0;  ///< that wait with requests of high priority
  };

  /// Urgent jobs in a row, after which anything else has its turn.
  static constexpr int kUrgentInRow = 4;
  /// Short writes of routes may be many and belong together: a start, its set points.
  static constexpr int kRoutedWritesInRow = 16;
  /// Devices whose exchanges fail have at most half of the time that others want. Their excess time
  /// is kept as a debt, at most this.
  static constexpr Duration kMostDebt = std::chrono::minutes(1);

  /// Whether an urgent job may go before everything else.
  bool UrgentAllowed(bool short_write) const {
    return urgent_in_row_ < (short_write ? kRoutedWritesInRow : kUrgentInRow);
  }
  /// The order; a choice may be in it twice.
  std::vector<Choice> Order(const Waiting& waiting) const;
  /// The first choice that had something.
  void OnTaken(Choice choice, const Waiting& waiting);
  /// No choice had anything.
  void OnNothing();
  /// A request went out.
  void OnSent(bool urgent) {
    if (!urgent) urgent_in_row_ = 0;
  }

  /// Time has passed; `failing`: the line was busy with a device whose last exchange failed.
  void OnTime(Duration passed, bool failing);
  /// Line time that a device took in vain before it was known to fail.
  void Charge(Duration lost) { debt_ += lost; }
  /// Devices that answer go first: those that fail have had more than their share.
  bool HealthyFirst() const { return debt_ > Duration::zero(); }

 private:
  int urgent_in_row_ = 0;        // urgent jobs sent since the last job of another kind
  std::size_t high_in_row_ = 0;  // routed requests of high priority
  bool poll_next_ = false;       // polls and routed requests of normal priority take turns
  Duration debt_{};  // line time that failing devices took and the others have not yet got back
};

}  // namespace baudgate
