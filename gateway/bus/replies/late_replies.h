// `LateReplies` decides how long a reply can still come to a request that got none. During this
// time the device gets only retries of that request; if replies carry no address, no other device
// of the line gets a request either. docs/timeouts.md has the times, and
// gateway/bus/replies/late_replies.cpp two tables of the cases. `Asked` describes a request;
// `Patience` lengthens the reply time of a device whose replies came late.
//
// Call OnEnded at the end of an exchange, then OnStray for bytes that belong to no exchange. These
// bytes can also come during the next exchange (LineNews::stray_before).
//
// Bytes after the end of an exchange are never read as a reply. If they are a late reply, it is
// counted, and the next waits are longer. A late reply that comes during a later exchange is judged
// by `WhoseReply` (gateway/bus/replies/whose_reply.h). If replies carry addresses, TakeOthers finds
// a late reply that came while another device was asked.
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

/// Greatest number of extra retries beyond the configured `retries`. Example: the replies of a
/// serial server come three requests late, so the fourth try gets the reply to the first try. One
/// more try makes up for a lost reply.
inline constexpr int kMostTriesMore = 4;
/// Greatest number of extra probes that find out by how many requests the replies of a device lag.
inline constexpr int kMostProbesMore = 16;

struct Asked {
  const Member* member = nullptr;
  const protocols::Request* request = nullptr;
  Instant sent{};      ///< when the first byte was sent; until then, when the line got the request
  bool first = false;  ///< the first request of its protocols::Task; false for a retry or a probe
  bool retry = false;
  bool probe = false;
  /// The probe finds out whether an offline device is back; no other job waits for it.
  bool lone_probe = false;
  /// A proof is needed before this request if the latest proof is older than 45 s (kProofRenews),
  /// not 1 min, because the line has time.
  bool renews_proof_early = false;
  bool proved = false;      ///< a probe directly before the task was answered
  bool unprovable = false;  ///< the task needs a probe before it, but the device cannot be probed
  bool writes = false;

  Instant sent_out() const { return sent + TransmissionTime(*request, member->times.character); }
  Duration reply_time() const { return ReplyTime(*request, member->times); }
  bool named() const { return !request->expect.address.empty(); }
  /// False if a converter may have written the address into the reply, as in Modbus TCP.
  bool names_itself() const { return named() && !request->numbered; }
  /// Returns the request without its sequence number, such as the transaction number of Modbus TCP.
  Bytes question() const { return WithoutNumber(*member->protocol, request->bytes); }
};

// `Patience` is the extra time that the line waits for a device beyond its reply time, because its
// replies came late repeatedly. Reply time and patience together do not exceed LineTimes::ceiling.
// See docs/timeouts.md, "Late replies". Example with a reply time of 300 ms:
//
//   event                        the line waits
//   a reply comes at 450 ms      300 ms: once may be chance
//   another reply at 450 ms      488 ms: 300 ms and 5/4 of the lateness
//   replies in time              gradually less
//   the device goes offline      300 ms, so that probes of it do not delay other devices
class Patience {
 public:
  /// Call when a late reply came after its exchange had ended. `lateness`: time since the end of
  /// the reply time.
  void OnLate(const Member& member, Duration lateness);
  /// Call when a reply was accepted. `lateness`: time since the end of the reply time; zero or
  /// less: in time.
  void OnAnswered(const Member& member, Duration lateness);
  void OnOffline(const Member& member) { entries_[member] = {}; }

  Duration More(const Member& member) const;

 private:
  struct Entry {
    int late_count = 0;  // number of late replies; kRepliesToForget replies in time reset it
    int in_time = 0;
    Duration most{};  // longest lateness of the counted late replies
    Duration more{};
  };

  static void Lengthen(Entry& entry, Duration lateness);

  ByMember<Entry> entries_;
};

class LateReplies {
 public:
  explicit LateReplies(const Roster& roster) : roster_(roster) {}

  /// Call at the end of an exchange. Computes how long the next requests have to wait.
  /// `nothing_to_wait_for`: waiting is useless, because the device cannot send a reply any more, or
  /// its replies always come some requests late.
  void OnEnded(const Asked& asked, const ExchangeEnd& end, bool nothing_to_wait_for, Instant now);

  struct StrayEffects {
    bool counts = true;  ///< false: the bytes do not count in LineCounters::stray_bytes
    /// The member whose late reply the bytes are. Null: the bytes are no late reply, or the late
    /// reply was reported before.
    const Member* late_member = nullptr;
    Duration lateness{};  ///< how long after the end of its reply time the late reply came
    const Member* warned = nullptr;  ///< null: there is no warning
    std::string warning;
  };
  StrayEffects OnStray(const StrayBytes& stray, Instant now);

