// `BackgroundJob` is a read of low priority, such as a load profile. It is sent when there is
// enough time before the next poll, and at the latest one minute after it is due (`Background` in
// gateway/bus/schedule/schedule.h).
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>

#include "gateway/bus/jobs/job.h"
#include "gateway/bus/jobs/line_context.h"
#include "gateway/bus/schedule/schedule.h"

namespace baudgate::bus {

class BackgroundJob final : public Job {
 public:
  BackgroundJob(Member& who, Instant now)
      : Job(who, {.kind = protocols::Task::Kind::background}, now) {}

 protected:
  void End(const JobEnd& end, Instant /*now*/, EndEffects& effects) override {
    const Duration took = ProvesLife(end.outcome) ? wire : Duration::zero();
    effects.background = EndEffects::Background{was_sent, took, proved};
  }
};

class BackgroundSource final : public JobSource {
 public:
  BackgroundSource(LineContext& line, Background::Which which) : line_(line), which_(which) {}

  std::unique_ptr<Job> Take(const Idle& idle) override;
  std::optional<Instant> NextAt(const Idle& idle) const override;

 private:
  LineContext& line_;
  const Background::Which which_;
};

inline std::unique_ptr<Job> BackgroundSource::Take(const Idle& idle) {
  Background& background = line_.agenda.background;
  const auto place = background.Next(which_, idle.now);
  if (!place) return nullptr;
  const bool renews =
      which_ == Background::Which::that_fits && background.MayProve(*place, idle.now);
  background.OnTaken(*place, idle.now);
  auto job = std::make_unique<BackgroundJob>(line_.roster.device(*place), idle.now);
  job->renews_proof_early = renews;
  return job;
}

inline std::optional<Instant> BackgroundSource::NextAt(const Idle& idle) const {
  return line_.agenda.background.NextAt(idle.now);
}

}  // namespace baudgate::bus
