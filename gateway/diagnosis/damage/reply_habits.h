// `ReplyHabits` stores how the replies of each device usually look: whether they come twice, only
// after the next request, always the same, or without a character. It is a part of `Observer`.
// `HeardExchange` contains one exchange; `ReplyLag` and `SameAgain` each recognise one habit;
// `TakenReplies` stores the latest replies. Memory is bounded.
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

// `HeardExchange` contains one exchange: all bytes from its request until the next request. Part of
// `Observer`. Memory is bounded.
class HeardExchange {
 public:
  /// Call when the port was opened. Bytes before the next call of Begin belong to no exchange.
  void OnOpened() { member_ = nullptr; }
  void Begin(const bus::Member& member, const protocols::Request& request,
             const bus::LineTimes& times, Instant now);
  void Hear(View bytes, Instant now);
  void Take(View frame) { frame_.assign(frame.begin(), frame.end()); }
  void End(Outcome outcome);
  /// True if bytes have come after End and after the last call of TakeMore.
  bool TakeMore();

  /// Returns the device of the exchange; null: there was no exchange since the port was opened.
  const bus::Member* member() const { return member_; }
  const protocols::Request& request() const { return request_; }
  const bus::LineTimes& times() const { return times_; }
  /// Returns the computed end of the request.
  Instant sent() const { return sent_; }
  /// Returns the silence before the request; kLongIdle: unknown.
  Duration idle() const { return idle_; }
  /// Returns how the exchange ended; Outcome::none: it has not ended.
  Outcome outcome() const { return outcome_; }
  const Bytes& heard() const { return heard_; }
  Bytes TakeHeard() { return std::exchange(heard_, {}); }
  const std::vector<Arrival>& arrivals() const { return arrivals_; }
  /// Returns when the latest bytes came. Call only if bytes have come.
  Instant last_came() const { return sent_ + arrivals_.back().after; }
  /// Returns the accepted reply; empty: no reply was accepted.
  const Bytes& frame() const { return frame_; }
  /// Returns the bytes before and after the reply. Without a reply, all bytes are in the first
  /// view.
  std::pair<View, View> BesideReply() const;
  /// Returns the exchange for Examine(). The result refers to data of this object.
  Hearing AsHearing(const bus::Roster& roster) const;

 private:
  const bus::Member* member_ = nullptr;
  protocols::Request request_;
  bus::LineTimes times_;
  Instant sent_{};
  Instant last_{};
  Duration idle_{};
  Outcome outcome_ = Outcome::none;
  std::size_t judged_ = 0;  // number of bytes that were examined
  Bytes heard_;
  std::vector<Arrival> arrivals_;
  Bytes frame_;
};

// `ReplyLag` decides whether a device answers late, or whether equipment in between holds each
// reply back until the next request comes (it "lags"). A lagging reply comes directly after the
// next request, at varying times after its own request. Examples:
//
//   after its request        after the next one     does the device lag?
//   620 ms                   not soon               no
//   900, 1400, 700 ms        12 ms                  no: three may be chance
//   900, 1400, 700, 950 ms   12 ms                  yes
//   900, 900, 900, 950 ms    12, 12, 13, 12 ms      yes
//   900, 910, 905, 900 ms    12, 22, 17, 12 ms      no: it is always equally late
//
class ReplyLag {
 public:
  /// A late reply came. `after`: time since its request. `next`: time since the next request;
  /// nothing: the reply did not come soon after the next request. Returns true if the device lags.
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

  std::size_t count_ = 0;  // late replies in a row that came soon after the next request
  Range after_;
  Range next_;
};

// `SameAgain` decides whether equipment returns the same bytes to every request: equal bytes came
// in successive exchanges with different requests, and were the right reply at least once.
// Examples:
//
//   requests               replies          the same again?
//   A, B                   x, x             no: two replies may be alike
//   A, B, C, D, E          x, x, x, x, x    yes, if x was right once
//   A, B, B, B, B, B, B    x each time      yes, if x cannot answer B
//
class SameAgain {
 public:
  /// This many further requests that get the same bytes are not chance; kSameNumbered applies if
  /// replies are numbered.
  static constexpr std::size_t kSame = 4;
  static constexpr std::size_t kSameNumbered = 2;

