// A gateway with points to write, and a sink that stores commands.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "config/model/config.h"
#include "gateway/bus/writes/write_command.h"
#include "gateway/outputs/dds/sample_writer.h"
#include "tests/support/keeping_sink.h"

namespace baudgate::dds::testing {

inline config::Point PointNamed(const std::string& name, config::Type type, bool allowed) {
  config::Point point;
  point.name = name;
  point.type = type;
  point.access = config::Access::read_write;
  point.writing.allowed = allowed;
  return point;
}

inline config::Config ServiceConfig() {
  config::Device device;
  device.name = "feeder-1";
  device.points = {PointNamed("setting", config::Type::float32, true),
                   PointNamed("trip", config::Type::boolean, true),
                   PointNamed("off", config::Type::uint16, false)};
  device.points[0].writing.min = 0;
  device.points[0].writing.max = 40;
  device.points[1].writing.select = true;
  config::Config config;
  config.name = "substation-7";
  config.dds.write = true;
  config.lines.resize(1);
  config.lines[0].name = "line";
  config.lines[0].devices = {device};
  return config;
}

inline constexpr WallTime kAsked{1'800'000'000s};

inline WriteArrival Ask(std::uint64_t seq, const std::string& point, double value) {
  WriteArrival arrival;
  arrival.request.gateway = "substation-7";
  arrival.request.client = "plc-1";
  arrival.request.seq = seq;
  arrival.request.device = "feeder-1";
  arrival.request.point = point;
  arrival.request.value = value;
  arrival.published = kAsked;
  arrival.writer.publisher.bytes = {1, 0x0F, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11};
  arrival.writer.entity = {0, 0, 1, 2};
  return arrival;
}

}  // namespace baudgate::dds::testing
