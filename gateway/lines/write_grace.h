// Delays giving up the port of a line until the write under way has ended, so that no password
// stays open in a device; a second at most. A part of gateway/lines/line_port.h.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <optional>
#include <utility>

#include "gateway/base/time.h"

namespace baudgate {

class WriteGrace {
 public:
  static constexpr Duration kMost = 1s;

  /// `then` is called at the end; it replaces an earlier one.
  void Begin(std::function<void()> then, Instant now) {
    then_ = std::move(then);
    until_ = now + kMost;
  }
  bool waits() const { return until_.has_value(); }
  /// It waits, and its time is over.
  bool IsOver(Instant now) const { return until_ && *until_ <= now; }
  /// Only if it waits: calls what waits, now.
  void End() {
    until_.reset();
    std::exchange(then_, nullptr)();
  }
  /// Drops the call that waits.
  void CallOff() {
    until_.reset();
    then_ = nullptr;
  }
  const std::optional<Instant>& until() const { return until_; }

 private:
  std::function<void()> then_;
  std::optional<Instant> until_;
};

}  // namespace baudgate
