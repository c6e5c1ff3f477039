// SPDX-License-Identifier: Apache-2.0
#include "protocols/set4tm/meter/latch.h"

#include <algorithm>

#include "protocols/set4tm/meter/codec.h"
#include "protocols/set4tm/meter/status.h"

namespace baudgate::protocols::set4tm {
namespace {

constexpr std::uint8_t kLatch = 0x08;    // parameter of kWrite
constexpr std::uint8_t kLatched = 0x14;  // parameter of kRead
constexpr std::uint8_t kLatchTime = 0x50;
/// If this machine's clock is set back by less than this, no second broadcast is sent for the same
/// period.
constexpr Duration kGuard = 1s;

}  // namespace

Bytes LatchPdu() { return {kWrite, kLatch, 0x55, 0xAA, 0x33, 0xCC}; }

/// True for the latch broadcast. Meters of type .03 and later accept any value of its byte after
/// 08, so the byte is not compared.
bool IsLatch(View pdu) {
  return pdu.size() == 6 && pdu[0] == kWrite && pdu[1] == kLatch &&
         std::ranges::equal(pdu.subspan(3), Bytes{0xAA, 0x33, 0xCC});
}

Bytes AskLatchTime() { return {kRead, kLatched, kLatchTime}; }

bool ReadsLatched(View pdu) {
  if (pdu.size() < 3 || pdu[0] != kRead) return false;
  if (pdu[1] == kFloatMask) return pdu.size() > 3 && pdu[3] == 1;
  return pdu[1] == kLatched || (pdu[1] == kFloats && (pdu[2] & 1U) != 0);
}

void LineLatch::OnClock(Now now) {
  if (!clock_) base_ = now;
  clock_ = now;
}

std::optional<Instant> LineLatch::DueAt(Duration period) const {
  if (!clock_) return std::nullopt;
  const Duration shown = base_.wall.time_since_epoch();
  const Duration next = (shown + kGuard) / period * period + period;
  const Instant due = clock_->instant + (next - clock_->wall.time_since_epoch());
  // If this machine's clock was set far back, the broadcast is still sent after two periods.
  return std::min(due, base_.instant + 2 * period);
}

void LineLatch::OnSent() {
  base_ = *clock_;
  ++number_;
}

void MeterLatch::OnTime(View time, unsigned number) {
  const bool same = time_ && std::ranges::equal(*time_, time);
  if (asked_ == number) {
    heard_ = heard_ && same;
  } else {
    const bool compares = time_ && asked_ && *asked_ + 1 == number;
    heard_ = compares && !same;
    missed_ = compares && same;
  }
  time_.emplace(time.begin(), time.end());
  asked_ = number;
  doubted_ = false;
}

void MeterLatch::OnFailure(unsigned number) {
  *this = {};
  asked_ = number;
}

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
  if (meter_.refused())
    return "the meter does not report the time of its latch (08 14 50), so its latched values are "
           "not used";
  if (meter_.Missed(line_.number())) {
    return "the meter missed the latest latch broadcast (FE 03 08), so its latched values are not "
           "used";
  }
  return "";
}

}  // namespace baudgate::protocols::set4tm
