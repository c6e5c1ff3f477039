// Whose turn it is to be looked for, what that cost the others, and how soon a return is noticed.
// gateway/poll/chooser.cpp asks; what a probe may cost is gateway/poll/probe_budget.h's affair.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <optional>
#include <vector>

#include "gateway/base/time.h"
#include "gateway/poll/by_member.h"
#include "gateway/poll/late_answers.h"
#include "gateway/poll/probe_budget.h"
#include "gateway/poll/roster.h"

namespace baudgate {

class Probes {
 public:
  /// A start or stop that a client sends to a slave that is offline is tried at a share of its own:
  /// a slave that has returned has to obey before the probes have found it. Needed by
  /// PollerRoutedFaults.AStopReachesASlaveThatHasReturnedBeforeTheProbesHaveFoundIt.
  static constexpr double kWriteShare = 0.1;

  /// Why a member that is offline is asked.
  enum class Kind : std::uint8_t { look, short_write };

  /// How things are on the line.
  struct Facts {
    Instant now{};
    Instant idle_since{};
    std::optional<Instant> next_wanted;  ///< when somebody who answers wants the line again
    std::optional<Instant>
        clients_gone;  ///< when clients of routes count as gone, if there were any
    std::function<bool(const Member&)> is_looked_for;  ///< somebody wants to know if it is back
    std::function<bool(const Member&)> client_waits;   ///< for an answer of it, now
  };

  Probes(const Roster& roster, const LateAnswers& late) : roster_(roster), late_(late) {}

  void OnOpened();
  /// It has just gone offline: what its probes cost before says nothing any more.
  void OnOffline(const Member& member) { states_[member] = {}; }

  /// The member to probe next, if there is time. Null: no offline member is wanted, or a late reply
  /// of each may still come.
  Member* Next(const Facts& facts) const;
  /// When; may change with anything that happens on the line.
  std::optional<Instant> NextAt(const Facts& facts) const;
  void OnTaken(const Member& member) { turn_ = member.place + 1; }
  /// When a short write may be tried at this one: as soon as its share allows, whatever else there
  /// is, because who sends it waits for nothing else.
  Instant NextWriteAt(const Member& member, const Facts& facts) const;

  /// The task that has asked it has ended; the line may not be idle yet.
  void OnEnd(const Member& member, Kind kind, Instant began) { ended_ = {&member, kind, began}; }
  /// Since when the line has not been idle because of a probe; nothing: it has not.
  std::optional<Instant> began() const;
  /// The line is idle again, and others have waited for it so long.
  void OnIdle(Duration waited, Instant now);
  void OnClosed() { ended_ = {}; }

  /// See LineStatus::notice_bound. One turn of all members that are offline: each costs its worst
  /// case and the pause, or as long as it takes to earn the time that the others waited for its
  /// last probe; a probe that makes them wait is sent behind an exchange of theirs only, hence the
  /// longest of their periods once. Where the polls leave too little room even so, the turn that
  /// was seen counts. A share that is used up has to be earned first.
  Duration NoticeBound(Instant now) const;

 private:
  struct State {
    std::optional<Duration> waited;    // how long others waited for its last probe
    std::optional<Instant> probed_at;  // when that was sent
    Duration gap{};                    // since the one before
  };
  /// A probe whose cost is known once the line is idle again.
  struct Ended {
    const Member* member = nullptr;
    Kind kind = Kind::look;
    Instant began{};
  };

  const Roster& roster_;
  const LateAnswers& late_;
  ByMember<State> states_;
  ProbeBudget looks_;
  ProbeBudget writes_{kWriteShare};
  Ended ended_;
  std::size_t turn_ = 0;
};

}  // namespace baudgate
