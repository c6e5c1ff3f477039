// Requests of transparent routes as jobs: which of them may be sent now, and for whom a client
// waits. gateway/bus/schedule/routed_side.h keeps them. A part of gateway/bus/jobs/chooser.h.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>

#include "gateway/bus/devices/roster.h"
#include "gateway/bus/jobs/agenda.h"
#include "gateway/bus/jobs/job.h"
#include "gateway/bus/replies/late_answers.h"
#include "gateway/bus/schedule/idle_time.h"
#include "gateway/bus/schedule/turns.h"

namespace baudgate {

class RoutedJobs {
 public:
  /// All references outlive it.
  RoutedJobs(Roster& roster, Agenda& agenda, const LateAnswers& late)
      : roster_(roster), agenda_(agenda), late_(late) {}

  Turns::Waiting Waiting() const;
  /// A request waits that may be sent, as far as its slave and earlier writes are concerned.
  bool AnyMayGo(Instant now) const;
  /// A short write waits that may be sent, likewise.
  bool ShortWriteMayGo(Instant now) const;
  /// A start or stop of a client waits for a slave that is not offline. For one that is offline it
  /// waits for a probe, so nothing else has to make room.
  bool ShortWriteWaits() const;
  /// A client wants to know whether this slave is back.
  bool IsLookedFor(const Member& slave, const Idle& idle) const;

  // Null: there is none that may be sent.
  std::unique_ptr<Job> Take(config::Priority priority, Instant now);
  std::unique_ptr<Job> TakeUrgent(Instant now);
  /// To this slave, even if it is offline.
  std::unique_ptr<Job> TakeShortWrite(std::uint8_t slave, Instant now);
  /// A client's request to an offline slave is its probe.
  std::unique_ptr<Job> TakeProbe(const Member& slave, const Idle& idle);

 private:
  bool MayGo(const RoutedRequest& request, Instant now) const;
  std::unique_ptr<Job> JobOf(RouteQueue::Batch batch, Instant now);

  Roster& roster_;
  Agenda& agenda_;
  const LateAnswers& late_;
};

}  // namespace baudgate
