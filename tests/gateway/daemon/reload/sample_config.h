// A configuration of three lines, which tests change.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "config/model/config.h"

namespace baudgate::reload {

inline config::Point PointOf(const std::string& name) {
  config::Point point;
  point.name = name;
  point.read = "V1";
  point.modbus = 0;
  return point;
}

inline config::Line LineOf(const std::string& name) {
  config::Line line;
  line.name = name;
  line.port = "/dev/" + name;
  line.protocol = "spabus";
  for (const char* device : {"a", "b"}) {
    config::Device& one = line.devices.emplace_back();
    one.name = name + "-" + device;
    one.address = "1";
    one.protocol = line.protocol;
    one.points = {PointOf("current"), PointOf("voltage")};
  }
  return line;
}

inline config::Config Sample() {
  config::Config config;
  for (const char* name : {"x", "y", "z"}) config.lines.push_back(LineOf(name));
  return config;
}

}  // namespace baudgate::reload
