// What a device says of its points, on the way to the point store: ToSample converts a reading to
// what users see, SamplesOf those of a whole reply, and JumpCheck decides which of them count at
// once. ToRaw is the way back, for writes.
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

/// A reading after conversion, ready to store. No value: the
/// last one is kept.
struct Sample {
  std::uint32_t point = 0;
  Value value;
  Quality quality = Quality::good;
};

// Between what a device says and what users see: sentinels, scale and offset, the range of the
// point's type, and `min` and `max` of what can only be read. A value that does not fit becomes bad
// quality, never another number.

/// `reading.point` is a valid index.
Sample ToSample(const config::Point& point, const protocols::Reading& reading);

/// A value as users write it, turned into the raw value that the protocol sends.
Result<Value> ToRaw(const config::Point& point, const Value& value);

/// Only of its points: other readings are left out.
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

// Which readings of one device count at once, and which only when a second one agrees: an 8-bit
// checksum, or none, lets some damage through. Per point, with jump 2:
//
//   last   readings         what users see
//   20.0   20.5             20.5
//   20.5   84.5, 20.6       20.5 uncertain, then 20.6: 84.5 was damage
//   20.6   84.5, 84.4       20.6 uncertain, then 84.4
//   84.4   12.0, 55.0, 71   84.4 uncertain twice, then 71.0 uncertain: there is no better one
//
// Without `jump` at the point it is a tenth of max - min if these are given, else the larger of
// a tenth of the last value and 1 % of the largest one seen. Bits and texts jump with every change.
// A first reading always jumps.
class JumpCheck {
 public:
  /// After this many readings in a row that disagree the last one counts.
  static constexpr int kMostReadings = 3;

  /// `points` outlive it.
  explicit JumpCheck(std::span<const config::Point> points) : points_(points) {}

  struct Result {
    std::vector<std::size_t> doubtful;    ///< their last values are uncertain until they are read
    bool ask_again = false;               ///< now
    bool unconfirmed = false;             ///< what jumped before was back at its last value
    std::optional<config::Group> spoils;  ///< a seldom group of which a point stays uncertain
  };
  /// Removes from the samples of one reply those that do not count yet. Samples that are not good
  /// always count.
  Result Check(std::vector<Sample>& samples);
  /// The device has confirmed a write: a reading that agrees counts.
  void OnWritten(std::size_t point, Value value);

 private:
  struct History {
    Value last;       // that counted
    Value candidate;  // read since, and not confirmed
    Decimal largest;
    int readings = 0;      // in a row that disagreed
    bool changes = false;  // the reply before was of something that changes
  };
  enum class Judgement { counts, wait, doubt, last_resort };

  Judgement Judge(const config::Point& point, History& history, const Value& value) const;
  static bool Agree(const config::Point& point, const History& history, const Value& a,
                    const Value& b);

  std::span<const config::Point> points_;
  std::vector<History> histories_;  // as points_; empty until one is needed
};

}  // namespace baudgate::bus
