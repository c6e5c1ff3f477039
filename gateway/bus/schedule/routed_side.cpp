// SPDX-License-Identifier: Apache-2.0
#include "gateway/bus/schedule/routed_side.h"

#include <limits>
#include <utility>

namespace baudgate {
namespace {

/// In whose name slaves that are offline are asked.
constexpr std::uint64_t kNobody = std::numeric_limits<std::uint64_t>::max();

}  // namespace

std::optional<Instant> RoutedSide::ClientsGone() const {
  return answered_at_ ? std::optional(*answered_at_ + kClientsReturn) : std::nullopt;
}

std::vector<RoutedRequest> RoutedSide::TakeHopeless(const Member& slave, std::size_t keep,
                                                    const PduCarrier& carrier, Instant now) {
  std::vector<RoutedRequest> reads = queue_.TakeReads(slave.slave, keep);
  for (const RoutedRequest& read : reads) {
    if (carrier.is_common(read.pdu)) refused_[slave.slave] = {read.pdu, now};
  }
  return reads;
}

bool RoutedSide::MayRepeatRead(const Member& slave, bool behind, Instant now) const {
  const auto refused = refused_.find(slave.slave);
  if (refused == refused_.end()) return false;
  return now - refused->second.at < (behind ? kStillWanted : kClientsReturn);
}

RouteQueue::Batch RoutedSide::RepeatRead(const Member& slave) const {
  RoutedRequest read;
  read.client = kNobody;
  read.slave = slave.slave;
  read.pdu = refused_.at(slave.slave).pdu;
  read.deadline = Instant::max();
  read.done = [](const RoutedReply&) {};
  RouteQueue::Batch batch;
  batch.push_back(std::move(read));
  return batch;
}

}  // namespace baudgate
