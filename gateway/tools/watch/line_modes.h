// The loop of those modes of `watch` that print a line for whatever comes. RunWatchEvents prints
// events and alarms.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <optional>
#include <ostream>
#include <string>

#include "gateway/base/time.h"
#include "gateway/outputs/dds/fast/subscriber.h"
#include "gateway/tools/terminal/command_end.h"
#include "gateway/tools/watch/point_feed.h"
#include "gateway/tools/watch/watch.h"

namespace baudgate {

struct LineLoop {
  const StopSignals& signals;
  std::optional<Duration> seconds;  ///< the end, beside a signal and a reader of `out` that leaves
  int mailbox = -1;                 ///< readable when there is something to print
  std::function<void()> print;
};

void RunLineLoop(const LineLoop& loop, Listening& listening, std::ostream& out, std::ostream& err);

// `baudgate watch --events`, `--alarms`: what happens in the devices of all gateways, one line an
// event or change of an alarm.

std::string JsonLine(const dds::EventSample& event);
std::string PlainLine(const dds::EventSample& event);
std::string JsonLine(const dds::AlarmSample& alarm);
std::string PlainLine(const dds::AlarmSample& alarm);

/// As RunWatch.
int RunWatchEvents(const WatchOptions& options, std::ostream& out, std::ostream& err);

}  // namespace baudgate
