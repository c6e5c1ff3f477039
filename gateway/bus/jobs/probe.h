// `ProbeJob` sends one small request to a device. If an absent device answers the probe, it is
// back. A probe can also go before another job, which waits behind it. The answer then shows which
// device is there, and whether replies come in order.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <string>
#include <utility>

#include "gateway/bus/jobs/job.h"

namespace baudgate::bus {

class ProbeJob final : public Job {
 public:
  /// `goal`: the job that waits behind the probe; null: no job waits.
  ProbeJob(Member& who, Instant now, std::unique_ptr<Job> goal = nullptr)
      : Job(who, {.kind = protocols::Task::Kind::probe}, now), goal_(std::move(goal)) {}

  NextStep Ask(LineContext& line, int repeats, Instant now) override;
  /// Ends the probe. If a job waits behind the probe, decides how this job continues or ends:
  ///
  ///   the probe                     the job behind it
  ///   was answered, in order        continues
  ///   failed                        ends with the outcome of the probe
  ///   was refused, or unsupported   ends as no_reply: it was not sent
  ///   was answered busy or ok, and  ends as busy
  ///   the device wants no requests
  ///   now, or replies are out of
  ///   order
  ///   its device is disabled now    ends as no_reply
  ///   a second reply came           ends as unexpected, if an answer waits
  ///
  After Finish(LineContext& line, const JobEnd& end, Instant now) override;
  After GoUnproved(LineContext& line, const std::string& why, Instant now) override;

  LineUse use() const override { return LineUse::probes; }
  bool ReadsBack(const Member& of) const override {
    return goal_ && goal_->ReadsBack(of) && !had_failure;
  }
  const Job& goal() const override {
    if (goal_) return *goal_;
    return *this;
  }
  std::unique_ptr<Job> TakeGoal() override { return std::move(goal_); }
  void OnSecondReply() override { spoilt_ = true; }
  void Abandon(std::uint64_t client, bool /*unsent*/) override {
    if (goal_) goal_->Abandon(client, false);
  }

 protected:
  bool MustRepeat(const LineContext& line, Instant now) const override;
  void OnReplaced(LineContext& line, Now now) override;

 private:
  std::unique_ptr<Job> goal_;
  bool spoilt_ = false;  // a second reply came while `goal_` waits
};

class ProbeSource final : public JobSource {
 public:
  explicit ProbeSource(LineContext& line) : line_(line) {}

  std::unique_ptr<Job> Take(const Idle& idle) override;
  std::optional<Instant> NextAt(const Idle& idle) const override;

 private:
  LineContext& line_;
};

}  // namespace baudgate::bus
