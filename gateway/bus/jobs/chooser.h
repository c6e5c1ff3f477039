// What a line does next: asks the parts in the order of gateway/bus/schedule/turns.h and makes a
// job of the first that has something. Called by gateway/bus/jobs/turn_taker.cpp whenever the line
// is idle.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <optional>

#include "gateway/bus/devices/roster.h"
#include "gateway/bus/jobs/agenda.h"
#include "gateway/bus/jobs/job.h"
#include "gateway/bus/jobs/routed_jobs.h"
#include "gateway/bus/replies/late_answers.h"
#include "gateway/bus/schedule/idle_time.h"
#include "gateway/bus/schedule/turns.h"

namespace baudgate {

class Chooser {
 public:
  /// All references outlive the chooser.
  Chooser(Roster& roster, Agenda& agenda, const LateAnswers& late);

  /// Null: nothing may be sent now. A routed job has its request already; others must be asked.
  std::unique_ptr<Job> Next(const Idle& idle);
  /// When Next may have something even if nothing else happens.
  std::optional<Instant> NextAt(const Idle& idle) const;

  /// Time has passed; the line was busy with this member, or (null) with none.
  void OnTime(Duration passed, const Member* busy_with);

  /// Whether the failed request of this job may be sent again now. Usually at once. But while a
  /// device that answers is due, nothing is repeated to a device that has failed a whole task, nor
  /// while another fails too: part of the bus may be cut off. A start or stop that a client sends
  /// does not wait for repetitions either. `more`: repetitions beyond the usual number, because
  /// other replies may come before its own.
  bool MayRepeat(const Job& job, int more, Instant now) const;
  /// Whether a read of a slave that is offline is its probe right now.
  bool MayProbe(const Member& member, const Idle& idle) const;
  /// The line is idle, so the cost of the probe that ended last is known.
  void ChargeProbe(Instant now);
  /// From then on no late reply of any member can come.
  Instant AllClearAt() const { return late_.AllClearAt(); }
  /// How long others waited if a probe took the line from `from` to `to`.
  Duration Waited(Instant from, Instant to) const;

  /// A short write of a route waits, and goes before a routed read that has not been sent yet.
  bool ShortWriteGoesFirst(Instant now) const;
  /// The requests of this routed job wait again, in front of those that came later.
  void PutBack(Job& job);

 private:
  Probes::Facts FactsOf(const Idle& idle) const;

  std::unique_ptr<Job> Take(Turns::Choice choice, const Idle& idle);
  std::unique_ptr<Job> TakeUrgent(const Idle& idle);
  std::unique_ptr<Job> TakeWriteProbe(const Idle& idle);
  std::unique_ptr<Job> TakeReadBack(Instant now);
  std::unique_ptr<Job> TakeCommand(const Idle& idle);
  std::unique_ptr<Job> TakeProbe(const Idle& idle);
  std::unique_ptr<Job> TakePoll(Instant now);
  std::unique_ptr<Job> TakeBackground(Background::Which which, Instant now);

  Roster& roster_;
  Agenda& agenda_;
  const LateAnswers& late_;
  RoutedJobs routed_;
};

}  // namespace baudgate
