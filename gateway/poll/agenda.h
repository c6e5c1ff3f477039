// All that waits to be sent on a line: polls that are due, writes and their read-backs, requests
// of routes. gateway/poll/chooser.cpp takes from it what goes first.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "gateway/poll/routed_side.h"
#include "gateway/poll/schedule.h"
#include "gateway/poll/write_queue.h"

namespace baudgate {

struct Agenda {
  Schedule schedule;
  WriteQueue write_queue;
  RoutedSide routes;
};

}  // namespace baudgate
