// All that waits to be sent on a line, and whose turn it is: polls that are due, writes and their
// read-backs, requests of routes, probes, background tasks, jobs that were put aside.
// gateway/bus/jobs/chooser.cpp takes from it what goes first.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "gateway/bus/devices/roster.h"
#include "gateway/bus/jobs/parked_jobs.h"
#include "gateway/bus/replies/late_answers.h"
#include "gateway/bus/schedule/background.h"
#include "gateway/bus/schedule/probes.h"
#include "gateway/bus/schedule/routed_side.h"
#include "gateway/bus/schedule/schedule.h"
#include "gateway/bus/schedule/turns.h"
#include "gateway/bus/schedule/write_queue.h"
#include "gateway/bus/writes/route_queue.h"

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
