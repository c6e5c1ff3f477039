// The meter's part in the broadcast latch of its line (latch.h): when it is sent, and what is made
// of the values behind it.
//
//   FE 03 08 55 AA 33 CC   due, and the line is free
//   05 08 14 50            other bytes than before: heard
//   05 08 1B 03 00         good; of a meter that has not heard it: waiting, without a value
//
// From the reply to 08 14 50 on no value of the latch before is shown any more: all that is latched
// waits, and is read anew at once. Otherwise a value of 12:00 would stand beside one of 12:15.
// SPDX-License-Identifier: Apache-2.0
#include <algorithm>

#include "protocols/set4tm/conversation.h"
#include "protocols/set4tm/conversation_steps.h"
#include "protocols/set4tm/expect.h"

namespace baudgate::protocols::set4tm {

bool MeterConversation::LatchIsDue(const Task& task, Instant now) const {
  const bool may = task.kind != Task::Kind::write && task.kind != Task::Kind::probe;
  if (!may || settings_.latch == Duration::zero()) return false;
  const auto due = line_latch_.DueAt(settings_.latch);
  return due && *due <= now;
}

Request MeterConversation::MakeLatch() const {
  Request request;
  request.bytes = MakeFrame(Bytes{kBroadcast}, LatchPdu(), settings_.checksum);
  request.expect = Expect(request.bytes, settings_);
  request.stamped = true;
  return request;
}

Then MeterConversation::OnSent(const Task& /*task*/, const Request& /*request*/, Instant /*now*/) {
  line_latch_.OnSent();
  return Then::ask_again;
}

bool MeterConversation::AsksLatchTime(const Task& task, Instant now) const {
  if (settings_.latch == Duration::zero() || latch_.refused()) return false;
  const bool wants = latch_.WantsTime(line_latch_.number());
  if (task.kind == Task::Kind::poll) {
    return wants && ReadsLatched(fields_.PduOf(plan_, task.query));
  }
  if (task.kind != Task::Kind::background) return false;
  // Another meter's task may have been first with the broadcast, and then there is no job.
  return wants || std::ranges::none_of(jobs_, [now](const BackgroundJob* one) {
           const auto due = one->due();
           return due && *due <= now;
         });
}

/// What was read of the latch before, but for what `answer` brings itself.
void MeterConversation::DropLatched(Answer& answer) const {
  const auto queries = plan_.queries();
  for (std::size_t query = 0; query < queries.size(); ++query) {
    if (!ReadsLatched(fields_.PduOf(plan_, query))) continue;
    for (const std::size_t point : queries[query].points) {
      if (std::ranges::find(answer.readings, point, &Reading::point) != answer.readings.end())
        continue;
      answer.readings.push_back(
          {.point = point, .quality = {Quality::bad_waiting, Reason::not_ready}});
    }
  }
}

void MeterConversation::TakeLatched(Reply& reply) {
  if (settings_.latch == Duration::zero()) return;
  const unsigned number = line_latch_.number();
  if (Is(reply.pdu, AskLatchTime())) {
    const bool told = latch_.Told(number);
    latch_.OnTime(reply.data, number);
    if (!told || !latch_.Heard(number)) DropLatched(reply.answer);
    if (!told && latch_.Heard(number)) reply.answer.then = Then::restart;
  }
  const bool heard = latch_.Heard(number);
  const std::chrono::duration<double> sent = line_latch_.sent_at().time_since_epoch();
  for (Reading& reading : reply.answer.readings) {
    if (reading.point == kNoPoint) continue;
    if (!heard) {
      reading.value = {};
      reading.quality = {Quality::bad_waiting, Reason::not_ready};
    } else if (fields_.DecoderOf(reading.point) == Decoder::latched) {
      reading.value = sent.count();
      reading.quality = Quality::good;
    }
  }
}

}  // namespace baudgate::protocols::set4tm
