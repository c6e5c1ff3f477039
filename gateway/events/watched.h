// Which alarms the configuration still watches, and with which priority: one that nobody watches
// would be active for ever.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

#include "config/model/config.h"
#include "gateway/events/alarm.h"

namespace baudgate::events {

/// Empty: it can be neither raised nor ended any more.
std::optional<config::AlarmPriority> PriorityOf(const config::Config& config, const Alarm& alarm);

}  // namespace baudgate::events
