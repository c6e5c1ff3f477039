// `RouteQueue` contains requests of clients of transparent routes that wait for one serial line,
// and chooses the next one. There are three priorities, hosts take turns, then the connections of a
// host. Short writes go before all others, and a write never goes before an earlier write to its
// slave. The queue has no clock
// and does no I/O. Each choice takes time in proportion to the number of waiting requests.
// `RoutedRequest` and `RoutedReply` are the contents; a `RouteTarget` takes requests: a line, or a
// server elsewhere. `RoutedSide` remembers when clients were served last, and which offline slaves
// they ask for.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <unordered_map>
#include <vector>

#include "config/model/outputs.h"
#include "gateway/base/bytes.h"
#include "gateway/base/fair_places.h"
#include "gateway/base/outcome.h"
#include "gateway/base/time.h"
#include "protocols/modbus_pdu/modbus_pdu.h"

namespace baudgate::protocols {
struct PduCarrier;
}  // namespace baudgate::protocols

namespace baudgate::bus {

struct Member;

// `RoutedRequest` is a Modbus request of a client that the gateway forwards unchanged, and
// `RoutedReply` is the reply. The target is a line (gateway/lines/line_runner.h) or a Modbus TCP
// server elsewhere (gateway/outputs/modbus/upstream/upstream.h).
struct RoutedReply {
  /// ok: `pdu` is the reply of the slave. refused: `pdu` is the exception with which the slave has
  /// answered. All others: there was no good reply, `pdu` is empty, and `reason` is the cause.
  Outcome outcome = Outcome::none;
  Bytes pdu;
  std::string reason;
  /// True if the request was sent. False, for example, if its deadline passed in the queue, its
  /// client left, or the port was closed.
  bool sent = false;
  bool shared = false;  ///< the reply to an identical read of another client answers this request
  Duration waited{};    ///< from the call of Submit to the first byte on the line
};

struct RoutedRequest {
  std::uint64_t client = 0;  ///< number of the client's connection
  std::uint64_t host = 0;    ///< number of the client's host (gateway/base/fair_places.h)
  std::uint8_t slave = 0;    ///< address on the line, or unit id at the server
  bool broadcast = false;    ///< to slave 0, without a reply
  Bytes pdu;                 ///< function code and data, 1…253 bytes
  config::Priority priority = config::Priority::normal;
  Instant arrived;
  Instant deadline;  ///< after this time the request is not sent, but answered with no_reply
  // The line sets these fields. `sequence`: number of the write among all writes to the line.
  // `tries`: how often the request was sent without a good reply.
  std::uint64_t sequence = 0;
  int tries = 0;
  /// Called exactly once with the reply, on any thread; not called if Submit returned false.
  std::function<void(RoutedReply)> done;
};

inline RoutedReply Abandoned(bool sent) {
  RoutedReply reply;
  reply.outcome = Outcome::no_reply;
  reply.reason = "the client is no longer connected";
  reply.sent = sent;
  return reply;
}

/// A target of transparent routes. All functions can be called from any thread.
class RouteTarget {
 public:
  virtual ~RouteTarget() = default;
  /// Takes a request. Returns false if the host of the request has too many requests already, or
  /// the target is stopping; `done` is not called then.
  virtual bool Submit(RoutedRequest request) = 0;
  /// Call when the client has left. Its waiting requests are answered at once and not sent; an
  /// exchange under way continues.
  virtual void Abandon(std::uint64_t client) = 0;
};

/// True if the request is a write (protocols/modbus_pdu/modbus_pdu.h has the table). Writes to one
/// slave are sent in their order.
inline bool IsWrite(const RoutedRequest& request) { return !modbus::IsRead(request.pdu[0]); }

class RouteQueue {
 public:
  /// Greatest number of requests that wait for a line or are under way on it.
  static constexpr std::size_t kLimit = 2048;  // 64 clients with 32 each
  /// Additional places for short writes only, so that a stop is accepted even if the queue is full.
  static constexpr std::size_t kKept = 128;
  /// A write of more registers than this is a block: it waits for its turn like a read.
  static constexpr std::size_t kShortWrite = 8;

  using MayAsk = std::function<bool(const RoutedRequest& request)>;
  /// The request to send, and identical reads that are answered by the same reply.
  using Batch = std::vector<RoutedRequest>;

  /// True if the request is a short write, such as a start or stop, which goes before reads and
  /// blocks.
  static bool IsShortWrite(const RoutedRequest& request);
  /// Takes a place for a request before it is passed to the queue. Returns false if the host of the
  /// request has its share. A host with requests of low priority has as many places as are free;
  /// normal priority: three times, high priority and short writes: seven times as many.
  static bool TakePlace(FairPlaces& places, const RoutedRequest& request);

  void Push(RoutedRequest request);
  /// Puts requests back that were taken but not answered, in front of all others.
  void Return(Batch batch);

