// The contract of twins. A twin is a simulated device: it answers request frames as the real device
// would. `baudgate simulate` and `demo` give it a pty, a bit rate, delays and faults
// (gateway/simulate/simulator.h); tests call it directly.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "gateway/base/bytes.h"
#include "gateway/base/time.h"
#include "gateway/base/value.h"

namespace baudgate {

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
};

}  // namespace baudgate
