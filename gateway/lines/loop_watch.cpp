// SPDX-License-Identifier: Apache-2.0
#include "gateway/lines/loop_watch.h"

#include <utility>

namespace baudgate {

void LoopWatch::Add(std::string name, std::optional<std::uint32_t> line, Ask ask) {
  loops_.push_back(
      {std::move(name), line, std::move(ask), std::make_shared<std::atomic<bool>>(true)});
}

void LoopWatch::Remove(std::uint32_t line) {
  std::erase_if(loops_, [line](const Loop& loop) { return loop.line == line; });
}

std::vector<LoopWatch::Change> LoopWatch::Look(WallTime now) {
  std::vector<Change> changes;
  complete_ = true;
  for (Loop& loop : loops_) {
    if (loop.answered->exchange(false)) {
      if (loop.missed >= kStuckAfter) changes.push_back({loop.name, loop.line, {}});
      loop.missed = 0;
      loop.asked = now;
      loop.ask([answered = loop.answered] { answered->store(true); });
      continue;
    }
    if (++loop.missed == kStuckAfter) changes.push_back({loop.name, loop.line, loop.asked});
    if (!loop.line) complete_ = false;
  }
  return changes;
}

}  // namespace baudgate
