// Where the jobs of one kind come from. Each kind implements this beside its job;
// gateway/bus/jobs/chooser.cpp has the list of all, and asks them in the order of
// gateway/bus/schedule/schedule.h.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <optional>

#include "gateway/base/time.h"
#include "gateway/bus/jobs/job.h"
#include "gateway/bus/schedule/turns.h"

namespace baudgate::bus {

class JobSource {
 public:
  virtual ~JobSource() = default;
  /// The line is idle. Null: nothing of this kind may be sent now.
  virtual std::unique_ptr<Job> Take(const Idle& idle) = 0;
  /// When Take may have something even if nothing else happens. May lie in the past.
  virtual std::optional<Instant> NextAt(const Idle& idle) const = 0;
};

}  // namespace baudgate::bus
