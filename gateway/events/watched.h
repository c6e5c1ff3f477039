// Which alarms the configuration still watches: one that nobody watches would be active for ever.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "config/model/config.h"
#include "gateway/events/alarm.h"

namespace baudgate::events {

/// It may still be raised, and ended.
bool Watches(const config::Config& config, const Alarm& alarm);

}  // namespace baudgate::events
