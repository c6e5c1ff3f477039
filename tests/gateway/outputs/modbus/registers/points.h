// Helpers to make configurations and requests in the Modbus tests.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <string>
#include <utility>
#include <vector>

#include "config/model/config.h"
#include "gateway/base/bytes.h"
#include "gateway/base/text.h"
#include "gateway/outputs/modbus/wire/request.h"

namespace baudgate::modbus {

inline config::Point MakePoint(config::Type type, std::uint16_t address,
                               config::Access access = config::Access::read) {
  config::Point point;
  point.name = "p" + std::to_string(address);
  point.type = type;
  point.modbus = address;
  point.access = access;
  point.writing.allowed = access != config::Access::read;
  if (type == config::Type::boolean) point.table = config::Table::bits;
  return point;
}

inline config::Point MakeText(std::size_t length, std::uint16_t address,
                              config::Access access = config::Access::read) {
  config::Point point = MakePoint(config::Type::string, address, access);
  point.text_length = length;
  return point;
}

inline config::Device MakeDevice(std::uint8_t unit, std::vector<config::Point> points) {
  config::Device device;
  device.name = "unit-" + std::to_string(unit);
  device.unit = unit;
  device.points = std::move(points);
  return device;
}

inline config::Config MakeConfig(std::vector<config::Device> devices) {
  config::Config config;
  config.lines.resize(1);
  config.lines[0].name = "line";
  config.lines[0].devices = std::move(devices);
  return config;
}

inline Bytes Frame(std::uint8_t unit, const std::string& pdu_hex,
                   std::uint16_t transaction = 0x1234) {
  return AduOf(transaction, unit, ParseHex(pdu_hex).value());
}

}  // namespace baudgate::modbus
