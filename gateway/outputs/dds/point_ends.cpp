// SPDX-License-Identifier: Apache-2.0
#include "gateway/outputs/dds/point_ends.h"

#include <functional>
#include <string_view>
#include <unordered_set>

#include "gateway/outputs/dds/fill_samples.h"

namespace baudgate::dds {

std::vector<std::uint32_t> PointEnds::TakeBack(const PointSlots& slots) {
  std::vector<std::uint32_t> back;
  const auto by_name = SlotsByName(store_, slots);
  std::erase_if(gone_, [&](const PointRef& ref) {
    const auto found = by_name.find(NameOf(store_, ref));
    if (found != by_name.end()) back.push_back(found->second);
    return found != by_name.end();
  });
  return back;
}

const PointSample* PointEnds::Next() {
  if (gone_.empty()) return nullptr;
  const PointRef ref = gone_.front();
  sample_ = {};
  sample_.gateway = config_.name;
  const auto look = [&](const DeviceRecord& record) {
    const Value& value = record.points[ref.point].value;
    FillPoint(record, ref.point, PointState::Of(value, Quality::bad_not_connected), sample_);
  };
  store_.Read(ref.device, std::cref(look));
  return &sample_;
}

void DeviceEnds::TakeBack() {
  std::unordered_set<std::string_view> there;
  for (std::uint32_t device = 0; device < store_.device_count(); ++device) {
    if (!store_.gone(device)) there.insert(store_.device(device).name);
  }
  std::erase_if(gone_,
                [&](std::uint32_t device) { return there.contains(store_.device(device).name); });
}

const DeviceSample* DeviceEnds::Next() {
  if (gone_.empty()) return nullptr;
  sample_ = {};
  sample_.gateway = config_.name;
  const auto look = [this](const DeviceRecord& record) { FillDevice(record, sample_); };
  store_.Read(gone_.front(), std::cref(look));
  sample_.state = static_cast<std::uint16_t>(DeviceState::disabled);
  return &sample_;
}

}  // namespace baudgate::dds
