// Routed requests that wait for one line, and which of them goes next: three priorities, clients in
// turn, short writes before everything else, and never a write before an earlier one to its slave.
// Requests come from gateway/lines/line_runner.h by way of gateway/bus/poller/poller.cpp.
// gateway/bus/jobs/chooser.cpp asks for the next one whenever the line is idle. Has no clock, and
// does not know the bytes of the line. A choice is made for every exchange, and takes time in
// proportion to the number of waiting requests. RoutedRequest and RoutedReply are what is passed
// on, and RouteTarget is the line, or the server elsewhere, that takes it. RoutedSide keeps when
// the clients were served last, and which offline slaves they want back.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "config/model/outputs.h"
#include "gateway/base/bytes.h"
#include "gateway/base/outcome.h"
#include "gateway/base/time.h"
#include "protocols/modbus_pdu/modbus_pdu.h"

namespace baudgate::protocols {
struct PduCarrier;
}  // namespace baudgate::protocols

namespace baudgate::bus {

struct Member;

// A Modbus request that the gateway passes on as it is, and the reply on its way back: what
// transparent routes hand to a line (gateway/lines/line_runner.h) or to a Modbus TCP server
// elsewhere (gateway/outputs/modbus/upstream/upstream.h).
struct RoutedReply {
  /// ok: `pdu` is the slave's reply. refused: `pdu` is the exception that the slave itself
  /// answered. Anything else: there was no good reply, `pdu` is empty and `reason` says why.
  Outcome outcome = Outcome::none;
  Bytes pdu;
  std::string reason;
  bool sent = false;    ///< false: its deadline passed in the queue, it was refused, its client had
                        ///< left before, or the port was closed
  bool shared = false;  ///< answered by the exchange of another client's identical read
  Duration waited{};    ///< from Submit to the first byte out
};

struct RoutedRequest {
  std::uint64_t client = 0;  ///< clients of one priority are served in turn
  std::uint8_t slave = 0;    ///< address on the line, or unit id at the server
  bool broadcast = false;    ///< to slave 0, without a reply
  Bytes pdu;                 ///< function code and data, 1…253 bytes
  config::Priority priority = config::Priority::normal;
  Instant arrived;
  Instant deadline;  ///< not sent later; answered no_reply when it passes
  // The line's own: its place among all writes to the line, and how often it was sent without a
  // good reply.
  std::uint64_t sequence = 0;
  int tries = 0;
  /// Called exactly once, on any thread, unless Submit said no.
  std::function<void(RoutedReply)> done;
};

/// The reply to a request whose client has left.
inline RoutedReply Abandoned(bool sent) {
  RoutedReply reply;
  reply.outcome = Outcome::no_reply;
  reply.reason = "the client is no longer connected";
  reply.sent = sent;
  return reply;
}

/// All calls from any thread.
class RouteTarget {
 public:
  virtual ~RouteTarget() = default;
  /// False: the queue is full, or the target is stopping; `done` is not called.
  virtual bool Submit(RoutedRequest request) = 0;
  /// The client has left: its waiting requests are not sent, and answered at once. An exchange
  /// under way goes on.
  virtual void Abandon(std::uint64_t client) = 0;
};

/// A write keeps its order among the requests of its slave (protocols/modbus_pdu/modbus_pdu.h has
/// the table).
inline bool IsWrite(const RoutedRequest& request) { return !modbus::IsRead(request.pdu[0]); }

class RouteQueue {
 public:
  /// The most requests that wait for one line or are under way on it.
  static constexpr std::size_t kLimit = 2048;  // 64 clients with 32 each
  /// Places beyond the limit that only short writes may take: a full queue refuses no stop.
  static constexpr std::size_t kKept = 128;
  /// Writes of more registers than this are blocks, which wait for their turn.
  static constexpr std::size_t kShortWrite = 8;

  /// Whether a request may be sent now, as far as its slave and the line are concerned.
  using MayAsk = std::function<bool(const RoutedRequest& request)>;
  /// The one to be sent, and identical reads that its reply answers as well.
  using Batch = std::vector<RoutedRequest>;

  /// Whether it may overtake reads and blocks.
  static bool IsShortWrite(const RoutedRequest& request);
  /// How many requests may be there already when this one is let in; others have `limit` places.
  static std::size_t LimitFor(const RoutedRequest& request, std::size_t limit = kLimit) {
    return limit + (IsShortWrite(request) ? kKept : 0);
  }

