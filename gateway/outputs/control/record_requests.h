// Requests about what is kept: `writes`, `events`, `alarms`, `ack`, `history` and `kept_points`.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "gateway/outputs/control/request.h"

namespace baudgate::control {

Reply ShowWrites(const Gateway& gateway, const Request& request);
Reply ShowEvents(const Gateway& gateway, const Request& request);
Reply ShowAlarms(const Gateway& gateway, const Request& request);
Reply Acknowledge(const Gateway& gateway, const Request& request);
Reply ShowHistory(const Gateway& gateway, const Request& request);
Reply ShowKeptPoints(const Gateway& gateway, const Request& request);

}  // namespace baudgate::control
