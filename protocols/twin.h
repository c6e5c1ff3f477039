// The contract of twins. A `Twin` is a simulated device: it answers request frames like the real
// device. `baudgate simulate` and `demo` give it a pty, a bit rate, delays and faults
// (gateway/tools/simulate/simulator.h); tests call it directly.
#pragma once

#include <string_view>

#include "gateway/base/bytes.h"
#include "gateway/base/time.h"
#include "gateway/base/value.h"
#include "protocols/conversation.h"

namespace baudgate::protocols {

/// The values that a simulated device measures, one for each point of its profile. Values are raw,
/// as on the wire. Example: if a point has scale 0.1 and shows 23.5, its raw value is 235.
class TwinValues {
 public:
  virtual ~TwinValues() = default;
  /// Returns the value at `now`. `point` is an index into the device's points. The value changes
  /// with time if the profile has `simulate: 10..20`.
  virtual Value Get(std::size_t point, Instant now) const = 0;
  /// Sets the value of a point, in place of its simulation, until the next Set.
  virtual void Set(std::size_t point, const Value& value) = 0;
};

class Twin {
 public:
  virtual ~Twin() = default;
  /// Returns the whole reply to `request`, a whole frame that the protocol's request_rule has cut.
  /// Empty: the device is silent, as real devices are when the request names another device or has
  /// a wrong checksum.
  virtual Bytes Answer(View request, Instant now) = 0;
  /// Sets the address in later replies to `address`, a valid address; the simulated device still
  /// answers requests to its own address. Example: the simulated device has address 7; after
  /// ReplyAs("9") it answers "?7A1" by "!9…". The call has no effect if replies of the protocol
  /// carry no address. Used for the fault wrong_address.
  virtual void ReplyAs(std::string_view address) = 0;
  /// Sets the simulated device's clock, which then runs on. Without a call the simulated device has
  /// no clock.
  virtual void SetClock(Now /*now*/) {}
  /// Makes an event happen now. `event.time` is not used: the event gets the time of the simulated
  /// device's clock. Returns false if the simulated device accepts no event.
  virtual bool Raise(const DeviceEvent& /*event*/, Now /*now*/) { return false; }
  /// Returns the next message that the simulated device sends unasked. Empty: there is no message
  /// now.
  virtual Bytes Say(Instant /*now*/) { return {}; }
};

}  // namespace baudgate::protocols
