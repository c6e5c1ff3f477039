// SPDX-License-Identifier: Apache-2.0
#include "gateway/bus/jobs/background.h"

#include "gateway/bus/jobs/line_context.h"

namespace baudgate::bus {

std::unique_ptr<Job> BackgroundSource::Take(const Idle& idle) {
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

std::optional<Instant> BackgroundSource::NextAt(const Idle& idle) const {
  return line_.agenda.background.NextAt(idle.now);
}

}  // namespace baudgate::bus
