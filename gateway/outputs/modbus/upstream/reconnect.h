// When the next request may make a connection to a server elsewhere, and why there is none. Time is
// an argument; for upstream.cpp.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstdint>
#include <string>
#include <utility>

#include "gateway/base/time.h"
#include "transports/reopen_ladder.h"

namespace baudgate::modbus {

class Reconnect {
 public:
  /// A server that returns is not kept waiting longer: only a request makes us look for it.
  static constexpr Duration kLongestPause = std::chrono::seconds(5);

  explicit Reconnect(std::uint32_t seed) : ladder_(seed) {}

  void OnConnected() {
    trouble_.clear();
    ladder_.Reset();
  }
  /// The next request makes a new connection: at once when the server has `accepted` this one, else
  /// after a pause. True: `why` is news.
  bool OnBroken(bool accepted, const std::string& why, Instant now) {
    may_at_ = accepted ? Instant::min() : now + std::min(ladder_.Next(), kLongestPause);
    return std::exchange(trouble_, why) != why;
  }

  bool MayConnect(Instant now) const { return now >= may_at_; }
  /// Why there was no connection last time; empty: there was one.
  const std::string& trouble() const { return trouble_; }

 private:
  ReopenLadder ladder_;
  Instant may_at_ = Instant::min();
  std::string trouble_;
};

}  // namespace baudgate::modbus
