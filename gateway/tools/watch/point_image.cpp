// SPDX-License-Identifier: Apache-2.0
#include "gateway/tools/watch/point_image.h"

#include <utility>

namespace baudgate {
namespace {

News Compare(const PointEvent& before, const PointEvent& now) {
  if (IsSameReading(before, now)) return News::nothing;
  return LooksAlike(before, now) ? News::reading : News::value;
}

}  // namespace

News PointImage::Put(const PointEvent& event) {
  const dds::PointSample& sample = event.sample;
  const auto [at, is_first] =
      image_.try_emplace({sample.gateway, sample.device, sample.point}, event);
  if (is_first) return News::point;
  const News news = Compare(at->second, event);
  at->second = event;
  return news;
}

std::vector<const PointEvent*> PointImage::Ordered() const {
  std::vector<const PointEvent*> ordered;
  for (auto first = image_.begin(); first != image_.end();) {
    const auto& [gateway, device, point] = first->first;
    std::vector<std::string> points;
    auto last = first;
    while (last != image_.end() && std::get<0>(last->first) == gateway &&
           std::get<1>(last->first) == device) {
      points.push_back(std::get<2>((last++)->first));
    }
    order_.Sort(points);
    for (const std::string& name : points) ordered.push_back(&image_.at({gateway, device, name}));
    first = last;
  }
  return ordered;
}

std::vector<PointRow> PointImage::Rows(WallTime now) const {
  const bool several =
      !image_.empty() && std::get<0>(image_.begin()->first) != std::get<0>(image_.rbegin()->first);
  std::vector<PointRow> rows;
  rows.reserve(image_.size());
  for (const PointEvent* event : Ordered()) {
    const dds::PointSample& sample = event->sample;
    PointRow row;
    row.device = several ? sample.gateway + "/" + sample.device : sample.device;
    row.point = sample.point;
    row.value = ValueText(sample);
    row.unit = sample.unit;
    row.quality = QualityOf(sample);
    if (sample.source_time_ns > 0) row.age = now - SourceTime(sample);
    row.gone = event->gone.has_value();
    rows.push_back(std::move(row));
  }
  return rows;
}

}  // namespace baudgate
