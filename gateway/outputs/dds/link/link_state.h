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
    silent,  ///< the process runs, but has sent nothing for two seconds
    waiting,
  };
  Phase phase = Phase::waiting;
  bool opened = false;  ///< the present process has opened DDS
  Instant heard{};      ///< time of the process's last message
  std::string reason;   ///< why the last process ended, e.g. "was ended by signal 6"
  /// In the state `waiting`: the time when the gateway starts the next process; nothing: another
  /// program starts it.
  std::optional<Instant> next_start{};
  std::uint32_t times_lost = 0;
  Subscribers subscribers;
  std::uint64_t written = 0;  ///< samples written by all processes so far
  std::uint64_t refused = 0;  ///< samples that the library did not accept, by all processes so far
  /// Write requests that were handled; empty: writing over DDS is not allowed.
  std::optional<std::uint64_t> requests{};
  std::uint64_t requests_dropped = 0;  ///< write requests that came too fast or found no space
  /// Events that were published; empty: no device has events.
  std::optional<std::uint64_t> events{};
  std::uint64_t events_skipped = 0;  ///< events that were lost before they could be published
  /// Counts of all processes so far; `participants` are those of the present process.
  DatagramCounters datagrams;
  /// Sentences, each with a reason why subscribers receive nothing at present.
  std::vector<std::string> remarks;
};

}  // namespace baudgate::dds
