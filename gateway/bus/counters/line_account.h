// `LineAccount` counts the traffic of a line, the use of its time, and faults of the line as a
// whole. It writes the counts to the point store, and passes bytes to the tap. `Burst` detects
// repeated events, `LineMinute` measures the use of the line time.
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

// `Burst` detects an event that happens again and again, while a single event may be chance. A
// burst begins when the event has happened three times with less than a minute between two of them,
// and ends after a minute without the event.
class Burst {
 public:
  static constexpr int kCount = 3;
  static constexpr Duration kTime = 1min;

  /// The event happened. Returns true if a burst begins.
  bool Add(Instant now) {
    if (count_ == 0 || now - last_ >= kTime) count_ = 0;
    last_ = now;
    return ++count_ >= kCount && !std::exchange(going_on_, true);
  }
  /// Returns true if the burst ends.
  bool EndsAt(Instant now) { return going_on_ && now - last_ >= kTime && !(going_on_ = false); }

 private:
  int count_ = 0;  // events with less than a minute between two of them
  Instant last_{};
  bool going_on_ = false;
};

// `LineMinute` measures the use of the time of a line, since the start and in the present minute.
// The use of an exchange is known when it ends; until then its time is not assigned.
class LineMinute {
 public:
  /// Parts of a minute, each 0 to 1.
  struct Use {
    double busy = 0;
    LineShares shares{};  ///< parts of `busy` with a known use
  };

  /// The port was opened: no exchange is under way, and a minute begins.
  void OnOpened(Instant now) {
    exchange_ = {};
    full_.reset();
    Begin(now);
  }
  void OnClosed() { full_ = Use{}; }
  /// Call after the time up to `now` has been reported (OnExchangeTime, OnDrained).
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
  /// Returns the use of the last full minute; before the first one is over, the use since the
  /// opening.
  Use use(Instant now) const { return full_ ? *full_ : UseAt(now); }

 private:
  static constexpr Duration kMinute = std::chrono::minutes(1);
  /// The use of a shorter time is not shown.
  static constexpr Duration kShortest = std::chrono::seconds(10);

  /// Begins a minute. An exchange under way continues.
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
  TimeByUse before_{};  // spent_ at the begin of the minute
  Duration busy_{};     // busy time of the minute
  Duration exchange_{};
  Instant began_{};
  std::optional<Use> full_;
};

class LineAccount final : public ExchangeObserver {
 public:
  /// `line`: its index in the point store. All references must stay valid for the lifetime of this
  /// object.
  LineAccount(PointStore& store, std::uint32_t line, PollerListener& listener)
      : store_(store), line_(line), listener_(listener) {}

  void Attach(Tap& tap) { tap_ = &tap; }

  /// Time has passed. `busy`: the line was busy. `drains`: it kept silence after an exchange.
  /// Returns the busy part of the time.
  Duration OnTime(Now now, bool busy, bool drains);
  void OnOpened();
  void OnClosed();

  void OnSent(const Member& member, const protocols::Request& request);
  /// Bytes came while `member` was asked; null: no member was asked.
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
  /// `counts`: the bytes are no rest of a broken reply.
  void CountStray(std::size_t count, bool counts) {
    counters_.babble += count;
    if (counts) counters_.stray_bytes += count;
  }
  void OnNegotiation() { ++counters_.negotiations; }

  /// `notice_bound`: see LineStatus.
  void Show(std::optional<Duration> notice_bound) const;

  const LineCounters& counters() const { return counters_; }
  std::uint64_t Answers() const;
  /// Returns true if no request since `when` was answered, and no message came unasked: a serial
  /// server may hang although its TCP connection works.
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
  bool echoes_ = false;                 // the request under way has come back
  std::optional<WallTime> cut_since_;   // since when the ring is open
  Burst others_;                        // echoes that differed: another master
  std::optional<Instant> silent_from_;  // since when no device has answered
  Instant last_failure_{};
};

}  // namespace baudgate::bus
