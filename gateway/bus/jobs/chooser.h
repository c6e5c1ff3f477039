// What a line does next: asks the parts in the order of gateway/bus/schedule/turns.h and makes a
// job of the first that has something. Called by gateway/bus/jobs/job_run.cpp whenever the line
// is idle. ParkedJobs keeps jobs that were put aside, and Agenda all that waits. RoutedJobs
// picks requests of routes, and Chooser decides.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstdint>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "gateway/bus/devices/roster.h"
#include "gateway/bus/jobs/job.h"
#include "gateway/bus/replies/late_replies.h"
#include "gateway/bus/schedule/probes.h"
#include "gateway/bus/schedule/schedule.h"
#include "gateway/bus/schedule/turns.h"
#include "gateway/bus/writes/route_queue.h"
#include "gateway/bus/writes/write_queue.h"

namespace baudgate::bus {

// Jobs that wait while the line goes on: their device was busy, or a late reply of it may still
// come. Chosen again by Chooser.

/// At most one read-back and one other job for each device.
class ParkedJobs {
 public:
  void Park(std::unique_ptr<Job> job, Instant until) { parked_.push_back({std::move(job), until}); }
  /// Null: none may go on yet.
  std::unique_ptr<Job> Take(Instant now) {
    const auto next =
        std::ranges::find_if(parked_, [now](const One& one) { return one.until <= now; });
    if (next == parked_.end()) return nullptr;
    std::unique_ptr<Job> job = std::move(next->job);
    parked_.erase(next);
    return job;
  }
  /// There is no room for this job.
  bool HasLike(const Job& job) const {
    return std::ranges::any_of(parked_, [&job](const One& one) {
      return one.member() == job.member && IsReadBack(*one.job) == IsReadBack(job);
    });
  }
  /// A read-back that has not failed yet.
  bool HasReadBack(const Member& member) const {
    return std::ranges::any_of(parked_,
                               [&member](const One& one) { return ReadsBack(*one.job, member); });
  }
  std::vector<std::unique_ptr<Job>> TakeAll(const Member& member) {
    std::vector<std::unique_ptr<Job>> taken;
    for (One& one : parked_) {
      if (one.member() == &member) taken.push_back(std::move(one.job));
    }
    std::erase_if(parked_, [](const One& one) { return one.job == nullptr; });
    return taken;
  }
  void Drop(const Member& member) {
    std::erase_if(parked_, [&member](const One& one) { return one.member() == &member; });
  }
  /// When the first may go on.
  std::optional<Instant> NextAt() const {
    const auto first = std::ranges::min_element(parked_, {}, &One::until);
    return first == parked_.end() ? std::nullopt : std::optional(first->until);
  }

 private:
  static bool IsReadBack(const Job& job) { return job.As<Job::ReadBack>() != nullptr; }

  struct One {
    std::unique_ptr<Job> job;
    Instant until{};
    const Member* member() const { return job->member; }
  };

  std::vector<One> parked_;
};

// All that waits to be sent on a line, and whose turn it is: polls that are due, writes and their
// read-backs, requests of routes, probes, background tasks, jobs that were put aside.
// Chooser takes from the agenda what goes first.
struct Agenda {
  /// Both outlive it.
  Agenda(Roster& roster, const LateReplies& late)
      : routes(route_queue), probes(roster, late), background(schedule) {}

  Schedule schedule;
  WriteQueue write_queue;
  RouteQueue route_queue;
  RoutedSide routes;
  Probes probes;
  Background background;
  ParkedJobs parked;
  Turns turns;
};

// Requests of transparent routes as jobs: which of them may be sent now, and for whom a client
// waits. gateway/bus/writes/route_queue.h keeps them.
class RoutedJobs {
 public:
  /// All references outlive it.
  RoutedJobs(Roster& roster, Agenda& agenda, const LateReplies& late)
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
  const LateReplies& late_;
};

class Chooser {
 public:
  /// All references outlive the chooser.
  Chooser(Roster& roster, Agenda& agenda, const LateReplies& late);

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
  const LateReplies& late_;
  RoutedJobs routed_;
};

}  // namespace baudgate::bus
