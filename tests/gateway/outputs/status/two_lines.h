// A gateway with two lines and three devices, without ports, and functions that fill its store.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "config/model/config.h"
#include "gateway/bus/points/point_store.h"

namespace baudgate::status {

config::Config TwoLines();

inline constexpr Instant kStarted{1h};
inline constexpr Now kNow{kStarted + 3h, WallTime{1'790'000'000s}};

void SetOpen(bus::PointStore& store, std::uint32_t line, const std::string& text);
void AddExchanges(bus::PointStore& store, std::uint32_t device, Outcome outcome,
                  std::uint32_t count, Now at, Duration round_trip = 20ms);

}  // namespace baudgate::status
