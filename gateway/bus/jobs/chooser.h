// `Chooser` picks the next job of a line: it asks the sources of jobs in the order of Turns
// (gateway/bus/schedule/schedule.h), and takes the first job that a source offers.
// gateway/bus/poller/poller.cpp calls it whenever the line is idle.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "gateway/bus/devices/roster.h"
#include "gateway/bus/jobs/job.h"
#include "gateway/bus/schedule/probes.h"
#include "gateway/bus/schedule/turns.h"

namespace baudgate::bus {

class Chooser {
 public:
  /// The chooser is a part of `line`.
  explicit Chooser(LineContext& line);

  /// Returns the next job. Null: no job may be sent now.
  std::unique_ptr<Job> Next(const Idle& idle);
  /// Returns when Next may have a job even if nothing else happens.
  std::optional<Instant> NextAt(const Idle& idle) const;

  /// Time has passed. `busy_with`: the member with which the line was busy; null: none.
  void OnTime(Duration passed, const Member* busy_with);

  /// Returns whether the failed request of `job` may be sent again now. The caller has checked that
  /// tries are left. `more`: extra tries, because replies to earlier requests may come first.
  /// * While a device that answers is due, a device whose last task failed gets no repetition.
  ///   The same holds for every device while another device fails, because part of the bus may be
  ///   cut off.
  /// * A background read is repeated only if there is time before the next poll.
  /// * While a start or stop of a client waits, a repeatable request is not repeated.
  /// The first two rules do not apply with `more`.
  bool MayRepeat(const Job& job, int more, Instant now) const;
  /// Returns whether a read of this offline slave may serve as its probe now.
  bool MayProbe(const Member& member, const Idle& idle) const;
  /// The line is idle, so the cost of the latest probe is known and is charged.
  void ChargeProbe(Instant now);
  /// Returns how long other work waited if a probe used the line from `from` to `to`.
  Duration Waited(Instant from, Instant to) const;
  /// Returns whether a waiting short write of a route goes before a routed read that has not been
  /// sent.
  bool ShortWriteGoesFirst(Instant now) const;
  Probes::Facts FactsOf(const Idle& idle) const;

 private:
  struct Source {
    std::optional<Turns::Choice> turn;  // empty: asked only if no other source has a job
    std::unique_ptr<JobSource> jobs;
  };

  LineContext& line_;
  std::vector<Source> sources_;
};

}  // namespace baudgate::bus
