// How many readers and writers the participants of the domain may announce: the DDS library keeps
// each, whatever its topic. Pure and of bounded size; gateway/outputs/dds/fast/datagram_check.h
// asks it.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <vector>

#include "gateway/base/time.h"
#include "gateway/outputs/dds/fast/participant_table.h"
#include "gateway/outputs/dds/rtps/rtps_fields.h"

namespace baudgate::dds {

struct EndpointLimits {
  std::size_t of_participant = 512;
  std::size_t all = 8192;
  /// New ones of a participant, after a burst of as many as it may have.
  Duration new_interval = 10ms;
};

class EndpointTable {
 public:
  explicit EndpointTable(const EndpointLimits& limits) : limits_(limits) {}

  /// False: there is no room, or they come too fast. One of a participant that is not among
  /// `participants` passes: the library does not keep it.
  bool Announce(const Guid& endpoint, ParticipantTable& participants, Instant now);
  void Left(const Guid& endpoint);
  /// With all that it has announced.
  void ParticipantLeft(const GuidPrefix& prefix);

  std::size_t size() const;

 private:
  struct Owner {
    GuidPrefix prefix{};
    std::vector<std::uint32_t> entities;
    Instant full_at{};  ///< the bucket of new ones
  };

  Owner* Find(const GuidPrefix& prefix);

  EndpointLimits limits_;
  std::vector<Owner> owners_;
};

}  // namespace baudgate::dds
