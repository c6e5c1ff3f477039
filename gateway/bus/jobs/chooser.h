// `Chooser` picks the next job of a line. It asks the sources of jobs (polls, writes, probes ...)
// in the order of Turns (gateway/bus/schedule/schedule.h), and takes the first job that a source
// offers. The poller calls it whenever the line is idle.
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
  /// `line` contains this chooser, so it outlives it.
  explicit Chooser(LineContext& line);

  /// Returns the next job, or null if no job can be sent now.
  std::unique_ptr<Job> Next(const Idle& idle);
  /// Returns when Next can return a job if nothing happens until then. The time can be in the past.
  std::optional<Instant> NextAt(const Idle& idle) const;

  /// Tells Turns for how long the line was busy with a failing device. `busy_with`: the member that
  /// the line was busy with, or null.
  void OnTime(Duration passed, const Member* busy_with);

  /// True if the failed request of `job` is to be sent again now. The caller has checked that the
  /// job has retries left. `more`: number of extra retries, given because replies to earlier
  /// requests may come first. Returns false in these cases:
  /// * `more` is 0, the job is a background read, and there is not enough time before the next
  ///   poll.
  /// * `more` is 0, a poll of a device that answers is due, and the last task of this device failed
  ///   or another device fails. Part of the bus may be cut off, and retries would only cost time.
  /// * A short write of a client waits (a start or stop), and the request can be sent again later.
  bool MayRepeat(const Job& job, int more, Instant now) const;
  /// True if this offline member is to be probed now, so that a client's read can be sent as the
  /// probe.
  bool MayProbe(const Member& member, const Idle& idle) const;
  /// Call when the line is idle after a probe. Charges the budget of the probe with the time for
  /// which it delayed other work.
  void ChargeProbe(Instant now);
  /// Returns for how long a probe that used the line from `from` to `to` delayed other work.
  Duration Waited(Instant from, Instant to) const;
  /// True if a waiting short write of a client (a start or stop) is to be sent before clients'
  /// reads.
  bool ShortWriteGoesFirst(Instant now) const;
  Probes::Facts FactsOf(const Idle& idle) const;

 private:
  struct Source {
    // Empty: this source is asked only if no other source has a job.
    std::optional<Turns::Choice> turn;
    std::unique_ptr<JobSource> jobs;
  };

  LineContext& line_;
  std::vector<Source> sources_;
};

}  // namespace baudgate::bus
