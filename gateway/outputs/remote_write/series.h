// `WriteRequest` encodes values as a request of Prometheus remote write 1.0, a message of Protocol
// Buffers that snappy compresses. Source: https://prometheus.io/docs/concepts/remote_write_spec/
//
//   WriteRequest: 1 TimeSeries …      TimeSeries: 1 Label …, 2 Sample …
//   Label: 1 name, 2 value            Sample: 1 value (double), 2 time (ms since 1970)
//
// The series of a point is that of /metrics (docs/metrics.md), with the name of the gateway and the
// configured labels. A message has four kinds of fields, so the encoder here is shorter than the
// use of a library, and needs none.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <map>
#include <span>
#include <string>
#include <vector>

#include "config/model/config.h"
#include "gateway/outputs/outlet/outlet.h"

namespace baudgate::remote_write {

/// The value of a sample that ends a series: NaN with these bits (staleness marker).
inline constexpr std::uint64_t kStale = 0x7FF0'0000'0000'0002;

/// Encodes the series of the points of one configuration.
class SeriesNames {
 public:
  explicit SeriesNames(const config::Config& config);

  /// False for a point with texts, which has no series.
  bool Has(const std::string& point) const { return !texts_.contains(point); }
  /// Returns the encoded labels of the point's series, sorted by name. A point that is no longer
  /// configured has no unit.
  std::string LabelsOf(const std::string& point) const;

 private:
  const std::string gateway_;
  const std::vector<config::RemoteWrite::Label> labels_;
  std::map<std::string, std::string, std::less<>> units_;  // by point
  std::map<std::string, bool, std::less<>> texts_;
};

struct WriteRequest {
  std::string body{};  ///< compressed; empty: the values have no series
  std::size_t samples = 0;
};

/// A good number or boolean becomes a sample with its own time, every other value a staleness
/// marker, because /metrics has no value then either. Texts are left out.
WriteRequest Encode(const SeriesNames& names, std::span<const outlet::KeptValue> values);

}  // namespace baudgate::remote_write
