// Requests about what is kept: `writes`, `events`, `alarms`, `ack`, `history` and `kept_points`.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "gateway/control/request.h"

namespace baudgate::control {

Reply ShowWrites(Gateway& gateway, const Request& request);
Reply ShowEvents(Gateway& gateway, const Request& request);
Reply ShowAlarms(Gateway& gateway, const Request& request);
Reply Acknowledge(Gateway& gateway, const Request& request);
Reply ShowHistory(Gateway& gateway, const Request& request);
Reply ShowKeptPoints(Gateway& gateway, const Request& request);

}  // namespace baudgate::control
