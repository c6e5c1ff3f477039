// To which request a reply belongs, as far as anybody can know; when a probe has to go first so
// that a reply to an earlier request is found out; and which readings are in doubt when one was
// taken for another's. Told by gateway/poll/job_run.cpp of every request and reply of the line.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <deque>
#include <vector>

#include "gateway/base/outcome.h"
#include "gateway/poll/answer_order.h"
#include "gateway/poll/identity.h"
#include "gateway/poll/late_answers.h"
#include "gateway/poll/roster.h"
#include "gateway/poll/schedule.h"

namespace baudgate {

class WhoseReply {
 public:
  explicit WhoseReply(const Roster& roster) : roster_(roster) {}

  /// The name that its replies carry, known from its first request on. Entries of one name are one
  /// device on the wire, and have one order.
  void Recognise(Member& member, const Bytes& sender);
  /// The first request of a task of a device, no probe and to be answered: a reply to an earlier
  /// request could pass for its own, or nobody knows yet who answers.
  bool NeedsProbeFirst(const Asked& asked) const;
  /// All answers that are possible belong to the requests that they follow.
  bool MayBeInStep(const Asked& asked) const;
  bool IsInStep(const Member& member) const { return OrderOf(member).IsInStep(); }

  void OnSent(const Asked& asked);

  struct Verdict {
    bool elsewhere = false;         ///< it belongs to an earlier request
    bool proves_life_only = false;  ///< it may, and would pass: its values are nobody's
  };
  /// A reply of the device itself came, good or not what was asked for.
  Verdict OnReply(const Asked& asked, View frame, Outcome outcome);
  /// The exchange is over. `silent`: an answer was due and the port stayed open.
  void OnEnd(const Asked& asked, Outcome outcome, bool silent);
  /// The port closed with an exchange of it under way.
  void OnClosed(const Member& member);

  /// Readings of this query were stored.
  void OnStored(QueryRef query);
  /// The line has rested for a reply time: what has not come by now is not owed any more.
  void OnRested() { unproven_.clear(); }
  /// Behind its reply came a second, different one: one of the two belongs elsewhere. Gives the
  /// queries whose readings are in doubt now.
  std::vector<QueryRef> OnSecondReply(const Member& member);

 private:
  struct State {
    AnswerOrder order;
    std::size_t first = kSelf;  // place of the first entry of the same name, whose order counts
    Identity identity;
    bool answered_probe = false;
  };
  static constexpr std::size_t kSelf = static_cast<std::size_t>(-1);

  State& Of(const Member& member) const;
  AnswerOrder& OrderOf(const Member& member) const;
  bool IsSafe(const Asked& asked) const;
  AnswerOrder::Fingerprint ProbeOf(const Member& member) const;
  AnswerOrder::Fingerprint FingerprintOf(const Asked& asked) const;
  bool LooksLikeProbe(const Asked& asked, View frame, Outcome outcome);

  const Roster& roster_;
  mutable std::deque<State> states_;  // by place
  AnswerOrder order_;                 // of all requests, whoever they went to
  // Of the request under way:
  AnswerOrder::Fingerprint sent_ = 0;
  bool safe_ = true;    // no reply to an earlier one can pass for its own
  bool heard_ = false;  // a reply of the device itself came
  // The last queries stored since the line last rested for one reply time.
  std::vector<QueryRef> unproven_;
};

}  // namespace baudgate
