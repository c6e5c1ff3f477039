// Routed requests that wait for one line, and which of them goes next: three priorities, clients in
// turn, short writes before everything else, and never a write before an earlier one to its slave.
// Requests come from gateway/lines/line_runner.h by way of gateway/bus/poller/poller.cpp, which
// asks for the next one whenever the line is idle. Has no clock, and does not know the bytes of the
// line. A choice is made for every exchange, and takes time in proportion to the number of waiting
// requests.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <optional>
#include <vector>

#include "gateway/bus/writes/routed.h"
#include "protocols/modbus/pdu/modbus_pdu.h"

namespace baudgate {

/// A write keeps its order among the requests of its slave (protocols/modbus/pdu/modbus_pdu.h has
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

}  // namespace baudgate
