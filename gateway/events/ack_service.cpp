// SPDX-License-Identifier: Apache-2.0
#include "gateway/events/ack_service.h"

#include "gateway/events/own_records.h"

namespace baudgate::events {

std::size_t AckService::Tell(const AckQuery& query, const std::vector<Alarm>& alarms,
                             EventBook& book, WallTime at) {
  std::size_t count = 0;
  for (const Alarm& alarm : alarms) {
    if (!IsUnacknowledged(alarm.state) || !query.Means(alarm)) continue;
    book.TellAlways(AckRecord(alarm, query, at));
    ++count;
  }
  return count;
}

void AckService::Answer(const std::vector<Ack>& acks, const std::string& trouble) {
  for (const Ack& ack : acks) ack.done({ack.alarms, trouble, ack.at});
}

}  // namespace baudgate::events
