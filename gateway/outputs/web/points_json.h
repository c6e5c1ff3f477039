// `PointsJson` returns points of the store as JSON: their descriptions and current values.
// `MapJson` returns the Modbus addresses of a device's points.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "config/model/config.h"
#include "config/model/device.h"
#include "gateway/bus/points/point_store.h"

namespace baudgate::web {

/// Numbers the points of the store. A point's number does not change while the gateway runs;
/// devices that a reload adds get the next numbers.
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
  /// Selects points whose LINE.DEVICE.POINT or description contains this text, in upper or lower
  /// case.
  std::string text{};
};

/// Returns {"time":…,"points":[{"id":0,"line":…,"device":…,"point":…,…}]}. `history`: that of the
/// configuration to which the store belongs.
nlohmann::ordered_json PointsJson(const bus::PointStore& store, const PointFilter& filter,
                                  const config::History& history, Now now);

/// Appends "[id,value,quality,"text",read_at_ms,"shown"],": the row of one point in a stream.
void AppendRow(const bus::DeviceRecord& record, std::size_t point, std::uint32_t id, Instant now,
               std::string& out);

std::string JsonText(std::string_view text);

/// Returns
/// {"unit":1,"registers":[{"point":"current_l1","table":"holding","address":0,"count":2,…}]}.
/// "unit" is null if the device has no Modbus unit.
nlohmann::ordered_json MapJson(const config::Device& device);

}  // namespace baudgate::web
