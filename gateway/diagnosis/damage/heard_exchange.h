// One exchange, and all that comes from its request until the next one. A part of
// gateway/diagnosis/damage/examiner.h. Bounded memory.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <utility>
#include <vector>

#include "gateway/base/bytes.h"
#include "gateway/base/outcome.h"
#include "gateway/base/time.h"
#include "gateway/bus/devices/roster.h"
#include "gateway/bus/exchange/line.h"
#include "gateway/diagnosis/damage/examine.h"

namespace baudgate {

class HeardExchange {
 public:
  /// The port has opened. What comes before Begin belongs to no exchange.
  void OnOpened() { member_ = nullptr; }
  void Begin(const Member& member, const Request& request, const LineTimes& times, Instant now);
  void Hear(View bytes, Instant now);
  /// The frame was taken for the reply.
  void Take(View frame) { frame_.assign(frame.begin(), frame.end()); }
  void End(Outcome outcome);
  /// More has come since its end, or since it was asked last.
  bool TakeMore();

  /// Null: there was none since the port was opened.
  const Member* member() const { return member_; }
  const Request& request() const { return request_; }
  const LineTimes& times() const { return times_; }
  /// The computed end of the request.
  Instant sent() const { return sent_; }
  /// The silence before the request.
  Duration idle() const { return idle_; }
  /// Outcome::none: it has not ended.
  Outcome outcome() const { return outcome_; }
  const Bytes& heard() const { return heard_; }
  Bytes TakeHeard() { return std::exchange(heard_, {}); }
  const std::vector<Arrival>& arrivals() const { return arrivals_; }
  /// When the latest bytes came. Only if some have come.
  Instant last_came() const { return sent_ + arrivals_.back().after; }
  /// The reply; empty: none was taken.
  const Bytes& frame() const { return frame_; }
  /// What was heard before and after the reply; without one, before it.
  std::pair<View, View> BesideReply() const;
  /// The same, for gateway/diagnosis/damage/examine.h.
  Hearing AsHearing(const Roster& roster) const;

 private:
  const Member* member_ = nullptr;
  Request request_;
  LineTimes times_;
  Instant sent_{};
  Instant last_{};  // when something was on the line last
  Duration idle_{};
  Outcome outcome_ = Outcome::none;
  std::size_t judged_ = 0;  // bytes that had come when it was looked at
  Bytes heard_;
  std::vector<Arrival> arrivals_;
  Bytes frame_;
};

}  // namespace baudgate
