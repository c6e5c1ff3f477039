// `WriteQueue` contains the writes to points of one line, in order. A command waits until it is
// sent or its deadline passes; when the device has confirmed it, its points are read back before
// the client is answered. gateway/bus/jobs/waiting_clients.cpp adds commands and answers their
// clients.
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

/// A query of a device. `device`: index of the device in the roster. `query`: number of the query.
struct QueryRef {
  std::size_t device = 0;
  std::size_t query = 0;
  bool operator==(const QueryRef&) const = default;
};

class WriteQueue {
 public:
  static constexpr std::size_t kLimit = 32;

  using MayGo = std::function<bool(const WriteCommand& command)>;
  using MayRead = std::function<bool(std::size_t device)>;

  /// Returns the next number for a write to the line. Commands and routed writes share the numbers.
  std::uint64_t NextSequence() { return ++sequence_; }

  bool full() const { return waiting_.size() >= kLimit; }
  bool empty() const { return waiting_.empty(); }
  void Push(WriteCommand command);
  /// Takes the first command that `may_go` accepts, even if earlier commands wait.
  std::optional<WriteCommand> Take(const MayGo& may_go);
  bool HasAny(const MayGo& may_go) const;
  const std::deque<WriteCommand>& waiting() const { return waiting_; }

  /// Requests a read of this query as soon as possible, because its points are being written or are
  /// uncertain. Several requests for a query lead to one read.
  void AddReadBack(QueryRef query);
  void AddReadBacks(std::size_t device, std::span<const protocols::Query> queries,
                    std::span<const std::size_t> points);
  /// Removes the waiting read-backs of the device and returns the points of their queries.
  /// `queries`: the queries that the device had when the read-backs were added.
  std::vector<std::size_t> TakeReadBacks(std::size_t device,
                                         std::span<const protocols::Query> queries);
  std::optional<QueryRef> TakeReadBack(const MayRead& may_read);
  const std::deque<QueryRef>& read_backs() const { return read_backs_; }

  /// Adds a command that the device has confirmed. It is answered when no read-back of the device
  /// waits any more, so that a client that writes and then reads does not get the old value.
  /// `device`: index of the device in the roster.
  void Confirm(WriteCommand command, std::size_t device, Instant now);
  struct Confirmed {
    WriteCommand command;
    std::size_t device = 0;
    Instant at;  ///< when the device confirmed the command; later readings show its effect
    std::size_t written = 0;
    /// True if another command has written a point of this command again. This point is removed
    /// from `command`.
    bool replaced = false;
  };
  /// Call when a point is written. The point no longer shows the result of earlier commands.
  void OnBegun(std::uint32_t device, std::uint32_t point);
  /// Returns true while a read-back of the device is under way that has not failed yet. When it has
  /// failed once, the answer to the write does not wait for retries.
  using IsReadingBack = std::function<bool(std::size_t device)>;
  std::vector<Confirmed> TakeConfirmed(const IsReadingBack& is_reading_back);

  struct Expired {
    std::vector<WriteCommand> unsent;
    std::vector<Confirmed> confirmed;  ///< confirmed, but not read back before the deadline
  };
  Expired TakeExpired(Instant now);
  /// Takes all waiting commands and removes all read-backs, because the port has closed.
  std::vector<WriteCommand> TakeAll();
  std::optional<Instant> Deadline() const;

 private:
  std::deque<WriteCommand> waiting_;  // in the order of their arrival
  std::vector<Confirmed> confirmed_;
  std::deque<QueryRef> read_backs_;
  std::uint64_t sequence_ = 0;
};

}  // namespace baudgate::bus
