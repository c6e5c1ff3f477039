// SPDX-License-Identifier: Apache-2.0
#include "gateway/outputs/web/map_json.h"

#include "config/model/point.h"
#include "gateway/outputs/web/points_json.h"

namespace baudgate::web {

nlohmann::ordered_json MapJson(const config::Device& device) {
  using Json = nlohmann::ordered_json;
  Json registers = Json::array();
  for (const config::Point& point : device.points) {
    if (!device.unit || !point.modbus) continue;
    const bool bit = point.table == config::Table::bits;
    registers.push_back({{"point", point.name},
                         {"table", bit ? "coil" : "holding"},
                         {"address", *point.modbus},
                         {"count", bit ? 1 : config::RegisterCount(point)},
                         {"type", config::Name(point.type)},
                         {"unit", point.unit},
                         {"access", AccessWord(point.access)}});
  }
  return {{"unit", device.unit ? Json(*device.unit) : Json(nullptr)},
          {"registers", std::move(registers)}};
}

}  // namespace baudgate::web
