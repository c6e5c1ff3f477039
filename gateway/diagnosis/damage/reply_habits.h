// Remembers how the replies of each device look in general: whether they come twice, behind the
// next request, again and again, or without a character. A part of
// gateway/diagnosis/observer.h. Bounded memory. HeardExchange holds one exchange, ReplyLag
// and SameAgain recognise a habit each, and TakenReplies keeps the latest replies.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstddef>
#include <deque>
#include <optional>
#include <utility>
#include <vector>

#include "gateway/base/bytes.h"
#include "gateway/base/finding.h"
#include "gateway/base/outcome.h"
#include "gateway/base/time.h"
#include "gateway/bus/devices/roster.h"
#include "gateway/bus/exchange/line.h"
#include "gateway/diagnosis/damage/changed_bytes.h"
#include "gateway/diagnosis/damage/examine.h"

namespace baudgate::diagnosis {

// One exchange, and all that comes from its request until the next one. A part of
// gateway/diagnosis/observer.h. Bounded memory.
class HeardExchange {
 public:
  /// The port has opened. What comes before Begin belongs to no exchange.
  void OnOpened() { member_ = nullptr; }
  void Begin(const bus::Member& member, const protocols::Request& request,
             const bus::LineTimes& times, Instant now);
  void Hear(View bytes, Instant now);
  /// The frame was taken for the reply.
  void Take(View frame) { frame_.assign(frame.begin(), frame.end()); }
  void End(Outcome outcome);
  /// More has come since its end, or since it was asked last.
  bool TakeMore();

  /// Null: there was none since the port was opened.
  const bus::Member* member() const { return member_; }
  const protocols::Request& request() const { return request_; }
  const bus::LineTimes& times() const { return times_; }
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
  Hearing AsHearing(const bus::Roster& roster) const;

 private:
  const bus::Member* member_ = nullptr;
  protocols::Request request_;
  bus::LineTimes times_;
  Instant sent_{};
  Instant last_{};  // when something was on the line last
  Duration idle_{};
  Outcome outcome_ = Outcome::none;
  std::size_t judged_ = 0;  // bytes that had come when it was looked at
  Bytes heard_;
  std::vector<Arrival> arrivals_;
  Bytes frame_;
};

// Does a device answer late, or does something in between let each reply go when the next request
// comes? In the second case its replies come right behind the next requests, at all kinds of times
// after their own.
//
//   behind its request       behind the next one    it lags
//   620 ms                   not soon               no
//   900, 1400, 700 ms        12 ms                  no: three may be chance
//   900, 1400, 700, 950 ms   12 ms                  yes
//   900, 900, 900, 950 ms    12, 12, 13, 12 ms      yes
//   900, 910, 905, 900 ms    12, 22, 17, 12 ms      no: it is always as late
//
class ReplyLag {
 public:
  /// A late reply came `after` its request and so soon behind the `next` one; empty: not soon.
  /// True: it lags.
  bool OnLate(Duration after, std::optional<Duration> next) {
    if (!next) {
      count_ = 0;
      return false;
    }
    if (count_++ == 0) after_ = next_ = {};
    after_.Add(after);
    next_.Add(*next);
    return count_ >= kNoChance && after_.Spread() >= std::max(kSpread, kWider * next_.Spread());
  }

 private:
  static constexpr std::size_t kNoChance = 4;
  static constexpr Duration kSpread = 20ms;
  static constexpr int kWider = 4;

  struct Range {
    void Add(Duration time) {
      least = std::min(least, time);
      most = std::max(most, time);
    }
    Duration Spread() const { return most - least; }

    Duration least = Duration::max();
    Duration most{};
  };

  std::size_t count_ = 0;  // in a row
  Range after_;
  Range next_;
};

// Does the same come whatever is asked? Byte for byte what came to other requests before, one after
// another, and it was right once.
//
//   asked            came             it is the same again
//   A, B             x, x             no: two replies may be alike
//   A, B, C, D, E    x, x, x, x, x    yes, if x was right once
//   A, B, B, B, B, B, B    each x     yes, if x cannot answer B
//
class SameAgain {
 public:
  /// The same reply to this many other requests is no chance, where each of them may be answered
  /// alike; and where replies are numbered.
  static constexpr std::size_t kSame = 4;
  static constexpr std::size_t kSameNumbered = 2;

