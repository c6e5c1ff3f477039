// The contract of twins. A `Twin` is a simulated device: it answers request frames like the real
// device. `baudgate simulate` and `demo` give it a pty, a bit rate, delays and faults
// (gateway/tools/simulate/simulator.h); tests call it directly.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string_view>

#include "gateway/base/bytes.h"
#include "gateway/base/time.h"
#include "gateway/base/value.h"
#include "protocols/conversation.h"

namespace baudgate::protocols {

/// The values that a simulated device measures, one for each point of its profile. Values are raw,
/// as on the wire: if a point has scale 0.1 and shows 23.5, its raw value is 235.
class TwinValues {
 public:
  virtual ~TwinValues() = default;
  /// Returns the value at `now`. `point` is an index into the device's points. The value changes
  /// with time if the profile has `simulate: 10..20`.
  virtual Value Get(std::size_t point, Instant now) const = 0;
  /// Sets the value of a point until the next Set, instead of its simulation.
  virtual void Set(std::size_t point, const Value& value) = 0;
};

class Twin {
 public:
  virtual ~Twin() = default;
  /// Returns the whole reply to `request`, a whole frame that the protocol's request_rule has cut.
  /// Empty: the device is silent, as real devices are when the request names another device or has
  /// a wrong checksum.
  virtual Bytes Answer(View request, Instant now) = 0;
  /// Makes later replies carry `address`, a valid address, instead of the device's own; the twin
  /// still answers requests to its own address. Address 7, ReplyAs("9"): "?7A1" is answered by
  /// "!9…". No effect if replies of the protocol carry no address. Used for the fault
  /// wrong_address.
  virtual void ReplyAs(std::string_view address) = 0;
  /// Sets the twin's clock, which then runs on. Without a call the twin has no clock.
  virtual void SetClock(Now /*now*/) {}
  /// Makes an event happen now. `event.time` is ignored: the twin's clock gives the time. False:
  /// this twin has no events.
  virtual bool Raise(const DeviceEvent& /*event*/, Now /*now*/) { return false; }
  /// Returns the next message that the twin sends unasked; empty: none now.
  virtual Bytes Say(Instant /*now*/) { return {}; }
};

}  // namespace baudgate::protocols
