// `LineAccount` counts the traffic of one serial line, the use of its time, and faults that concern
// the whole line. It writes the counts to the point store and passes the bytes to the tap. `Burst`
// detects repeated events; `LineMinute` measures how the time of the line is used.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <utility>

#include "gateway/base/outcome.h"
#include "gateway/base/time.h"
#include "gateway/bus/devices/poller_listener.h"
#include "gateway/bus/devices/roster.h"
#include "gateway/bus/exchange/line.h"
#include "gateway/bus/points/line_status.h"
#include "gateway/bus/points/point_store.h"
#include "gateway/bus/replies/ended_exchange.h"

namespace baudgate::bus {

// `Burst` separates repeated events from a single event, which may be chance. A burst begins when
// the event has happened three times with less than a minute between two events in a row. It ends
// after a minute without the event.
class Burst {
 public:
  static constexpr int kCount = 3;
  static constexpr Duration kTime = 1min;

  /// Call when the event has happened. Returns true if a burst begins with it.
  bool Add(Instant now) {
    if (count_ == 0 || now - last_ >= kTime) count_ = 0;
    last_ = now;
    return ++count_ >= kCount && !std::exchange(going_on_, true);
  }
  /// Returns true, once, if the burst has ended at `now`.
  bool EndsAt(Instant now) { return going_on_ && now - last_ >= kTime && !(going_on_ = false); }

 private:
  int count_ = 0;  // events so far, each less than a minute after the event before
  Instant last_{};
  bool going_on_ = false;
};

// `LineMinute` measures for what the time of a line is used (LineUse), since the start and in the
// present minute. The use of an exchange is known only when it ends; until then its time counts as
// busy without a use.
class LineMinute {
 public:
  /// The parts of a minute, 0 to 1, in which the line was busy.
  struct Use {
    double busy = 0;
    LineShares shares{};  ///< parts of `busy` by use, as far as the use is known
  };

  /// The port was opened, so no exchange is under way, and a new minute begins.
  void OnOpened(Instant now) {
    exchange_ = {};
    full_.reset();
    Begin(now);
  }
  void OnClosed() { full_ = Use{}; }
  /// Call after OnExchangeTime or OnDrained was called for the time up to `now`.
  void OnTime(Instant now) {
    if (now - began_ < kMinute) return;
    full_ = UseAt(now);
    Begin(now);
  }
  void OnExchangeTime(Duration passed) {
    exchange_ += passed;
    busy_ += passed;
  }
  void OnDrained(Duration passed) {
    Of(LineUse::drains) += passed;
    busy_ += passed;
  }
  void CountExchange(LineUse use) { Of(use) += std::exchange(exchange_, {}); }

  const TimeByUse& spent() const { return spent_; }
  /// Returns the use of the last complete minute. Before a minute is complete, returns the use
  /// since the port was opened.
  Use use(Instant now) const { return full_ ? *full_ : UseAt(now); }

 private:
  static constexpr Duration kMinute = std::chrono::minutes(1);
  /// If the present minute is shorter than this, its use is shown as zero.
  static constexpr Duration kShortest = std::chrono::seconds(10);

  /// Begins a new minute. The time of an exchange under way is counted when the exchange ends.
  void Begin(Instant now) {
    began_ = now;
    before_ = spent_;
    busy_ = {};
  }
  Use UseAt(Instant now) const {
    const Duration whole = now - began_;
    if (whole < kShortest) return {};
    const auto part = [whole](Duration of) {
      return static_cast<double>(of.count()) / static_cast<double>(whole.count());
    };
    Use use{.busy = part(busy_)};
    for (std::size_t i = 0; i < kLineUses; ++i) use.shares[i] = part(spent_[i] - before_[i]);
    return use;
  }
  Duration& Of(LineUse use) { return spent_[static_cast<std::size_t>(use)]; }

  TimeByUse spent_{};
  TimeByUse before_{};  // spent_ at the beginning of the minute
  Duration busy_{};
  Duration exchange_{};
  Instant began_{};
  std::optional<Use> full_;
};

class LineAccount final : public ExchangeObserver {
 public:
  /// `line`: index of the line in the point store. All references must stay valid for the lifetime
  /// of this object.
  LineAccount(PointStore& store, std::uint32_t line, PollerListener& listener)
      : store_(store), line_(line), listener_(listener) {}

  void Attach(Tap& tap) { tap_ = &tap; }

  /// Reports that time has passed until `now`. `busy`: the line was busy. `drains`: the line kept
  /// silence after an exchange. Returns how long the line was busy.
  Duration OnTime(Now now, bool busy, bool drains);
  void OnOpened();
  void OnClosed();

  void OnSent(const Member& member, const protocols::Request& request);
  /// Bytes were received while `member` was asked (null: no exchange was under way).
  void OnHeard(const EchoWatch::Received& heard, const Member* member);
  void OnExchange(const EndedExchange& ended, Now now) override;
  void Warn(const Member& member, const std::string& warning) {
    listener_.OnWarning(member.index, warning);
  }
  void OnUnasked(Outcome outcome) {
    Count(outcome);
    if (ProvesLife(outcome)) OnAnswer();
  }
  void OnProbe() { ++counters_.probes; }
  void OnLate() { ++counters_.late; }
  /// Counts bytes that belong to no exchange. `counts`: the bytes are not the rest of a broken
  /// reply, so they count as LineCounters::stray_bytes too.
  void CountStray(std::size_t count, bool counts) {
    counters_.babble += count;
    if (counts) counters_.stray_bytes += count;
  }
  void OnNegotiation() { ++counters_.negotiations; }

  /// Writes all counts to the status of the line. `notice_bound`: see LineStatus.
  void Show(std::optional<Duration> notice_bound) const;

  const LineCounters& counters() const { return counters_; }
  std::uint64_t Answers() const;
  /// Returns true if requests failed at `when` or later, and no answer or unasked message came
  /// since before `when`. A serial server may hang although its TCP connection works.
  bool SilentSince(Instant when) const {
    return silent_from_ && *silent_from_ < when && last_failure_ >= when;
  }

 private:
  void Count(Outcome outcome);
  void OnAnswer();
  void OnCollision();
  void OnRing(const Member& member, bool cut);

  PointStore& store_;
  const std::uint32_t line_;
  PollerListener& listener_;
  Tap* tap_ = nullptr;
  LineCounters counters_;
  LineMinute minute_;
  Now now_{};
  bool open_ = false;
  bool echoes_ = false;  // the request under way has come back as an echo
  // When the bus, a fibre ring, stopped echoing requests, so the ring may be open; empty: the bus
  // echoes.
  std::optional<WallTime> cut_since_;
  Burst others_;  // echoes that differ from the request, because another master sends
  std::optional<Instant> silent_from_;  // first failure since the last answer of any device
  Instant last_failure_{};
};

}  // namespace baudgate::bus
