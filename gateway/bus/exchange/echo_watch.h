// Which bytes from a bus are the echo of our own request, and whether the echo is as configured.
// Called by gateway/bus/poller/reception.h before the bytes go to gateway/bus/exchange/line.h.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "config/model/line.h"
#include "gateway/base/bytes.h"
#include "gateway/bus/exchange/echo_filter.h"
#include "gateway/bus/exchange/line.h"
#include "protocols/conversation.h"

namespace baudgate {

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
