// `LateReplies` decides until when a reply may still come to a request that was given up. Until
// then the device gets only repetitions of that request; if replies carry no address, other devices
// get no request either. docs/timeouts.md has the numbers, late_replies.cpp two tables. `Asked` is
// an exchange for the parts that learn from it; `Patience` lengthens the wait for a device whose
// replies came late.
//
// Call OnEnded at the end of an exchange, then OnStray for bytes that come after it. Bytes that
// came before the end of an exchange but do not belong to it (LineNews::stray_before) count for the
// exchange before.
//
// Bytes after the end of an exchange are not read as a reply: a late reply is counted, and makes
// the next waits longer. A late reply that comes while a request is on the wire is judged by
// whose_reply.h. If replies carry addresses, TakeOthers finds a late reply that came while another
// device was asked.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstddef>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "gateway/base/bytes.h"
#include "gateway/base/outcome.h"
#include "gateway/base/time.h"
#include "gateway/bus/devices/roster.h"
#include "gateway/bus/exchange/line.h"
#include "protocols/conversation.h"
#include "protocols/protocol.h"

namespace baudgate::bus {

/// The most tries beyond `retries`. Example: a serial server that is three replies late gives the
/// reply to the first try to the fourth try. One more try makes up for a lost reply.
inline constexpr int kMostTriesMore = 4;
/// The most probes in a row that find out by how many replies a device lags.
inline constexpr int kMostProbesMore = 16;

struct Asked {
  const Member* member = nullptr;
  const protocols::Request* request = nullptr;
  Instant sent{};      ///< when the first byte was sent; before that, when the line got the request
  bool first = false;  ///< the first request of a task that is no probe, and no repetition
  bool retry = false;  ///< the same request has failed before
  bool probe = false;
  /// No task waits for the probe: it finds out whether the device is back.
  bool lone_probe = false;
  bool renews_proof_early = false;  ///< the proof is renewed early, because the line has time
  bool proved = false;              ///< the member has answered a probe before this task
  bool unprovable = false;          ///< a probe was needed before this task, and cannot be asked
  bool writes = false;

  Instant sent_out() const { return sent + TransmissionTime(*request, member->times.character); }
  Duration reply_time() const { return ReplyTime(*request, member->times); }
  /// True if the reply contains the address of its device.
  bool named() const { return !request->expect.address.empty(); }
  /// True if the device itself writes the address, and not a converter in front of it.
  bool names_itself() const { return named() && !request->numbered; }
  /// Returns the bytes of the request without its number.
  Bytes question() const { return WithoutNumber(*member->protocol, request->bytes); }
};

// `Patience` is the time that the line waits for a device beyond its reply time, if its replies
// came late again and again. Reply time and patience end at the ceiling at the latest;
// docs/timeouts.md, "Late replies". Example with a reply time of 300 ms:
//
//   event                        the line waits
//   a reply comes at 450 ms      300 ms: once may be chance
//   another reply at 450 ms      488 ms: 300 ms and 5/4 of the lateness
//   replies in time              gradually less
//   the device goes offline      300 ms, so that probes of it do not delay other devices
//
class Patience {
 public:
  /// A reply came `lateness` after the reply time.
  void OnLate(const Member& member, Duration lateness);
  /// A reply was taken `lateness` after the reply time. Zero or less: in time.
  void OnAnswered(const Member& member, Duration lateness);
  void OnOffline(const Member& member) { entries_[member] = {}; }

  /// Returns the time beyond the configured reply time.
  Duration More(const Member& member) const;

 private:
  struct Entry {
    int late_count = 0;  // number of late replies; reset after many replies in time
    int in_time = 0;     // number of replies in time, in a row
    Duration most{};     // longest lateness of these late replies
    Duration more{};
  };

  static void Lengthen(Entry& entry, Duration lateness);

  ByMember<Entry> entries_;
};

class LateReplies {
 public:
  explicit LateReplies(const Roster& roster) : roster_(roster) {}

  /// Call at the end of an exchange: decides how long the next requests wait.
  /// `nothing_to_wait_for`: waiting is useless, because the device owes no reply (no reply can
  /// still come), or always lags by some replies.
  void OnEnded(const Asked& asked, const ExchangeEnd& end, bool nothing_to_wait_for, Instant now);

  struct StrayEffects {
    bool counts = true;  ///< the bytes count as stray bytes of the line
    /// The bytes are the late reply of this member; reported once per exchange.
    const Member* late_member = nullptr;
    Duration lateness{};             ///< how long after its reply time that reply came
    const Member* warned = nullptr;  ///< the device that `warning` is about
    std::string warning;
  };
  StrayEffects OnStray(const StrayBytes& stray, Instant now);

  /// Stores received bytes of all devices for TakeOthers.
  void Hear(View bytes, Instant now);
  struct Late {
    const Member* member = nullptr;
    Duration lateness{};
  };
  /// Call when the next request is to be sent. Returns the late replies of members that were not
  /// asked last, found in all bytes since the request before. Each reply is returned once, and only
  /// replies that carry an address are found.
  std::vector<Late> TakeOthers();

