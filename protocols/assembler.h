// Cuts frames out of the bytes that come from a line, however they are split: the one buffering
// loop around all frame rules. Bytes come from gateway/bus/exchange/line.h (or a twin), frames go
// back to it.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <string_view>
#include <utility>

#include "gateway/base/bytes.h"
#include "gateway/base/outcome.h"
#include "protocols/frame_rule.h"

namespace baudgate::protocols {

/// in == delivered + discarded + held(), always.
struct AssemblerCounters {
  std::uint64_t in = 0;
  std::uint64_t delivered = 0;
  std::uint64_t discarded = 0;
};

class Assembler {
 public:
  /// Drops what is held (counted as discarded) and starts afresh with this rule and expectation.
  void Begin(FrameRule rule, Expectation expect);

  /// Memory stays below expect.max_bytes + bytes.size(): what overflows is discarded as corrupt
  /// from the front, one byte at a time, so a frame after it can still be found.
  void Feed(View bytes);

  /// The next whole frame, if there is one. `idle`: the line is silent, so the rule may now decide
  /// what it left open; bytes for which it still needs more are discarded as partial. `discarded`:
  /// discarded bytes are appended to it; null: they are not wanted.
  std::optional<Bytes> Next(bool idle, Bytes* discarded = nullptr);

  std::size_t held() const { return held_.size() - head_; }
  /// Bytes that were fed since Begin.
  std::size_t fed() const { return fed_; }

  /// The worst that was discarded since Begin, and its reason: corrupt over unexpected over partial
  /// over none.
  Outcome blame() const { return blame_; }
  std::string_view why() const { return why_; }
  /// The same, and forgets it.
  Outcome TakeBlame() {
    why_ = {};
    return std::exchange(blame_, Outcome::none);
  }

  const AssemblerCounters& counters() const { return counters_; }

 private:
  void Discard(std::size_t count, Outcome blame, std::string_view why);
  void Consume(std::size_t count);
  View Held() const { return View(held_).subspan(head_); }

  FrameRule rule_ = nullptr;
  Expectation expect_;
  Bytes held_;
  std::size_t head_ = 0;
  std::size_t fed_ = 0;
  Outcome blame_ = Outcome::none;
  std::string_view why_;
  AssemblerCounters counters_;
};

}  // namespace baudgate::protocols
