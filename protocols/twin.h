// The contract of twins: device simulators that answer requests as the real device does.
// gateway/simulate/simulator.h gives a twin its pty, its bit rate, its think time and its faults.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "gateway/base/bytes.h"
#include "gateway/base/time.h"
#include "gateway/base/value.h"

namespace baudgate {

/// The world that a twin measures: raw values of its points, by index into the device's points.
class TwinValues {
 public:
  virtual ~TwinValues() = default;
  virtual Value Get(std::size_t point, Instant now) const = 0;
  /// A written value replaces the simulated one.
  virtual void Set(std::size_t point, const Value& value) = 0;
};

class Twin {
 public:
  virtual ~Twin() = default;
  /// The whole reply to one whole request frame; empty = the device stays silent.
  virtual Bytes Answer(View request, Instant now) = 0;
};

}  // namespace baudgate
