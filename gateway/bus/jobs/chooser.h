// Chooser picks the next job of a line: asks the sources of jobs in the order of Turns
// (gateway/bus/schedule/schedule.h), and takes the first job offered. Called by
// gateway/bus/poller/poller.cpp whenever the line is idle.
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

  /// Null: nothing may be sent now.
  std::unique_ptr<Job> Next(const Idle& idle);
  /// When Next may have something even if nothing else happens.
  std::optional<Instant> NextAt(const Idle& idle) const;

  /// Time has passed; the line was busy with this member, or (null) with none.
  void OnTime(Duration passed, const Member* busy_with);

  /// Returns whether the failed request of `job` may be sent again now. The caller has checked that
  /// tries are left. While a device that answers is due, nothing is repeated to a device whose last
  /// task failed, or while another device fails, because part of the bus may be cut off. A read in
  /// the background is repeated only where there is room. Nothing repeatable is repeated while a
  /// start or stop of a client waits. `more`: extra tries, granted because replies to earlier
  /// requests may come first; then the rules about failing devices and room do not apply.
  bool MayRepeat(const Job& job, int more, Instant now) const;
  /// Whether a read of a slave that is offline is its probe right now.
  bool MayProbe(const Member& member, const Idle& idle) const;
  /// The line is idle, so the cost of the probe that ended last is known.
  void ChargeProbe(Instant now);
  /// How long others waited if a probe took the line from `from` to `to`.
  Duration Waited(Instant from, Instant to) const;
  /// A short write of a route waits, and goes before a routed read that has not been sent yet.
  bool ShortWriteGoesFirst(Instant now) const;
  /// How things are on the line, for the probes.
  Probes::Facts FactsOf(const Idle& idle) const;

 private:
  struct Source {
    std::optional<Turns::Choice> turn;  // empty: only where nothing else has anything
    std::unique_ptr<JobSource> jobs;
  };

  LineContext& line_;
  std::vector<Source> sources_;
};

}  // namespace baudgate::bus
