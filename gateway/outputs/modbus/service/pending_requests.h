// Requests of one client that are not answered yet, by their numbers: writes to devices, or routed
// requests. Pure.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <utility>
#include <vector>

#include "gateway/base/bytes.h"
#include "gateway/base/time.h"

namespace baudgate::modbus {

struct PendingRequest {
  /// At its deadline the line answers what it has not sent, and a write that is confirmed. What is
  /// on the wire then is answered by the server this much later; the record of a write gets the
  /// end that comes.
  static constexpr Duration kGrace = 20ms;

  std::uint64_t number = 0;
  Instant deadline;
  /// The beginning of the request: to the function code; of a write all that its good answer
  /// repeats of it.
  Bytes frame;
  std::size_t route = 0;   ///< its number, of a routed request
  bool abandoned = false;  ///< it goes on, but is not answered

  /// When the server answers it itself.
  Instant Limit() const { return deadline + kGrace; }
};

class PendingRequests {
 public:
  /// Requests of one client that may wait for lines and servers; more are answered "busy".
  static constexpr std::size_t kMost = 32;

  /// No number comes twice.
  std::uint64_t NextNumber() { return next_number_++; }
  void Add(PendingRequest request) { requests_.push_back(std::move(request)); }
  /// Empty: it was answered before.
  std::optional<PendingRequest> Take(std::uint64_t number);
  std::vector<PendingRequest> TakeAll() { return std::exchange(requests_, {}); }
  void AbandonAll();

  std::size_t size() const { return requests_.size(); }
  /// When the first is to be answered by the server; empty: none waits.
  std::optional<Instant> Deadline() const;
  /// The numbers of those whose limit has passed.
  std::vector<std::uint64_t> Overdue(Instant now) const;

 private:
  std::vector<PendingRequest> requests_;  ///< in the order in which they came
  std::uint64_t next_number_ = 0;
};

}  // namespace baudgate::modbus
