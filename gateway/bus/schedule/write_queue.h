// Writes to points of one line, in order: waiting, sent in time or not at all, confirmed, and read
// back before their clients are answered. gateway/bus/jobs/waiting_clients.cpp puts them in, and
// ends those that were not sent or have been read back. RoutedSide keeps when the clients of
// transparent routes were served last, and which offline slaves they want back.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <optional>
#include <span>
#include <vector>

#include "gateway/base/time.h"
#include "gateway/bus/devices/roster.h"
#include "gateway/bus/schedule/schedule.h"
#include "gateway/bus/writes/route_queue.h"
#include "gateway/bus/writes/write_command.h"
#include "protocols/conversation.h"

namespace baudgate {

class WriteQueue {
 public:
  /// Most commands that wait. Read-backs are as many as queries at most.
  static constexpr std::size_t kLimit = 32;

  using MayGo = std::function<bool(const WriteCommand& command)>;
  using MayRead = std::function<bool(std::size_t device)>;

  /// The place of the next write among all writes to the line, whichever way they come.
  std::uint64_t NextSequence() { return ++sequence_; }

  bool full() const { return waiting_.size() >= kLimit; }
  bool empty() const { return waiting_.empty(); }
  /// Gives the command its sequence.
  void Push(WriteCommand command);
  /// The first command that may go. It may overtake others that may not: `may_go` decides.
  std::optional<WriteCommand> Take(const MayGo& may_go);
  bool HasAny(const MayGo& may_go) const;
  const std::deque<WriteCommand>& waiting() const { return waiting_; }

  /// Read this query as soon as possible: its points are being written, or a reading of it is in
  /// doubt. Several calls lead to one read.
  void AddReadBack(QueryRef query);
  /// The same of all queries of the device that read one of these points.
  void AddReadBacks(std::size_t device, std::span<const Query> queries,
                    std::span<const std::size_t> points);
  /// The points of all queries of the device that wait to be read. `queries`: those it had when
  /// they were added.
  std::vector<std::size_t> TakeReadBacks(std::size_t device, std::span<const Query> queries);
  std::optional<QueryRef> TakeReadBack(const MayRead& may_read);
  const std::deque<QueryRef>& read_backs() const { return read_backs_; }

  /// The device has confirmed it. It is answered when nothing of that device is to be read back any
  /// more, so a client that reads what it has just written does not get the old value. `device`: as
  /// in QueryRef.
  void Confirm(WriteCommand command, std::size_t device, Instant now);
  struct Confirmed {
    WriteCommand command;
    std::size_t device = 0;
    Instant at;  ///< readings after this show its effect
    std::size_t written = 0;
    bool replaced =
        false;  ///< some of its points were written again, and are no longer in `command`
  };
  /// The point is being written again, so it no longer shows the result of an earlier write.
  void OnBegun(std::uint32_t device, std::uint32_t point);
  /// A read-back of the device is under way that has not failed yet. After its first failure the
  /// answer to the write does not wait for it any longer.
  using IsReadingBack = std::function<bool(std::size_t device)>;
  std::vector<Confirmed> TakeConfirmed(const IsReadingBack& is_reading_back);

  struct Expired {
    std::vector<WriteCommand> unsent;
    std::vector<Confirmed> confirmed;  ///< in time, but not read back in time
  };
  Expired TakeExpired(Instant now);
  /// The port is closed: all that wait; nothing is to be read back any more.
  std::vector<WriteCommand> TakeAll();
  /// The earliest of all.
  std::optional<Instant> Deadline() const;

 private:
  std::deque<WriteCommand> waiting_;  // in the order of their arrival
  std::vector<Confirmed> confirmed_;
  std::deque<QueryRef> read_backs_;
  std::uint64_t sequence_ = 0;
};

// The clients of transparent routes on one line: when they were served last, and which slaves they
// want back. gateway/bus/writes/route_queue.h keeps and chooses their requests,
// gateway/bus/jobs/job_run.h sends and answers them: no conversation takes part.
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
                                          const PduCarrier& carrier, Instant now);
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

}  // namespace baudgate