  /// Call for each exchange. `right`: `came` is the reply to `request`. `misfit`: it cannot be the
  /// reply. Returns true if the same bytes come to every request.
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
  /// Replies shorter than this may be equal by chance.
  static constexpr std::size_t kShortest = 4;
  /// Replies that only come some requests late cause fewer misfits (see misfits_) than this.
  static constexpr std::size_t kMisfits = 6;

  Bytes came_;
  Bytes asked_;              // the latest request to which the bytes came
  std::size_t others_ = 0;   // other requests in a row to which the same bytes came
  std::size_t misfits_ = 0;  // exchanges in which the bytes could not be the reply
  bool right_ = false;       // the bytes were the right reply to a request at least once
};

// `TakenReplies` stores the latest accepted replies with their requests. If bytes equal one of
// them, they are a copy; if they are a little shorter, they may be damaged. Memory is bounded.
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
  /// True if the frame was accepted as the reply to a request other than `request`.
  bool WasForOther(const Bytes& request, const Bytes& frame) const {
    return std::ranges::any_of(latest_, [&](const TakenReply& one) {
      return one.request != request && one.reply == frame;
    });
  }
  /// True if a text begins with the same character as the last reply to the same request, but is
  /// one or two characters shorter.
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
  /// A text is damaged if it lacks at most this many characters.
  static constexpr std::size_t kFewLost = 2;

  std::deque<TakenReply> latest_;
};

/// If a reply comes later than this after a request, it is not counted as the reply to that
/// request.
inline constexpr Duration kLongestLag = std::chrono::seconds(5);

class ReplyHabits {
 public:
  /// Call when a request begins that expects a reply.
  void OnBegin(const bus::Member& member) { ++of_[member].since; }
  /// Call when the last request got no byte and is sent again. `tried`: when its first try was
  /// sent.
  void OnLost(const bus::Member& member, Instant tried);
  void OnAnswered(const HeardExchange& exchange);

  /// A request that seemed lost and was sent again.
  struct LostTry {
    Duration after{};      ///< time since the first try of the request
    std::size_t back = 0;  ///< number of exchanges of the member that have begun since this request
  };
  /// Call when a second reply of the member came. If a request seemed lost and was sent again a
  /// short time ago, one of the two replies was its late reply: returns this request, once.
  /// Nothing: no request was lost, so the device sends two replies.
  std::optional<LostTry> TakeLostTry(const bus::Member& member, Instant came);

  /// A late reply came, with the times of ReplyLag::OnLate. Returns true if the device lags.
  bool OnLate(const bus::Member& member, Duration after, std::optional<Duration> next) {
    return of_[member].lag.OnLate(after, next);
  }
  /// Returns true if the bytes of this exchange came to other requests before (SameAgain). `right`:
  /// they are the reply to this request. Transaction numbers are not compared.
  bool NoteSame(const HeardExchange& exchange, bool right);
  /// True if the frames beside the reply were all accepted for other requests a short time ago:
  /// equipment in between sends replies twice.
  bool IsCopy(const HeardExchange& exchange) const;
  /// True if the last right reply of the device has come again, with its transaction number.
  bool IsLastRight(const HeardExchange& exchange) {
    return of_[*exchange.member()].right == exchange.heard();
  }
  /// Corrects the finding about a text that seems to lack a character: if the same text comes again
  /// to the same request, it is the usual form of the device and no damage.
  Finding Compare(const HeardExchange& exchange, Finding finding);

 private:
  struct Entry {
    bool doubles = false;  // more than one reply came although no request was lost
    // First try of the last request that got no byte and was sent again; zero: there is no such
    // request.
    Instant lost{};
    std::size_t since = 0;  // exchanges since the request of `lost`
    ReplyLag lag;
    SameAgain same;
    Bytes right;        // the last bytes that were the right reply to a request
    TakenReply misfit;  // a text that lacks a character; a good reply to the same request clears it
  };

  bus::ByMember<Entry> of_;
  TakenReplies taken_;
};

}  // namespace baudgate::diagnosis
