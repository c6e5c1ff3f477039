// Jobs that wait while the line goes on: their device was busy, or a late reply of it may still
// come. Chosen again by gateway/bus/jobs/chooser.cpp.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "gateway/bus/jobs/job.h"

namespace baudgate {

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

}  // namespace baudgate
