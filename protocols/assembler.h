// `Assembler` collects the bytes of a line, which come in pieces of any size, and cuts frames out
// of them with a frame rule. gateway/bus/exchange/line.h and simulated devices pass the bytes to it
// and get the frames.
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
  /// Drops the buffered bytes, which count as discarded, and starts again with this rule and
  /// expectation.
  void Begin(FrameRule rule, Expectation expect);

  /// Appends `bytes`. Call Next afterwards until it returns nothing: at most expect.max_bytes then
  /// remain in the buffer. Next discards older bytes as corrupt, one at a time, so that a frame
  /// behind them is still found.
  void Feed(View bytes);

  /// Returns the next whole frame, or nothing if the buffer contains none. `idle`: the line is
  /// silent, so no more bytes of an incomplete frame will come, and it is discarded as partial.
  /// Discarded bytes are appended to `discarded`, unless it is null.
  std::optional<Bytes> Next(bool idle, Bytes* discarded = nullptr);

  std::size_t held() const { return held_.size() - head_; }
  std::size_t fed() const { return fed_; }

  /// Returns the most serious outcome of the bytes that were discarded since Begin or TakeBlame:
  /// corrupt, else unexpected, else partial, else none. why() is the reason for that outcome, such
  /// as "checksum".
  Outcome blame() const { return blame_; }
  std::string_view why() const { return why_; }
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
