// Where the publisher's samples go: the seam between the publisher and the DDS library.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include "gateway/base/time.h"
#include "gateway/dds/samples.h"

namespace baudgate::dds {

/// Used by one thread, save for subscribers().
class SampleWriter {
 public:
  virtual ~SampleWriter() = default;

  /// False when the library did not take the sample.
  virtual bool Write(const PointSample& sample) = 0;
  virtual bool Write(const DeviceSample& sample) = 0;
  /// Tells subscribers that there is no such point or device any more; only the key matters.
  virtual bool Dispose(const PointSample& sample) = 0;
  virtual bool Dispose(const DeviceSample& sample) = 0;
  /// Waits until all subscribers have everything; false after `most`.
  virtual bool WaitAcknowledged(Duration most) = 0;
  /// Readers of the points topic that are connected now.
  virtual std::uint32_t subscribers() const = 0;
};

}  // namespace baudgate::dds
