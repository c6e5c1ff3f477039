// A gateway with a device that can be written, for the tests of MQTT.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <string>

#include "config/model/config.h"

namespace baudgate::mqtt::testing {

inline config::Point PointNamed(const std::string& name, config::Type type, bool allowed,
                                const std::string& unit = {}) {
  config::Point point;
  point.name = name;
  point.type = type;
  point.unit = unit;
  point.access = allowed ? config::Access::read_write : config::Access::read;
  point.writing.allowed = allowed;
  return point;
}

/// Returns the gateway "gate" with the line "bay", and on it "feeder" with the points current (A),
/// setting (0 to 40), trip (must be selected) and text.
inline config::Config GatewayConfig(std::uint16_t port = 1883) {
  config::Device device;
  device.name = "feeder";
  device.points = {PointNamed("current", config::Type::float32, false, "A"),
                   PointNamed("setting", config::Type::float32, true),
                   PointNamed("trip", config::Type::boolean, true),
                   PointNamed("text", config::Type::string, false)};
  device.points[1].writing.min = 0;
  device.points[1].writing.max = 40;
  device.points[2].writing.select = true;
  config::Config config;
  config.name = "gate";
  config.mqtt.on = true;
  config.mqtt.brokers = {{{"127.0.0.1", port}, false}};
  config.mqtt.client = "baudgate-gate";
  config.mqtt.commands = true;
  config.lines.resize(1);
  config.lines[0].name = "bay";
  config.lines[0].devices = {device};
  return config;
}

}  // namespace baudgate::mqtt::testing
