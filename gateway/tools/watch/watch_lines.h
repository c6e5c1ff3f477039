// What `watch` prints of a point, as plain text or as JSON: samples in, one line out.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>

#include "gateway/base/quality.h"
#include "gateway/base/time.h"
#include "gateway/outputs/dds/fast/subscriber.h"

namespace baudgate {

/// A sample, or the end of a point: then only its key is meant.
struct PointEvent {
  dds::PointSample sample;
  dds::Origin origin;
  std::optional<dds::Gone> gone;
};

WallTime SourceTime(const dds::PointSample& sample);
Quality QualityOf(const dds::PointSample& sample);
std::string ValueText(const dds::PointSample& sample);

/// Sent once more, by the heartbeat: no reading stands between them.
bool IsSameReading(const PointEvent& before, const PointEvent& now);
/// The same value and quality, read once more.
bool LooksAlike(const PointEvent& before, const PointEvent& now);

std::string JsonLine(const PointEvent& event);
std::string PlainLine(const PointEvent& event);

}  // namespace baudgate
