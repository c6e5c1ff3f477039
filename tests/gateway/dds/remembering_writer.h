// A place for samples that only remembers them, for tests of the sender and the publisher.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <string>
#include <vector>

#include "gateway/dds/sample_writer.h"

namespace baudgate::dds::testing {

class RememberingWriter : public SampleWriter {
 public:
  bool Write(const PointSample& sample) override { return Keep(points, sample); }
  bool Write(const DeviceSample& sample) override { return Keep(devices, sample); }
  bool Dispose(const PointSample& sample) override {
    return Keep(disposed, sample.device + "." + sample.point);
  }
  bool Dispose(const DeviceSample& sample) override { return Keep(disposed, sample.device); }
  bool WaitAcknowledged(Duration) override { return true; }
  std::uint32_t subscribers() const override { return 0; }

  /// The latest sample of a point; null when there is none.
  const PointSample* Latest(const std::string& point) const {
    const auto at = std::find_if(points.rbegin(), points.rend(),
                                 [&](const PointSample& s) { return s.point == point; });
    return at == points.rend() ? nullptr : &*at;
  }

  std::vector<PointSample> points;
  std::vector<DeviceSample> devices;
  std::vector<std::string> disposed;
  bool refuse = false;

 private:
  template <typename T>
  bool Keep(std::vector<T>& list, const T& entry) {
    if (!refuse) list.push_back(entry);
    return !refuse;
  }
};

}  // namespace baudgate::dds::testing
