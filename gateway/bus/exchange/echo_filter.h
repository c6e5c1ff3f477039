// Takes our own request out of what comes back on a two-wire bus whose adapter echoes. Sans-I/O: it
// gets what is sent and what the transport delivers, and passes on what the device has sent.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "config/model/line.h"
#include "gateway/base/bytes.h"

namespace baudgate {

struct EchoResult {
  Bytes bytes;             ///< what is not echo, in order
  bool complete = false;   ///< the last byte of the echo came in just now
  bool collision = false;  ///< verify only: the echo differs from what was sent, or is missing
};

/// strip: bytes are held back while they repeat the request and dropped once it is whole; at the
/// first difference they are released untouched, so a bus that does not echo works. verify: the
/// same, and the difference is reported. off: every byte passes at once, and `complete` tells
/// whether the request came back.
class EchoFilter {
 public:
  explicit EchoFilter(config::Echo mode) : mode_(mode) {}

  /// Before the bytes go to the transport: an echo may be back before Send returns.
  void OnSent(View request);
  EchoResult Filter(View received);
  /// The exchange is over and the next bytes belong to another one. Gives back what was still held
  /// as the start of an echo; in verify mode an echo that never became whole is a collision.
  EchoResult OnExchangeEnd();

  /// Bytes have arrived that look like the start of the echo.
  bool holding() const { return matched_ > 0 && matched_ < expected_.size(); }

 private:
  bool passes() const { return mode_ == config::Echo::off; }

  config::Echo mode_;
  Bytes expected_;           ///< sent in this exchange
  std::size_t matched_ = 0;  ///< of expected_, seen so far
  bool differs_ = false;     ///< this exchange has no echo, or a wrong one
};

}  // namespace baudgate
