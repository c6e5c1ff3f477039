// `Assembler` buffers the bytes of a line and cuts frames out of them with a frame rule, however
// the bytes are split. gateway/bus/exchange/line.h and twins feed it and take the frames.
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

/// Counts of the bytes that went through an Assembler. At any time in == delivered + discarded +
/// held().
struct AssemblerCounters {
  std::uint64_t in = 0;
  std::uint64_t delivered = 0;
  std::uint64_t discarded = 0;
};

class Assembler {
 public:
  /// Drops the buffered bytes (they count as discarded) and restarts with this rule and
  /// expectation.
  void Begin(FrameRule rule, Expectation expect);

  /// Appends `bytes`. The buffer stays below expect.max_bytes + bytes.size(): excess bytes are
  /// discarded as corrupt from the front, one at a time, so a frame behind them can still be found.
  void Feed(View bytes);

  /// Returns the next whole frame, or nothing if the buffer contains none. `idle`: the line is
  /// silent, so the rule must decide now; an incomplete frame is discarded as partial. All
  /// discarded bytes are appended to `discarded`, unless it is null.
  std::optional<Bytes> Next(bool idle, Bytes* discarded = nullptr);

  std::size_t held() const { return held_.size() - head_; }
  std::size_t fed() const { return fed_; }

  /// Returns the most serious outcome of the bytes that were discarded since Begin or TakeBlame:
  /// corrupt before unexpected before partial before none. why() is its reason.
  Outcome blame() const { return blame_; }
  std::string_view why() const { return why_; }
  /// Returns blame(), then sets blame() to none and clears why().
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
