// SPDX-License-Identifier: Apache-2.0
#include "protocols/dcon/type_codes.h"

namespace baudgate::protocols::dcon {
namespace {

/// "°C" and "degC" are one.
std::string_view Plain(std::string_view unit) { return unit == "°C" ? "degC" : unit; }

}  // namespace

std::string_view UnitOfType(std::uint8_t type) {
  switch (type) {
    case 0x00:
    case 0x01:
    case 0x02:
    case 0x03:
    case 0x0B:
    case 0x0C:
      return "mV";
    case 0x04:
    case 0x05:
    case 0x08:
    case 0x09:
    case 0x0A:
      return "V";
    case 0x06:
    case 0x07:
    case 0x0D:
    case 0x1A:
      return "mA";
    default:
      return (type >= 0x0E && type <= 0x19) || (type >= 0x20 && type <= 0x2D) ? "degC" : "";
  }
}

bool IsAnalogOutput(std::uint8_t type) { return (type >= 0x30 && type <= 0x35) || type == 0x3F; }

bool IsUnitOfTypes(std::string_view unit) {
  const std::string_view plain = Plain(unit);
  return plain == "V" || plain == "mV" || plain == "mA" || plain == "degC";
}

std::optional<double> FactorOfType(std::uint8_t type, std::string_view unit) {
  const std::string_view own = UnitOfType(type);
  const std::string_view wanted = Plain(unit);
  if (own.empty() || !IsUnitOfTypes(unit) || own == wanted) return 1;
  if (own == "mV" && wanted == "V") return 0.001;
  if (own == "V" && wanted == "mV") return 1000;
  return std::nullopt;
}

}  // namespace baudgate::protocols::dcon
