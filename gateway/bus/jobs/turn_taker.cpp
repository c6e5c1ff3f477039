// SPDX-License-Identifier: Apache-2.0
#include "gateway/bus/jobs/turn_taker.h"

#include <algorithm>
#include <memory>
#include <utility>

#include "gateway/base/deadline.h"

namespace baudgate {

void TurnTaker::OnTime(Now now, Duration passed, bool idle) {
  chooser_.OnTime(passed, idle ? nullptr : run_.member());
  run_.SetTime(now);
}

bool TurnTaker::Take(const Idle& idle) {
  const Member* last = nullptr;
  while (CountTurn(last, idle.now)) {
    if (run_.job() == nullptr) {
      if (hold_.holds()) return false;
      ChargeProbe(idle.now);  // of one that was not sent
      std::unique_ptr<Job> job = chooser_.Next(idle);
      if (!job) return false;
      last = job->member;
      run_.Begin(std::move(job));
      continue;
    }
    switch (run_.TakeTurn()) {
      case JobRun::Turn::send:
        return true;
      case JobRun::Turn::next:
        break;
      case JobRun::Turn::wait:
        return false;
    }
  }
  return false;
}

/// Counts one more turn. False: there were too many at this moment. `last`: the member of the
/// latest job.
bool TurnTaker::CountTurn(const Member* last, Instant now) {
  const TurnLimit::Turn turn = limit_.Take(now);
  const Member* const member = run_.job() != nullptr ? run_.job()->member : last;
  if (turn == TurnLimit::Turn::rest_and_tell && member != nullptr) {
    account_.Warn(*member, TurnLimit::kWarning);
  }
  return turn == TurnLimit::Turn::take;
}

std::optional<Instant> TurnTaker::NextAt(const Idle& idle) const {
  if (const auto rest = limit_.RestsUntil(idle.now)) return rest;
  if (run_.job() != nullptr) return run_.NextTurnAt();  // until no late answer can meet its request
  std::optional<Instant> soonest;
  if (const auto until = hold_.WaitsUntil()) {
    const Instant clear = std::min(chooser_.AllClearAt(), *until);
    if (clear > idle.now) soonest = clear;
  }
  return hold_.holds() ? soonest : Soonest({soonest, chooser_.NextAt(idle)});
}

bool TurnTaker::Pause(Instant now) {
  hold_.Pause(now);
  return run_.job() == nullptr && std::min(chooser_.AllClearAt(), *hold_.WaitsUntil()) <= now;
}

}  // namespace baudgate
