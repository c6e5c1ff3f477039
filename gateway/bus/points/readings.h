// The way of a reading to the point store: ToSample converts a reading to the value that users see,
// SamplesOf converts the readings of a whole reply, and `JumpCheck` decides which of them count at
// once. ToRaw converts in the other direction, for writes.
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

/// A reading after conversion, ready to store. Without a value the last value stays.
struct Sample {
  std::uint32_t point = 0;
  Value value;
  Quality quality = Quality::good;
};

// Conversion between values of the device and values for users: sentinels, scale and offset, the
// range of the type, and `min` and `max` of read-only points. A value that does not fit gets a bad
// quality, and never becomes another number.

/// `reading.point` must be a valid index.
Sample ToSample(const config::Point& point, const protocols::Reading& reading);

/// Converts a value as users write it to the raw value that the protocol sends.
Result<Value> ToRaw(const config::Point& point, const Value& value);

/// Readings of points that the device does not have are left out.
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

// `JumpCheck` decides which readings of a device count at once, and which count only if a second
// reading agrees: a checksum of 8 bits, or none, does not detect all damage. Per point, with jump
// 2:
//
//   last   readings         what users see
//   20.0   20.5             20.5
//   20.5   84.5, 20.6       20.5 uncertain, then 20.6: 84.5 was damaged
//   20.6   84.5, 84.4       20.6 uncertain, then 84.4
//   84.4   12.0, 55.0, 71   84.4 uncertain twice, then 71.0 uncertain: there is no better value
//
// Default of `jump`: a tenth of max - min if these are given; else the larger of a tenth of the
// last value and 1 % of the largest value seen. Each change of a bit or a text is a jump, and so is
// a first reading.
class JumpCheck {
 public:
  /// After this many readings in a row that disagree, the last reading counts.
  static constexpr int kMostReadings = 3;

  /// `points` must stay valid for the lifetime of this object.
  explicit JumpCheck(std::span<const config::Point> points) : points_(points) {}

  struct Result {
    /// Points whose last values are uncertain until they are read again.
    std::vector<std::size_t> doubtful;
    bool ask_again = false;               ///< the points have to be read again now
    bool unconfirmed = false;             ///< a value that jumped was back at its last value
    std::optional<config::Group> spoils;  ///< a seldom group with a point that stays uncertain
  };
  /// Removes from the samples of one reply those that do not count yet. Samples that are not good
  /// always count.
  Result Check(std::vector<Sample>& samples);
  /// The device has confirmed a write: a reading that agrees with `value` counts at once.
  void OnWritten(std::size_t point, Value value);

 private:
  struct History {
    Value last;       // the last value that counted
    Value candidate;  // read since, but not confirmed
    Decimal largest;
    int readings = 0;      // number of readings in a row that disagreed
    bool changes = false;  // the reply before was marked as changing
  };
  enum class Judgement { counts, wait, doubt, last_resort };

  Judgement Judge(const config::Point& point, History& history, const Value& value) const;
  static bool Agree(const config::Point& point, const History& history, const Value& a,
                    const Value& b);

  std::span<const config::Point> points_;
  std::vector<History> histories_;  // same indices as points_; empty until needed
};

}  // namespace baudgate::bus
