// How far a point's value can be trusted: OPC DA quality codes.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string_view>

namespace baudgate {

enum class Quality : std::uint8_t {
  bad = 0x00,
  bad_configuration = 0x04,
  bad_not_connected = 0x08,
  bad_device_failure = 0x0C,
  bad_sensor_failure = 0x10,
  bad_last_known = 0x14,
  bad_communication = 0x18,
  bad_out_of_service = 0x1C,
  bad_waiting = 0x20,  ///< every point is born so
  uncertain = 0x40,
  uncertain_last_usable = 0x44,
  uncertain_sub_normal = 0x58,
  good = 0xC0,
};

constexpr bool IsGood(Quality quality) { return (static_cast<unsigned>(quality) & 0xC0U) == 0xC0U; }
constexpr bool IsUncertain(Quality quality) {
  return (static_cast<unsigned>(quality) & 0xC0U) == 0x40U;
}
constexpr bool IsBad(Quality quality) { return (static_cast<unsigned>(quality) & 0xC0U) == 0; }

/// For people: "good", "uncertain: last usable", "bad: communication failure", …
constexpr std::string_view Name(Quality quality) {
  switch (quality) {
    case Quality::bad:
      return "bad";
    case Quality::bad_configuration:
      return "bad: configuration";
    case Quality::bad_not_connected:
      return "bad: not connected";
    case Quality::bad_device_failure:
      return "bad: device failure";
    case Quality::bad_sensor_failure:
      return "bad: sensor failure";
    case Quality::bad_last_known:
      return "bad: last known";
    case Quality::bad_communication:
      return "bad: communication failure";
    case Quality::bad_out_of_service:
      return "bad: out of service";
    case Quality::bad_waiting:
      return "bad: waiting for initial data";
    case Quality::uncertain:
      return "uncertain";
    case Quality::uncertain_last_usable:
      return "uncertain: last usable";
    case Quality::uncertain_sub_normal:
      return "uncertain: sub-normal";
    case Quality::good:
      return "good";
  }
  return "bad";
}

}  // namespace baudgate
