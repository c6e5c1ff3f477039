// All that waits to be sent on a line, and whose turn it is: polls that are due, writes and their
// read-backs, requests of routes, probes, background tasks, jobs that were put aside.
// gateway/poll/chooser.cpp takes from it what goes first.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "gateway/poll/background.h"
#include "gateway/poll/late_answers.h"
#include "gateway/poll/parked_jobs.h"
#include "gateway/poll/probes.h"
#include "gateway/poll/roster.h"
#include "gateway/poll/routed_side.h"
#include "gateway/poll/schedule.h"
#include "gateway/poll/turns.h"
#include "gateway/poll/write_queue.h"
#include "gateway/requests/route_queue.h"

namespace baudgate {

struct Agenda {
  /// Both outlive it.
  Agenda(Roster& roster, const LateAnswers& late)
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

}  // namespace baudgate
