// The account of a line: what it has carried, what its time went to, and what is wrong with it as a
// whole. Shown in the point store, its bytes in the tap.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>

#include "gateway/base/outcome.h"
#include "gateway/base/time.h"
#include "gateway/bus/counters/burst.h"
#include "gateway/bus/counters/line_minute.h"
#include "gateway/bus/devices/poller_listener.h"
#include "gateway/bus/devices/roster.h"
#include "gateway/bus/exchange/echo_watch.h"
#include "gateway/bus/exchange/tap.h"
#include "gateway/bus/points/line_status.h"
#include "gateway/bus/points/point_store.h"

namespace baudgate {

class LineAccount {
 public:
  /// `line`: its index in the store. All references outlive it.
  LineAccount(PointStore& store, std::uint32_t line, PollerListener& listener)
      : store_(store), line_(line), listener_(listener) {}

  void Attach(Tap& tap) { tap_ = &tap; }

  /// Time has passed; `busy`: the line was busy, or `drains`: it kept silence after an exchange.
  /// Returns how much of the time that took.
  Duration OnTime(Now now, bool busy, bool drains);
  void OnOpened();
  void OnClosed();

  void OnSent(const Member& member, const Request& request);
  /// Bytes came, while `member` was asked; null: nobody was.
  void OnHeard(const EchoWatch::Received& heard, const Member* member);
  /// `broadcast`: nothing has answered. `use`: what it was for.
  void OnExchange(const Member& member, const ExchangeEnd& end, bool broadcast, LineUse use);
  /// About a member, for the user.
  void Warn(const Member& member, const std::string& warning) {
    listener_.OnWarning(member.index, warning);
  }
  /// A device has sent something unasked, with this outcome.
  void OnUnasked(Outcome outcome) {
    Count(outcome);
    if (ProvesLife(outcome)) OnAnswer();
  }
  void OnProbe() { ++counters_.probes; }
  void OnLate() { ++counters_.late; }
  /// `counts`: they are no rest of a broken reply.
  void OnStray(std::size_t count, bool counts) {
    counters_.babble += count;
    if (counts) counters_.stray_bytes += count;
  }
  void OnNegotiation() { ++counters_.negotiations; }
  /// `echo: verify`: the echo of a request was missing.
  void OnNoEcho() { ++counters_.collisions; }
  /// `cut`: the bus has stopped echoing (gateway/bus/exchange/echo_watch.h), as `member` was asked.
  void OnRing(const Member& member, bool cut);

  /// `notice_bound`: see LineStatus.
  void Show(Duration notice_bound) const;

  const LineCounters& counters() const { return counters_; }
  /// Replies of devices, so far.
  std::uint64_t Answers() const;
  /// Nothing that was asked since `when` was answered, and nothing came unasked: a serial server
  /// may hang although its TCP connection lives.
  bool SilentSince(Instant when) const {
    return silent_from_ && *silent_from_ < when && last_failure_ >= when;
  }

 private:
  void Count(Outcome outcome);
  void OnAnswer();
  void OnCollision();

  PointStore& store_;
  const std::uint32_t line_;
  PollerListener& listener_;
  Tap* tap_ = nullptr;
  LineCounters counters_;
  LineMinute minute_;
  Now now_{};
  bool open_ = false;
  bool echoes_ = false;                 // the request under way has come back
  std::optional<WallTime> cut_since_;   // the ring
  Burst others_;                        // echoes that differed
  std::optional<Instant> silent_from_;  // since then no device has answered
  Instant last_failure_{};              // of an exchange
};

}  // namespace baudgate
