// `Agenda` contains all work that waits on one serial line: due polls, writes and read-backs,
// requests of routes, probes, background reads and parked jobs. `Chooser` takes the next job from
// it.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "gateway/bus/jobs/job.h"
#include "gateway/bus/schedule/probes.h"
#include "gateway/bus/schedule/schedule.h"
#include "gateway/bus/schedule/turns.h"
#include "gateway/bus/writes/route_queue.h"
#include "gateway/bus/writes/write_queue.h"

namespace baudgate::bus {

// `ParkedJobs` contains interrupted jobs. A job is parked, while the line does other work, if its
// device is busy or may still send a late reply. Each device has at most one parked read-back (a
// read after a write) and one other parked job.
class ParkedJobs final {
 public:
  void Park(std::unique_ptr<Job> job, Instant until) { parked_.push_back({std::move(job), until}); }
  /// Takes a job whose waiting time is over, or returns null.
  std::unique_ptr<Job> Take(Instant now) {
    const auto next =
        std::ranges::find_if(parked_, [now](const One& one) { return one.until <= now; });
    if (next == parked_.end()) return nullptr;
    std::unique_ptr<Job> job = std::move(next->job);
    parked_.erase(next);
    return job;
  }
  /// True if a job of the same device and kind (read-back or other) is parked, so `job` must not be
  /// parked.
  bool HasLike(const Job& job) const {
    return std::ranges::any_of(parked_, [&job](const One& one) {
      return one.member() == job.member && one.job->is_read_back() == job.is_read_back();
    });
  }
  /// True if a read-back of points of `member` is parked, and none of its exchanges has failed.
  bool HasReadBack(const Member& member) const {
    return std::ranges::any_of(parked_,
                               [&member](const One& one) { return one.job->ReadsBack(member); });
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
  std::optional<Instant> NextAt() const {
    const auto first = std::ranges::min_element(parked_, {}, &One::until);
    return first == parked_.end() ? std::nullopt : std::optional(first->until);
  }

 private:
  struct One {
    std::unique_ptr<Job> job;
    Instant until{};
    const Member* member() const { return job->member; }
  };

  std::vector<One> parked_;
};

struct Agenda {
  /// Both references must stay valid for the lifetime of this object.
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

}  // namespace baudgate::bus
