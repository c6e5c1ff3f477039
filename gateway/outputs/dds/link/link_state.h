// `LinkState` is the state of the process baudgate-dds, for `baudgate status`.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "gateway/base/time.h"
#include "gateway/outputs/dds/domain.h"

namespace baudgate::dds {

struct LinkState {
  enum class Phase : std::uint8_t {
    starting,  ///< the process runs and has not opened DDS yet
    up,
    silent,   ///< the process runs and has sent nothing for two seconds
    waiting,  ///< there is no process
  };
  Phase phase = Phase::waiting;
  bool opened = false;  ///< the process has opened DDS
  Instant heard{};      ///< time of its last message
  std::string reason;   ///< why the last process ended, e.g. "was ended by signal 6"
  /// In `waiting`: when we start the next process; empty: another program starts it.
  std::optional<Instant> next_start{};
  std::uint32_t times_lost = 0;  ///< processes that ended after they had opened DDS
  Subscribers subscribers;
  std::uint64_t written = 0;  ///< samples written by all processes so far
  std::uint64_t refused = 0;  ///< samples that the library did not accept, by all processes so far
  /// With `dds: { write: allow }`: write requests that were handled; and those that came too fast
  /// and were dropped.
  std::optional<std::uint64_t> requests{};
  std::uint64_t requests_dropped = 0;
  /// If devices have events: events that were published, and those that could not be.
  std::optional<std::uint64_t> events{};
  std::uint64_t events_skipped = 0;
  DatagramCounters datagrams;  ///< of all processes so far; `participants`: of the present process
  /// Why subscribers receive nothing at present, one sentence each.
  std::vector<std::string> remarks;
};

}  // namespace baudgate::dds
