// SPDX-License-Identifier: Apache-2.0
#include "protocols/set4tm/latched_reads.h"

#include <algorithm>

#include "protocols/set4tm/conversation_steps.h"

namespace baudgate::protocols::set4tm {
namespace {

constexpr Quality kWaits = {Quality::bad_waiting, Reason::not_ready};

}  // namespace

bool LatchedReads::IsDue(Instant now) const {
  if (period_ == Duration::zero()) return false;
  const auto due = line_.DueAt(period_);
  return due && *due <= now;
}

std::optional<Instant> LatchedReads::DueAt() const {
  if (!tells()) return std::nullopt;
  return WantsTime() ? Instant() : line_.DueAt(period_);
}

void LatchedReads::OnFailure(View asked) {
  meter_.Doubt();
  if (Is(asked, AskLatchTime())) meter_.OnFailure(line_.number());
}

void LatchedReads::Drop(Answer& answer, const PointReads& reads) {
  const auto queries = reads.Queries();
  for (std::size_t query = 0; query < queries.size(); ++query) {
    if (!reads.ReadsLatched(query)) continue;
    for (const std::size_t point : queries[query].points) {
      const auto& readings = answer.readings;
      if (std::ranges::find(readings, point, &Reading::point) != readings.end()) continue;
      answer.readings.push_back({.point = point, .quality = kWaits});
    }
  }
}

void LatchedReads::Take(Reply& reply, const PointReads& reads) {
  if (period_ == Duration::zero() || !ReadsLatched(reply.pdu)) return;
  const unsigned number = line_.number();
  if (Is(reply.pdu, AskLatchTime())) {
    const bool told = meter_.Told(number);
    meter_.OnTime(reply.data, number);
    if (!told || !meter_.Heard(number)) Drop(reply.answer, reads);
    if (!told && meter_.Heard(number)) reply.answer.then = Then::restart;
  }
  const bool heard = meter_.Heard(number);
  const std::chrono::duration<double> sent = line_.sent_at().time_since_epoch();
  for (Reading& reading : reply.answer.readings) {
    if (reading.point == kNoPoint) continue;
    if (!heard) {
      reading.value = {};
      reading.quality = kWaits;
    } else if (reads.fields().DecoderOf(reading.point) == Decoder::latched) {
      reading.value = sent.count();
      reading.quality = Quality::good;
    }
  }
}

std::string LatchedReads::Learned() const {
  if (meter_.refused()) return "does not tell when it latched: its latched values are not served";
  if (meter_.Missed(line_.number())) {
    return "has not heard the latest latch: its latched values are not served";
  }
  return "";
}

}  // namespace baudgate::protocols::set4tm
