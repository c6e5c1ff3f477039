// How each kind of job ends: facts in, effects out. Applied by gateway/bus/jobs/effect_applier.cpp.
//
//   kind         its end leads to
//   poll         line time of the fast round; the count of its query; a seldom group that was not
//                read is read again
//   read-back    a seldom group as above; not answered: its points are in doubt; its query gone:
//                they are read by the queries of the new plan
//   events       nothing of its own
//   background   how long its exchange took, or that it was lost or not sent
//   probe        nothing of its own
//   write        its points are in doubt until they are read; it is confirmed, goes on, or is
//                answered. Not answered: polls go before the next write
//   routed       its clients are answered. An unanswered write: as above
//
// For all kinds the end says whether the member is there, unless the job does not judge it.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "gateway/base/outcome.h"
#include "gateway/base/time.h"
#include "gateway/bus/jobs/job.h"
#include "gateway/bus/schedule/effects.h"

namespace baudgate {

/// Moves the requests of routes out of the job and changes nothing else of it.
EndEffects EffectsOf(Job& job, const JobEnd& end, Instant now);

}  // namespace baudgate