  /// The port closed during an exchange. The reply may come after the port has opened again: from
  /// the device within its reply time; from a serial server, which stores what it receives, until
  /// the ceiling.
  void OnClosed(const Member& member, Instant now);
  /// A request that the poller does not know (a telegram by hand) got no reply: a reply may come
  /// until the ceiling.
  void OnUnknownRequest(const Member& member, Instant now) {
    SetLate(member, now + member.times.ceiling);
  }
  /// A second, different reply of the member came. From the second time on, two devices may have
  /// its address: its good replies are then followed by a silence of its drain time for a while.
  void OnSecondReply(const Member& member) {
    Entry& entry = entries_[member];
    if (!std::exchange(entry.had_second, true)) return;
    entry.trail = std::max(entry.trail, member.times.drain);
  }
  /// Returns how long after the reply time the first byte of the reply came. Zero or less: in time.
  static Duration Lateness(const Asked& asked, const ExchangeEnd& end);
  /// The member is offline: silent, not late. If it is late after all, its bytes will show this
  /// again.
  void OnOffline(const Member& member) {
    entries_[member].more_drain = {};
    patience_.OnOffline(member);
  }

  Instant LateUntil(const Member& member) const;
  bool IsClear(const Member& member, Instant now) const { return LateUntil(member) <= now; }
  /// Returns from when on no late reply of any member can come.
  Instant AllClearAt() const;
  /// Returns the earliest moment at which a late reply to another request cannot be taken for the
  /// reply to this request. A reply that carries an address is not taken for the reply of another
  /// device.
  Instant ClearAt(const Asked& asked) const;
  Duration PatienceFor(const Member& member) const { return patience_.More(member); }
  /// Returns PatienceFor the member of this request, but zero for a probe of an absent device.
  Duration MoreReply(const Asked& asked) const {
    return asked.lone_probe ? Duration() : patience_.More(*asked.member);
  }
  /// Returns how much longer than the drain time the silence after a failed exchange of the member
  /// has to be.
  Duration ExtraDrain(const Member& member) const;
  /// Returns the silence that has to follow even a good reply.
  Duration Aftermath(const Asked& asked, Instant now) const;
  /// Returns the longest reply time of all members. After a silence of this length no reply comes.
  Duration LongestReply() const;
  /// Returns the longest line time of an exchange with the member if it does not answer.
  Duration WorstCase(const Member& member) const;
  /// Returns the member whose exchange ended last; null: there was none.
  const Member* last() const { return last_; }

 private:
  /// The last exchange of a member. It decides what later bytes may be.
  struct Last {
    enum class End : std::uint8_t {
      silent,     // no answer, unexpected, answered after silence, or no exchange yet
      answered,   // later bytes are a second copy, or noise
      corrupt,    // later bytes are the rest of the damaged reply
      cut_short,  // later bytes are the rest of a reply that was cut short
    };
    End end = End::silent;
    bool absent = false;    // the exchange was a probe while the member was offline
    std::size_t least = 0;  // number of bytes of the shortest reply
    std::size_t after = 0;  // number of bytes since the end of the exchange
    // When the reply to the first try was due, if there was silence. Empty after a damaged reply.
    std::optional<Instant> due{};
    std::optional<Instant> late_from{};  // bytes from this moment on are the late reply
    Duration retried{};  // if the reply came to a repetition: the time from `due` until then
    protocols::Request request{};  // the request, if its reply may come late and carries an address
  };
  struct Entry {
    Instant late_until{};                     // until then the reply to a failed request may come
    std::optional<Instant> unanswered_since;  // start of the first exchange since the last reply
    Last last;
    // How much longer than the drain time bytes came after a failed exchange.
    Duration more_drain{};
    // Silence after good replies, because more bytes came after one of them. `more_drain` is the
    // silence after failures. Needed by
    // MisbehavingTwin.DoubledRepliesAffectNoOtherReply/Set4tm9600.
    Duration trail{};
    bool told_late = false;
    bool had_second = false;
  };

  std::optional<Instant> AnsweredAt(const Member& member, const protocols::Request& request) const;
  static Last LastOf(const Entry& before, const Asked& asked, Outcome outcome, Instant now);
  void SetWait(const Asked& asked, const ExchangeEnd& end, bool nothing_to_wait_for, Instant now);
  static void LearnSilence(Entry& entry, const Member& member, const StrayBytes& stray,
                           StrayEffects& effects);
  bool MayStillAnswer(const Asked& asked, const ExchangeEnd& end) const;
  bool OthersMayAnswer(const Member& member, Instant at) const;
  void SetLate(const Member& member, Instant until);

  const Roster& roster_;
  Patience patience_;
  ByMember<Entry> entries_;
  const Member* last_ = nullptr;
  Bytes heard_;  // all bytes since the latest request, at most kMostHeard
  struct Piece {
    std::size_t end = 0;  // index in heard_ of the end of the piece
    Instant at{};
  };
  std::vector<Piece> pieces_;
};

}  // namespace baudgate::bus
