// Until when a reply may still come to a request that was given up. Until then nothing but
// repetitions goes to its device; where replies carry no address, to no other device either.
// Numbers are in docs/timeouts.md. whose_reply.h knows to which request a reply belongs that did
// come. OnEnded is told how an exchange ended, then OnStray of whatever comes after it. Bytes that
// came before the end of an exchange, and do not belong to it (LineNews::stray_before), count for
// the exchange before. The tables of both are in late_replies.cpp.
//
// Asked is one such exchange, and Patience lengthens the wait for a device whose replies came late.
//
// Bytes that come after the end of an exchange are read by nobody: a late reply is counted, and
// makes the next waits longer. It is read only if it comes while a request is on the wire: then
// whose_reply.h judges it. Where replies carry addresses, one that comes while another device is
// asked is found when the next request is sent (TakeOthers).
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

/// The most tries beyond `retries`. Example: a server that is three replies late gives the fourth
/// try the reply to the first, and one more try makes up for a lost one.
inline constexpr int kMostTriesMore = 4;
/// The most probes in a row that find out by how many replies a device lags.
inline constexpr int kMostProbesMore = 16;

/// One exchange, for the parts of the poller that learn from it.
struct Asked {
  const Member* member = nullptr;
  const protocols::Request* request = nullptr;
  Instant sent{};           ///< its first byte; until then, when the line was given it
  bool first = false;       ///< the first request of a task that is no probe; no repetition
  bool retry = false;       ///< the same request had failed before
  bool probe = false;       ///< the task is a probe
  bool lone_probe = false;  ///< no task waits for it: it finds out whether the device is back
  bool renews_proof_early = false;  ///< because the line has time
  bool proved = false;              ///< the member has answered a probe before this task
  bool unprovable = false;          ///< a probe was wanted before this task, and cannot be asked
  bool writes = false;              ///< the task writes points

  /// When its last byte is out.
  Instant sent_out() const { return sent + TransmissionTime(*request, member->times.character); }
  Duration reply_time() const { return ReplyTime(*request, member->times); }
  /// The reply says whose it is.
  bool named() const { return !request->expect.address.empty(); }
  /// The device has written that itself, and not a converter before it.
  bool names_itself() const { return named() && !request->numbered; }
  /// What is asked, whichever number the request has.
  Bytes question() const { return WithoutNumber(*member->protocol, request->bytes); }
};

// How much longer than its reply time the line waits for a device whose replies came late again and
// again. Within the ceiling; docs/timeouts.md, "Late replies". With reply 300 ms:
//
//   a reply comes at 450 ms      300 ms: once may be chance
//   another one                  488 ms, a quarter more than it was late
//   replies in time              gradually less
//   it goes offline              300 ms: probes of an absent device cost the others no more
//
class Patience {
 public:
  /// A reply came `lateness` after it was due.
  void OnLate(const Member& member, Duration lateness);
  /// A reply was taken, `lateness` after it was due; not above zero: in time.
  void OnAnswered(const Member& member, Duration lateness);
  void OnOffline(const Member& member) { entries_[member] = {}; }

  /// Beyond the reply time of its configuration.
  Duration More(const Member& member) const;

 private:
  struct Entry {
    int late_count = 0;  // late replies since `in_time` was last high enough to forget them
    int in_time = 0;     // replies in time, in a row
    Duration most{};     // the lateness of the latest of these
    Duration more{};
  };

  static void Lengthen(Entry& entry, Duration lateness);

  ByMember<Entry> entries_;
};

class LateReplies {
 public:
  explicit LateReplies(const Roster& roster) : roster_(roster) {}

  /// The exchange has ended: decides how long the next requests wait. `nothing_to_wait_for`:
  /// waiting is useless, because the device owes no reply, or always lags by a number of replies.
  void OnEnded(const Asked& asked, const ExchangeEnd& end, bool nothing_to_wait_for, Instant now);

  struct StrayEffects {
    bool counts = true;                   ///< among the line's stray bytes
    const Member* late_member = nullptr;  ///< whose late reply it is, once for each exchange
    Duration lateness{};                  ///< of that reply, since it was due
    const Member* warned = nullptr;       ///< the device that `warning` is about
    std::string warning;
  };
  StrayEffects OnStray(const StrayBytes& stray, Instant now);

