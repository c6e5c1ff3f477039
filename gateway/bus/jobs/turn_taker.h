// Gives turns while the line is idle: to the job under way, or to one that is chosen, unless the
// line is held or has taken turns without end. Driven by gateway/bus/poller/poller.cpp.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

#include "gateway/base/time.h"
#include "gateway/bus/counters/line_account.h"
#include "gateway/bus/jobs/chooser.h"
#include "gateway/bus/jobs/job_run.h"
#include "gateway/bus/schedule/hold.h"
#include "gateway/bus/schedule/idle_time.h"
#include "gateway/bus/schedule/turn_limit.h"

namespace baudgate {

class TurnTaker {
 public:
  /// All outlive it.
  TurnTaker(Chooser& chooser, JobRun& run, LineAccount& account)
      : chooser_(chooser), run_(run), account_(account) {}

  /// Before each input. `passed`: the time since the last one; `idle`: the line has been idle.
  void OnTime(Now now, Duration passed, bool idle);
  void OnOpened() { hold_.OnOpened(); }
  void OnClosed() { hold_.OnClosed(); }

  /// The line is idle. True: the request of the job is to be sent now.
  bool Take(const Idle& idle);
  /// The line is idle: when Take may say something else even if nothing else happens.
  std::optional<Instant> NextAt(const Idle& idle) const;
  /// The line is idle, so the cost of the probe that ended last is known.
  void ChargeProbe(Instant now) { chooser_.ChargeProbe(now); }

  // See Poller.
  void WindUp() { hold_.WindUp(); }
  void CallOffWindUp() { hold_.CallOffWindUp(); }
  /// True: no job is under way, and no late reply can come, or was waited for long enough.
  bool Pause(Instant now);
  /// False: there was no pause.
  bool GoOn() { return hold_.GoOn(); }
  /// Null: no job is under way.
  const Job* job() const { return run_.job(); }

 private:
  bool CountTurn(const Member* last, Instant now);

  Chooser& chooser_;
  JobRun& run_;
  LineAccount& account_;
  Hold hold_;
  TurnLimit limit_;
};

}  // namespace baudgate
