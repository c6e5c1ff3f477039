// Takes our own request out of what comes back on a two-wire bus whose adapter echoes. Sans-I/O: it
// gets what is sent and what the transport delivers, and passes on what the device has sent.
// EchoWatch tells which bytes from the bus are the echo, and whether the echo is as configured.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "config/model/line.h"
#include "gateway/base/bytes.h"
#include "gateway/bus/exchange/line.h"
#include "protocols/conversation.h"

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

// Which bytes from a bus are the echo of our own request, and whether the echo is as configured.
// Called by gateway/bus/poller/line_inputs.h before the bytes go to gateway/bus/exchange/line.h.
class EchoWatch {
 public:
  struct Received {
    Bytes bytes;                    ///< what is not echo; with `off`, all that came
    bool echo = false;              ///< `off`: the request under way has come back whole
    bool collision = false;         ///< `verify`: the echo differs from what was sent
    const char* warning = nullptr;  ///< for the user, each warning once
  };

  explicit EchoWatch(config::Echo mode) : mode_(mode), filter_(mode) {}

  void OnOpened() { echoes_ = false; }
  void OnClosed() { filter_.OnExchangeEnd(); }
  /// Before the bytes go to the port: an echo may be back before sending returns.
  void OnSent(View request);
  /// `asked`: the request under way; null when there is none.
  Received OnReceived(View bytes, const Request* asked);
  /// The frame equals its request, the protocol confirms writes in that way, and this bus was seen
  /// to echo: perhaps no device has answered.
  bool MayBeEcho(const Request& request, View frame) const;
  /// The exchange of `request` is over; its reason is set if the echo explains it. True: with
  /// `verify` the echo was missing.
  bool OnExchangeEnd(const Request& request, ExchangeEnd& end);
  /// `off`: the request sent last has come back.
  bool echoed() const { return echoed_; }
  /// `verify`: the bus used to echo, and none of the latest requests came back: a fibre ring is
  /// open somewhere, and its devices are not to blame for their silence.
  bool is_cut() const { return has_echoed_ && unechoed_ >= kUnechoedOfACut; }

 private:
  static constexpr int kUnechoedOfACut = 3;

  config::Echo mode_;
  EchoFilter filter_;
  bool echoes_ = false;  // `off`, and yet requests have come back since the last reply without one
  bool echoed_ = false;  // the present request has
  bool has_echoed_ = false;  // `verify`: ever
  int unechoed_ = 0;         // requests in a row of which nothing came back
  bool told_echo_ = false;
  bool told_collision_ = false;
};

}  // namespace baudgate
