// Finds in an exchange what belongs to an earlier one: a reply that is late or comes again, the
// rest of one that broke off, a request that comes back late. gateway/bus/replies/whose_reply.h
// decides which replies count. A part of gateway/diagnosis/observer.h. Bounded memory.
//
//   > ?A1
//   > ?B1      < !A1=5 !B1=7          !A1=5 is the late reply to ?A1
//
//   > ?A1      < !A1=5
//   > ?A2      < !A1=5 !A2=6          !A1=5 has come again
//
// BrokenReply and NumberedRequests keep what EarlierReplies compares with.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstddef>
#include <deque>
#include <optional>
#include <vector>

#include "gateway/base/bytes.h"
#include "gateway/base/finding.h"
#include "gateway/base/time.h"
#include "gateway/bus/devices/roster.h"
#include "gateway/bus/exchange/line.h"
#include "gateway/diagnosis/damage/reply_habits.h"
#include "protocols/protocol.h"

namespace baudgate::diagnosis {

// A reply that broke off, and whose rest may come in a later exchange.
//
//   < 01 03 04 00 0B          kept
//   > the next request
//   < 00 16 6B F5             with what is kept it makes a whole reply: it is the rest
//
class BrokenReply {
 public:
  BrokenReply() = default;
  /// `begin` came to a request; its last byte at `last`.
  BrokenReply(const bus::Member& member, const protocols::Request& request, View begin,
              Instant last)
      : member_(&member), request_(request), begin_(begin.begin(), begin.end()), last_(last) {}

  /// An exchange with the member has begun.
  void OnBegin(const bus::Member& member) { began_ += member_ == &member ? 1 : 0; }
  /// When its rest came in this exchange: before or behind the reply that was taken; where none
  /// was, before or behind the beginning of another one. Empty: it did not come. From the computed
  /// end of the request.
  std::optional<Duration> FindRest(const HeardExchange& exchange) const;

  const bus::Member& member() const { return *member_; }
  /// When its last byte came.
  Instant last() const { return last_; }
  /// Exchanges of the member that have begun since.
  std::size_t began() const { return began_; }

 private:
  bool IsAwaited(const HeardExchange& exchange) const;
  bool IsRest(View rest, Instant came) const;

  const bus::Member* member_ = nullptr;
  protocols::Request request_;
  Bytes begin_;
  Instant last_{};
  std::size_t began_ = 0;
};

// When the latest requests went out, where frames carry a number: a reply that comes behind other
// requests tells by its number how late it is. Bounded memory.
//
//   > 01 5C ...                 1.0 s
//   > 01 66 ...                 2.5 s
//   < 01 5C ...                 2.8 s: 1.8 s behind its request
//
class NumberedRequests {
 public:
  /// A retry has the number of its first try.
  void OnSent(const bus::Member& member, const protocols::Request& request, Instant now) {
    size_ = std::min(TransactionBytes(*member.protocol), request.bytes.size());
    if (size_ == 0) return;
    if (const std::size_t at = IndexOf(request.bytes); at < sent_.size()) {
      sent_[at].tries.push_back(now);
      return;
    }
    sent_.push_back({&member, request.bytes, {now}, ReplyTime(request, member.times)});
    if (sent_.size() > kKept) sent_.pop_front();
  }
  void OnAnswered(View reply) {
    if (const std::size_t at = IndexOf(reply); at < sent_.size()) ++sent_[at].answered;
  }

  struct Late {
    const bus::Member* member = nullptr;
    /// Behind the first try of its request. If another try was answered before: behind the last
    /// try that it may answer, as that one's reply would not be late.
    Duration after{};
    Duration lateness{};  ///< since it was due; below zero: it is not late
  };
  /// What came is the late reply to an earlier request. Nothing: it is the reply to the latest one,
  /// its request is not known, or each try of that was answered before.
  std::optional<Late> Find(View reply, Instant came) const {
    const std::size_t at = IndexOf(reply);
    if (at + 1 >= sent_.size()) return std::nullopt;
    const Sent& its = sent_[at];
    if (its.answered >= its.tries.size()) return std::nullopt;
    Duration after = came - its.tries.front();
    for (const Instant tried : its.tries) {
      if (its.answered > 0 && came - tried > its.reply_time) after = came - tried;
    }
    return Late{its.member, after, after - its.reply_time};
  }

