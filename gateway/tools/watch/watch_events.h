// `baudgate watch --events`, `--alarms`: what happens in the devices of all gateways, one line an
// event or change of an alarm.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <ostream>
#include <string>

#include "gateway/outputs/dds/fast/subscriber.h"
#include "gateway/tools/watch/watch.h"

namespace baudgate {

std::string JsonLine(const dds::EventSample& event);
std::string PlainLine(const dds::EventSample& event);
std::string JsonLine(const dds::AlarmSample& alarm);
std::string PlainLine(const dds::AlarmSample& alarm);

/// As RunWatch.
int RunWatchEvents(const WatchOptions& options, std::ostream& out, std::ostream& err);

}  // namespace baudgate
