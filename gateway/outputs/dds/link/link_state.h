// How it stands with the process that speaks DDS: what `baudgate status` shows of it.
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
    starting,  ///< it runs, and has not said yet that samples may come
    up,
    silent,   ///< it runs and has not been heard of for two seconds
    waiting,  ///< there is none
  };
  Phase phase = Phase::waiting;
  bool opened = false;                  ///< its library is open
  Instant heard{};                      ///< the last sign of life
  std::string reason;                   ///< why there is none: "it was ended by signal 6"
  std::optional<Instant> next_start{};  ///< of `waiting`; empty: it comes when somebody starts it
  std::uint32_t times_lost = 0;         ///< how often one that was there was lost
  Subscribers subscribers;
  std::uint64_t written = 0;  ///< samples, by all processes so far
  std::uint64_t refused = 0;  ///< samples that the library did not take, likewise
  /// Where `dds: { write: allow }` stands: write requests that were looked at, and those that came
  /// too fast to be.
  std::optional<std::uint64_t> requests{};
  std::uint64_t requests_dropped = 0;
  /// Where devices have events: those that were published, and those that could not be.
  std::optional<std::uint64_t> events{};
  std::uint64_t events_skipped = 0;
  DatagramCounters datagrams;        ///< the same; its participants now
  std::vector<std::string> remarks;  ///< why subscribers can get nothing now, a sentence each
};

}  // namespace baudgate::dds
