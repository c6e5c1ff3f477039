// From the point store into the samples of points and devices: all fields but the gateway's name.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include "gateway/bus/points/point_store.h"
#include "gateway/outputs/dds/publish_plan.h"
#include "gateway/outputs/dds/samples.h"

namespace baudgate::dds {

/// `state`: of the point's value, at its quality now.
void FillPoint(const DeviceRecord& record, std::uint32_t point, const PointState& state,
               PointSample& sample);
void FillDevice(const DeviceRecord& record, DeviceSample& sample);

}  // namespace baudgate::dds
