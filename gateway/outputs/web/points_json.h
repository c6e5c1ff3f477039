// The points of the store as JSON: what they are, and how they stand. MapJson tells where the
// points stand on Modbus.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "config/model/device.h"
#include "gateway/bus/points/point_store.h"

namespace baudgate::web {

/// A number for each point of the store, as long as the gateway runs: what a reload begins gets new
/// ones behind the others.
class PointNumbers {
 public:
  explicit PointNumbers(const bus::PointStore& store);
  std::uint32_t Of(std::uint32_t device, std::uint32_t point) const {
    return first_.at(device) + point;
  }

 private:
  std::vector<std::uint32_t> first_;
};

struct PointFilter {
  std::string line{};
  std::optional<std::uint32_t> device{};
  std::string text{};  ///< a part of LINE.DEVICE.POINT or of the description, in any case
};

/// {"time":…,"points":[{"id":0,"line":…,"device":…,"point":…,…}]}
nlohmann::ordered_json PointsJson(const bus::PointStore& store, const PointFilter& filter, Now now);

/// Adds "[id,value,quality,"text",read_at_ms],": a point as streams have it.
void AppendRow(const bus::DeviceRecord& record, std::size_t point, std::uint32_t id, Instant now,
               std::string& out);

/// The text in quotation marks.
std::string JsonText(std::string_view text);

// Where the points of a device stand on Modbus.

/// {"unit":1,"registers":[{"point":"current_l1","table":"holding","address":0,"count":2,…}]}. The
/// unit is null where the device is not on Modbus.
nlohmann::ordered_json MapJson(const config::Device& device);

}  // namespace baudgate::web