  /// Takes a short write, or an earlier write that has to go before it. Empty: none can be sent
  /// now.
  Batch TakeUrgent(const MayAsk& may_ask);
  /// True if TakeUrgent would return a write for this slave, because of a short write to it, as
  /// soon as the slave can be asked.
  bool HasUrgent(std::uint8_t slave) const;
  Batch Take(config::Priority priority, const MayAsk& may_ask);
  /// Takes the next request for this slave; writes are taken before reads.
  Batch TakeFor(std::uint8_t slave);
  bool HasFor(std::uint8_t slave) const { return NextFor(slave).has_value(); }
  /// Takes all reads for this slave except the first `keep` reads.
  std::vector<RoutedRequest> TakeReads(std::uint8_t slave, std::size_t keep);

  std::vector<RoutedRequest> TakeOf(std::uint8_t slave);

  std::vector<RoutedRequest> TakeExpired(Instant now);
  std::vector<RoutedRequest> TakeAll();
  void Abandon(std::uint64_t client);

  bool empty() const { return waiting_.empty(); }
  std::size_t size() const { return waiting_.size(); }
  bool HasAny(const MayAsk& may_ask) const;
  /// Returns the sequence number of the first waiting write for this slave or for all slaves;
  /// empty: none waits.
  std::optional<std::uint64_t> FirstWrite(std::uint8_t slave) const;
  std::size_t Clients(config::Priority priority) const;
  std::vector<std::uint8_t> Slaves() const;
  std::optional<Instant> Deadline() const;

 private:
  /// Positions are indices in waiting_.
  std::optional<std::size_t> NextFor(std::uint8_t slave) const;
  template <typename Wanted>
  Batch TakeBest(const MayAsk& may_ask, Wanted wanted);
  Batch TakeWithTwins(std::size_t place);
  template <typename Wanted>
  std::vector<RoutedRequest> TakeIf(Wanted wanted);
  /// Gives the host and the client of the request the last turns, unless they have turns already.
  void AddTurns(const RoutedRequest& request);
  /// Removes the turns of each host and client that has no more waiting requests.
  void ForgetServed(const std::vector<RoutedRequest>& taken);

  /// The turn of each host, or each client, that waits. The lowest is next.
  using TurnBy = std::unordered_map<std::uint64_t, std::uint64_t>;

  std::deque<RoutedRequest> waiting_;  // in the order of their arrival
  TurnBy turn_of_host_;
  TurnBy turn_of_client_;
  std::uint64_t next_turn_ = 0;
};

// `RoutedSide` remembers when clients of transparent routes were served last on one line, and which
// offline slaves they ask for. (`RouteQueue` contains their requests; gateway/bus/jobs/routed.h
// sends them.)
class RoutedSide {
 public:
  /// Clients that poll through transparent routes are assumed to send a request at least this
  /// often.
  static constexpr Duration kClientsReturn = std::chrono::seconds(2);
  /// For this long after a client has asked for an offline slave, clients are assumed to wait for
  /// the return of the slave.
  static constexpr Duration kStillWanted = std::chrono::minutes(1);

  /// `queue` must stay valid for the lifetime of this object.
  explicit RoutedSide(RouteQueue& queue) : queue_(queue) {}

  void OnAnswered(Instant now) { answered_at_ = now; }
  /// Returns when the clients count as gone, kClientsReturn after the latest answer; empty: no
  /// request of a client was answered.
  std::optional<Instant> ClientsGone() const;
  bool ClientsAreHere(Instant now) const { return ClientsGone() && now < *ClientsGone(); }

  /// Takes the reads for an offline slave, except the first `keep`, so that they can be answered at
  /// once. Remembers the last of these reads that every slave answers (is_common), for RepeatRead.
  std::vector<RoutedRequest> TakeHopeless(const Member& slave, std::size_t keep,
                                          const protocols::PduCarrier& carrier, Instant now);
  /// True if the last read for this offline slave can be repeated as a probe, although no request
  /// waits: a client that asks its slaves in turn may be waiting for another slave at present.
  /// Allowed for kClientsReturn after the read; for kStillWanted if `behind` (directly after
  /// another exchange). Needed by AskedInTurn.AReturningSlaveIsFoundByAClientThatAsksSlavesInTurn.
  bool MayRepeatRead(const Member& slave, bool behind, Instant now) const;
  /// Returns a copy of the last read for this slave. Its reply goes to no client.
  RouteQueue::Batch RepeatRead(const Member& slave) const;

 private:
  struct Refused {
    Bytes pdu;
    Instant at{};
  };

  RouteQueue& queue_;
  std::optional<Instant> answered_at_;
  std::map<std::uint8_t, Refused> refused_;  // key: slave; the last read while it was offline
};

}  // namespace baudgate::bus
