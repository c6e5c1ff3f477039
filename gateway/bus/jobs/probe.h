// A probe finds out whether an absent device is back, or, before another job, whose replies come.
// Then that job waits behind the probe.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <string>
#include <utility>

#include "gateway/bus/jobs/job.h"

namespace baudgate::bus {

class ProbeJob final : public Job {
 public:
  /// `goal`: the job that waits behind it; null: none.
  ProbeJob(Member& who, Instant now, std::unique_ptr<Job> goal = nullptr)
      : Job(who, {.kind = protocols::Task::Kind::probe}, now), goal_(std::move(goal)) {}

  NextStep Ask(LineContext& line, int repeats, Instant now) override;
  /// Without a job behind it: as every job. Else that job goes on, or ends:
  ///
  ///   the probe                     the job behind it
  ///   was answered, in order        goes on
  ///   has failed                    ends as the probe has
  ///   was refused, or unknown       ends as no_reply: it was not sent
  ///   was answered with busy, ok,   ends as busy
  ///   and peace is wanted, or the
  ///   replies are not in order
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
  bool spoilt_ = false;  // a second reply has come since the goal waits
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
