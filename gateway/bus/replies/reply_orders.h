// The orders of replies on a line: one for each device, and one for all requests together, because
// a serial server in front of the line delays all replies alike. A reply that carries its sender's
// address is none of those that the server owes to others, so for such a request the order of its
// device counts alone. A part of gateway/bus/replies/whose_reply.h.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstddef>

#include "gateway/base/bytes.h"
#include "gateway/base/time.h"
#include "gateway/bus/devices/by_member.h"
#include "gateway/bus/devices/roster.h"
#include "gateway/bus/replies/answer_order.h"
#include "gateway/bus/replies/asked.h"

namespace baudgate {

class ReplyOrders {
 public:
  explicit ReplyOrders(const Roster& roster) : roster_(roster) {}

  /// Learns the address that its replies carry, from its first request. Entries of one address are
  /// one device on the wire, and share one order.
  void Recognise(Member& member, const Bytes& sender) {
    if (!member.sender.empty() || sender.empty()) return;
    member.sender = sender;
    for (const Member* other : roster_.everyone()) {
      if (other == &member || !member.IsSame(*other)) continue;
      devices_[member].first = FirstOf(*other);
      return;
    }
  }

  AnswerOrder& Of(const Member& member) { return devices_.At(FirstOf(member)).order; }
  const AnswerOrder& Of(const Member& member) const { return devices_.At(FirstOf(member)).order; }

  void OnSent(const Member& member, const SentRequest& request) {
    Of(member).OnSent(request);
    line_.OnSent(request);
  }
  /// `fits`: see AnswerOrder.
  void OnAnswer(const Member& member, bool fits, const AnswerOrder::MayAnswer& may_answer) {
    const bool own = Of(member).OnAnswer(fits, may_answer);
    const bool known = line_.OnAnswer(fits, may_answer);
    if (!known) line_.OnLost();
    if (!own && !known) Of(member).OnLost();
  }
  /// See AnswerOrder.
  bool IsBehindProof(const Asked& asked) const {
    return Of(*asked.member).IsBehindProof() && (asked.names_itself() || line_.IsBehindProof());
  }
  void OnOddForm(const Member& member) {
    Of(member).OnOddForm();
    line_.OnOddForm();
  }
  /// A reply has come twice.
  void OnCopy(const Member& member) {
    Of(member).OnCopy();
    line_.OnCopy();
  }
  /// See AnswerOrder.
  void ForgetBefore(const Member& member, Instant time) {
    Of(member).ForgetBefore(time);
    line_.ForgetBefore(time);
  }
  /// Nothing is owed by this device, and nothing by the server.
  void Reset(const Member& member) {
    Of(member).Reset();
    line_.Reset();
  }

  /// The latest reply may belong to this, the latest request.
  bool MayBeInStep(const Asked& asked) const {
    return Of(*asked.member).MayBeInStep() && (asked.names_itself() || line_.MayBeInStep());
  }
  /// The latest reply belongs to this request or its repetitions, and to no earlier task's.
  bool IsOfLatest(const Asked& asked) const {
    return Of(*asked.member).IsOfLatest() && (asked.names_itself() || line_.IsOfLatest());
  }
  /// The latest reply answers this request, or an earlier one of the same bytes.
  bool IsAnswerTo(const Asked& asked) const {
    const Bytes question = asked.question();
    return Of(*asked.member).IsAnswerTo(question) &&
           (asked.names_itself() || line_.IsAnswerTo(question));
  }
  /// An owed reply would be recognised, whatever is sent next.
  bool IsSafe(const Asked& asked) const {
    return Of(*asked.member).IsSafe() && (asked.names_itself() || line_.IsSafe());
  }
  /// How many replies may still come: before OnSent to earlier requests only, after it also its
  /// own.
  int Owed(const Asked& asked) const {
    const std::size_t own = Of(*asked.member).Owed();
    return static_cast<int>(asked.names_itself() ? own : std::max(own, line_.Owed()));
  }
  /// Another device of the line may owe a reply that comes before the awaited one. The two counts
  /// of owed replies do not tell: a reply that comes while another device is asked is not taken off
  /// those that its own device owes.
  bool OthersOwe(const Asked& asked) const {
    return line_.Owes([&](const SentRequest& sent) {
      const auto& everyone = roster_.everyone();
      return sent.place < everyone.size() && !everyone[sent.place]->IsSame(*asked.member);
    });
  }
  /// See AnswerOrder.
  Duration Older(const Asked& asked) const {
    const Duration own = Of(*asked.member).Older();
    return asked.names_itself() ? own : std::max(own, line_.Older());
  }

 private:
  static constexpr std::size_t kSelf = static_cast<std::size_t>(-1);
  struct Entry {
    AnswerOrder order;
    std::size_t first = kSelf;  // place of the first entry of the same address, whose order counts
  };

  /// The place of the entry whose order counts for it.
  std::size_t FirstOf(const Member& member) const {
    const std::size_t first = devices_[member].first;
    return first == kSelf ? member.place : first;
  }

  const Roster& roster_;
  ByMember<Entry> devices_;
  AnswerOrder line_;  // of all requests, whoever they went to
};

}  // namespace baudgate
