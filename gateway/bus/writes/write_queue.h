// `WriteQueue` contains the writes to points of one line, in order: they wait, are sent in time or
// not at all, are confirmed, and are read back before their clients are answered.
// gateway/bus/jobs/waiting_clients.cpp adds commands, and ends those that were not sent or have
// been read back.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <functional>
#include <optional>
#include <span>
#include <vector>

#include "gateway/base/time.h"
#include "gateway/bus/writes/write_command.h"
#include "protocols/conversation.h"

namespace baudgate::bus {

/// A query of a device of the line: place of the device, and number of the query.
struct QueryRef {
  std::size_t device = 0;
  std::size_t query = 0;
  bool operator==(const QueryRef&) const = default;
};

class WriteQueue {
 public:
  /// The most commands that wait. There are at most as many read-backs as queries.
  static constexpr std::size_t kLimit = 32;

  using MayGo = std::function<bool(const WriteCommand& command)>;
  using MayRead = std::function<bool(std::size_t device)>;

  /// Returns the place of the next write among all writes to the line, from commands and routes.
  std::uint64_t NextSequence() { return ++sequence_; }

  bool full() const { return waiting_.size() >= kLimit; }
  bool empty() const { return waiting_.empty(); }
  /// Adds the command, and sets its sequence.
  void Push(WriteCommand command);
  /// Takes the first command that `may_go` accepts. It may overtake commands that may not go.
  std::optional<WriteCommand> Take(const MayGo& may_go);
  bool HasAny(const MayGo& may_go) const;
  const std::deque<WriteCommand>& waiting() const { return waiting_; }

  /// Reads this query as soon as possible, because its points are being written, or a reading of it
  /// is in doubt. Several calls lead to one read.
  void AddReadBack(QueryRef query);
  /// Calls AddReadBack for all queries of the device that read one of these points.
  void AddReadBacks(std::size_t device, std::span<const protocols::Query> queries,
                    std::span<const std::size_t> points);
  /// Takes the points of all queries of the device that wait to be read. `queries`: the queries
  /// when they were added.
  std::vector<std::size_t> TakeReadBacks(std::size_t device,
                                         std::span<const protocols::Query> queries);
  std::optional<QueryRef> TakeReadBack(const MayRead& may_read);
  const std::deque<QueryRef>& read_backs() const { return read_backs_; }

  /// Adds a command that the device has confirmed. It is answered when no read-back of the device
  /// waits any more, so a client that reads what it has just written does not get the old value.
  /// `device`: as in QueryRef.
  void Confirm(WriteCommand command, std::size_t device, Instant now);
  struct Confirmed {
    WriteCommand command;
    std::size_t device = 0;
    Instant at;  ///< readings after this show the effect of the write
    std::size_t written = 0;
    /// Some of its points were written again, and are no longer in `command`.
    bool replaced = false;
  };
  /// The point is being written again, so it no longer shows the result of an earlier write.
  void OnBegun(std::uint32_t device, std::uint32_t point);
  /// Returns whether a read-back of the device is under way that has not failed yet. After its
  /// first failure the answer to the write no longer waits for it.
  using IsReadingBack = std::function<bool(std::size_t device)>;
  std::vector<Confirmed> TakeConfirmed(const IsReadingBack& is_reading_back);

  struct Expired {
    std::vector<WriteCommand> unsent;
    std::vector<Confirmed> confirmed;  ///< confirmed in time, but not read back in time
  };
  Expired TakeExpired(Instant now);
  /// Takes all waiting commands and drops all read-backs, because the port is closed.
  std::vector<WriteCommand> TakeAll();
  std::optional<Instant> Deadline() const;

 private:
  std::deque<WriteCommand> waiting_;  // in the order of their arrival
  std::vector<Confirmed> confirmed_;
  std::deque<QueryRef> read_backs_;
  std::uint64_t sequence_ = 0;
};

}  // namespace baudgate::bus
