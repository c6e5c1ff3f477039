// The contract of twins. A twin is a simulated device: it answers request frames as the real device
// would. `baudgate simulate` and `demo` give it a pty, a bit rate, delays and faults
// (gateway/tools/simulate/simulator.h); tests call it directly.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string_view>

#include "gateway/base/bytes.h"
#include "gateway/base/time.h"
#include "gateway/base/value.h"
#include "protocols/conversation.h"

namespace baudgate::protocols {

/// What a simulated device measures: one value for each point of its profile. The values are raw,
/// as on the wire: if a point has scale 0.1 and shows 23.5, its raw value is 235.
class TwinValues {
 public:
  virtual ~TwinValues() = default;
  /// `point`: index into the device's points. Changes with time where the profile says
  /// `simulate: 10..20`.
  virtual Value Get(std::size_t point, Instant now) const = 0;
  /// Stays until the next Set: from now on Get gives `value`.
  virtual void Set(std::size_t point, const Value& value) = 0;
};

class Twin {
 public:
  virtual ~Twin() = default;
  /// The whole reply frame to `request`, one whole frame that the protocol's request_rule has cut.
  /// Empty: the device is silent, as real ones are when the request names another device or has a
  /// wrong checksum.
  virtual Bytes Answer(View request, Instant now) = 0;
  /// From now on replies carry `address`, a valid one, in place of the device's own; requests to
  /// its own address are answered as before. Address 7, ReplyAs("9"): "?7A1" is answered by "!9…".
  /// If replies of the protocol carry no address, nothing changes. For the fault wrong_address.
  virtual void ReplyAs(std::string_view address) = 0;
  /// Sets its own clock, which runs on. A twin whose clock was never set has none.
  virtual void SetClock(Now /*now*/) {}
  /// The event happens now; `event.time` is ignored, because the twin's own clock gives it. False:
  /// this twin has no events.
  virtual bool Raise(const DeviceEvent& /*event*/, Now /*now*/) { return false; }
  /// The next message that it sends unasked; empty: there is none now.
  virtual Bytes Say(Instant /*now*/) { return {}; }
};

}  // namespace baudgate::protocols