 private:
  static constexpr std::size_t kKept = 32;
  struct Sent {
    const bus::Member* member = nullptr;
    Bytes request;
    std::vector<Instant> tries;
    Duration reply_time{};
    std::size_t answered = 0;  // of them
  };
  /// sent_.size(): there is none.
  std::size_t IndexOf(View frame) const {
    if (size_ == 0 || frame.size() < size_) return sent_.size();
    const auto found = std::ranges::find_if(sent_, [&](const Sent& sent) {
      return std::ranges::equal(View(sent.request).first(size_), frame.first(size_));
    });
    return static_cast<std::size_t>(found - sent_.begin());
  }

  std::size_t size_ = 0;  // of the number
  std::deque<Sent> sent_;
};

/// An earlier exchange as it looks now: the one of `member` that is `back` before its last.
struct EarlierFinding {
  const bus::Member* member = nullptr;
  Finding finding{};
  std::size_t back = 0;
};

class EarlierReplies {
 public:
  /// It outlives this.
  explicit EarlierReplies(ReplyHabits& habits) : habits_(habits) {}

  /// The exchange has begun. `unanswered`: what came to the one before, if that was with the same
  /// member.
  void OnBegin(const HeardExchange& exchange, Bytes unanswered);
  void OnAnswered(const HeardExchange& exchange);
  void NoteSilence(const HeardExchange& exchange);
  /// The rest of its reply may come later.
  void OnBroken(const HeardExchange& exchange);
  /// That rest has come in the same exchange.
  void OnMended() { broken_ = {}; }

  /// The rest of a reply that broke off has come in this exchange.
  bool FindRest(const HeardExchange& exchange);
  /// The bytes beside the reply of this exchange answer a request that was lost and repeated.
  bool FindBeside(const HeardExchange& exchange, const Finding& finding);
  /// A second reply of the member has come: what is found where one of both was late.
  std::optional<Finding> FindLostTry(const bus::Member& member, Instant came);
  /// The finding of this exchange, where what came may be the reply to another request.
  Finding Attribute(const HeardExchange& exchange, Finding finding);
  /// A request of this gateway has come back so late that it looks like another master's.
  bool IsLateEcho(const HeardExchange& exchange) const;

  /// A reply of another member that was late or came twice, or the rest of an earlier reply, found
  /// in the exchange that was looked at last. Empty: there are no more.
  std::optional<EarlierFinding> Take();

 private:
  struct Open {
    const bus::Member* member = nullptr;
    protocols::Request request;
    Instant sent{};
    Instant first{};  // the first try of those that have no answer, within the ceiling
    Instant tried{};  // the first try of the last seconds
    Bytes vain;       // what came to the try before it
    bool answered = false;
    bool silent = false;    // and not a byte came
    bool late = false;      // its reply has come late
    bool repeated = false;  // what was found is the same reply once more
    Bytes reply;
    std::optional<Finding> in_its_place{};  // what came late says why there is no reply
  };
  /// The last exchange of a member, and the one before it.
  struct LastTwo {
    Open last;
    Open before;
  };
  /// When a reply to an earlier request came.
  struct Came {
    Duration after{};     // behind the first try of that request
    Duration lateness{};  // since it was due
    bool late = false;
    bool early = false;              // the last bytes came soon behind the request of the exchange
    std::optional<Duration> next{};  // so soon behind the next request; empty: not soon
  };

  Open* FindEarlier(const HeardExchange& exchange);
  static bool TakeIfAnswered(Open& open, const HeardExchange& exchange);
  static Came CameOf(const HeardExchange& exchange, const Open& whose);
  Finding Late(const Open& open, const Came& came);
  std::optional<Finding> LateByNumber(const HeardExchange& exchange);
  bool FindNumberedBeside(const HeardExchange& exchange);
  Finding AttributeToItself(const HeardExchange& exchange, const Open& whose, const Came& came,
                            Finding finding);
  Finding AttributeToAnother(const HeardExchange& exchange, Open& whose, const Came& came,
                             Finding finding);

  ReplyHabits& habits_;
  bus::ByMember<LastTwo> open_;
  NumberedRequests numbered_;
  BrokenReply broken_;
  Bytes beside_;  // what stands behind the reply of the last exchange, where its number told of it
  std::vector<EarlierFinding> found_;
};

}  // namespace baudgate::diagnosis
