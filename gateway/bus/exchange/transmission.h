// The transmission of one request: when its first and its last character go out, and which bytes
// come meanwhile. A part of gateway/bus/exchange/line.h.
//
//   the port           bytes that come during the transmission
//   keeps its bit rate  no reply is possible yet: kept apart. Stray as soon as more bytes come; the
//                       reply, if nothing else comes in the reply time
//   does not            an echo, or a reply: they are left to the line
//
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <utility>

#include "gateway/base/bytes.h"
#include "gateway/base/time.h"

namespace baudgate {

class Transmission {
 public:
  /// `keeps_bit_rate`: see Line::OnOpened.
  void OnOpened(bool keeps_bit_rate) { keeps_bit_rate_ = keeps_bit_rate; }
  /// The first character goes out now; all take `length`.
  void Begin(Instant now, Duration length) {
    from_ = now;
    until_ = now + length;
    early_.clear();
  }
  /// Bytes have come before its end. False: they are left to the line.
  bool Keeps(View bytes) {
    if (!keeps_bit_rate_) return false;
    if (early_.size() < kMostKept) Append(early_, bytes);
    return true;
  }
  /// The bytes that were kept apart.
  Bytes TakeEarly() { return std::exchange(early_, {}); }
  bool has_early() const { return !early_.empty(); }
  /// They were the reply: the port forwards as fast as it can.
  void OnEarlyReply() { keeps_bit_rate_ = false; }

  bool keeps_bit_rate() const { return keeps_bit_rate_; }
  Instant from() const { return from_; }
  Instant until() const { return until_; }

  /// An early reply with noise around it. A pty delivers faster than any wire, so what is kept
  /// needs a bound of its own.
  static constexpr std::size_t kMostKept = 1024;

 private:
  bool keeps_bit_rate_ = false;
  Instant from_{};
  Instant until_{};  // computed
  Bytes early_;      // kept apart
};

}  // namespace baudgate
