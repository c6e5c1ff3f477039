// Finds event loops that hang: each is asked once a second for a sign of life. If one of the
// gateway's own loops hangs, the gateway must be restarted; the loop of a single line concerns only
// that line. No thread, no clock and no loop of its own: gateway/daemon/daemon.cpp has them.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "gateway/base/time.h"

namespace baudgate {

/// One thread at a time; signs come from any.
class LoopWatch {
 public:
  /// A loop hangs after this many looks in a row without a sign. Looks are counted, not seconds: a
  /// machine that slept has missed none.
  static constexpr int kStuckAfter = 5;

  /// Posts `sign` to the loop.
  using Ask = std::function<void(std::function<void()> sign)>;
  struct Change {
    std::string loop;
    std::optional<std::uint32_t> line;
    std::optional<WallTime> stuck_since;  ///< empty: it runs again
  };

  /// `line`: nothing but this line depends on the loop.
  void Add(std::string name, std::optional<std::uint32_t> line, Ask ask);
  /// The loop of a line that has ended.
  void Remove(std::uint32_t line);
  /// Returns which loops hang, or run again, since the last look. Asks all that have answered.
  std::vector<Change> Look(WallTime now);
  /// Whether all loops of the gateway itself had answered at the last look.
  bool complete() const { return complete_; }

 private:
  struct Loop {
    std::string name;
    std::optional<std::uint32_t> line;
    Ask ask;
    std::shared_ptr<std::atomic<bool>> answered;  // the loop may outlive this
    WallTime asked{};
    int missed = 0;
  };

  std::vector<Loop> loops_;
  bool complete_ = true;
};

}  // namespace baudgate
