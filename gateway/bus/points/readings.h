// Conversion of readings: ToSample converts a reading of the protocol to the value that users see,
// SamplesOf converts all readings of a reply, and ToRaw converts a value of users to the value that
// is written. `JumpCheck` decides which readings need a second reading before they are stored.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "config/model/device.h"
#include "config/model/point.h"
#include "gateway/base/decimal.h"
#include "gateway/base/result.h"
#include "gateway/base/value.h"
#include "protocols/conversation.h"

namespace baudgate::bus {

/// A converted reading, ready for the point store. If it has no value, the stored value stays.
struct Sample {
  std::uint32_t point = 0;
  Value value;
  Quality quality = Quality::good;
};

// Conversion between values of the device and values for users. It applies sentinels, scale and
// offset, the range of the type, and for read-only points `min` and `max`. A value that does not
// fit gets a bad quality, and is never replaced by another number.

/// `reading.point` must be the index of `point` in its device.
Sample ToSample(const config::Point& point, const protocols::Reading& reading);

/// Converts a value of users to the raw value that the protocol sends. The error says why the value
/// does not fit.
Result<Value> ToRaw(const config::Point& point, const Value& value);

/// Converts the readings of a reply. Readings of points that the device does not have are left out.
inline std::vector<Sample> SamplesOf(const config::Device& device,
                                     std::span<const protocols::Reading> readings) {
  std::vector<Sample> samples;
  samples.reserve(readings.size());
  for (const protocols::Reading& reading : readings) {
    if (reading.point >= device.points.size()) continue;
    samples.push_back(ToSample(device.points[reading.point], reading));
  }
  return samples;
}

inline std::vector<std::uint32_t> PointsOf(std::span<const Sample> samples) {
  std::vector<std::uint32_t> points;
  points.reserve(samples.size());
  for (const Sample& sample : samples) points.push_back(sample.point);
  return points;
}

// `JumpCheck` detects damaged readings, because a checksum of 8 bits, or none, does not detect all
// damage. A reading that jumps away from the last value is accepted only if a second reading agrees
// with it. Example with jump: 2 for one point:
//
//   last   readings         what users see
//   20.0   20.5             20.5
//   20.5   84.5, 20.6       20.5 uncertain, then 20.6: 84.5 was damaged
//   20.6   84.5, 84.4       20.6 uncertain, then 84.4
//   84.4   12.0, 55.0, 71   84.4 uncertain twice, then 71.0 uncertain: there is no better value
//
// Default of `jump`: a tenth of max - min if both are given; else the larger of a tenth of the last
// value and 1 % of the largest value seen. Each change of a bit or a text is a jump; a first
// reading is always checked.
class JumpCheck {
 public:
  /// After this many readings in a row that disagree, the last reading is stored as uncertain.
  static constexpr int kMostReadings = 3;

  /// `points` must stay valid for the lifetime of this object.
  explicit JumpCheck(std::span<const config::Point> points) : points_(points) {}

  struct Result {
    /// Points whose stored values are uncertain until they are read again.
    std::vector<std::size_t> doubtful;
    bool ask_again = false;
    bool unconfirmed = false;  ///< a value jumped, and the second reading was the last value again
    /// Set if a point of the group `once` or `daily` stays uncertain: the group to read again.
    std::optional<config::Group> spoils;
  };
  /// Removes the samples that a second reading must confirm first. Samples whose quality is not
  /// good are never removed.
  Result Check(std::vector<Sample>& samples);
  /// Call when the device has confirmed a write, so that a reading that agrees with `value` needs
  /// no second reading.
  void OnWritten(std::size_t point, Value value);

 private:
  struct History {
    Value last;
    Value candidate;  // a reading that is not confirmed yet
    Decimal largest;
    int readings = 0;      // number of readings in a row that were not accepted
    bool changes = false;  // the previous reply had a reading marked as uncertain
  };
  enum class Judgement { counts, wait, doubt, last_resort };

  Judgement Judge(const config::Point& point, History& history, const Value& value) const;
  static bool Agree(const config::Point& point, const History& history, const Value& a,
                    const Value& b);

  std::span<const config::Point> points_;
  std::vector<History> histories_;  // empty until the first check
};

}  // namespace baudgate::bus
