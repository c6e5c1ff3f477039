// `EarlierReplies` recognises bytes that come during an exchange but belong to an earlier exchange:
// a late or repeated reply, the rest of a reply that broke off, a request that comes back late. It
// is a part of `Observer`, for the diagnosis; gateway/bus/replies/whose_reply.h decides which
// replies are accepted. Memory is bounded. Examples (">": sent, "<": received):
//
//   > ?A1
//   > ?B1      < !A1=5 !B1=7          !A1=5 is the late reply to ?A1
//
//   > ?A1      < !A1=5
//   > ?A2      < !A1=5 !A2=6          !A1=5 has come again
//
// `BrokenReply` and `NumberedRequests` contain data of earlier exchanges for the comparison.
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

// `BrokenReply` stores a reply that broke off, because its rest may come in a later exchange.
// Example:
//
//   < 01 03 04 00 0B          stored
//   > the next request
//   < 00 16 6B F5             completes the stored bytes to a reply, so it is their rest
//
class BrokenReply {
 public:
  BrokenReply() = default;
  /// `begin`: the bytes that came. `last`: when the last of them came.
  BrokenReply(const bus::Member& member, const protocols::Request& request, View begin,
              Instant last)
      : member_(&member), request_(request), begin_(begin.begin(), begin.end()), last_(last) {}

  /// Call when an exchange begins. Counts the exchanges with the same member.
  void OnBegin(const bus::Member& member) { began_ += member_ == &member ? 1 : 0; }
  /// Returns when the rest came in this exchange, counted from the computed end of its request. The
  /// rest is searched before and after the accepted reply; if none was accepted, before and after
  /// the beginning of another reply. Nothing: the rest did not come.
  std::optional<Duration> FindRest(const HeardExchange& exchange) const;

  const bus::Member& member() const { return *member_; }
  Instant last() const { return last_; }
  /// Returns how many exchanges of the member have begun since the reply broke off.
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

// `NumberedRequests` stores when the latest requests were sent, for protocols whose frames contain
// a number. When a reply comes after other requests, its number shows to which request it belongs
// and how late it is. Memory is bounded. Example:
//
//   > 01 5C ...                 1.0 s
//   > 01 66 ...                 2.5 s
//   < 01 5C ...                 2.8 s: 1.8 s after its request
//
class NumberedRequests {
 public:
  /// Call for each request. A retry has the number of its first try.
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
    /// Time from the first try of the request to the reply. If another try was answered before:
    /// time from the last try for which the reply is late.
    Duration after{};
    Duration lateness{};  ///< time since the end of the reply time; negative: the reply is in time
  };
  /// Returns the earlier request that `reply` answers late. Nothing: it answers the latest request,
  /// its request is not stored, or each try of this request was answered already.
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
    std::size_t answered = 0;
  };
  /// Returns the index of the request whose number is in this frame; sent_.size(): there is no such
  /// request.
  std::size_t IndexOf(View frame) const {
    if (size_ == 0 || frame.size() < size_) return sent_.size();
    const auto found = std::ranges::find_if(sent_, [&](const Sent& sent) {
      return std::ranges::equal(View(sent.request).first(size_), frame.first(size_));
    });
    return static_cast<std::size_t>(found - sent_.begin());
  }

  std::size_t size_ = 0;  // length of the number in bytes
  std::deque<Sent> sent_;
};

/// A new finding about an earlier exchange. `back`: 0: the member's last exchange; 1: the exchange
/// before it.
struct EarlierFinding {
  const bus::Member* member = nullptr;
  Finding finding{};
  std::size_t back = 0;
};

class EarlierReplies {
 public:
  /// `habits` must stay valid for the lifetime of this object.
  explicit EarlierReplies(ReplyHabits& habits) : habits_(habits) {}

  /// Call when an exchange has begun. `unanswered`: the bytes that came in the exchange before, if
  /// it was with the same member.
  void OnBegin(const HeardExchange& exchange, Bytes unanswered);
  void OnAnswered(const HeardExchange& exchange);
  void NoteSilence(const HeardExchange& exchange);
  /// Stores the beginning of a reply that broke off, because its rest may come later.
  void OnBroken(const HeardExchange& exchange);
  /// The rest of the stored reply came in the same exchange, so it is not searched any more.
  void OnMended() { broken_ = {}; }

  /// Returns true if the rest of a stored reply came in this exchange. The finding of the exchange
  /// in which the reply broke off becomes `split`.
  bool FindRest(const HeardExchange& exchange);
  /// Returns true if the bytes beside the reply are the reply to a try that seemed lost and was
  /// repeated.
  bool FindBeside(const HeardExchange& exchange, const Finding& finding);
  /// Call when a second reply of the member came. If a try of its request seemed lost and was
  /// repeated, the second reply is late: returns the finding about that try. Nothing: no try was
  /// lost.
  std::optional<Finding> FindLostTry(const bus::Member& member, Instant came);
  /// Returns the finding of this exchange, corrected if its bytes may be the reply to another
  /// request.
  Finding Attribute(const HeardExchange& exchange, Finding finding);
  /// True if the bytes contain a request of this gateway, so that they look like a request of
  /// another master but are a late echo.
  bool IsLateEcho(const HeardExchange& exchange) const;

  /// Returns a new finding about an earlier exchange that the calls above have found: a reply was
  /// late or came twice, or its rest came. Nothing: there are no more findings.
  std::optional<EarlierFinding> Take();

 private:
  struct Open {
    const bus::Member* member = nullptr;
    protocols::Request request;
    Instant sent{};
    Instant first{};  // when the first unanswered try was sent, at most 5/4 of the ceiling ago
    Instant tried{};  // when the first unanswered try was sent, at most kLongestLag ago
    Bytes vain;       // bytes that came after the previous try
    bool answered = false;
    bool silent = false;
    bool late = false;
    bool repeated = false;  // the reply that was found is a copy of `reply`
    Bytes reply;
    // Set if the late reply contains a reason why there is no value.
    std::optional<Finding> in_its_place{};
  };
  /// The last exchange of a member, and the last before it with a different request.
  struct LastTwo {
    Open last;
    Open before;
  };
  /// When the reply to an earlier request came.
  struct Came {
    Duration after{};     // time since the first try of the earlier request
    Duration lateness{};  // time since the end of the reply time of this request
    bool late = false;
    // The last bytes came less than half a reply time after the present request.
    bool early = false;
    // Time since the request of the present exchange. Nothing: the reply did not come soon after
    // the present request, or the line was not silent before this request.
    std::optional<Duration> next{};
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
  Bytes beside_;  // bytes after the last reply that were attributed by their number
  std::vector<EarlierFinding> found_;
};

}  // namespace baudgate::diagnosis
