// `RouteQueue` contains routed requests that wait for one line, and chooses which goes next: three
// priorities, clients in turn, short writes before all others, and never a write before an earlier
// write to its slave. Requests come from gateway/lines/line_runner.h through
// gateway/bus/poller/poller.cpp. gateway/bus/jobs/chooser.cpp asks for the next request whenever
// the line is idle. The queue has no clock and does not see the bytes of the line. Each choice
// takes time in proportion to the number of waiting requests.
// `RoutedRequest` and `RoutedReply` are passed on; `RouteTarget` takes them: a line, or a server
// elsewhere. `RoutedSide` keeps when the clients were served last, and which offline slaves they
// want back.
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

// A Modbus request that the gateway passes on unchanged, and its reply. Transparent routes give
// requests to a line (gateway/lines/line_runner.h) or to a Modbus TCP server elsewhere
// (gateway/outputs/modbus/upstream/upstream.h).
struct RoutedReply {
  /// ok: `pdu` is the reply of the slave. refused: `pdu` is the exception that the slave itself
  /// answered. Anything else: there was no good reply, `pdu` is empty and `reason` is the cause.
  Outcome outcome = Outcome::none;
  Bytes pdu;
  std::string reason;
  /// false: its deadline passed in the queue, it was refused, its client had left before, or the
  /// port was closed.
  bool sent = false;
  bool shared = false;  ///< answered by the exchange of an identical read of another client
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
  // Set by the line: place among all writes to the line, and how often the request was sent without
  // a good reply.
  std::uint64_t sequence = 0;
  int tries = 0;
  /// Called exactly once, on any thread, unless Submit returned false.
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
  /// Returns false if the queue is full, or if the target is stopping; `done` is not called then.
  virtual bool Submit(RoutedRequest request) = 0;
  /// The client has left: its waiting requests are not sent, and are answered at once. An exchange
  /// under way continues.
  virtual void Abandon(std::uint64_t client) = 0;
};

/// Returns whether the request is a write, which keeps its order among the requests of its slave
/// (protocols/modbus_pdu/modbus_pdu.h has the table).
inline bool IsWrite(const RoutedRequest& request) { return !modbus::IsRead(request.pdu[0]); }

class RouteQueue {
 public:
  /// The most requests that wait for one line or are under way on it.
  static constexpr std::size_t kLimit = 2048;  // 64 clients with 32 each
  /// Places beyond the limit for short writes only, so that a full queue refuses no stop.
  static constexpr std::size_t kKept = 128;
  /// Writes of more registers than this are blocks, which wait for their turn.
  static constexpr std::size_t kShortWrite = 8;

  /// Returns whether a request may be sent now, as far as its slave and the line are concerned.
  using MayAsk = std::function<bool(const RoutedRequest& request)>;
  /// The request to send, and identical reads that its reply answers as well.
  using Batch = std::vector<RoutedRequest>;

  /// Returns whether the request may overtake reads and blocks.
  static bool IsShortWrite(const RoutedRequest& request);
  /// Returns how many requests may wait already when this request is accepted; other requests have
  /// `limit` places.
  static std::size_t LimitFor(const RoutedRequest& request, std::size_t limit = kLimit) {
    return limit + (IsShortWrite(request) ? kKept : 0);
  }

  void Push(RoutedRequest request);
  /// Puts back requests that were taken and not answered, in front of all others.
  void Return(Batch batch);

  /// Takes a short write, or a write that a short write waits for. Empty: none may be sent now.
  Batch TakeUrgent(const MayAsk& may_ask);
  /// Returns whether TakeUrgent would find a write for this slave, if the slave may be asked.
  bool HasUrgent(std::uint8_t slave) const;
  Batch Take(config::Priority priority, const MayAsk& may_ask);
  /// Takes the next request for this slave, its writes first.
  Batch TakeFor(std::uint8_t slave);
  bool HasFor(std::uint8_t slave) const { return NextFor(slave).has_value(); }
  /// Takes all reads of this slave except the first `keep`.
  std::vector<RoutedRequest> TakeReads(std::uint8_t slave, std::size_t keep);

  std::vector<RoutedRequest> TakeOf(std::uint8_t slave);

  std::vector<RoutedRequest> TakeExpired(Instant now);
  std::vector<RoutedRequest> TakeAll();
  void Abandon(std::uint64_t client);

  bool empty() const { return waiting_.empty(); }
  std::size_t size() const { return waiting_.size(); }
  bool HasAny(const MayAsk& may_ask) const;
  /// Returns the sequence of the first write that waits for this slave, or for all slaves.
  std::optional<std::uint64_t> FirstWrite(std::uint8_t slave) const;
  std::size_t Clients(config::Priority priority) const;
  /// Returns each slave for which a request waits, once.
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
  /// Clients with no request left in the queue lose their turn.
  void ForgetServed(const std::vector<RoutedRequest>& taken);

  std::deque<RoutedRequest> waiting_;            // in the order of their arrival
  std::map<std::uint64_t, std::uint64_t> turn_;  // turn of each waiting client: lowest first
  std::uint64_t next_turn_ = 0;
};

// `RoutedSide` keeps the clients of transparent routes on one line: when they were served last, and
// which slaves they want back. `RouteQueue` contains and chooses their requests;
// gateway/bus/jobs/routed.h sends and answers them without a conversation.
class RoutedSide {
 public:
  /// Clients of transparent routes that poll do so at least this often.
  static constexpr Duration kClientsReturn = std::chrono::seconds(2);
  /// A client that asked for an offline slave is assumed to want it back for this long.
  static constexpr Duration kStillWanted = std::chrono::minutes(1);

  /// `queue` must stay valid for the lifetime of this object.
  explicit RoutedSide(RouteQueue& queue) : queue_(queue) {}

  void OnAnswered(Instant now) { answered_at_ = now; }
  /// Returns when the clients count as gone; empty: there were none.
  std::optional<Instant> ClientsGone() const;
  /// Returns whether a client may ask at any moment, because a client was served shortly before.
  bool ClientsAreHere(Instant now) const { return ClientsGone() && now < *ClientsGone(); }

  /// Takes the reads of an offline slave, except the first `keep`, to be answered at once. A read
  /// is remembered for the probes of the slave.
  std::vector<RoutedRequest> TakeHopeless(const Member& slave, std::size_t keep,
                                          const protocols::PduCarrier& carrier, Instant now);
  /// Returns whether a client without a waiting request still wants to know if this slave is back.
  /// A client that asks its slaves in turn waits for other slaves meanwhile, so its last read is
  /// repeated as a probe: for 2 s at once, up to 1 min only directly after another exchange
  /// (`behind`). Needed by
  /// AskedInTurn.AReturningSlaveIsFoundByAClientThatAsksSlavesInTurn.
  bool MayRepeatRead(const Member& slave, bool behind, Instant now) const;
  /// Returns the last read of this slave by a client, now without a client.
  RouteQueue::Batch RepeatRead(const Member& slave) const;

 private:
  struct Refused {
    Bytes pdu;
    Instant at{};
  };

  RouteQueue& queue_;
  std::optional<Instant> answered_at_;
  std::map<std::uint8_t, Refused> refused_;  // by slave, while the slave is offline
};

}  // namespace baudgate::bus