  void Push(RoutedRequest request);
  /// Puts back requests that were taken and not answered, in front of all others.
  void Return(Batch batch);

  /// A short write, or a write that a short write waits for; empty: none may be sent now.
  Batch TakeUrgent(const MayAsk& may_ask);
  /// Whether TakeUrgent would find one for this slave, if it may be asked.
  bool HasUrgent(std::uint8_t slave) const;
  Batch Take(config::Priority priority, const MayAsk& may_ask);
  /// Whatever may be sent to this slave next, its writes first.
  Batch TakeFor(std::uint8_t slave);
  bool HasFor(std::uint8_t slave) const { return NextFor(slave).has_value(); }
  /// Reads of this slave, all but the first `keep`.
  std::vector<RoutedRequest> TakeReads(std::uint8_t slave, std::size_t keep);

  /// All of this slave.
  std::vector<RoutedRequest> TakeOf(std::uint8_t slave);

  std::vector<RoutedRequest> TakeExpired(Instant now);
  std::vector<RoutedRequest> TakeAll();
  /// Answers the waiting requests of a client that has left.
  void Abandon(std::uint64_t client);

  bool empty() const { return waiting_.empty(); }
  std::size_t size() const { return waiting_.size(); }
  bool HasAny(const MayAsk& may_ask) const;
  /// The sequence of the first write that waits for this slave, or for all.
  std::optional<std::uint64_t> FirstWrite(std::uint8_t slave) const;
  /// Clients of this priority that wait.
  std::size_t Clients(config::Priority priority) const;
  /// Every slave that something waits for, once.
  std::vector<std::uint8_t> Slaves() const;
  std::optional<Instant> Deadline() const;

 private:
  /// Places are indices in waiting_.
  std::optional<std::size_t> NextFor(std::uint8_t slave) const;
  template <typename Wanted>
  Batch TakeBest(const MayAsk& may_ask, Wanted wanted);
  Batch TakeWithTwins(std::size_t place);
  template <typename Wanted>
  std::vector<RoutedRequest> TakeIf(Wanted wanted);
  /// Clients with nothing left in the queue lose their turn.
  void ForgetServed(const std::vector<RoutedRequest>& taken);

  std::deque<RoutedRequest> waiting_;            // in the order of their arrival
  std::map<std::uint64_t, std::uint64_t> turn_;  // of clients that wait: lowest first
  std::uint64_t next_turn_ = 0;
};

// The clients of transparent routes on one line: when they were served last, and which slaves they
// want back. RouteQueue keeps and chooses their requests, gateway/bus/jobs/routed.h sends and
// answers them: no conversation takes part.
class RoutedSide {
 public:
  /// Clients of transparent routes that poll do so at least this often.
  static constexpr Duration kClientsReturn = std::chrono::seconds(2);
  /// A client that asked for an offline slave is assumed to want it back for this long.
  static constexpr Duration kStillWanted = std::chrono::minutes(1);

  /// It outlives this.
  explicit RoutedSide(RouteQueue& queue) : queue_(queue) {}

  /// An exchange for a client was answered.
  void OnAnswered(Instant now) { answered_at_ = now; }
  /// When the clients count as gone; empty: there were none.
  std::optional<Instant> ClientsGone() const;
  /// Clients do not say when they will be back: one that was just served may ask at any moment.
  bool ClientsAreHere(Instant now) const { return ClientsGone() && now < *ClientsGone(); }

  /// Reads of an offline slave, except the first `keep`: to be answered at once. What was asked for
  /// is remembered for its probes.
  std::vector<RoutedRequest> TakeHopeless(const Member& slave, std::size_t keep,
                                          const protocols::PduCarrier& carrier, Instant now);
  /// Whether a client that has no request waiting right now still wants to know if this slave is
  /// back: a client that asks its slaves one after the other waits for others then, so its last
  /// read is repeated in its place. For 2 s after that at once, up to 1 min only directly after
  /// another exchange (`behind`). Needed by
  /// AskedInTurn.ASlaveThatReturnsIsFoundThoughItsClientNeverWaitsForIt.
  bool MayRepeatRead(const Member& slave, bool behind, Instant now) const;
  /// The read, without a client.
  RouteQueue::Batch RepeatRead(const Member& slave) const;

 private:
  struct Refused {
    Bytes pdu;  // the last read of a client from it
    Instant at{};
  };

  RouteQueue& queue_;
  std::optional<Instant> answered_at_;
  std::map<std::uint8_t, Refused> refused_;  // by slave, while offline
};

}  // namespace baudgate::bus
