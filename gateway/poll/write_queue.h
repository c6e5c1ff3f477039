// Writes to points of one line, in order: waiting, sent in time or not at all, confirmed, and read
// back before their clients are answered. gateway/poll/poller.cpp puts them in;
// waiting_clients.cpp ends those that were not sent or have been read back.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <deque>
#include <functional>
#include <optional>
#include <span>
#include <vector>

#include "gateway/base/time.h"
#include "gateway/poll/schedule.h"
#include "gateway/requests/write_command.h"
#include "protocols/conversation.h"

namespace baudgate {

class WriteQueue {
 public:
  /// Most commands that wait, and most read-backs.
  static constexpr std::size_t kLimit = 32;

  using MayGo = std::function<bool(const WriteCommand& command)>;
  using MayRead = std::function<bool(std::size_t device)>;

  /// The place of the next write among all writes to the line, whichever way they come.
  std::uint64_t NextSequence() { return ++sequence_; }

  bool full() const { return waiting_.size() >= kLimit; }
  bool empty() const { return waiting_.empty(); }
  /// Gives the command its sequence.
  void Push(WriteCommand command);
  /// The first command that may go. Those behind one that may not, may overtake it only where
  /// `may_go` lets them.
  std::optional<WriteCommand> Take(const MayGo& may_go);
  bool HasAny(const MayGo& may_go) const;
  const std::deque<WriteCommand>& waiting() const { return waiting_; }

  /// A write of this query's points is on its way, or a reading of it is in doubt: it is to be read
  /// as soon as possible. Once, however often it is asked for.
  void AddReadBack(QueryRef query);
  /// The same of all queries of the device that read this point.
  void AddReadBacks(std::size_t device, std::span<const Query> queries, std::size_t point);
  std::optional<QueryRef> TakeReadBack(const MayRead& may_read);
  const std::deque<QueryRef>& read_backs() const { return read_backs_; }

  /// The device has confirmed it: it is answered once nothing is to be read back any more, so that
  /// a client that reads what it has just written does not get the value from before.
  void Confirm(WriteCommand command, Instant now);
  struct Confirmed {
    WriteCommand command;
    Instant at;  ///< what is read later shows what it has done
    std::size_t written = 0;
    bool replaced = false;  ///< of some of its points, which are no longer in `command`
  };
  /// The point is being written once more: what it shows from now on is not what was written
  /// before.
  void OnBegun(std::uint32_t device, std::uint32_t point);
  /// `reading_back`: a read-back is under way that has not failed yet. A device that does not
  /// answer it at once does not hold up the answer to the write.
  std::vector<Confirmed> TakeConfirmed(bool reading_back);

  struct Expired {
    std::vector<WriteCommand> unsent;
    std::vector<Confirmed> confirmed;  ///< in time; only their read-back is not
  };
  Expired TakeExpired(Instant now);
  /// The port is closed: all that wait; nothing is to be read back any more.
  std::vector<WriteCommand> TakeAll();
  /// The soonest of all.
  std::optional<Instant> Deadline() const;

 private:
  std::deque<WriteCommand> waiting_;  // in the order of their arrival
  std::vector<Confirmed> confirmed_;
  std::deque<QueryRef> read_backs_;
  std::uint64_t sequence_ = 0;
};

}  // namespace baudgate
