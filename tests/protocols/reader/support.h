// Builds readers and their lines for tests.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "config/catalog/option_values.h"
#include "config/model/line.h"
#include "protocols/reader/protocol.h"

namespace baudgate::protocols {

inline config::Point ReaderPoint(const std::string& read,
                                 config::Type type = config::Type::uint32) {
  config::Point point;
  point.name = read;
  point.read = read;
  point.type = type;
  point.text_length = type == config::Type::string ? 40 : 0;
  return point;
}

inline constexpr std::uint32_t kTag = 0;
inline constexpr std::uint32_t kCounter = 4;
inline constexpr std::uint32_t kPresent = 5;

/// Returns a reader with the points 0…6: tag, high, middle, low, counter, present, tag@1.
inline config::Device Reader(const std::vector<std::pair<std::string, std::string>>& texts = {}) {
  config::Device device;
  device.name = "gate";
  device.address = "1";
  device.protocol = "reader";
  device.options = config::DefaultOptions(ReaderProtocol());
  for (const auto& [name, text] : texts) {
    for (const OptionSpec& spec : ReaderProtocol().options) {
      if (spec.name == name) device.options.Set(name, config::ParseOption(spec, text).value());
    }
  }
  device.never_old = true;
  device.events = true;
  using config::Type;
  device.points = {ReaderPoint("tag", Type::string),
                   ReaderPoint("high", Type::uint16),
                   ReaderPoint("middle", Type::uint16),
                   ReaderPoint("low", Type::uint16),
                   ReaderPoint("counter"),
                   ReaderPoint("present", Type::boolean),
                   ReaderPoint("tag@1", Type::string)};
  return device;
}

inline Bytes TagFrame(const std::string& digits) { return ToBytes("\r\n-" + digits + "\r\n>"); }

inline config::Line GateLine(config::Device device) {
  config::Line line;
  line.name = "gate";
  line.protocol = "reader";
  line.serial = ReaderProtocol().serial;
  line.devices = {std::move(device)};
  return line;
}

}  // namespace baudgate::protocols