  /// Bytes have come, whoever sent them.
  void Hear(View bytes, Instant now);
  /// A reply of `member`, so long after it was due.
  struct Late {
    const Member* member = nullptr;
    Duration lateness{};
  };
  /// The next request is to be sent. Returns the late replies of members that were not asked last,
  /// among all bytes since the request before; each reply once. Only replies that carry an address
  /// are found.
  std::vector<Late> TakeOthers();

  /// The port closed with an exchange under way. Its reply may come after the port has opened
  /// again: from the device within its reply time; from a serial server, which keeps what it
  /// receives, until the end of the ceiling.
  void OnClosed(const Member& member, Instant now);
  /// A request that the poller does not know got no reply: one may come until its ceiling.
  void OnUnknownRequest(const Member& member, Instant now) {
    SetLate(member, now + member.times.ceiling);
  }
  /// A second, different reply of it came, and not for the first time: two devices may have its
  /// address. Its good replies are followed by a silence of its drain time for a while.
  void OnSecondReply(const Member& member) {
    Entry& entry = entries_[member];
    if (!std::exchange(entry.had_second, true)) return;
    entry.trail = std::max(entry.trail, member.times.drain);
  }
  /// How much later than its reply time the first byte of its reply came; not above zero: in time.
  static Duration Lateness(const Asked& asked, const ExchangeEnd& end);
  /// It is offline: silent, not late. If it is late after all, its bytes will show it again.
  void OnOffline(const Member& member) {
    entries_[member].more_drain = {};
    patience_.OnOffline(member);
  }

  Instant LateUntil(const Member& member) const;
  bool IsClear(const Member& member, Instant now) const { return LateUntil(member) <= now; }
  /// From then on no late reply of any member can come.
  Instant AllClearAt() const;
  /// The earliest moment at which this request can be sent without a late reply to another one
  /// being taken for its reply. A reply that carries its sender's address is taken for no other
  /// device's.
  Instant ClearAt(const Asked& asked) const;
  /// The extra reply time that its late replies have earned.
  Duration PatienceFor(const Member& member) const { return patience_.More(member); }
  /// The same for this request, but zero for a probe of an absent device.
  Duration MoreReply(const Asked& asked) const {
    return asked.lone_probe ? Duration() : patience_.More(*asked.member);
  }
  /// How much longer than its drain time the silence after one of its failed exchanges has to be.
  Duration ExtraDrain(const Member& member) const;
  /// The silence that has to follow even a good reply.
  Duration Aftermath(const Asked& asked, Instant now) const;
  /// The longest reply time of all members: after such a rest of the line, no reply comes.
  Duration LongestReply() const;
  /// How long an exchange of it takes the line at most when it does not answer.
  Duration WorstCase(const Member& member) const;
  /// The member whose exchange ended last.
  const Member* last() const { return last_; }

 private:
  /// The last exchange of a member: what bytes after it may be.
  struct Last {
    enum class End : std::uint8_t {
      silent,     // or unexpected, or answered after silence, or there was no exchange
      answered,   // bytes after it are a second copy, or noise
      corrupt,    // bytes after it are the rest of the damaged reply
      cut_short,  // bytes after it are the rest of a reply that was cut short
    };
    End end = End::silent;
    bool absent = false;    // it was a probe of the member while that was offline
    std::size_t least = 0;  // bytes of its shortest reply
    std::size_t after = 0;  // bytes since its end
    // When the reply to its first try was due, if that met silence. After a damaged reply nothing
    // is due.
    std::optional<Instant> due{};
    std::optional<Instant> late_from{};  // bytes from here on are its late reply
    Duration retried{};  // if its reply came to a repetition: the time from `due` until then
    protocols::Request request{};  // if its reply may come late, and carries an address
  };
  struct Entry {
    Instant late_until{};                     // until then a reply to a failed request may come
    std::optional<Instant> unanswered_since;  // start of the first exchange since its last reply
    Last last;
    Duration more_drain{};  // how much longer than its drain time its bytes kept coming after a
                            // failed exchange
    // Silence that follows its good replies, because more bytes came after one. The silence after
    // failures is `more_drain`. Needed by
    // MisbehavingTwin.DoubledRepliesAffectNoOtherReply/Set4tm9600.
    Duration trail{};
    bool told_late = false;   // the user has been warned
    bool had_second = false;  // a second, different reply came
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
  Bytes heard_;  // since the latest request, at most kMostHeard
  struct Piece {
    std::size_t end = 0;  // in heard_
    Instant at{};
  };
  std::vector<Piece> pieces_;  // of heard_
};

}  // namespace baudgate::bus