  /// `right`: it is the reply to `request`; `misfit`: it cannot be.
  bool OnCame(View came, const Bytes& request, bool right, bool misfit, bool numbered) {
    if (came.size() < kShortest) return false;
    if (!std::ranges::equal(came, came_)) {
      *this = {};
      came_.assign(came.begin(), came.end());
      asked_ = request;
    } else if (request != asked_) {
      ++others_;
      asked_ = request;
    }
    right_ = right_ || right;
    if (misfit) ++misfits_;
    if (!right_ || others_ == 0) return false;
    return misfits_ >= kMisfits || others_ >= (numbered ? kSameNumbered : kSame);
  }

 private:
  /// Fewer bytes may well be the same.
  static constexpr std::size_t kShortest = 4;
  /// So often in a row it came to requests that it cannot answer: more than a lag brings.
  static constexpr std::size_t kMisfits = 6;

  Bytes came_;
  Bytes asked_;              // by which request
  std::size_t others_ = 0;   // further requests in a row to which the same came
  std::size_t misfits_ = 0;  // exchanges that it came to and is no reply to
  bool right_ = false;       // it was the reply to one of them
};

// The latest replies that were taken, and what they answered: a copy of one is no reply to another
// request, and damage shows in its length. Bounded memory.
struct TakenReply {
  Bytes request;
  Bytes reply;

  bool operator==(const TakenReply&) const = default;
};

class TakenReplies {
 public:
  void Add(const Bytes& request, const Bytes& reply) {
    latest_.push_back({request, reply});
    if (latest_.size() > kKept) latest_.pop_front();
  }
  /// The frame was taken for the reply to another request than this.
  bool WasForOther(const Bytes& request, const Bytes& frame) const {
    return std::ranges::any_of(latest_, [&](const TakenReply& one) {
      return one.request != request && one.reply == frame;
    });
  }
  /// A text that is a character or two shorter than the last reply to the same request.
  bool IsShorterThanLast(const Bytes& request, const Bytes& text) const {
    if (text.empty() || !std::ranges::all_of(request, IsPrintable)) return false;
    const auto last =
        std::find_if(latest_.rbegin(), latest_.rend(),
                     [&request](const TakenReply& one) { return one.request == request; });
    if (last == latest_.rend() || text.front() != last->reply.front()) return false;
    return text.size() < last->reply.size() && text.size() + kFewLost >= last->reply.size();
  }

 private:
  static constexpr std::size_t kKept = 8;
  /// So many characters may be missing inside a text.
  static constexpr std::size_t kFewLost = 2;

  std::deque<TakenReply> latest_;
};

/// A request that was sent earlier gets no reply any more.
inline constexpr Duration kLongestLag = std::chrono::seconds(5);

class ReplyHabits {
 public:
  /// A request that has a reply has begun.
  void OnBegin(const bus::Member& member) { ++of_[member].since; }
  /// Not a byte came to its last request, which is sent again; `tried`: its first try.
  void OnLost(const bus::Member& member, Instant tried);
  void OnAnswered(const HeardExchange& exchange);

  /// A request that was lost and repeated lately.
  struct LostTry {
    Duration after{};      ///< from its first try until now
    std::size_t back = 0;  ///< exchanges of its member that have begun since
  };
  /// A second reply of the member came at `came`. One of both replies answers that request, and was
  /// late. Empty: there is no such request, so the device sends two replies. Each is taken once.
  std::optional<LostTry> TakeLostTry(const bus::Member& member, Instant came);

  /// See ReplyLag.
  bool OnLate(const bus::Member& member, Duration after, std::optional<Duration> next) {
    return of_[member].lag.OnLate(after, next);
  }
  /// True: the same came to other requests before. `right`: it is the reply. The transaction
  /// number is not compared.
  bool NoteSame(const HeardExchange& exchange, bool right);
  /// Beside its own reply there are only such as were taken for other requests just before:
  /// something in between sends twice.
  bool IsCopy(const HeardExchange& exchange) const;
  /// A text that seems to lack a character. If the same comes to the same request again, the device
  /// sends another form.
  Finding Compare(const HeardExchange& exchange, Finding finding);

 private:
  struct Entry {
    bool doubles = false;   // more than one reply came, and none was lost before
    Instant lost{};         // the first try of the last request that was repeated as nothing came
    std::size_t since = 0;  // exchanges that began since its last try without an answer
    ReplyLag lag;
    SameAgain same;
    TakenReply misfit;  // a text that lacks a character, and none was good to that request since
  };

  bus::ByMember<Entry> of_;
  TakenReplies taken_;
};

}  // namespace baudgate::diagnosis
