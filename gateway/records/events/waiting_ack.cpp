// SPDX-License-Identifier: Apache-2.0
#include "gateway/records/events/waiting_ack.h"

#include "gateway/records/events/own_records.h"

namespace baudgate::events {

std::size_t TellAcks(const AckQuery& query, const std::vector<Alarm>& alarms, EventBook& book,
                     WallTime at) {
  std::size_t count = 0;
  for (const Alarm& alarm : alarms) {
    if (!IsUnacknowledged(alarm.state) || !query.Means(alarm)) continue;
    book.TellAlways(AckRecord(alarm, query, at));
    ++count;
  }
  return count;
}

void AnswerAcks(const std::vector<WaitingAck>& acks, const std::string& trouble) {
  for (const WaitingAck& ack : acks) ack.done({ack.alarms, trouble, ack.at});
}

}  // namespace baudgate::events
