// SPDX-License-Identifier: Apache-2.0
#include "gateway/store/line_status.h"

#include <algorithm>

namespace baudgate {

LineCounters& LineCounters::operator+=(const LineCounters& other) {
  exchanges += other.exchanges;
  for (std::size_t i = 0; i < kOutcomeCount; ++i) outcomes[i] += other.outcomes[i];
  bytes_in += other.bytes_in;
  bytes_out += other.bytes_out;
  stray_bytes += other.stray_bytes;
  late += other.late;
  collisions += other.collisions;
  echoes += other.echoes;
  probes += other.probes;
  busy += other.busy;
  round_trips.Add(other.round_trips);
  return *this;
}

void LineStatus::AddLane(const LineStatus& lane) {
  static_cast<LineCounters&>(*this) += lane;
  use = std::max(use, lane.use);
  notice_bound = std::max(notice_bound, lane.notice_bound);
}

}  // namespace baudgate
