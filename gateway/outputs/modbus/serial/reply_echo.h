// Knows the gateway's own replies in what a two-wire adapter hears, on the side of the slave: the
// reply to a write of one register equals its request, and carrying it out would never end.
// Sans-I/O; used by master_session.cpp.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "config/model/listener.h"
#include "gateway/base/bytes.h"
#include "gateway/base/time.h"
#include "gateway/bus/exchange/echo_filter.h"

namespace baudgate::modbus {

/// strip: bytes that repeat the last reply are taken out where they come first, whenever that is.
/// off: bytes pass. Both: the first whole frame after a reply is its echo when it equals the reply
/// and has ended in time. So an echo behind noise is found as well.
class ReplyEcho {
 public:
  /// An adapter, its driver and a busy machine give back what was sent within this time and the
  /// time that it takes on the line.
  static constexpr Duration kLatest = 50ms;

  explicit ReplyEcho(config::Listener::Echo mode)
      : strips_(mode == config::Listener::Echo::strip) {}

  /// Before the reply goes out. `until`: when the last byte of its echo has come at the latest.
  void OnSent(View reply, Instant until);
  /// What is left of bytes that have come, in order.
  Bytes Filter(View received);
  /// Bytes have arrived that look like the start of an echo.
  bool holding() const { return strips_ && filter_.holding(); }
  /// The bus has fallen silent: gives back what was held.
  Bytes OnSilence() { return filter_.OnExchangeEnd().bytes; }
  /// Whether a whole frame among what is left is the echo. `ended`: when its last byte came.
  bool IsEcho(View frame, Instant ended);

 private:
  bool strips_;
  EchoFilter filter_{config::Echo::strip};
  Bytes owed_;  ///< the last reply; empty once a frame or its whole echo has come
  Instant until_;
};

}  // namespace baudgate::modbus
