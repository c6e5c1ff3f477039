// Until when a reply may still come to a request that was given up. Until then its device is not
// asked; where replies carry no address, nobody is. gateway/poll/job_answer.cpp tells what has
// ended, upkeep.cpp what that means, poller_line.cpp what came behind; numbers are in
// docs/timeouts.md. whose_reply.h knows to which request a reply belongs that did come.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "gateway/base/outcome.h"
#include "gateway/base/time.h"
#include "gateway/line/line.h"
#include "gateway/poll/asked.h"
#include "gateway/poll/by_member.h"
#include "gateway/poll/patience.h"
#include "gateway/poll/roster.h"

namespace baudgate {

class LateAnswers {
 public:
  explicit LateAnswers(const Roster& roster) : roster_(roster) {}

  /// Before what came behind its end is told.
  void OnEnd(const Asked& asked, Outcome outcome, Instant now);

  struct Stray {
    bool counts = true;              ///< among the line's stray bytes
    const Member* late = nullptr;    ///< whose late answer it is, told once for each exchange
    Duration lateness{};             ///< of that, since it was due
    const Member* warned = nullptr;  ///< of whom the user should know
    std::string warning;
  };
  Stray OnStray(const StrayBytes& stray, Instant now);

  /// What the end means for the next requests. `in_step`: its replies are proven to belong to their
  /// requests, so that it owes none.
  void Conclude(const Asked& asked, const ExchangeEnd& end, bool in_step, Instant now);
  /// The port closed with an exchange under way, whose reply may reach the next opening of the
  /// port: from the device within its reply time; from a serial server, which keeps what comes, as
  /// late as a reply can be.
  void OnClosed(const Member& member, Instant now);
  /// From the end of its request to the first byte of its reply.
  static Duration TookUntilReply(const Asked& asked, const ExchangeEnd& end);
  /// It is offline: silent, not late. Its bytes will tell should it be late even so.
  void OnOffline(const Member& member) {
    states_[member].lateness = {};
    patience_.OnOffline(member);
  }

  Instant LateUntil(const Member& member) const;
  bool IsClear(const Member& member, Instant now) const { return LateUntil(member) <= now; }
  /// The earliest moment at which this request can be sent without a late reply to another one
  /// being taken for its reply. A reply that carries its sender's address is taken for no other
  /// device's.
  Instant ClearAt(const Asked& asked) const;
  /// So much longer than its reply time it is waited for.
  Duration PatienceFor(const Member& member) const { return patience_.More(member); }
  /// The same for this request: not where it looks whether the device is back.
  Duration MoreReply(const Asked& asked) const {
    return asked.lone_probe ? Duration() : patience_.More(*asked.member);
  }
  /// How much longer than its drain time the silence behind a failed exchange of it has to be.
  Duration ExtraDrain(const Member& member) const;
  /// The silence that has to follow even a good reply.
  Duration Aftermath(const Asked& asked, Instant now) const;
  /// The longest that an exchange of it keeps the line when it does not answer.
  Duration WorstCase(const Member& member) const;
  /// Whose exchange ended last.
  const Member* last() const { return last_; }

 private:
  enum class End : std::uint8_t {
    silent,     // or unexpected, or not at all
    answered,   // bytes behind it are too many
    corrupt,    // bytes behind it are the rest of that
    cut_short,  // likewise
  };
  struct State {
    Instant late_until{};               // until then an answer to a failed request may come
    std::optional<Instant> unanswered;  // start of the first exchange since its last answer
    std::optional<Instant> late_from;  // bytes from here on are the late answer to its last request
    // When the answer was due to the first try of its last request that met silence. A damaged
    // reply is no late one: behind that nothing is due.
    std::optional<Instant> due;
    Duration retried{};   // its last reply came to a repetition, so long after that
    Duration lateness{};  // how much longer than its drain time its bytes were seen to
                          // take behind the end of an exchange that had failed
    // How long after good answers more bytes came; not part of lateness, which lengthens what is
    // waited behind failures only. Needed by MisbehavingTwin.DoubledRepliesSpoilNoOther/Set4tm9600.
    Duration trail{};
    std::size_t trailing_bytes = 0;  // behind its last exchange, while that was a good one
    End end = End::silent;           // of its last exchange
    bool told_late = false;          // the user has been warned
  };

  bool MayStillAnswer(const Asked& asked, const ExchangeEnd& end) const;
  void SetLate(const Member& member, Instant until);

  const Roster& roster_;
  Patience patience_;
  ByMember<State> states_;
  const Member* last_ = nullptr;
};

}  // namespace baudgate
