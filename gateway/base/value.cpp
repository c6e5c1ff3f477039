// SPDX-License-Identifier: Apache-2.0
#include "gateway/base/value.h"

#include <limits>
#include <type_traits>

#include "gateway/base/text.h"

namespace baudgate {

double ToDouble(const Value& value) {
  return std::visit(
      [](const auto& held) -> double {
        using T = std::decay_t<decltype(held)>;
        if constexpr (std::is_arithmetic_v<T>) {
          return static_cast<double>(held);
        } else {
          return std::numeric_limits<double>::quiet_NaN();
        }
      },
      value);
}

std::string ToText(const Value& value) {
  return std::visit(
      [](const auto& held) -> std::string {
        using T = std::decay_t<decltype(held)>;
        if constexpr (std::is_same_v<T, std::monostate>) {
          return {};
        } else if constexpr (std::is_same_v<T, bool>) {
          return held ? "true" : "false";
        } else if constexpr (std::is_same_v<T, double>) {
          return FormatNumber(held);
        } else if constexpr (std::is_same_v<T, std::string>) {
          return held;
        } else {
          return std::to_string(held);
        }
      },
      value);
}

namespace {

std::string_view NameOf(Quality::Code code) {
  switch (code) {
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

}  // namespace

std::string_view Name(Reason reason) {
  switch (reason) {
    case Reason::none:
      return {};
    case Reason::over_range:
      return "over range";
    case Reason::under_range:
      return "under range";
    case Reason::open_sensor:
      return "open sensor";
    case Reason::channel_disabled:
      return "channel disabled";
    case Reason::not_fitted:
      return "not fitted";
    case Reason::not_ready:
      return "not ready";
    case Reason::device_fault:
      return "device fault";
    case Reason::other_module:
      return "the device does not match its profile";
    case Reason::swapped:
      return "the device was swapped";
    case Reason::password_refused:
      return "password refused";
    case Reason::no_permission:
      return "no permission";
    case Reason::sentinel:
      return "no measurement";
    case Reason::out_of_range:
      return "out of the type's range";
  }
  return "unknown reason";
}

std::string Name(Quality quality) {
  std::string name(NameOf(quality.code));
  if (quality.reason != Reason::none) name.append(", ").append(Name(quality.reason));
  return name;
}

}  // namespace baudgate