  /// Stores received bytes for the search of TakeOthers.
  void Hear(View bytes, Instant now);
  struct Late {
    const Member* member = nullptr;
    Duration lateness{};
  };
  /// Call when the next request is to be sent. Searches the bytes since the previous request for
  /// late replies of devices that were not asked last. Returns each of them once. Finds only
  /// replies that carry an address.
  std::vector<Late> TakeOthers();

  /// Call when the port has closed during an exchange. When the port has opened again, the reply
  /// may still come: from a device within its reply and drain times, from a serial server until
  /// LineTimes::ceiling, because a server stores received bytes.
  void OnClosed(const Member& member, Instant now);
  /// Call when a telegram that a user has sent (`baudgate ask`) got no reply. The reply may come
  /// until LineTimes::ceiling is over.
  void OnUnknownRequest(const Member& member, Instant now) {
    SetLate(member, now + member.times.ceiling);
  }
  /// Call when a second, different reply of the member came, as from two devices with one address.
  /// From the second call on, the line stays silent for LineTimes::drain after each good reply of
  /// the member.
  void OnSecondReply(const Member& member) {
    Entry& entry = entries_[member];
    if (!std::exchange(entry.had_second, true)) return;
    entry.trail = std::max(entry.trail, member.times.drain);
  }
  /// Returns how long after the end of its reply time the reply began. Zero or less: in time.
  static Duration Lateness(const Asked& asked, const ExchangeEnd& end);
  /// Call when the member is offline. Removes the extra waits that its late replies have caused, so
  /// that probes of it do not delay other devices.
  void OnOffline(const Member& member) {
    entries_[member].more_drain = {};
    patience_.OnOffline(member);
  }

  Instant LateUntil(const Member& member) const;
  bool IsClear(const Member& member, Instant now) const { return LateUntil(member) <= now; }
  /// Returns the time after which no late reply of any member can come.
  Instant AllClearAt() const;
  /// Returns the time after which no late reply can be mistaken for the reply to this request. A
  /// reply with an address is never mistaken for the reply of another device.
  Instant ClearAt(const Asked& asked) const;
  Duration PatienceFor(const Member& member) const { return patience_.More(member); }
  Duration MoreReply(const Asked& asked) const {
    return asked.lone_probe ? Duration() : patience_.More(*asked.member);
  }
  /// Returns the silence beyond LineTimes::drain after a failed exchange of the member.
  Duration ExtraDrain(const Member& member) const;
  /// Returns the silence of the line after a good reply to this request.
  Duration Aftermath(const Asked& asked, Instant now) const;
  /// Returns the longest reply time of all members. After a silence of this length no reply can
  /// come.
  Duration LongestReply() const;
  /// Returns how long an exchange with the member takes if it does not answer.
  Duration WorstCase(const Member& member) const;
  /// Returns the member whose exchange ended last; null: no exchange has ended yet.
  const Member* last() const { return last_; }

 private:
  /// The last exchange of a member. It decides what the bytes after it can be.
  struct Last {
    enum class End : std::uint8_t {
      silent,     // no answer, or an answer after silence: later bytes may be a late reply
      answered,   // later bytes are a second copy, or noise
      corrupt,    // later bytes are the rest of the damaged reply
      cut_short,  // later bytes are the rest of a reply that was cut short
    };
    End end = End::silent;
    bool absent = false;    // the exchange was a probe of an offline member
    std::size_t least = 0;  // length of the shortest possible reply
    std::size_t after = 0;  // bytes received since the end of the exchange
    // When the reply to the first try was due. Empty if no try met silence.
    std::optional<Instant> due{};
    // Earliest time of the expected late reply. Empty: no late reply is expected.
    std::optional<Instant> late_from{};
    Duration retried{};            // if a retry was answered: the time from `due` to that answer
    protocols::Request request{};  // unanswered request; set only if its reply contains an address
  };
  struct Entry {
    Instant late_until{};  // the reply to a failed request may come until this time
    std::optional<Instant> unanswered_since;  // when the first request without a reply was sent
    Last last;
    // Extra silence after failed exchanges, because bytes came later than LineTimes::drain.
    Duration more_drain{};
    // Silence after good replies, because a copy came after a good reply. Needed by
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
    std::size_t end = 0;  // index in heard_ behind the last byte of the piece
    Instant at{};
  };
  std::vector<Piece> pieces_;
};

}  // namespace baudgate::bus
