// A client sends no more: it leaves when the port has sent what it got from the client, or after
// half a minute. Time is an argument.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>

#include "gateway/base/time.h"

namespace baudgate::serial_server {

class PortDrain {
 public:
  static constexpr Duration kLookEvery = 10ms;
  static constexpr Duration kLongest = 30s;

  void Begin(Instant now) { since_ = look_at_ = now; }
  bool has_begun() const { return since_.has_value(); }
  /// When to look at the port next; empty: the client still sends.
  std::optional<Instant> Deadline() const { return look_at_; }

  /// At the deadline. `is_drained`: the port has sent everything. Returns why the client leaves;
  /// empty: not yet.
  std::optional<std::string> Look(bool is_drained, Instant now) {
    look_at_ = now + kLookEvery;
    if (now - *since_ >= kLongest) {
      return "it has left, and the port did not take all that it had sent";
    }
    if (is_drained) return "it has left";
    return std::nullopt;
  }

 private:
  std::optional<Instant> since_;
  std::optional<Instant> look_at_;
};

}  // namespace baudgate::serial_server
